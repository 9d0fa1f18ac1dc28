"""The best clearance and what good damping goes with, against plain loops over the same cube."""

import math
from collections.abc import Sequence
from typing import Any

import numpy as np
import pytest
import xarray as xr

import damper
from damper.analysis import best_clearance, damping_shares


@pytest.fixture(scope="module")
def cube() -> xr.Dataset:
    """Return a small study of a damper of a tenth of the mass around resonance."""
    return damper.simulate(
        mass_ratio=0.1,
        damping_ratio=0.02,
        frequency_ratio=[0.85, 0.95, 0.98, 1.0, 1.02, 1.15],
        clearance=[2.0, 6.0, 9.0, 12.0, 30.0],
        restitution=[0.0, 0.3, 0.8],
        transient=30,
        periods=10,
        observers=["response", "impacts", "bursts"],
    )


def test_best_clearance_is_the_one_with_the_smallest_largest_amplitude(cube: xr.Dataset) -> None:
    found = best_clearance(cube)
    assert found["restitution"].tolist() == [0.0, 0.3, 0.8]
    for best in found.to_dict("records"):
        worst = {}
        for d in cube.clearance.values:
            here = cube.sel(clearance=d, restitution=best["restitution"])
            worst[d] = max(float(here.peak_displacement.sel(frequency_ratio=w))
                           for w in cube.frequency_ratio.values)  # fmt: skip
        assert best["worst_amplitude"] == pytest.approx(min(worst.values()), rel=2e-6)
        assert worst[best["best_clearance"]] == best["worst_amplitude"]
        place = list(worst).index(best["best_clearance"])
        around = [math.nan, *worst.values(), math.nan]
        beside = (best["worst_amplitude_below"], best["worst_amplitude_above"])
        np.testing.assert_equal(beside, (around[place], around[place + 2]))
        assert best["interior"] == (best["best_clearance"] not in (2.0, 30.0))
        # The linear response is largest at resonance: 1 / (2 zeta) there.
        assert best["undamped_amplitude"] == pytest.approx(25.0, rel=1e-9)


def test_band_is_the_width_of_the_damped_frequencies(cube: xr.Dataset) -> None:
    grid = cube.frequency_ratio.values
    widths = [0.05, 0.065, 0.025, 0.02, 0.075, 0.065]  # half of both steps beside each value
    for best in best_clearance(cube).to_dict("records"):
        line = cube.sel(restitution=best["restitution"], clearance=best["best_clearance"])
        ratio = line.peak_displacement.values * np.hypot(1.0 - grid**2, 2.0 * 0.02 * grid)
        assert best["band"] == pytest.approx(np.dot(widths, ratio < 0.9), rel=1e-12)
        assert best["lowest_amplitude_ratio"] == pytest.approx(ratio.min(), rel=1e-12)
        assert best["lowest_at_frequency_ratio"] == grid[ratio.argmin()]


def test_worst_of_several_runs_counts() -> None:
    """Starts and clearances between which the best clearance is another than that of each draw."""
    several = damper.simulate(
        mass_ratio=0.1,
        damping_ratio=0.02,
        frequency_ratio=[0.9, 1.0, 1.1],
        clearance=[6.0, 9.0, 12.0, 15.0],
        restitution=[0.3, 0.8],
        transient=30,
        periods=10,
        draws={"count": 3, "seed": 1, "initial_relative_velocity": [-1, 1]},
        observers=["response", "impacts", "bursts"],
    )
    found = best_clearance(several, worst=["draw"])
    assert found["restitution"].tolist() == [0.3, 0.8]
    for best in found.to_dict("records"):
        here = several.sel(restitution=best["restitution"])
        largest = {
            d: max(here.peak_displacement.sel(clearance=d).values.ravel().tolist())
            for d in here.clearance.values.tolist()
        }
        assert best["worst_amplitude"] == min(largest.values())
        assert largest[best["best_clearance"]] == best["worst_amplitude"]
        line = here.sel(clearance=best["best_clearance"])
        ratios = [max(line.amplitude_ratio.sel(frequency_ratio=w).values) for w in (0.9, 1.0, 1.1)]
        assert best["highest_amplitude_ratio"] == max(ratios)
        assert best["amplified"] == pytest.approx(np.dot([0.05, 0.1, 0.05], np.array(ratios) > 1))
        assert best["lowest_amplitude_ratio"] == min(ratios)
        place = int(np.argmin(ratios))
        run = int(line.amplitude_ratio.isel(frequency_ratio=place).values.argmax())
        assert best["impacts_per_period"] == line.impacts_per_period[place, run]
    each = [best_clearance(several.isel(draw=k))["worst_amplitude"] for k in range(3)]
    assert (found["worst_amplitude"] > np.max(each, axis=0)).any()
    assert (found["worst_amplitude"] >= np.max(each, axis=0)).all()
    # Each run counts where shares are taken.
    counted = [damping_shares(several.isel(draw=k))["with_impacts"] for k in range(3)]
    assert damping_shares(several)["with_impacts"] == sum(counted)


def test_chatter_is_that_of_any_mass(cube: xr.Dataset) -> None:
    """Of two masses of which one never chatters, all is as with the other alone."""
    of_two = xr.concat([cube[["chatter", "sticking_fraction"]] * k for k in (0, 1)], "body")
    several = cube.assign({name: of_two[name] for name in of_two})
    assert best_clearance(several).equals(best_clearance(cube))
    assert damping_shares(several) == damping_shares(cube)


def test_shares_are_what_a_loop_counts(cube: xr.Dataset) -> None:
    contact = lasting = good = both = 0
    two, below, above = [], [], []
    for point in cube.to_dataframe().reset_index().to_dict("records"):
        if not point["impacts_per_period"] > 0:
            continue
        contact += 1
        lasts = point["chatter"] > 0 or point["sticking_fraction"] > 0
        lasting += lasts
        good += point["rms_ratio"] < 0.5
        both += lasts and point["rms_ratio"] < 0.5
        if not lasts and abs(point["impacts_per_period"] - 2.0) < 0.05:
            two.append((point["rms_ratio"], point["frequency_ratio"]))
        if abs(point["frequency_ratio"] - 1.0) > 0.1:
            side = below if point["frequency_ratio"] < 1.0 else above
            side.append(point["rms_ratio"] > 1.0)
    assert 0 < both < good
    shares = damping_shares(cube)
    assert (shares["with_impacts"], shares["well_damped"]) == (contact, good)
    assert shares["lasting"] == lasting / contact
    assert shares["lasting_well_damped"] == both / good
    assert shares["median_rms_two_impacts"] == np.median([rms for rms, _ in two])
    well = [w for rms, w in two if rms < 0.5]
    assert shares["well_damped_two_impacts"] == len(well)
    assert shares["near_resonance"] == sum(abs(w - 1.0) <= 0.1 for w in well) / len(well)
    assert (shares["lowest"], shares["highest"]) == (min(well), max(well))
    assert shares["amplified_below"] == sum(below) / len(below)
    assert shares["amplified_above"] == sum(above) / len(above)


def made_up(peak: Any, frequencies: Sequence[float] = (0.5, 1.0, 1.5)) -> xr.Dataset:
    """Return a cube of two restitutions, two clearances and three frequencies."""
    coords = {
        "restitution": [0.0, 0.8],
        "frequency_ratio": list(frequencies),
        "clearance": [1.0, 2.0],
    }
    values = {
        "peak_displacement": peak,
        "amplitude_ratio": 0.4,
        "rms_ratio": 0.4,
        "impacts_per_period": 2.0,
        "sticking_fraction": 0.0,
        "chatter": 0,
    }
    shape = (2, len(frequencies), 2)
    arrays = {n: (tuple(coords), np.broadcast_to(v, shape)) for n, v in values.items()}
    return xr.Dataset(arrays, coords, {"title": "Made up"})


def test_clearance_at_which_a_run_stopped_is_not_the_best() -> None:
    peak = np.array([1.0, 2.0]).reshape(1, 1, 2) * np.ones((2, 3, 1))
    peak[0, 1, 0] = np.nan
    assert best_clearance(made_up(peak))["best_clearance"].tolist() == [2.0, 1.0]
    nothing = best_clearance(made_up(np.nan))
    assert nothing.empty
    assert list(nothing.columns[:2]) == ["restitution", "best_clearance"]


def test_missing_variables_and_axes_are_named(cube: xr.Dataset) -> None:
    with pytest.raises(ValueError, match=r"no variable 'rms_ratio': .* 'response' among the obs"):
        damping_shares(cube.drop_vars("rms_ratio"))
    with pytest.raises(ValueError, match=r"unknown axis 'clearence' .*'clearance'"):
        best_clearance(cube, over="clearence")

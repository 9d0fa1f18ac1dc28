"""Several runs at each point as one number, against plain loops over the same runs."""

import math
from itertools import product

import numpy as np
import pytest
import xarray as xr

import damper
from damper.analysis import share, worst
from damper.analysis.reduction import reduced, spread


@pytest.fixture(scope="module")
def cube() -> xr.Dataset:
    """A damper followed both ways from two starts, at clearances that some runs do not touch."""
    return damper.simulate(
        mass_ratio=0.1,
        damping_ratio=0.02,
        frequency_ratio=[1.0, 1.02, 1.04],
        clearance=[9.0, 12.0],
        restitution=0.6,
        transient=20,
        periods=5,
        follow={"frequency_ratio": "both"},
        draws={"count": 2, "seed": 1, "initial_relative_velocity": [-1, 1]},
        observers=["response", "bursts"],
    )


def test_worst_and_share_are_what_a_loop_finds(cube: xr.Dataset) -> None:
    limit = float(cube.amplitude_ratio.median())
    stopped = cube.amplitude_ratio.copy()
    stopped[0, 0, 1, 1] = math.nan
    for over in (("draw",), ("draw", "direction"), ("clearance", "direction")):
        greatest, part = worst(stopped, over), share(stopped, over, above=limit)
        left = {dim: stopped[dim].values.tolist() for dim in stopped.dims if dim not in over}
        for place in product(*left.values()):
            here = dict(zip(left, place, strict=True))
            runs = stopped.sel(here).values.ravel().tolist()
            known = not any(map(math.isnan, runs))
            found = greatest.sel(here).item(), part.sel(here).item()
            above = sum(run > limit for run in runs) / len(runs)
            np.testing.assert_equal(found, (max(runs), above) if known else (math.nan, math.nan))
    assert float(share(cube.amplitude_ratio, "draw", above=limit).max()) == 1.0


def test_share_of_the_worst(cube: xr.Dataset) -> None:
    place, (name,) = reduced(
        cube, ["chatter"], {"worst": ["draw"], "share": ["direction"], "above": 0.0}
    )
    both = np.maximum(cube.chatter.isel(draw=0), cube.chatter.isel(draw=1)) > 0
    expected = 0.5 * both.sel(direction="up") + 0.5 * both.sel(direction="down")
    assert name == "chatter_share"
    np.testing.assert_array_equal(place[name], expected.transpose(*place[name].dims))
    assert {"direction", "draw"}.isdisjoint(place.dims)


def test_less_damping_is_worse() -> None:
    ratios = xr.DataArray([[1.0, 3.0, 2.0]], dims=("clearance", "draw"))
    found = spread(ratios.rename("equivalent_damping_ratio"), "draw")
    assert {name: array.item() for name, array in found.items()} == {
        "equivalent_damping_ratio": 1.0,
        "equivalent_damping_ratio_best": 3.0,
        "equivalent_damping_ratio_median": 2.0,
    }
    assert "chatter_median" not in spread(ratios.rename("chatter")[:, :2], "draw")  # of two: none


def test_the_best_design_of_the_worst_runs(cube: xr.Dataset) -> None:
    """At each frequency the clearance whose worst draw and direction is the least, by a loop."""
    stopped = cube[["peak_displacement", "amplitude_ratio"]].copy(deep=True)
    stopped.peak_displacement[0, 0, 0, 0] = math.nan
    settings = {"worst": ["direction"], "band": ["draw"], "choose": ["clearance"]}
    found, (peak, ratio) = reduced(stopped, ["peak_displacement", "amplitude_ratio"], settings)
    for k in range(3):
        here = stopped.isel(frequency_ratio=k)
        worsts = {d: np.max(here.peak_displacement.sel(clearance=d).values) for d in (9.0, 12.0)}
        best = min((d for d in worsts if not math.isnan(worsts[d])), key=lambda d: worsts[d])
        assert found.clearance[k] == best
        assert found[peak][k] == worsts[best]
        ratios = here.amplitude_ratio.sel(clearance=best)
        assert found[ratio][k] == ratios.max()
        assert found["amplitude_ratio_best"][k] == ratios.max("direction").min()


def test_words_say_what_was_reduced(cube: xr.Dataset) -> None:
    greatest = worst(cube.peak_displacement, ["draw", "direction"])
    assert greatest.attrs["long_name"].endswith("either way, worst of 2 draws × 2 directions")
    assert greatest.attrs["scaled_by"] == "F0/K"
    part = share(cube.peak_displacement, "clearance", above=2)
    assert part.attrs == {
        "long_name": "part of 2 values of clearance above 2: largest primary displacement, either "
        "way",
        "units": "1",
    }


def test_what_has_no_worst_is_refused(cube: xr.Dataset) -> None:
    message = (
        "worst: no value of 'sticking_fraction' is worse than another: must be one of peak_displ"
    )
    with pytest.raises(ValueError, match=message):
        worst(cube.sticking_fraction, "draw")
    with pytest.raises(ValueError, match=r"unknown axis 'drwa' \(did you mean 'draw'\?\)"):
        worst(cube.rms_ratio, "drwa")
    with pytest.raises(TypeError, match="above = '1': must be a real number"):
        share(cube.rms_ratio, "draw", above="1")

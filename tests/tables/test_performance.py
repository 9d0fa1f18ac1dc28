"""The performance table against plain loops over the same cube, and its words on made-up cubes."""

import csv
import io
import math
from typing import Any

import numpy as np
import pytest
import xarray as xr

import damper
from damper.tables import About
from damper.tables import make as make_kind
from damper.tables.performance import best_clearances, make, statements

SETTINGS = {"along": "frequency_ratio", "over": "clearance", "good": 0.5, "damped": 0.9}
ABOUT = About("A study", {"mass_ratio": 0.1}, assumed={"mass_ratio": "lost"})


@pytest.fixture(scope="module")
def cube() -> xr.Dataset:
    """Return a small study of a damper of a tenth of the mass around resonance."""
    return damper.simulate(
        mass_ratio=0.1,
        damping_ratio=0.02,
        frequency_ratio=[0.9, 0.95, 0.98, 1.0, 1.02, 1.1],
        clearance=[2.0, 6.0, 9.0, 12.0, 30.0],
        restitution=[0.0, 0.3, 0.8],
        transient=150,
        periods=20,
        observers=["response", "impacts", "bursts"],
    )


def rows(text: str) -> list[dict[str, str]]:
    return list(csv.DictReader(io.StringIO(text)))


def test_best_clearance_is_the_one_with_the_smallest_largest_amplitude(cube: xr.Dataset) -> None:
    found = best_clearances(cube, "frequency_ratio", "clearance", 0.9)
    assert [best.where for best in found] == [{"restitution": r} for r in (0.0, 0.3, 0.8)]
    for best in found:
        worst = {}
        for d in cube.clearance.values:
            amplitudes = [
                float(cube.peak_displacement.sel(clearance=d, frequency_ratio=w, **best.where))
                for w in cube.frequency_ratio.values
            ]
            worst[d] = max(amplitudes)
        assert best.worst == pytest.approx(min(worst.values()), rel=2e-6)
        assert worst[best.clearance] == best.worst
        place = list(worst).index(best.clearance)
        around = [math.nan, *worst.values(), math.nan]
        np.testing.assert_equal(best.beside, (around[place], around[place + 2]))
        assert best.interior == (best.clearance not in (2.0, 30.0))
        # The linear response is largest at resonance: 1 / (2 zeta) there.
        assert best.undamped == pytest.approx(25.0, rel=1e-9)


def test_band_is_the_width_of_the_damped_frequencies(cube: xr.Dataset) -> None:
    for best in best_clearances(cube, "frequency_ratio", "clearance", 0.9):
        place = best.where | {"clearance": best.clearance}
        grid = cube.frequency_ratio.values
        width = 0.0
        lowest = (math.inf, 0.0)
        for k, w in enumerate(grid):
            ratio = float(cube.peak_displacement.sel(place | {"frequency_ratio": w})) * math.hypot(
                1.0 - w * w, 2.0 * 0.02 * w
            )
            lowest = min(lowest, (ratio, w))
            if ratio < 0.9:
                left = 0.5 * (grid[k] - grid[k - 1]) if k else 0.0
                right = 0.5 * (grid[k + 1] - grid[k]) if k + 1 < len(grid) else 0.0
                width += left + right
        assert best.band == pytest.approx(width, rel=1e-12, abs=1e-15)
        assert best.lowest == pytest.approx(lowest[0], rel=1e-12)
        assert best.at == lowest[1]


def test_statements_count_what_a_loop_counts(cube: xr.Dataset) -> None:
    found = best_clearances(cube, "frequency_ratio", "clearance", 0.9)
    a8, a9, a10 = statements(cube, found, "frequency_ratio", 0.5)
    contact = lasting = good = both = plastic = 0
    flat = cube.to_dataframe().reset_index().to_dict("records")
    for point in flat:
        if not point["impacts_per_period"] > 0:
            continue
        contact += 1
        plastic += point["restitution"] == 0.0
        lasts = point["chatter"] > 0 or point["sticking_fraction"] > 0
        lasting += lasts
        if point["rms_ratio"] < 0.5:
            good += 1
            both += lasts
    assert 0 < both < good
    assert f"{lasting / contact:.0%} chatter or stick" in a8.measured
    assert f"ratio < 0.5) {both / good:.0%};" in a8.measured
    assert a8.verdict == ("holds" if both / good > lasting / contact else "does not hold")
    assert a9.measured.startswith(f"{plastic} points with impacts, 0 of them chatter")
    assert a10.name == "A10"


def made_up(**changes: Any) -> xr.Dataset:
    """Return a cube of two restitutions, two clearances and three frequencies, all damped."""
    dims = ("restitution", "frequency_ratio", "clearance")
    shape = (2, 3, 2)
    values = {
        "peak_displacement": np.full(shape, 2.0),
        "amplitude_ratio": np.full(shape, 0.4),
        "rms_ratio": np.full(shape, 0.4),
        "impacts_per_period": np.full(shape, 2.0),
        "bursts_per_period": np.full(shape, 2.0),
        "complete_fraction": np.full(shape, 1.0),
        "sticking_fraction": np.full(shape, 0.3),
        "chatter": np.zeros(shape, dtype="i1"),
    }
    values |= {name: np.broadcast_to(value, shape) for name, value in changes.items()}
    coords = {
        "restitution": [0.0, 0.8],
        "frequency_ratio": [0.5, 1.0, 1.5],
        "clearance": [1.0, 2.0],
    }
    return xr.Dataset({name: (dims, value) for name, value in values.items()}, coords)


def verdicts(cube: xr.Dataset) -> dict[str, str]:
    found = best_clearances(cube, "frequency_ratio", "clearance", 0.9)
    return {s.name: s.verdict for s in statements(cube, found, "frequency_ratio", 0.5)}


def test_plastic_impacts() -> None:
    assert verdicts(made_up())["A9"] == "holds"
    assert verdicts(made_up(complete_fraction=0.5))["A9"] == "holds only in part"
    assert verdicts(made_up(chatter=1))["A9"] == "does not hold"
    assert verdicts(made_up().sel(restitution=[0.8]))["A9"] == "not tested"


def test_good_damping_with_and_without_chatter() -> None:
    half = np.array([0.0, 0.3]).reshape(2, 1, 1)
    good = np.array([0.9, 0.1]).reshape(2, 1, 1)
    assert verdicts(made_up(sticking_fraction=half, rms_ratio=good))["A8"] == "holds"
    assert verdicts(made_up(sticking_fraction=half, rms_ratio=good[::-1]))["A8"] == "does not hold"
    assert verdicts(made_up(sticking_fraction=0.0))["A8"] == "not tested"


def test_band_and_two_impacts_per_period() -> None:
    wide = np.array([0.4, 1.0]).reshape(2, 1, 1)
    # The linear response peak / ratio is largest in the middle.
    peak = np.array([0.5, 2.0, 0.5]).reshape(1, 3, 1) * wide
    near = np.array([0.9, 0.4, 0.9]).reshape(1, 3, 1)
    common = {"sticking_fraction": 0.0, "peak_displacement": peak, "amplitude_ratio": wide}
    assert verdicts(made_up(**common, rms_ratio=near))["A10"] == "holds"
    assert verdicts(made_up(**common, rms_ratio=0.4))["A10"] == "holds only in part"
    common |= {"peak_displacement": peak[::-1], "amplitude_ratio": wide[::-1]}
    assert verdicts(made_up(**common, rms_ratio=0.4))["A10"] == "does not hold"


def test_clearance_at_which_a_run_stopped_is_not_the_best() -> None:
    peak = np.array([1.0, 2.0]).reshape(1, 1, 2) * np.ones((2, 3, 1))
    whole = made_up(peak_displacement=peak)
    assert best_clearances(whole, "frequency_ratio", "clearance", 0.9)[0].clearance == 1.0
    peak[0, 1, 0] = np.nan
    stopped = made_up(peak_displacement=peak)
    assert best_clearances(stopped, "frequency_ratio", "clearance", 0.9)[0].clearance == 2.0


def test_equal_clearances_give_the_first_one() -> None:
    peak = np.array([2.0, 2.0 - 1e-9]).reshape(1, 1, 2)
    found = best_clearances(made_up(peak_displacement=peak), "frequency_ratio", "clearance", 0.9)
    assert [best.clearance for best in found] == [1.0, 1.0]


def test_texts_say_what_was_found(cube: xr.Dataset) -> None:
    text, markdown = make_kind("performance", cube, SETTINGS, ABOUT)
    assert (text, markdown) == make(cube, SETTINGS, ABOUT)
    table = rows(text)
    found = best_clearances(cube, "frequency_ratio", "clearance", 0.9)
    assert [float(row["best_clearance"]) for row in table] == [best.clearance for best in found]
    assert [float(row["restitution"]) for row in table] == [0.0, 0.3, 0.8]
    assert markdown.startswith("# A study: damper performance\n")
    assert "- mass ratio: lost" in markdown
    assert "Fixed: mass_ratio = 0.1." in markdown
    for name in ("A8", "A9", "A10"):
        assert f"\n| {name} |" in markdown
    for best in found:
        assert f"{best.worst:.3g} of 25" in markdown


def test_single_restitution_has_one_row_without_a_name(cube: xr.Dataset) -> None:
    alone = cube.isel(restitution=1)
    text, markdown = make(alone, SETTINGS, ABOUT)
    assert len(rows(text)) == 1
    assert "| best clearance, F0/K | largest amplitude, F0/K | beside it, F0/K | band |" in markdown
    assert "not tested" in markdown


def test_end_of_the_axis_has_one_neighbour() -> None:
    peak = np.array([1.0, 2.0]).reshape(1, 1, 2)
    text, markdown = make(made_up(peak_displacement=peak), SETTINGS, ABOUT)
    assert "| 1 (end of the axis) | 1 of 2.5 | 2 |" in markdown
    assert [row["worst_amplitude_below"] for row in rows(text)] == ["nan", "nan"]


def test_empty_table_when_every_run_stopped() -> None:
    nothing = made_up(peak_displacement=np.nan)
    found = best_clearances(nothing, "frequency_ratio", "clearance", 0.9)
    assert found == []
    text, markdown = make(nothing, SETTINGS, ABOUT)
    assert len(text.splitlines()) == 1
    assert "not tested" in markdown


def test_unknown_kind_is_told_with_the_known_ones(cube: xr.Dataset) -> None:
    with pytest.raises(ValueError, match="did you mean 'performance'"):
        make_kind("perfomance", cube, SETTINGS, ABOUT)

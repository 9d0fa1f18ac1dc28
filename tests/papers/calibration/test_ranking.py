"""Joined scores and their order, on made-up cubes, and the table of a small calibration."""

import math
from typing import Any

import numpy as np
import pytest
import xarray as xr

import damper
from damper.papers.base import Tolerances
from damper.papers.calibration.ranking import JOINED, rank
from damper.papers.statements import SCORES
from damper.tables import Table, make

SETTINGS: dict[str, Any] = {"rows": 20}


def bursts(onsets: list[list[float]]) -> xr.Dataset:
    """Cube of sets (mass ratio, clearance) that differ by their onsets."""
    dims = ("mass_ratio", "clearance", "frequency_ratio")
    values = np.array(onsets)[..., None]
    return xr.Dataset(
        {
            "burst_at_onset": (dims, values),
            "burst_at_duration": (dims, np.full_like(values, 11.0)),
            "burst_at_complete": (dims, np.ones(values.shape, dtype="i1")),
        },
        {"mass_ratio": [0.1, 0.2], "clearance": [0.01, 0.02, 0.03], "frequency_ratio": [0.2]},
    )


def clearances(parts: list[list[int]], masses: list[float]) -> xr.Dataset:
    """Cube of sets (mass ratio, frequency ratio): how many of four clearances chatter."""
    chatter = np.array([[[1] * n + [0] * (5 - n) for n in row] for row in parts], dtype="i1")
    coords = {
        "mass_ratio": masses,
        "frequency_ratio": [0.5, 0.9],
        "clearance": [0.3, 0.6, 0.9, 1.2, 1.5],
    }
    return xr.Dataset({"chatter": (tuple(coords), chatter)}, coords)


ONSETS = [[332.0, 333.0, 334.0], [332.0, 331.0, 333.0]]


def test_one_statement_is_its_own_rank() -> None:
    found = rank(bursts(ONSETS), ["A3"])
    np.testing.assert_allclose(
        found.scores[JOINED], [[1.0, 0.5, 2.0**-4], [1.0, 0.5, 0.5]], rtol=1e-12
    )
    # Equals stay in the order of the axes.
    assert found.order().tolist() == [0, 3, 1, 4, 5, 2]
    assert next(found.places([5])) == {"mass_ratio": 0.2, "clearance": 0.03}
    assert found.rank({"mass_ratio": 0.1, "clearance": 0.02}) == (3, pytest.approx(0.5))
    assert found.rank({"mass_ratio": 0.1}) == (1, 1.0)
    assert found.sets == 6


def test_joined_is_the_geometric_mean_over_shared_parameters() -> None:
    """A1's best frequency counts; the clearance of A3 makes no difference to A1."""
    other = clearances([[2, 3], [1, 0]], [0.1, 0.2])
    found = rank(bursts(ONSETS), ["A3"], {"A1": other})
    expected = np.sqrt(
        np.array([[1.0, 0.5, 2.0**-4], [1.0, 0.5, 0.5]]) * np.array([[3 / 4], [1 / 4]])
    )
    np.testing.assert_allclose(found.scores[JOINED], expected, rtol=1e-12)
    assert found.freed["A1"]["frequency_ratio"].values.tolist() == [0.9, 0.5]
    assert found.own["A1"].dims == ("mass_ratio", "frequency_ratio")
    assert found.scores["A1"].dims == ("mass_ratio", "clearance")


def test_joined_at_the_values_that_both_have() -> None:
    other = clearances([[4, 0], [0, 2]], [0.2, 0.5])
    found = rank(bursts(ONSETS), ["A3"], {"A1": other})
    assert found.scores.mass_ratio.values.tolist() == [0.2]
    np.testing.assert_allclose(found.scores[JOINED], [np.sqrt([1.0, 0.5, 0.5])], rtol=1e-12)
    assert found.own["A3"].sizes["mass_ratio"] == 2


def test_studies_without_a_common_value() -> None:
    other = clearances([[4, 0], [0, 2]], [0.3, 0.5])
    with pytest.raises(ValueError, match="mass_ratio: the studies that are joined have no value"):
        rank(bursts(ONSETS), ["A3"], {"A1": other})


# --- the table


@pytest.fixture(scope="module")
def cube() -> xr.Dataset:
    """Return a small calibration about the preset of docs/calibration.md."""
    return damper.simulate(
        mass_ratio=[0.1, 0.2],
        damping_ratio=[0.01, 0.02],
        restitution=[0.7, 0.8],
        clearance=[0.02, 0.03, 0.04],
        phase=[0.0, math.pi / 2.0],
        frequency_ratio=[0.2, 0.25, 0.3],
        transient=0,
        periods=25,
        observers={"burst_at": {"time": 332.0}, "chatter_bursts": {"since": [0, 15]}},
    )


PRESET = {"mass_ratio": 0.2, "damping_ratio": 0.01, "restitution": 0.8, "clearance": 0.03}


def table(cube: xr.Dataset, **changes: Any) -> Table:
    given = SETTINGS | {"statements": ["A3", "A4", "A5"], "preset": PRESET | {"phase": 0.0}}
    return make("ranking", {"cube": cube}, **given | changes)


def test_rows_are_the_sets_in_order(cube: xr.Dataset) -> None:
    rows = table(cube).data
    assert rows["rank"].tolist() == list(range(1, 21))
    assert rows["joined"].is_monotonic_decreasing
    for row in rows.to_dict("records"):
        three = [row[name] for name in ("A3", "A4", "A5")]
        assert row["joined"] == pytest.approx(math.prod(three) ** (1 / 3), rel=1e-12)
        names = ("mass_ratio", "damping_ratio", "restitution", "clearance", "phase")
        low = cube.sel({name: row[name] for name in names} | {"frequency_ratio": 0.2})
        assert row["onset"] == float(low.burst_at_onset)
        assert row["duration"] == float(low.burst_at_duration)


def test_preset_and_what_it_scores(cube: xr.Dataset) -> None:
    markdown = table(cube).markdown()
    found = rank(cube, ["A3", "A4", "A5"])
    number, best = found.rank(PRESET | {"phase": 0.0})
    assert f"has the joined score {best:.4g} and is number {number} of 48 sets" in markdown
    assert " preset |" in markdown
    assert "preset" not in table(cube, preset=None).markdown()


def test_pinned_values_are_those_of_the_scores(cube: xr.Dataset) -> None:
    markdown = table(cube).markdown()
    (line,) = [line for line in markdown.splitlines() if line.startswith("| restitution |")]
    cells = [cell.strip() for cell in line.strip("|").split("|")][1:]
    for name, cell in zip(("A3", "A4", "A5"), cells, strict=False):
        scores = SCORES[name].measure(cube, Tolerances()).score
        best = {r: float(scores.sel(restitution=r).max()) for r in (0.7, 0.8)}
        left = [f"{r:g}" for r, top in best.items() if top >= 0.5]
        assert cell == ("any" if len(left) == 2 else ", ".join(left) or "none"), name


def test_counts_of_sets_that_hold(cube: xr.Dataset) -> None:
    markdown = table(cube).markdown()
    (text,) = [line for line in markdown.splitlines() if line.startswith("Together")]
    assert "doubled" not in table(cube, statements=["A5"]).markdown()
    for scale, words in ((1.0, "all hold in {} "), (2.0, "doubled in {} ")):
        tolerances = Tolerances(scale, scale, 0.1 * scale)
        each = [SCORES[name].measure(cube, tolerances).score for name in ("A3", "A4", "A5")]
        each = [array.transpose(*each[0].dims).values for array in each]
        number = int(np.all([values >= 0.5 for values in each], axis=0).sum())
        assert words.format(number) in text


def test_same_text_twice(cube: xr.Dataset) -> None:
    first, second = table(cube), table(cube.copy(deep=True))
    assert (first.csv(), first.markdown()) == (second.csv(), second.markdown())
    # However the axes lie in the file.
    turned = rank(cube.transpose("frequency_ratio", "phase", ...), ["A3", "A5"])
    straight = rank(cube, ["A3", "A5"])
    again = turned.scores[JOINED].transpose(*straight.scores[JOINED].dims)
    xr.testing.assert_allclose(again, straight.scores[JOINED])

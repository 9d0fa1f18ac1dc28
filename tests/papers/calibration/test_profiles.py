"""Profiles: what they draw of made-up calibrations."""

from typing import Any

import numpy as np
import pytest
import xarray as xr
from figures.drawing import assert_nothing_overlaps, legend_texts
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from damper.figures.common.style import style
from damper.papers.calibration.figures.profiles import Profiles, draw
from damper.papers.calibration.ranking import JOINED, rank

PI_2 = 1.5707963267948966
AXES = {
    "mass_ratio": [0.05, 0.1, 0.2, 0.5],
    "damping_ratio": [0.0, 0.01, 0.1],
    "restitution": [0.6, 0.7, 0.8],
    "clearance": np.geomspace(0.01, 0.09, 7).tolist(),
    "phase": [0.0, PI_2],
    "frequency_ratio": [0.2, 0.25, 0.3],
}
ALL_A = ["A3", "A4", "A5", "A5_record", "A7"]


def calibration() -> xr.Dataset:
    """Cube of random bursts about those that paper A states."""
    numbers = np.random.default_rng(7)
    shape = tuple(map(len, AXES.values()))
    dims, late = tuple(AXES), (*AXES, "since")
    chatter = numbers.integers(1, 20, (*shape, 2))
    complete = (chatter * numbers.random((*shape, 2))).astype(int)
    cube = xr.Dataset(
        {
            "burst_at_onset": (dims, numbers.normal(332.0, 3.0, shape)),
            "burst_at_duration": (dims, numbers.normal(11.0, 2.0, shape)),
            "burst_at_complete": (dims, np.ones(shape, dtype="i1")),
            "chatter_bursts": (late, chatter),
            "chatter_complete": (late, complete),
            "sticking_bursts": (late, complete),
            "chatter_duration": (late, numbers.normal(10.0, 1.0, (*shape, 2))),
            "chatter_onset": (late, numbers.uniform(0.0, 400.0, (*shape, 2))),
        },
        AXES | {"since": [0.0, 15.0]},
        {"title": "A made-up calibration"},
    )
    cube.clearance.attrs["units"] = "F0/K"
    return cube


@pytest.fixture(scope="module")
def cube() -> xr.Dataset:
    return calibration()


def curves(ax: Axes) -> dict[str, np.ndarray]:
    """Curves by their labels, as rows (x, y)."""
    return {
        str(line.get_label()): line.get_xydata() for line in ax.lines if line.get_label()[0] != "_"
    }


def profiles(cube: xr.Dataset, others: dict[str, Any] | None = None, **settings: Any) -> Figure:
    given = {"statements": ["A3", "A4", "A5"], "also": dict.fromkeys(others or {}, "other")}
    with style():
        return draw({"cube": cube, **(others or {})}, Profiles.model_construct(**given | settings))


def test_a_row_for_each_phase_and_a_panel_for_each_parameter(cube: xr.Dataset) -> None:
    figure = profiles(cube)
    assert len(figure.axes) == 8
    assert [figure.axes[k].get_title("left") for k in (0, 4)] == ["sine force", "cosine force"]
    labels = [ax.get_xlabel() for ax in figure.axes[4:]]
    for label, symbol in zip(labels, (r"\mu", r"\zeta", "$r$", "$d$"), strict=True):
        assert symbol in label
    assert [ax.get_xscale() for ax in figure.axes[:4]] == ["linear", "linear", "linear", "log"]
    assert_nothing_overlaps(figure)


def test_curves_are_the_best_scores(cube: xr.Dataset) -> None:
    figure = profiles(cube)
    found = rank(cube, ["A3", "A4", "A5"])
    names = {"A3": "A3", "A4": "A4", "A5": "A5", "joined: geometric mean": JOINED}
    for row, phase in enumerate((0.0, PI_2)):
        for column, axis in enumerate(("mass_ratio", "damping_ratio", "restitution", "clearance")):
            shown = curves(figure.axes[4 * row + column])
            assert set(shown) == set(names)
            for label, name in names.items():
                scores = found.scores[name].sel(phase=phase)
                best = [float(scores.sel({axis: x}).max()) for x in AXES[axis]]
                np.testing.assert_allclose(shown[label][:, 0], AXES[axis])
                np.testing.assert_allclose(shown[label][:, 1], best)


def test_preset_is_marked_in_its_row(cube: xr.Dataset) -> None:
    preset = {"mass_ratio": 0.2, "restitution": 0.8, "phase": 0.0}
    figure = profiles(cube, preset=preset)
    marks = [
        [line.get_xdata()[0] for line in ax.lines if line.get_lw() == 0.8] for ax in figure.axes
    ]
    assert marks == [[0.2], [], [0.8], [], [], [], [], []]
    assert "preset" in legend_texts(figure)
    assert "preset" not in legend_texts(profiles(cube))


def test_a_statement_of_another_study(cube: xr.Dataset) -> None:
    """It has a curve where it varies the parameter, on its own values."""
    clearance = [0.5, 1.0, 1.5]
    masses = [0.1, 0.2, 0.5]
    chatter = np.array(
        [[[1, 1, 0], [1, 0, 0]], [[0, 0, 0], [1, 0, 0]], [[0, 0, 1], [1, 0, 1]]], dtype="i1"
    )
    other = xr.Dataset(
        {"chatter": (("mass_ratio", "frequency_ratio", "clearance"), chatter)},
        {"mass_ratio": masses, "frequency_ratio": [0.5, 0.9], "clearance": clearance},
    )
    figure = profiles(cube, {"A1": other})
    points = [[0.1, 1.0], [0.2, 0.5], [0.5, 0.0]]
    np.testing.assert_allclose(curves(figure.axes[0])["A1"], points)
    assert curves(figure.axes[0])["joined: geometric mean"][:, 0].tolist() == masses
    assert all("A1" not in curves(ax) for ax in figure.axes[1:4])


def test_colours_and_dashes_differ(cube: xr.Dataset) -> None:
    figure = profiles(cube, statements=ALL_A)
    lines = [line for line in figure.axes[0].lines if line.get_label()[0] != "_"]
    assert len({line.get_color() for line in lines}) == 6
    assert len({str(line._dash_pattern) for line in lines}) == 6
    assert_nothing_overlaps(figure)

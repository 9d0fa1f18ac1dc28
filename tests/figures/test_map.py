"""Maps of small cubes, where every cell's colour is known."""

import json
from typing import Any

import numpy as np
import pytest
import xarray as xr
from figures.drawing import drawn, legend_texts, made_up
from matplotlib.axes import Axes
from matplotlib.collections import QuadMesh
from matplotlib.colors import to_rgba
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from damper import simulate
from damper.figures.common.style import BLUE, MISSING, ORANGE, PALE
from damper.figures.map import classified
from damper.observers.motion import ObservedMotion

X = [0.8, 0.9, 1.0, 1.1]
Y = [0.5, 1.0, 1.5]
AXES = {"frequency_ratio": X, "clearance": Y}
PLACE = {"x": "frequency_ratio", "y": "clearance"}
#: clearance (rows) by frequency (columns)
CHATTER = np.array([[0, 1, 2, 0], [0, 2, 2, -1], [0, 0, 1, 0]])
NO_CONTACT_KNOWN = ["no chatter", "incomplete chatter", "complete chatter"]
RATIO = np.array([[1.2, 0.9, 0.3, 0.8], [1.5, 0.4, 0.3, 0.9], [1.1, 0.5, 0.2, np.nan]])


def the_map(cube: xr.Dataset, variable: str, **settings: Any) -> Figure:
    return drawn("map", cube, **{"variable": variable, **PLACE, **settings})


def chatter(**settings: Any) -> Figure:
    return the_map(made_up(AXES, chatter=CHATTER.T), "chatter", **settings)


def ratio(**settings: Any) -> Figure:
    """What has no value is zero, as the ratio to an infinite amplitude is."""
    return the_map(made_up(AXES, rms_ratio=np.nan_to_num(RATIO.T)), "rms_ratio", **settings)


def mesh(ax: Axes) -> QuadMesh:
    (found,) = (item for item in ax.collections if isinstance(item, QuadMesh))
    return found


def colours(ax: Axes) -> np.ndarray:
    """Colour of every cell, rows from below."""
    cells = mesh(ax)
    cells.update_scalarmappable()
    return cells.get_facecolor().reshape(*cells.get_array().shape, 4)


def marks(ax: Axes) -> list[tuple[float, float]]:
    (line,) = (line for line in ax.lines if isinstance(line, Line2D) and line.get_marker() == "o")
    return list(zip(line.get_xdata(), line.get_ydata(), strict=True))


# --- cells


def test_classes_have_their_colours() -> None:
    colour = {0: PALE, 1: ORANGE, 2: BLUE, -1: MISSING}
    figure = chatter()
    (ax,) = figure.axes
    expected = [[to_rgba(colour[value]) for value in row] for row in CHATTER]
    np.testing.assert_array_equal(colours(ax), expected)
    assert legend_texts(figure) == [*NO_CONTACT_KNOWN, "run stopped"]


def test_no_contact_is_a_class_of_its_own() -> None:
    cube = made_up(AXES, chatter=np.abs(CHATTER.T))
    impacts = np.ones(cube.chatter.shape)
    impacts[0, 0] = 0.0
    figure = the_map(cube.assign(impacts_per_period=(cube.chatter.dims, impacts)), "chatter")
    assert legend_texts(figure)[:2] == ["no contact", "impacts without chatter"]
    found = colours(figure.axes[0])
    assert tuple(found[0, 0]) == to_rgba("white")
    assert tuple(found[2, 0]) != to_rgba("white")
    assert tuple(found[0, 2]) == to_rgba(BLUE)


def test_motions_have_names() -> None:
    """The most frequent one first."""
    cube = made_up(AXES, rms_ratio=1.0)
    names = [variable.name for variable in ObservedMotion.variables]
    found = np.ones((6, 4, 3))
    found[2, 0, 1] = 3.0  # impacts on the left wall
    found[:, 1, :] = np.array([0.0, *[np.nan] * 5])[:, None]
    found[0, 3, 2] = np.nan  # stopped
    values = {name: (cube.rms_ratio.dims, x) for name, x in zip(names, found, strict=True)}
    figure = the_map(cube.assign(values), "attractor")
    assert legend_texts(figure) == [
        "period 1, 1 impact and 1 complete chatter sequence on each wall, more to the right",
        "no period found",
        "period 1, impacts 3 left, 1 right, complete chatter sequences 1 left, 1 right",
        "run stopped",
    ]
    cells = colours(figure.axes[0])
    assert (cells[:, 2] == cells[0, 0]).all()
    assert (cells[:, 1] == cells[0, 1]).all()
    assert len({tuple(cell) for cell in cells.reshape(-1, 4)}) == 4


def test_motions_are_marked_once_per_cycle() -> None:
    """Where runs start, at their phase; of many alike one, of irregular ones none."""
    axes = {"initial_displacement": [-1.0, 0.0, 1.0], "initial_relative_velocity": [-1.0, 1.0]}
    cube = made_up(axes, rms_ratio=1.0)
    names = [variable.name for variable in ObservedMotion.variables]
    cube = cube.assign({name: cube.rms_ratio.copy() for name in names})
    cube["motion_period"][2] = 0
    cube["motion_impacts_left"][1] = 3.0
    sample = (*cube.motion_period.dims, "sample")
    states = {"displacement": 0.5, "velocity": 0.25, "free_displacement": 0.0, "free_velocity": 1.0}
    cube = cube.assign({name: (sample, np.full((3, 2, 2), x)) for name, x in states.items()})
    cube["displacement"][1, :, 1] = -0.5
    cube.attrs["observers"] = json.dumps({"stroboscopic_section": {"free_mass": True}})
    look = {"variable": "attractor", "x": "initial_displacement", "y": "initial_relative_velocity"}
    ax = drawn("map", cube, **look).axes[0]
    marks = {str(mark.get_mfc()): sorted(mark.get_xydata().tolist()) for mark in ax.lines}
    assert sorted(marks.values()) == [[], [[-0.5, 0.75], [0.5, 0.75]], [[0.5, 0.75]]]
    assert "motions once per cycle, projected" in legend_texts(ax.figure)
    cube.attrs["observers"] = json.dumps({"stroboscopic_section": {"when": 0.5}})
    assert not drawn("map", cube, **look).axes[0].lines


def test_continuous_colours_and_their_bar() -> None:
    """Stopped runs are grey; so is a run without the value, as of no impact."""
    values = np.arange(12.0).reshape(4, 3)
    values[2, 1] = np.nan
    figure = the_map(made_up(AXES, peak_displacement=values), "peak_displacement")
    ax, bar = figure.axes
    np.testing.assert_array_equal(np.ma.filled(mesh(ax).get_array(), np.nan), values.T)
    assert tuple(colours(ax)[1, 2]) == to_rgba(MISSING)
    label = " ".join(bar.get_ylabel().split())
    assert label == r"largest displacement $x_\mathrm{max}$ / ($F_0/K$)"
    assert legend_texts(figure) == ["run stopped"]
    finished = made_up(AXES, peak_displacement=values)
    finished["status"] = 0 * finished.status
    assert legend_texts(the_map(finished, "peak_displacement")) == ["no value"]


def test_ratios_are_white_at_one_with_a_line() -> None:
    figure = ratio()
    ax = figure.axes[0]
    cells = mesh(ax)
    assert cells.cmap(cells.norm(1.0))[:3] == pytest.approx((1, 1, 1), abs=0.02)
    blue, orange = cells.cmap(cells.norm(0.3)), cells.cmap(cells.norm(1.5))
    assert blue[2] > blue[0]
    assert orange[0] > orange[2]
    # Either side has the colours of its own range.
    known = cells.get_array().compressed()
    assert cells.norm(known.min()) == pytest.approx(0.0)
    assert cells.norm(known.max()) == pytest.approx(1.0)
    assert cells.norm.inverse(cells.norm(0.3)) == pytest.approx(0.3)
    assert tuple(colours(ax)[2, 3]) == to_rgba(MISSING)
    assert legend_texts(figure) == ["no value", "ratio = 1"]
    shown = list(figure.axes[1].get_yticks())
    assert min(shown) < 1.0 < max(shown) <= known.max()


def test_cells_are_as_wide_as_their_place_or_of_equal_size() -> None:
    cube = made_up({"frequency_ratio": [0.5, 1.0, 2.5], "clearance": [0.1, 1.0, 10.0]}, chatter=0)
    ax = the_map(cube, "chatter").axes[0]
    corners = mesh(ax).get_coordinates()
    np.testing.assert_allclose(corners[0, :, 0], [0.25, 0.75, 1.75, 3.25])
    np.testing.assert_allclose(corners[:, 0, 1], np.array([0.1, 1.0, 10.0, 100.0]) / 10**0.5)
    assert (ax.get_xscale(), ax.get_yscale()) == ("linear", "log")
    ax = the_map(cube, "chatter", equal=True).axes[0]
    corners = mesh(ax).get_coordinates()
    np.testing.assert_allclose(corners[0, :, 0], [-0.5, 0.5, 1.5, 2.5])
    assert [text.get_text() for text in ax.get_yticklabels()] == ["0.1", "1", "10"]


# --- best


@pytest.mark.parametrize(("best", "rows"), [("min", [1, 2, 0]), ("max", [0, 0, 1])])
def test_best_is_marked_at_each_abscissa_where_the_damper_helps(best: str, rows: list[int]) -> None:
    figure = ratio(best=best)
    assert marks(figure.axes[0]) == [(x, Y[row]) for x, row in zip(X[1:], rows, strict=True)]
    word = {"min": "least", "max": "greatest"}[best]
    text = legend_texts(figure)[-1]
    assert text.startswith("best clearance at each frequency ratio (" + word)


def test_points_without_contact_are_hatched_and_never_best() -> None:
    impacts = np.ones((4, 3))
    impacts[1, 1] = impacts[2] = 0.0
    cube = made_up(AXES, rms_ratio=RATIO.T)
    cube = cube.assign(impacts_per_period=(cube.rms_ratio.dims, impacts))
    figure = the_map(cube, "rms_ratio", best="min")
    assert marks(figure.axes[0]) == [(0.9, Y[2]), (1.1, Y[0])]
    assert "walls never touched" in legend_texts(figure)


def test_steady_amplitude_over_the_map() -> None:
    ax = chatter(theory="steady_amplitude").axes[0]
    (line,) = ax.lines
    omega, amplitude = np.array(line.get_data())
    expected = 1.0 / np.abs(1.0 - omega**2 + 0.04j * omega)
    np.testing.assert_allclose(amplitude, expected)
    assert legend_texts(chatter(theory="steady_amplitude"))[-1].startswith("$d = A$")


# --- several runs at a point

DRAWN = np.stack([RATIO.T, RATIO.T[::-1], 0.5 * RATIO.T], axis=-1)


def several(**arrays: Any) -> xr.Dataset:
    return made_up(AXES, {"draw": [0, 1, 2]}, **arrays)


def test_the_share_of_several_runs() -> None:
    figure = the_map(several(rms_ratio=DRAWN), "rms_ratio", share=["draw"], above=1)
    cells = mesh(figure.axes[0]).get_array()
    expected = np.where(np.isnan(DRAWN).any(axis=-1), np.nan, (DRAWN > 1).mean(axis=-1)).T
    np.testing.assert_array_equal(np.ma.filled(cells, np.nan), expected)
    label = " ".join(figure.axes[1].get_ylabel().split())
    assert label.startswith("part of 3 draws above 1: rms displacement")


def test_what_no_contact_means_from_exact_rest() -> None:
    """The same runs at a relative velocity reach a wall, or may yet."""
    common: dict[str, Any] = {
        **{"mass_ratio": 0.1, "damping_ratio": 0.02, "frequency_ratio": [1.3, 1.4]},
        **{"clearance": [1.0, 9.0], "restitution": 0.6, "transient": 20, "periods": 2},
        **{"observers": ["response", "impacts", "bursts"]},
    }
    rest, moving = (simulate(**common, initial_relative_velocity=v) for v in (0.0, 1e-3))
    held = simulate(**common, support_stiffness_ratio=0.1)
    rubbing = simulate(**common, friction=0.1)
    words = " from exact rest (neutrally stable without friction)"
    idle = int((rest.impacts_per_period == 0).sum())
    assert rest.attrs["runs_idle_from_rest"] == idle > 0
    for cube, text in ((rest, words), (moving, ""), (held, ""), (rubbing, "")):
        assert ("runs_idle_from_rest" in cube.attrs) == bool(text)
        for kind in ("bifurcation", "curves"):
            settings = {"along": "frequency_ratio", "variables": ["rms_displacement"]}
            figure = drawn(kind, cube, **settings, at={"clearance": 9.0})
            heading = figure.get_suptitle().replace("\n", " ")
            assert ("where idle, from exact rest alone" in heading) == bool(text)
        assert f"walls never touched{text}" in legend_texts(the_map(cube, "rms_ratio"))
        assert legend_texts(the_map(cube, "chatter"))[0] == f"no contact{text}"


def test_contacts_are_of_any_mass_or_of_the_one_shown() -> None:
    cube = simulate(
        damping_ratio=0.05,
        frequency_ratio=[0.9, 1.1],
        restitution=0.6,
        masses=[
            {"mass_ratio": 0.1, "clearance": [0.5, 99.0]},
            {"mass_ratio": 0.1, "clearance": 99.0},
        ],
        transient=20,
        periods=2,
        observers={"response": {}, "bursts": {"bodies": [0, 1]}, "impacts": {}},
    )
    assert cube.attrs["runs_idle_from_rest"] == 2
    for variable, body, touched in (("rms_ratio", None, 2), ("chatter", 0, 2), ("chatter", 1, 0)):
        at = {} if body is None else {"body": body}
        x, y = "frequency_ratio", "clearance_0"
        shown = classified(cube, {"variable": variable, "at": at, "x": x, "y": y}, x, y)
        assert int(shown.touched.sum()) == touched

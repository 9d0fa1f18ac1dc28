"""Bifurcation diagrams of small made-up cubes, where every mark's place is known."""

from typing import Any

import numpy as np
import pytest
import xarray as xr
from figures import drawing
from figures.drawing import assert_nothing_overlaps
from matplotlib.axes import Axes
from matplotlib.colors import to_rgb
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from damper import simulate
from damper.figures.common.style import BLACK, BLUE, COLUMN, ORANGE, SKY, THEORY
from damper.theory.steady import steady_amplitude

GRID = [0.0, 0.1, 0.2, 0.3, 0.4, 0.5, 0.6, 0.7, 0.8, 0.9, 1.0]
#: Incomplete at .1 and .2, complete at .4 to .6, complete at the end; a stopped run at .8.
CHATTER = [0, 1, 1, 0, 2, 2, 2, 0, -1, 0, 2]
SAMPLES = 5


def made_up(
    axes: dict[str, list[float]] | None = None,
    chatter: list[int] | None = CHATTER,
    branches: dict[str, list[Any]] | None = None,
) -> xr.Dataset:
    """Cube over restitution and other axes whose samples say where they belong."""
    axes = {"mass_ratio": [0.1], "frequency_ratio": [1.1, 1.5], "restitution": GRID} | (axes or {})
    axes |= {"restitution": axes.pop("restitution")}  # the last one
    lengths = [len(values) for values in (*axes.values(), *(branches or {}).values())]
    samples = np.arange(np.prod(lengths))[:, None] + np.linspace(0.0, 0.5, SAMPLES)
    arrays: dict[str, Any] = {"displacement": samples, "velocity": -10.0 * samples}
    if chatter is not None:
        arrays["chatter"] = np.resize(np.array(chatter, "i1"), lengths)
    return drawing.made_up(axes, branches, **arrays)


def drawn(cube: xr.Dataset, **settings: Any) -> Figure:
    """Figure whose layout has been made, with every warning an error."""
    return drawing.drawn("bifurcation", cube, **{"along": "restitution", **settings})


def panels(figure: Figure) -> list[list[Axes]]:
    """Axes in rows of two."""
    axes = figure.axes
    return [axes[k : k + 2] for k in range(0, len(axes), 2)]


def points(ax: Axes) -> Line2D:
    (line,) = (line for line in ax.lines if line.get_marker() == ".")
    return line


#: Kind of chatter by its colour.
KINDS = {to_rgb(BLUE): "complete", to_rgb(ORANGE): "incomplete"}


def shades(ax: Axes) -> set[tuple[float, float, str]]:
    """Left and right end and kind of each shaded stretch."""
    spans = [(p.get_x(), p.get_x() + p.get_width(), p.get_facecolor()) for p in ax.patches]
    return {
        (round(left, 9), round(right, 9), KINDS[to_rgb(colour)]) for left, right, colour in spans
    }


def bars(ax: Axes) -> set[tuple[float, float, str]]:
    """The same of the bars on the upper edge."""
    lines = [line for line in ax.lines if line.get_marker() != "."]
    ends = [(*np.round(line.get_xdata(), 9).tolist(), line.get_color()) for line in lines]
    return {(left, right, KINDS[to_rgb(colour)]) for left, right, colour in ends}


# --- one panel alone, and a marked range


def bracket(ax: Axes) -> tuple[float, float]:
    (line,) = (line for line in ax.lines if line.get_color() == THEORY)
    return float(min(line.get_xdata())), float(max(line.get_xdata()))


def test_mark_is_a_bracket_with_a_label() -> None:
    cube = made_up({"frequency_ratio": [1.1]})
    settings = {"variables": ["displacement"], "mark": (0.1, 0.5), "mark_label": "as stated"}
    figure = drawn(cube, **settings)
    (ax,) = figure.axes
    assert bracket(ax) == (0.1, 0.5)
    assert figure.get_figwidth() == COLUMN
    texts = ["incomplete chatter", "complete chatter", "as stated"]
    assert drawing.legend_texts(figure) == texts
    assert ax.get_xlim() == (0.0, 1.0)
    assert_nothing_overlaps(figure)


# --- points


#: Dimensions of a cube in another order than its axes have.
TURNED = ("sample", "restitution", "frequency_ratio", "mass_ratio")


def test_points_are_the_samples_over_their_abscissa() -> None:
    cube = made_up({"mass_ratio": [0.25, 0.1]})
    turned = cube.transpose(*TURNED)
    figure = drawn(turned, rows="frequency_ratio", at={"mass_ratio": 0.1})
    for row, value in zip(panels(figure), (1.1, 1.5), strict=True):
        place = cube.sel(mass_ratio=0.1, frequency_ratio=value)
        for ax, name in zip(row, ("displacement", "velocity"), strict=True):
            line = points(ax)
            got = set(zip(line.get_xdata(), line.get_ydata(), strict=True))
            expected = {
                (r, float(sample)) for r in GRID for sample in place[name].sel(restitution=r).values
            }
            assert got == expected


# --- chatter


EXPECTED = {(0.05, 0.25, "incomplete"), (0.35, 0.65, "complete"), (0.95, 1.0, "complete")}


def test_shading_lies_where_chatter_is() -> None:
    """Half a grid step about each value, ends at the axis' end, and nothing where it stopped."""
    for ax in drawn(made_up().transpose(*TURNED), rows="frequency_ratio").axes:
        assert shades(ax) == EXPECTED
        assert bars(ax) == EXPECTED


# --- unusual cubes


def test_logarithmic_axis_is_drawn_as_one() -> None:
    """Points are as far apart on the paper, and shades reach half way between them there."""
    grid = [0.01 * 10.0 ** (k / 4) for k in range(9)]
    levels = [0, 2, 2, 0, 1, 0, 0, 0, 2]
    cube = made_up({"frequency_ratio": [1.1], "restitution": grid}, levels)
    for ax in drawn(cube).axes:
        places = ax.transData.transform([(value, 0.0) for value in grid])[:, 0]
        assert np.diff(places) == pytest.approx(np.diff(places).mean(), rel=1e-6)
        assert ax.get_xlim() == pytest.approx((grid[0], grid[-1]))
        step = 10.0 ** (1 / 8)
        assert sorted(shades(ax)) == [
            (pytest.approx(grid[1] / step), pytest.approx(grid[2] * step), "complete"),
            (pytest.approx(grid[4] / step), pytest.approx(grid[4] * step), "incomplete"),
            (pytest.approx(grid[8] / step), pytest.approx(grid[8]), "complete"),
        ]


# --- relative motion, approach speeds, amplitudes


def simulated(**settings: Any) -> xr.Dataset:
    return simulate(
        mass_ratio=0.1,
        damping_ratio=0.02,
        frequency_ratio=[0.8, 0.9, 1.0],
        clearance=2.0,
        restitution=0.5,
        transient=20,
        periods=5,
        observers={
            "stroboscopic_section": {"free_mass": True},
            "impacts": {"speeds": 12},
            "response": {},
        },
        **settings,
    )


def test_free_mass_between_the_walls_and_approach_speeds() -> None:
    cube = simulated()
    figure = drawn(
        cube,
        along="frequency_ratio",
        variables=["relative_displacement", "relative_velocity", "approach_speed"],
    )
    place, velocity, speeds = (points(ax).get_ydata() for ax in figure.axes)
    between = (cube.free_displacement - cube.displacement).values.ravel() / 2.0
    np.testing.assert_allclose(place, between)
    assert np.abs(place).max() <= 1.0 + 1e-12
    np.testing.assert_allclose(velocity, (cube.free_velocity - cube.velocity).values.ravel())
    np.testing.assert_array_equal(speeds, cube.approach_speed.values.ravel())
    assert [ax.get_yscale() for ax in figure.axes] == ["linear", "linear", "log"]
    # A ratio of lengths has no unit.
    assert figure.axes[0].get_ylabel().endswith("$(y - x)/d$")
    with pytest.raises(ValueError, match="free_mass: true"):
        drawn(
            cube.drop_vars("free_displacement"),
            along="frequency_ratio",
            variables=["relative_velocity"],
        )


def test_of_several_masses_one_is_drawn_over_its_own_clearance_or_chatter_of_any() -> None:
    bodies = {"bodies": [0, 1]}
    cube = simulate(
        **{"damping_ratio": 0.02, "frequency_ratio": [0.8, 0.9], "restitution": 0.5},
        masses=[{"mass_ratio": 0.1, "clearance": 2.0}, {"mass_ratio": 0.1, "clearance": 0.1}],
        **{"transient": 20, "periods": 5},
        observers={"stroboscopic_section": {"free_mass": True, **bodies}, "bursts": bodies},
    )
    settings: dict[str, Any] = {"along": "frequency_ratio", "variables": ["relative_displacement"]}
    figure = drawn(cube, **settings, at={"body": 1})
    assert "mass 1" in figure.get_suptitle()
    between = (cube.free_displacement.sel(body=1) - cube.displacement).values.ravel() / 0.1
    np.testing.assert_allclose(points(figure.axes[0]).get_ydata(), between)
    assert np.abs(between).max() <= 1.0 + 1e-12
    cube["chatter"][:] = [[0, 0], [2, 0]]
    (ax,) = drawn(cube, along="frequency_ratio", variables=["displacement"]).axes
    assert [patch.get_x() for patch in ax.patches] == [pytest.approx(0.85)]


def test_a_long_legend_takes_no_height_of_the_panels() -> None:
    """With theory it has five lines in one column; labels of two rows ran into one another."""
    given = {"mass_ratio": 0.1, "damping_ratio": 0.1, "frequency_ratio": 1.0, "transient": 2}
    axes = {"clearance": [4.0, 5.0, 6.0], "restitution": [0.4, 0.6], "periods": 3}
    cube = simulate(**given, **axes, follow={"clearance": "both"})
    look = {"along": "clearance", "rows": "restitution", "variables": ["displacement"]}
    plain, long = (drawn(cube, **look, theory=theory) for theory in (None, "two_impacts"))
    assert len(drawing.legend_texts(long)) > len(drawing.legend_texts(plain)) > 3
    for figure in (plain, long):
        figure.draw_without_rendering()
    free, taken = (figure.axes[0].get_window_extent().height for figure in (plain, long))
    assert taken > 0.9 * free


def test_amplitudes_are_points_of_each_direction_over_the_undamped_curve() -> None:
    """Points, for a line would join what lies on either side of a jump."""
    cube = simulated(follow={"frequency_ratio": "both"})
    figure = drawn(cube, along="frequency_ratio", variables=["peak_displacement"])
    (ax,) = figure.axes
    assert ax.get_yscale() == "log"
    up, down, alone = ax.lines
    for line, direction in ((up, "up"), (down, "down")):
        assert line.get_linestyle() == "None"
        expected = cube.peak_displacement.sel(direction=direction).values.ravel()
        np.testing.assert_array_equal(line.get_ydata(), expected)
    undamped = [steady_amplitude(0.02, omega) for omega in (0.8, 0.9, 1.0)]
    np.testing.assert_allclose(alone.get_ydata(), undamped, rtol=1e-12)
    # No entry for chatter, which was not observed.
    texts = ["continued upwards", "continued downwards", "without damper"]
    assert drawing.legend_texts(figure) == texts
    assert_nothing_overlaps(figure)


# --- branches


def branched(branches: dict[str, list[Any]], chatter: list[list[int]] | None = None) -> xr.Dataset:
    """One row of a made-up cube whose samples differ between the branches."""
    levels = None if chatter is None else np.array(chatter).T.ravel().tolist()
    return made_up({"frequency_ratio": [1.1]}, levels or [0], branches)


def clouds(ax: Axes) -> dict[str, Line2D]:
    names = {BLACK: "up", SKY: "down"}
    return {names[line.get_color()]: line for line in ax.lines if line.get_marker() == "."}


UP_AND_DOWN = {"direction": ["up", "down"]}


def test_each_direction_has_its_colour() -> None:
    cube = branched(UP_AND_DOWN)
    figure = drawn(cube)
    for ax, name in zip(figure.axes, ("displacement", "velocity"), strict=True):
        found = clouds(ax)
        assert set(found) == {"up", "down"}
        for direction, line in found.items():
            expected = cube[name].sel(direction=direction).values.ravel()
            np.testing.assert_array_equal(line.get_ydata(), expected)
            np.testing.assert_array_equal(line.get_xdata(), np.repeat(GRID, SAMPLES))
        # What lies beneath shows as a rim, and alone where the other one is elsewhere.
        assert found["down"].get_markersize() > 1.5 * found["up"].get_markersize()
    assert drawing.legend_texts(figure) == [
        "continued upwards",
        "continued downwards",
        "incomplete chatter",
        "complete chatter",
    ]

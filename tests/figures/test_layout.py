"""What all figures share: selection, labels, scales, legends."""

from pathlib import Path

import numpy as np
import pytest
from figures.drawing import made_up
from matplotlib.figure import Figure

from damper.analysis.optimum import least
from damper.figures.common.layout import head, select, write_prefixes
from damper.figures.common.panels import finish, legend_line, panel_grid
from damper.figures.common.style import label, save, style

AXES = {"mass_ratio": [0.1, 0.2], "clearance": [0.5, 1.0, 1.5]}
DIRECTIONS = {"direction": ["up", "down"]}


def test_selection_keeps_what_is_shown_and_squeezes_the_rest() -> None:
    cube = made_up({**AXES, "restitution": [0.5]}, DIRECTIONS, chatter=1)
    place = select(cube, ["chatter"], {"mass_ratio": 0.2, "direction": "up"}, ("clearance", None))
    assert place.chatter.dims == ("clearance",)
    assert (place.mass_ratio, place.restitution, place.direction) == (0.2, 0.5, "up")
    # A parameter that is the same throughout may be given as well.
    at = {"restitution": 0.5, "damping_ratio": 0.02}
    select(cube, ["chatter"], at, ("mass_ratio", "clearance", "direction"))


@pytest.mark.parametrize(
    ("variable", "at", "keep", "words"),
    [
        ("chater", {}, (), r"unknown variable 'chater' \(did you mean 'chatter'\?\): must"),
        ("chatter", {}, ("gap",), r"unknown axis 'gap': must be one of mass_ratio, clearance"),
        ("chatter", {}, ("mass_ratio",), r"clearance has 3 values but no place.*'clearance': 0.5"),
        ("chatter", {"clearance": 1.8}, (), r"clearance = 1.8: outside .* 0.5 to 1.5; .* 1.5"),
        ("chatter", {"gap": 1.0}, (), r"no axis 'gap' with 1.0: must be one of mass_ratio"),
        ("chatter", {"restitution": 0.7}, (), r"no axis 'restitution' with 0.7"),
        ("chatter", {"direction": "left"}, (), r"direction = 'left': must be one of up, down"),
        ("chatter", {}, ("mass_ratio", "clearance"), r"direction has 2 values"),
    ],
)
def test_selection_tells_what_is_wrong(
    variable: str, at: dict[str, object], keep: tuple[str, ...], words: str
) -> None:
    cube = made_up(AXES, DIRECTIONS, chatter=1)
    with pytest.raises(ValueError, match=words):
        select(cube, [variable], at, keep)


def test_least_of_nearly_equal_values_is_the_first() -> None:
    assert least(np.array([2.0, 1.0 + 1e-9, 1.0, 1.5])) == 1
    assert least(np.array([2.0, 1.1, 1.0])) == 2
    assert least(np.array([np.inf, np.inf])) == 0
    assert least(np.array([0.0, -1.0, -1.0])) == 1


@pytest.mark.parametrize(
    ("largest", "units", "scale", "shown", "texts"),
    [
        (2e-3, "m", "linear", "mm", {"0.00", "0.50", "2.00"}),
        (2e-6, "m/s", "linear", "(µm/s)", {"0.00", "0.50", "2.00"}),
        (3e7, "N/m", "linear", "(MN/m)", {"0", "10", "30"}),
        (2e-3, "m", "log", "mm", {"0.5", "1", "2"}),
        (2e-2, "m", "log", "mm", {"0.01", "1", "10"}),
        (5.0, "m", "linear", "m", {"0", "1", "5"}),
        (2e-3, "s2", "linear", "s²", set()),
    ],
)
def test_axes_have_the_prefix_that_suits_them(
    largest: float, units: str, scale: str, shown: str, texts: set[str], tmp_path: Path
) -> None:
    """The data stay as they are; an axis with the same limits and no label of its own follows."""
    with style():
        figure, ((above,), (below,)) = panel_grid(2, height=2.0)
        first = {"linear": 0.0, "log": largest / (4 if largest < 1e-2 else 1e4)}[scale]
        below.plot([first, largest], [0.0, 1.0])
        below.set(xscale=scale, xlabel=label("length", "$l$", units))
        write_prefixes(figure)
        save(figure, tmp_path / "one.png")
    assert below.get_xlabel() == f"length $l$ / {shown}"
    written = {text.get_text() for text in below.get_xticklabels()}
    assert texts <= written
    assert above.xaxis.get_major_formatter() is below.xaxis.get_major_formatter()
    assert below.lines[0].get_xdata()[1] == largest
    assert bool(texts) != bool(below.xaxis.get_offset_text().get_text())


def test_a_heading_has_what_is_not_default() -> None:
    cube = made_up(AXES, DIRECTIONS, chatter=1).isel(clearance=0, mass_ratio=0, direction=0)
    for phase, shown in ((0.0, False), (0.5, True)):
        figure = Figure()
        head(figure, cube.assign_coords(phase=phase), "A caption")
        assert (r"$\varphi$" in figure.get_suptitle()) is shown


def test_a_figure_grows_with_a_long_legend_alone() -> None:
    heights = []
    for count in (1, 3, 5):
        figure = Figure(figsize=(3.0, 2.0), layout="constrained")
        figure.subplots()
        lines = [legend_line(f"line {k}, whose name fills the whole width") for k in range(count)]
        finish(figure, made_up(AXES, chatter=1), None, lines, room=3)
        heights.append(figure.get_figheight())
    assert heights[0] == heights[1] == 2.0 < heights[2] < 2.0 + 3 * 0.2

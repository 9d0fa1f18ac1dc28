"""Parts of the starts that end in each motion, stacked."""

import numpy as np
from figures.drawing import drawn, legend_texts, made_up

from damper.figures.basins import pairs_together
from damper.figures.common.style import PALE, motion_colours
from damper.observers.motion import ObservedMotion


def test_parts_are_stacked_over_the_axis() -> None:
    axes = {"frequency_ratio": [0.8, 0.9, 1.0], "initial_velocity": [-1.0, 1.0, 2.0, 3.0]}
    cube = made_up(axes, rms_ratio=1.0)
    period = np.array([[1.0] * 4, [1.0, 1.0, 1.0, 2.0], [np.nan] * 4])
    motions = {variable.name: np.ones((3, 4)) for variable in ObservedMotion.variables}
    motions["motion_period"] = period
    cube = cube.assign({name: (cube.status.dims, x) for name, x in motions.items()})
    figure = drawn("basins", cube, along="frequency_ratio")
    assert [text.split(",")[0] for text in legend_texts(figure)] == ["period 2", "period 1"]
    lower, upper = figure.axes[0].collections
    assert lower.get_paths()[0].vertices[:, 1].max() == 1.0
    assert upper.get_paths()[0].vertices[:, 1].min() == 0.75
    assert "4 starts at each value" in figure.get_suptitle()


def test_a_motion_has_one_colour_in_all_figures() -> None:
    pair = ["period 1, impacts 1 left, 2 right", "period 1, impacts 2 left, 1 right"]
    doubled = "period 2, impacts 2 left, 4 right"
    one, other = motion_colours([*pair, doubled]), motion_colours([doubled, "other motions", *pair])
    assert {name: other[name] for name in one} == one
    assert len({*other.values()}) == 4
    assert other["other motions"] == PALE
    # More kinds than hues still have colours.
    assert len(motion_colours([f"period {k}, no impacts" for k in range(1, 12)])) == 11


def test_mirror_pairs_lie_side_by_side() -> None:
    names = ["period 1, impacts 1 left, 2 right", "no period found"]
    names += ["period 4, 4 impacts on each wall, more to the left", "other motions"]
    names += ["period 1, impacts 2 left, 1 right", "period 2, impacts 2 left, 4 right"]
    names += ["period 4, 4 impacts on each wall, more to the right"]
    order = [names.index(name) for name in pairs_together(names)]
    assert order == [0, 4, 1, 2, 6, 3, 5]

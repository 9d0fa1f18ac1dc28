"""Parts of the starts that end in each motion, stacked."""

import numpy as np
from figures.drawing import drawn, legend_texts, made_up

from damper.observers.motion import ObservedMotion


def test_parts_are_stacked_over_the_axis() -> None:
    axes = {"frequency_ratio": [0.8, 0.9, 1.0], "initial_velocity": [-1.0, 1.0, 2.0, 3.0]}
    cube = made_up(axes, rms_ratio=1.0)
    period = np.array([[1.0] * 4, [1.0, 1.0, 1.0, 2.0], [np.nan] * 4])
    motions = {variable.name: np.ones((3, 4)) for variable in ObservedMotion.variables}
    motions["motion_period"] = period
    cube = cube.assign({name: (cube.status.dims, x) for name, x in motions.items()})
    figure = drawn("basins", cube, along="frequency_ratio")
    assert [text.split(",")[0] for text in legend_texts(figure)] == ["period 1", "period 2"]
    lower, upper = figure.axes[0].collections
    assert lower.get_paths()[0].vertices[:, 1].max() == 1.0
    assert upper.get_paths()[0].vertices[:, 1].min() == 0.75
    assert "4 starts at each value" in figure.get_suptitle()

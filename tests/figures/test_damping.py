"""The figure of damping: points and the law where they should be, and what it says of the rest."""

from typing import Any

import numpy as np
import pytest
from figures.drawing import assert_nothing_overlaps, drawn, legend_texts, svg_of
from matplotlib.axes import Axes
from matplotlib.colors import to_rgba
from matplotlib.lines import Line2D

import damper
from damper.figures.common.style import BLACK
from damper.theory.free_decay import amplitude_range, equivalent_damping

SI = {
    "primary_mass": 2.0,
    "damping": 0.04,
    "stiffness": 200.0,
    "force_amplitude": 0.0,
    "forcing_frequency": 10.0,
    "free_mass": [0.02, 0.002],
    "gap": 0.5,
    "restitution": [0.3, 0.6],
}
RATIOS = {
    "mass_ratio": [0.01, 0.001],
    "damping_ratio": 0.001,
    "frequency_ratio": 1.0,
    "clearance": 0.25,
    "force_amplitude": 0.0,
    "restitution": [0.3, 0.6],
}
RUN: dict[str, Any] = {"initial_displacement": 0.3, "transient": 0, "periods": 100}
ASKED = {"decay": {"half_cycles": 150}}


def law(ax: Axes) -> list[Line2D]:
    return [line for line in ax.lines if to_rgba(line.get_color()) == to_rgba(BLACK)]


@pytest.mark.parametrize("si", [False, True], ids=["dimensionless", "SI"])
def test_points_and_law(si: bool, tmp_path) -> None:
    cube = damper.simulate(**(SI if si else RATIOS), **RUN, observers=ASKED)
    lines = "free_mass" if si else "mass_ratio"
    figure = drawn("damping", cube, lines=lines, panels="restitution")
    assert len(figure.axes) == 2
    for ax, r in zip(figure.axes, (0.3, 0.6), strict=True):
        points = [line for line in ax.lines if line not in law(ax)]
        for line, mu, value in zip(points, (0.01, 0.001), cube[lines].values, strict=True):
            run = cube.sel({"restitution": r, lines: value})
            ratio = run.equivalent_damping_ratio.values
            seen = np.isfinite(ratio)
            assert seen.sum() > 100
            xi, added = line.get_data()
            np.testing.assert_allclose(xi, run.peak_amplitude.values[seen] / 0.25)
            np.testing.assert_allclose(added, (ratio[seen] - 0.001) / mu, atol=1e-9)
        stable, beyond, _ = law(ax)
        p = damper.Parameters(0.01, 0.001, 1.0, 0.25, r, force_amplitude=0.0)
        low, high = amplitude_range(p)
        xi, added = stable.get_data()
        assert xi[[0, -1]] * 0.25 == pytest.approx([low, high])
        np.testing.assert_allclose(
            added[1:], (equivalent_damping(p, 0.25 * xi[1:]) - 0.001) / 0.01, rtol=1e-9
        )
        assert beyond.get_xdata()[-1] == max(line.get_xdata().max() for line in points)
    assert sum("simulated" in text for text in legend_texts(figure)) == 2
    heading = figure.get_suptitle().replace("\n", " ")
    assert f"up to {int(cube.half_cycles.max()) - 150} half cycles not listed" in heading
    assert_nothing_overlaps(figure)
    svg_of(figure, tmp_path)


def test_another_damper_is_refused() -> None:
    cube = damper.simulate(
        **RATIOS | {"restitution": 0.3, "mass_ratio": 0.01},
        **RUN, observers=ASKED, support_stiffness_ratio=1e-4,
    )  # fmt: skip
    with pytest.raises(ValueError, match="this damper has a support of the free mass"):
        drawn("damping", cube)

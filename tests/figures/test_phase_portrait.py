"""Phase portraits and Poincare maps of simulated trajectories."""

from typing import Any

import numpy as np
import pytest
import xarray as xr
from figures.drawing import drawn
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from damper import simulate
from damper.figures import phase_portrait
from damper.figures.phase_portrait import _SECTION as SECTION

POINT = {"mass_ratio": 0.25, "damping_ratio": 0.02, "frequency_ratio": 2.0, "clearance": 0.05}
OBSERVERS: dict[str, Any] = {"stroboscopic_section": None, "trajectory": {"length": 8}}


def simulated(**given: Any) -> xr.Dataset:
    settings = {"transient": 300, "periods": 40, "observers": OBSERVERS}
    return simulate(**{**POINT, "restitution": [0.566, 0.582], **settings, **given})


@pytest.fixture(scope="module")
def cube() -> xr.Dataset:
    """One point on the section, and no period."""
    return simulated()


def line(ax: Axes, style: dict[str, Any]) -> Line2D:
    (found,) = [k for k in ax.lines if k.get_color() == style["color"] and k.get_marker() == "None"]
    return found


def table(figure: Any, columns: int = 2) -> np.ndarray:
    return np.array(figure.axes).reshape(3, columns)


def test_lines_are_the_motion(cube: xr.Dataset) -> None:
    axes = table(drawn("phase_portrait", cube, columns="restitution"))
    for column, r in zip(axes.T, cube.restitution.values, strict=True):
        run = cube.sel(restitution=r)
        known = np.isfinite(run.trajectory_time.values)
        x, v, y, u = (
            run[f"trajectory_{name}"].values[known]
            for name in ("displacement", "velocity", "free_displacement", "free_velocity")
        )
        primary = line(column[0], phase_portrait._PRIMARY)
        np.testing.assert_array_equal(primary.get_xdata(), x)
        np.testing.assert_array_equal(primary.get_ydata(), v)
        relative = line(column[1], phase_portrait._RELATIVE)
        np.testing.assert_array_equal(relative.get_xdata(), y - x)
        np.testing.assert_array_equal(relative.get_ydata(), u - v)


def test_section_and_its_number_of_points(cube: xr.Dataset) -> None:
    axes = table(drawn("phase_portrait", cube, columns="restitution"))
    before, after = axes[2]
    for ax, r in zip((before, after), cube.restitution.values, strict=True):
        run = cube.sel(restitution=r)
        (points,) = ax.lines
        np.testing.assert_array_equal(points.get_xdata(), run.displacement.values)
        np.testing.assert_array_equal(points.get_ydata(), run.velocity.values)
    found = [ax.get_title(loc="left") for ax in (before, after)]
    assert found[0] == "$r$ = 0.566: Poincaré map, 1 point (40 taken)"
    assert found[1] == "$r$ = 0.582: Poincaré map, no period found (40 taken)"
    # One scale for both.
    assert before.get_xlim() == after.get_xlim()
    assert before.get_ylim() == after.get_ylim()


def test_what_is_missing_is_told() -> None:
    few = simulated(restitution=0.6, observers=OBSERVERS | {"trajectory": {"events": 3}})
    axes = table(drawn("phase_portrait", few), 1)
    assert axes[0, 0].texts[0].get_text().startswith(f"{int(few.trajectory_events_left_out)} event")
    bare = simulated(restitution=0.6, observers=["trajectory"])
    with pytest.raises(ValueError, match="unknown variable 'displacement'"):
        drawn("phase_portrait", bare)


def test_few_points_of_a_section_are_seen() -> None:
    """Twenty of a motion without a period are as large as a single one, thousands small."""
    sizes = []
    for count in (20, 400, 4000):
        points = np.random.default_rng(1).normal(size=(2, count))
        run = xr.Dataset({n: ("sample", v) for n, v in zip(SECTION, points, strict=True)})
        ax = Figure().subplots()
        phase_portrait._section(ax, run, "")
        sizes.append(ax.lines[0].get_markersize())
    assert sizes == [6.0, 3.0, 2.2]

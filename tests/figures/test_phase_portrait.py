"""Phase portraits and Poincare maps of simulated trajectories."""

from itertools import pairwise
from typing import Any

import numpy as np
import pytest
import xarray as xr
from figures.drawing import SI, drawn, laid_out
from matplotlib.axes import Axes
from matplotlib.lines import Line2D

from damper import simulate
from damper.figures import phase_portrait

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


def test_walls_enclose_the_relative_motion(cube: xr.Dataset) -> None:
    axes = table(drawn("phase_portrait", cube, columns="restitution"))
    for ax in axes[1]:
        walls = [k.get_xdata()[0] for k in ax.lines if k.get_color() == "#777777"]
        assert walls == [-0.05, 0.05]
        inside = line(ax, phase_portrait._RELATIVE).get_xdata()
        assert np.abs(inside).max() == pytest.approx(0.05, abs=1e-12)
        low, high = ax.get_xlim()
        assert low < -0.05 < 0.05 < high


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


def test_rounding_errors_do_not_fill_a_panel() -> None:
    single = simulated(restitution=0.566, transient=1000)  # settled: 300 periods leave 4e-7
    axes = table(drawn("phase_portrait", single), 1)
    for low, high, name in (
        (*axes[2, 0].get_xlim(), "displacement"),
        (*axes[2, 0].get_ylim(), "velocity"),
    ):
        spread = float(np.ptp(single[name].values))
        assert spread < 1e-4 * (high - low)
    assert axes[2, 0].get_title(loc="left") == "Poincaré map, 1 point (40 taken)"


@pytest.mark.parametrize("restitution", [0.566, [0.5, 0.566, 0.582]])
def test_tick_labels_do_not_touch(restitution: float | list[float]) -> None:
    wide = simulated(restitution=restitution, transient=60)  # a transient spreads the section
    columns = wide.restitution.size
    settings = {"columns": "restitution" if columns > 1 else None}
    figure = laid_out(drawn("phase_portrait", wide, **settings))
    renderer = figure.canvas.get_renderer()
    for row in table(figure, columns):
        boxes = [
            label.get_window_extent(renderer)
            for ax in row
            for tick, label in zip(ax.get_xticks(), ax.get_xticklabels(), strict=True)
            if ax.get_xlim()[0] <= tick <= ax.get_xlim()[1]
        ]
        assert len(boxes) >= 2 * columns
        for left, right in pairwise(boxes):
            assert left.x1 + 4 < right.x0


def test_si_units() -> None:
    frame = simulate(
        **SI,
        gap=0.001,
        forcing_frequency=[18.0, 24.0],
        transient=20,
        periods=5,
        observers={"impact_section": {"samples": 10}, "trajectory": None},
    )
    axes = table(drawn("phase_portrait", frame, columns="forcing_frequency"))
    assert axes[1, 0].get_xlabel() == "relative displacement $(y - x)$ / mm"
    walls = [k.get_xdata()[0] for k in axes[1, 0].lines if k.get_color() == "#777777"]
    assert walls == [-0.0005, 0.0005]
    assert "(10 taken)" in axes[2, 0].get_title(loc="left")


def test_what_is_missing_is_told() -> None:
    few = simulated(restitution=0.6, observers=OBSERVERS | {"trajectory": {"events": 3}})
    axes = table(drawn("phase_portrait", few), 1)
    assert axes[0, 0].texts[0].get_text().startswith(f"{int(few.trajectory_events_left_out)} event")
    bare = simulated(restitution=0.6, observers=["trajectory"])
    with pytest.raises(ValueError, match="unknown variable 'displacement'"):
        drawn("phase_portrait", bare)


def test_no_clearance() -> None:
    stuck = simulated(clearance=0.0, restitution=0.6, transient=5, periods=20)
    axes = table(drawn("phase_portrait", stuck), 1)
    assert (line(axes[1, 0], phase_portrait._RELATIVE).get_xdata() == 0.0).all()

"""Time histories of simulated trajectories."""

import math
from typing import Any

import numpy as np
import pytest
import xarray as xr
from figures.drawing import drawn, legend_texts
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Rectangle
from scenes import SLOW as POINT

from damper import Record, events, simulate
from damper.figures import trajectory
from damper.parameters import Parameters
from damper.tables import make

PERIOD = 2 * math.pi / 0.2


def simulated(**given: Any) -> xr.Dataset:
    settings = {"transient": 0, "periods": 3, "observers": {"trajectory": None}}
    return simulate(**{**POINT, **settings, **given})


@pytest.fixture(scope="module")
def cube() -> xr.Dataset:
    """From rest: a chatter that ends in sticking in the second period."""
    return simulated()


def lines(ax: Axes) -> dict[str, Line2D]:
    names = {trajectory._PRIMARY["color"]: "primary", trajectory._FREE["color"]: "free"}
    return {names[k.get_color()]: k for k in ax.lines if k.get_color() in names}


def stuck(ax: Axes) -> list[tuple[float, float]]:
    spans = [patch for patch in ax.patches if isinstance(patch, Rectangle)]
    return [(span.get_x(), span.get_x() + span.get_width()) for span in spans]


def panels(figure: Figure) -> tuple[Axes, Axes]:
    above, below = figure.axes
    return above, below


def test_lines_are_the_trajectory(cube: xr.Dataset) -> None:
    above, below = panels(drawn("trajectory", cube))
    known = np.isfinite(cube.trajectory_time.values)
    for ax, name in ((above, "displacement"), (below, "velocity")):
        for body, prefix in (("primary", "trajectory_"), ("free", "trajectory_free_")):
            line = lines(ax)[body]
            expected = cube[f"{prefix}{name}"].values[known]
            np.testing.assert_array_equal(line.get_ydata(), expected)
            time = cube.trajectory_time.values[known] / PERIOD
            np.testing.assert_allclose(line.get_xdata(), time)
            assert np.isfinite(line.get_ydata()).all()
    assert below.get_xlim() == pytest.approx((0.0, 3.0))


def test_sticking_is_shaded_where_it_happens(cube: xr.Dataset) -> None:
    found = events(Parameters(**POINT), until=3 * PERIOD)
    sticks = found["time"][found["kind"] == 1] / PERIOD
    releases = found["time"][found["kind"] == 2] / PERIOD
    assert len(sticks)
    figure = drawn("trajectory", cube)
    for ax in figure.axes:
        spans = stuck(ax)
        np.testing.assert_allclose([a for a, _ in spans], sticks, rtol=1e-9)
        np.testing.assert_allclose([b for _, b in spans][: len(releases)], releases, rtol=1e-9)
    assert legend_texts(figure)[-1] == "sticking"


@pytest.mark.parametrize(("start", "stop"), [(0.0, 2.0), (1.0, 1.5), (0.5, None), (2.0, 9.0)])
def test_a_part_reaches_both_edges(cube: xr.Dataset, start: float, stop: float | None) -> None:
    _, below = panels(drawn("trajectory", cube, start=start, stop=stop))
    time = lines(below)["primary"].get_xdata()
    end = min(3.0 if stop is None else stop, 3.0)
    assert below.get_xlim() == pytest.approx((start, end))
    assert time[0] <= start
    assert time[-1] >= end - 1e-9
    assert time[1] >= start
    assert time[-3] <= end


def test_events_that_did_not_fit_are_told() -> None:
    few = simulated(observers={"trajectory": {"events": 3}})
    left_out = int(few.trajectory_events_left_out)
    above, _ = panels(drawn("trajectory", few))
    assert left_out > 10
    assert above.get_title(loc="right").startswith(f"{left_out} events did not fit")
    whole, _ = panels(drawn("trajectory", simulated()))
    assert whole.get_title(loc="right") == ""


# --- what drives the primary, and the primary alone


SHAKEN: dict[str, Any] = {
    "primary_mass": 2.0,
    "damping": 1.0,
    "stiffness": 200.0,
    "forcing_frequency": 3.0,
    "force_amplitude": 9.0,
    "free_mass": 0.2,
    "gap": 0.1,
    "restitution": 0.6,
    "transient": {"time": 0.1},
    "periods": {"time": 2.0},
}
BASE = Record([0.0, 0.4, 1.1, 1.3], [0.0, 1.0, -0.5, 0.0], of="base_acceleration")


@pytest.fixture(scope="module")
def shaken() -> xr.Dataset:
    asked = {"samples_per_period": 150, "drive": True, "without_damper": True}
    return simulate(**SHAKEN, forcing=BASE, observers={"trajectory": asked})


def test_what_drives_stands_above_in_its_own_unit_and_time(shaken: xr.Dataset) -> None:
    top, *others = drawn("trajectory", shaken).axes
    (line,) = (line for line in top.lines if line.get_color() == trajectory._FORCE["color"])
    time, drive = line.get_data()
    np.testing.assert_allclose(
        drive, 9.0 * np.interp(time + 0.1, BASE.time, BASE.value, right=0.0), atol=1e-12
    )
    assert time[-1] == pytest.approx(2.0, abs=2.0 * math.pi / 3.0 / 150.0)
    assert top.get_title(loc="left") == "acceleration of the base"
    assert others[-1].get_xlabel() == "time $t - t_0$ / s"
    at_once = shaken.assign_attrs(transient_periods=0)
    assert drawn("trajectory", at_once).axes[-1].get_xlabel() == "time $t$ / s"
    assert "Omega" not in drawn("trajectory", shaken).get_suptitle()


def test_free_motion_has_no_clock_in_figures_and_tables() -> None:
    common = {name: POINT[name] for name in ("mass_ratio", "damping_ratio", "restitution")}
    cube = simulate(
        **common,
        **{"clearance": [0.2, 0.3], "forcing": "none", "initial_displacement": 1.0},
        **{"transient": 0, "periods": 2, "observers": {"trajectory": None, "bursts": None}},
    )
    figure = drawn("trajectory", cube, at={"clearance": 0.2})
    assert figure.axes[-1].get_xlabel() == r"time $t$ / ($\sqrt{M/K}$)"
    assert figure.axes[-1].get_xlim()[1] == pytest.approx(4.0 * math.pi)
    assert "omega" not in figure.get_suptitle()
    text = make("intervals", {"cube": cube}, along="clearance", resolution=0.1).markdown()
    assert "frequency ratio" not in text
    assert "phase" not in text


def test_primary_alone_is_that_of_a_gap_out_of_reach(shaken: xr.Dataset) -> None:
    asked = {"trajectory": {"samples_per_period": 150}}
    far = simulate(**SHAKEN | {"gap": 1e4}, forcing=BASE, observers=asked)
    sampled = np.isnan(shaken.trajectory_event) & np.isfinite(shaken.trajectory_time)
    alone = shaken.trajectory_alone.values[sampled.values]
    np.testing.assert_allclose(alone, far.trajectory_displacement.values[: alone.size], atol=1e-14)
    assert abs(alone - shaken.trajectory_displacement.values[sampled.values]).max() > 1e-3
    assert "primary without damper" in legend_texts(drawn("trajectory", shaken))

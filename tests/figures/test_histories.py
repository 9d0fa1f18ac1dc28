"""Time histories one above the other, with chatter and sticking shaded."""

import math
from typing import Any

import numpy as np
import pytest
import xarray as xr
from figures.drawing import assert_nothing_overlaps, drawn, legend_texts
from matplotlib.axes import Axes
from matplotlib.colors import to_hex
from matplotlib.patches import Rectangle

from damper import simulate
from damper.analysis.stretches import listed_bursts, sticking
from damper.figures import histories
from damper.figures.common.style import BLUE, YELLOW

POINT = {"mass_ratio": 0.25, "damping_ratio": 0.02, "frequency_ratio": 1.5, "clearance": 0.05}
PERIOD = 2 * math.pi / 1.5
RESTITUTION = [0.3, 0.6, 0.8]
#: What each value does: sticks without chatter, completes, does not complete.
CLASSES = ["no chatter", "complete chatter", "incomplete chatter"]
OBSERVERS: dict[str, Any] = {
    "bursts": {"records": 30},
    "trajectory": {"start": 2, "length": 3, "samples_per_period": 200},
}


def simulated(**given: Any) -> xr.Dataset:
    settings = {"transient": 100, "periods": 10, "observers": OBSERVERS}
    return simulate(**{**POINT, "restitution": RESTITUTION, **settings, **given})


@pytest.fixture(scope="module")
def cube() -> xr.Dataset:
    return simulated()


def spans(ax: Axes, kind: str) -> list[tuple[float, float]]:
    found = []
    for patch in ax.patches:
        assert isinstance(patch, Rectangle)
        colour = to_hex(patch.get_facecolor()).upper()
        is_a = "incomplete" if patch.get_hatch() else {BLUE: "complete", YELLOW: "sticking"}[colour]
        if is_a == kind:
            found.append((patch.get_x(), patch.get_x() + patch.get_width()))
    return found


def test_lines_are_the_relative_motion_over_the_clearance(cube: xr.Dataset) -> None:
    figure = drawn("histories", cube, panels="restitution")
    assert len(figure.axes) == len(RESTITUTION)
    for ax, r in zip(figure.axes, RESTITUTION, strict=True):
        run = cube.sel(restitution=r)
        known = np.isfinite(run.trajectory_time.values)
        relative = run.trajectory_free_displacement - run.trajectory_displacement
        (line,) = [k for k in ax.lines if k.get_color() == histories._RELATIVE["color"]]
        np.testing.assert_allclose(line.get_ydata(), relative.values[known] / 0.05)
        np.testing.assert_allclose(line.get_xdata(), run.trajectory_time.values[known] / PERIOD)
        assert np.abs(line.get_ydata()).max() == pytest.approx(1.0, abs=1e-9)
        walls = [k.get_ydata()[0] for k in ax.lines if k.get_color() == histories._WALL["color"]]
        assert walls == [-1.0, 1.0]
    assert figure.axes[-1].get_xlim() == pytest.approx((0.0, 3.0))


def chatter(run: xr.Dataset) -> list[tuple[float, float, bool]]:
    """Start and end, since the sampled stretch began, and kind of each burst of chatter."""
    zero = float(run.trajectory_start)
    bursts = [burst for burst in listed_bursts(run) if burst.chatter]
    return [(burst.onset - zero, burst.end - zero, burst.complete) for burst in bursts]


def test_shades_are_the_stretches(cube: xr.Dataset) -> None:
    figure = drawn("histories", cube, panels="restitution")
    shaded = set()
    for ax, r in zip(figure.axes, RESTITUTION, strict=True):
        run = cube.sel(restitution=r)
        for kind in ("complete", "incomplete"):
            expected = [
                (start / PERIOD, stop / PERIOD)
                for start, stop, complete in chatter(run)
                if complete is (kind == "complete") and stop > 0.0 and start < 3.0 * PERIOD
            ]
            np.testing.assert_allclose(spans(ax, kind), expected)
            shaded |= {kind} if expected else set()
        known = np.isfinite(run.trajectory_time.values)
        stuck = sticking(
            run.trajectory_time.values[known] / PERIOD, run.trajectory_mode.values[known]
        )
        np.testing.assert_allclose(spans(ax, "sticking"), stuck)
    assert shaded == {"complete", "incomplete"}
    # A complete burst ends where sticking begins.
    ends, starts = ([k[i] for k in spans(figure.axes[1], n)] for n, i in SEAMS)
    assert set(np.round(ends, 9)) <= set(np.round(starts, 9))


SEAMS = (("complete", 1), ("sticking", 0))


def test_classes_and_legend(cube: xr.Dataset) -> None:
    figure = drawn("histories", cube, panels="restitution")
    for ax, r, text in zip(figure.axes, RESTITUTION, CLASSES, strict=True):
        assert ax.get_title(loc="left") == f"$r$ = {r:g}"
        visible = int(cube.visible_impacts.sel(restitution=r))
        assert ax.get_title(loc="right") == f"{text}, most visible impacts in a burst: {visible}"
    shades = ["complete chatter", "incomplete chatter", "sticking"]
    entries = ["free mass relative to the primary", "walls", *shades]
    assert legend_texts(figure) == entries
    assert "each panel classed from 10 cycles" in figure.get_suptitle()
    assert_nothing_overlaps(figure)
    plain = drawn("histories", cube.sel(restitution=[0.3]), panels="restitution")
    assert legend_texts(plain) == ["free mass relative to the primary", "walls", "sticking"]


def test_what_did_not_fit_is_told() -> None:
    few = simulated(
        restitution=[0.6], observers=OBSERVERS | {"trajectory": {"start": 2, "events": 3}}
    )
    (text,) = drawn("histories", few, panels="restitution").axes[0].texts
    assert text.get_text().startswith(f"{int(few.trajectory_events_left_out[0])} events did not")
    short = simulated(restitution=[0.6], observers=OBSERVERS | {"bursts": {"records": 6}})
    (text,) = drawn("histories", short, panels="restitution").axes[0].texts
    assert text.get_text() == "later bursts are not listed (observers: bursts: records)"
    (ax,) = drawn("histories", short, panels="restitution", stop=0.5).axes
    assert not ax.texts

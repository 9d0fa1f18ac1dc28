"""Slow invariant manifold: amplitudes of both masses, simulated and in the small-mass limit."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Annotated, Any, ClassVar

import numpy as np
from pydantic import Field

from damper.analysis.amplitudes import amplitudes
from damper.analysis.closed_forms import damper_at
from damper.analysis.stretches import MOTION_VARIABLES
from damper.figures.common import panels
from damper.figures.common.layout import select
from damper.figures.common.style import BLACK, BLUE, ORANGE
from damper.parameters.lazy import Artist, Axes, Figure, xr
from damper.study.fields import Text
from damper.study.products import MOST_PANELS, At, Caption, Each, FigureSettings, Role
from damper.theory import need_basic
from damper.theory.slow_manifold import SYMMETRIC_LIMIT, amplitude, fold, stable

_STABLE: dict[str, Any] = {"color": BLACK, "lw": 0.8}
_UNSTABLE: dict[str, Any] = {"color": BLACK, "lw": 0.9, "ls": (0, (3.0, 1.5))}
_POINT: dict[str, Any] = {"color": BLACK, "ls": "", "mfc": "white", "mew": 0.8}
_FOLD = _POINT | {"marker": "o", "ms": 3.6}
_LIMIT = _POINT | {"marker": "s", "ms": 3.4}
#: Cycles with two impacts, one on each wall, and all others -> how they are drawn.
_CYCLE: dict[str, Any] = {"ls": "", "marker": ".", "mew": 0.0, "rasterized": True}
_CYCLES: dict[bool, dict[str, Any]] = {
    False: _CYCLE | {"color": ORANGE, "ms": 2.8},
    True: _CYCLE | {"color": BLUE, "ms": 4.4},
}
_MEANINGS = {True: "simulated: two impacts in the cycle", False: "simulated: more or fewer"}
#: Most of the curve to be seen: theta beyond the largest simulated one.
_MARGIN = 1.08


class SlowManifold(FigureSettings):
    """Amplitude of the free mass against that of the primary, cycle by cycle, over the manifold.

    Uses the events of the trajectory; a light free mass and a slowly changing amplitude show it.
    """

    of_theory: ClassVar[bool] = True
    needs = ("trajectory",)
    roles: ClassVar[Mapping[str, Role]] = {"panels": Role(most=MOST_PANELS), "each": Role()}

    panels: Annotated[
        Text | None, Field(description="Axis of whose values each makes a panel.")
    ] = None
    each: Each = None
    at: At = None
    caption: Caption = None


def draw(results: Mapping[str, Any], settings: SlowManifold) -> Figure:
    """Draw the amplitude of the free mass against that of the primary, cycle by cycle."""
    keep = settings.panels, "instant"
    place = select(results["cube"], MOTION_VARIABLES, settings.at, keep)
    shown = panels.parts(place, settings.panels)
    figure, axes = panels.wrapped_panels(len(shown), {1: 2.2, 2: 2.2, 3: 2.2}, rest=1.2)
    drawn: set[bool] = set()
    for ax, (text, panel) in zip(axes, shown, strict=True):
        drawn |= _panel(ax, panel)
        panels.title(ax, text)
    primary, free = "amplitude of the primary", "peak of the free mass"
    over = "\nover the clearance"
    panels.label_outer(axes, f"{primary}{over} $\\xi$", f"{free}{over} $\\theta$")
    return panels.finish(figure, place, settings.caption, _handles(drawn))


def _panel(ax: Axes, panel: xr.Dataset) -> set[bool]:
    """Draw one panel; return which kinds of cycles it has."""
    cycles = amplitudes(panel)
    kinds = set()
    for two, style in _CYCLES.items():
        part = cycles.two_impacts == two
        if part.any():
            ax.plot(cycles.xi[part], cycles.theta[part], **style)
            kinds.add(two)
    if not kinds:
        panels.note_empty_panel(ax, "no impacts on the right wall")
    damper, _ = damper_at(panel)
    need_basic(damper)
    restitution = damper.restitution
    most = _MARGIN * max([2.0, *cycles.theta.tolist()])
    theta = np.linspace(0.0, most, 600)
    bounds = fold(restitution).theta, min(SYMMETRIC_LIMIT, most)
    theta = np.unique(np.concatenate([theta, bounds]))
    held = stable(theta, restitution) | np.isin(theta, bounds)
    for kept, style in ((held, _STABLE), (theta <= bounds[0], _UNSTABLE)):
        ax.plot(amplitude(theta[kept], restitution), theta[kept], **style)
    above = theta >= bounds[1]
    ax.plot(amplitude(theta[above], restitution), theta[above], **_UNSTABLE)
    ax.plot(fold(restitution).xi, fold(restitution).theta, **_FOLD)
    ax.plot(amplitude(SYMMETRIC_LIMIT, restitution), SYMMETRIC_LIMIT, **_LIMIT)
    right = max([1.5, *cycles.xi.tolist()])
    ax.set(xlim=(0.0, 1.04 * right), ylim=(0.0, most))
    return kinds


def _handles(drawn: set[bool]) -> list[Artist]:
    cycles = [two for two in (True, False) if two in drawn]
    return [
        *(panels.legend_line(_MEANINGS[two], **_CYCLES[two] | {"ms": 6.0}) for two in cycles),
        panels.legend_line("slow invariant manifold, stable", **_STABLE),
        panels.legend_line("the same, unstable", **_UNSTABLE),
        panels.legend_line("fold: least amplitude", **_FOLD),
        panels.legend_line("end of the symmetric motion", **_LIMIT),
    ]

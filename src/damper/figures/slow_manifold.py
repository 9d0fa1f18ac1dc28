"""Slow invariant manifold: amplitudes of both masses, simulated and in the small-mass limit."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Annotated, Any, ClassVar

import numpy as np
from pydantic import Field

from damper.analysis.amplitudes import TRAJECTORY_VARIABLES, amplitudes
from damper.analysis.closed_forms import damper_at
from damper.figures.common.layout import head, legend, place_text, say, select
from damper.figures.common.style import BLACK, BLUE, COLUMN, ORANGE, PAGE
from damper.study.fields import Text
from damper.study.products import (
    MOST_PANELS,
    At,
    Caption,
    Each,
    FigureSettings,
    Role,
)
from damper.theory import need_basic
from damper.theory.slow_manifold import SYMMETRIC_LIMIT, amplitude, fold, stable

if TYPE_CHECKING:
    import xarray as xr
    from matplotlib.artist import Artist
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

_STABLE: dict[str, Any] = {"color": BLACK, "lw": 0.8}
_UNSTABLE: dict[str, Any] = {"color": BLACK, "lw": 0.9, "ls": (0, (3.0, 1.5))}
_FOLD: dict[str, Any] = {
    "color": BLACK,
    "ls": "",
    "marker": "o",
    "ms": 3.6,
    "mfc": "white",
    "mew": 0.8,
}
_LIMIT: dict[str, Any] = {
    "color": BLACK,
    "ls": "",
    "marker": "s",
    "ms": 3.4,
    "mfc": "white",
    "mew": 0.8,
}
#: Cycles with two impacts, one on each wall, and all others -> how they are drawn.
_CYCLES: dict[bool, dict[str, Any]] = {
    False: {"color": ORANGE, "ls": "", "marker": ".", "ms": 2.8, "mew": 0.0, "rasterized": True},
    True: {"color": BLUE, "ls": "", "marker": ".", "ms": 4.4, "mew": 0.0, "rasterized": True},
}
_MEANINGS = {
    True: "simulated: two impacts in the cycle",
    False: "simulated: more or fewer",
}
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
    from matplotlib.figure import Figure

    cube = results["cube"]
    panels = settings.panels
    place = select(cube, TRAJECTORY_VARIABLES, settings.at, (panels, "instant"))
    shown = place[panels].values.tolist() if panels else [None]
    columns = min(3, len(shown))
    lines = -(-len(shown) // columns)
    size = (COLUMN if columns == 1 else PAGE, 1.2 + 2.2 * lines)
    figure = Figure(figsize=size, layout="constrained")
    axes = figure.subplots(lines, columns, sharex=True, sharey=True, squeeze=False).ravel()
    for ax in axes[len(shown) :]:
        ax.remove()
    drawn: dict[bool, bool] = {}
    for index, (ax, value) in enumerate(zip(axes[: len(shown)], shown, strict=True)):
        panel = place if value is None else place.sel({panels: value})
        for kind in _panel(ax, panel):
            drawn[kind] = True
        if panels:
            ax.set_title(place_text(place, panels, value), loc="left")
        if index + columns >= len(shown):
            ax.set_xlabel("amplitude of the primary\nover the clearance $\\xi$")
            ax.tick_params(labelbottom=True)
        if index % columns == 0:
            ax.set_ylabel("peak of the free mass\nover the clearance $\\theta$")
    head(figure, place, settings.caption)
    legend(figure, _handles(drawn))
    return figure


def _panel(ax: Axes, panel: xr.Dataset) -> list[bool]:
    """Draw one panel; return which kinds of cycles it has."""
    cycles = amplitudes(panel)
    kinds = []
    for two, style in _CYCLES.items():
        part = cycles.two_impacts == two
        if part.any():
            ax.plot(cycles.xi[part], cycles.theta[part], **style)
            kinds.append(two)
    if not kinds:
        say(ax, "no impacts on the right wall")
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


def _handles(drawn: Mapping[bool, bool]) -> list[Artist]:
    from matplotlib.lines import Line2D

    handles: list[Artist] = [
        Line2D([], [], label=_MEANINGS[two], **_CYCLES[two] | {"ms": 6.0})
        for two in (True, False)
        if two in drawn
    ]
    return [
        *handles,
        Line2D([], [], label="slow invariant manifold, stable", **_STABLE),
        Line2D([], [], label="the same, unstable", **_UNSTABLE),
        Line2D([], [], label="fold: least amplitude", **_FOLD),
        Line2D([], [], label="end of the symmetric motion", **_LIMIT),
    ]

"""Damping of a free vibration: equivalent damping ratio over amplitude, beside the closed form."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Annotated, Any, ClassVar

import numpy as np
from pydantic import Field

from damper.analysis.closed_forms import damper_at
from damper.figures.common import panels
from damper.figures.common.layout import numbers, select
from damper.figures.common.style import BLACK, BLUE, ORANGE, PURPLE
from damper.parameters import Parameters
from damper.parameters.dampers import BASIC
from damper.parameters.lazy import Axes, Figure, xr
from damper.study.fields import Text
from damper.study.products import MOST_PANELS, At, Caption, Each, FigureSettings, Role
from damper.theory.free_decay import amplitude_range, equivalent_damping, largest_damping

#: Each line's points: points of a later line are smaller and on top, so that all can be seen.
_POINT: dict[str, Any] = {"ls": "", "marker": "o", "rasterized": True}
_POINTS: tuple[dict[str, Any], ...] = (
    _POINT | {"mec": PURPLE, "mfc": "none", "mew": 0.7, "ms": 4.6},
    _POINT | {"color": ORANGE, "mew": 0.0, "ms": 2.9},
    _POINT | {"color": BLUE, "mew": 0.0, "ms": 1.3},
)
_LAW: dict[str, Any] = {"color": BLACK, "lw": 0.9}
_UNSTABLE = _LAW | {"ls": (0, (3.0, 1.5))}
_LARGEST: dict[str, Any] = {"color": BLACK, "ls": "", "marker": "D", "mfc": "white", "ms": 4.0}
#: Height of a panel over the largest damping of the closed form in it.
_HEADROOM = 1.3
#: Part of that height that is shown below 0, where the free mass gives energy back.
_BELOW = 0.08


class DampingFigure(FigureSettings):
    """Damping that impacts add to a free vibration, over its amplitude, beside its closed form.

    That is the equivalent damping ratio less that of the dashpot. It is shown over the mass ratio:
    dampers of any light free mass are then on one curve for each restitution.
    """

    of_theory: ClassVar[bool] = True
    knows: ClassVar[tuple[str, ...]] = (*BASIC, "force_amplitude", "forcing")
    needs = ("decay",)
    roles: ClassVar[Mapping[str, Role]] = {
        "lines": Role(most=len(_POINTS)),
        "panels": Role(most=MOST_PANELS),
        "each": Role(),
    }

    lines: Annotated[
        Text | None,
        Field(
            description="Axis of whose values each has points of its own, such as the mass ratio; "
            f"{len(_POINTS)} at most."
        ),
    ] = None
    panels: Annotated[
        Text | None, Field(description="Axis of whose values each makes a panel.")
    ] = None
    each: Each = None
    at: At = None
    caption: Caption = None


def draw(results: Mapping[str, Any], settings: DampingFigure) -> Figure:
    """Draw the damping that impacts add over the amplitude, half cycle by half cycle."""
    variables = ("peak_amplitude", "equivalent_damping_ratio", "half_cycles")
    keep = settings.panels, settings.lines, "half_cycle"
    place = select(results["cube"], variables, settings.at, keep)
    shown = panels.parts(place, settings.panels)
    figure, axes = panels.wrapped_panels(len(shown), {1: 2.4, 2: 2.4, 3: 2.4}, rest=1.2)
    for ax, (text, panel) in zip(axes, shown, strict=True):
        _panel(ax, panel, settings.lines)
        panels.title(ax, text)
    outside = _scale(axes)
    panels.label_outer(
        axes,
        "amplitude of the primary\nover the clearance $A/d$",
        "damping ratio added by impacts\nover the mass ratio "
        r"$(\zeta_\mathrm{eq} - \zeta)/\mu$",
    )
    dots = (*_POINTS[:2], _POINTS[2] | {"ms": 2.6})  # in the legend
    handles = [
        panels.legend_line(", ".join(filter(None, ("simulated: one half cycle", text))), **style)
        for style, (text, _) in zip(dots, panels.parts(place, settings.lines), strict=False)
    ]
    handles += [
        panels.legend_line("closed form of free decay, from the fold on", **_LAW),
        panels.legend_line("the same, no longer stable", **_UNSTABLE),
        panels.legend_line(r"largest by the closed form: $2d = \pi A\,(1+r)/(1-r)$", **_LARGEST),
    ]
    return panels.finish(figure, place, settings.caption, handles, [*_left_out(place), *outside])


def _panel(ax: Axes, panel: xr.Dataset, lines: str | None) -> None:
    """Draw one panel: points of each line, and the closed form of each restitution among them."""
    laws: dict[float, Parameters] = {}
    any_points = False
    shown = panels.parts(panel, lines)
    for number, (style, (_, line)) in enumerate(zip(_POINTS, shown, strict=False)):
        damper, units = damper_at(line)
        # Of equal laws any will do.
        laws[damper.restitution] = damper
        amplitude = numbers(line.peak_amplitude, "half_cycle") / (units.length * damper.clearance)
        ratio = numbers(line.equivalent_damping_ratio, "half_cycle")
        seen = np.isfinite(ratio)
        any_points |= bool(seen.any())
        added = (ratio[seen] - damper.damping_ratio) / damper.mass_ratio
        ax.plot(amplitude[seen], added, zorder=2.0 + 0.1 * number, **style)
    if not any_points:
        panels.note_empty_panel(ax, "no whole cycle of a free vibration here")
    seen_to = max(float(np.max(line.get_xdata(), initial=1.0)) for line in ax.lines)
    for damper in laws.values():
        _law(ax, damper, seen_to)


def _law(ax: Axes, damper: Parameters, most: float) -> None:
    """Draw the closed form of one damper, from the fold to an amplitude over the clearance."""
    low, high = (bound / damper.clearance for bound in amplitude_range(damper))

    def added(ratio: Any) -> Any:
        return (ratio - damper.damping_ratio) / damper.mass_ratio

    # The fold has a vertical tangent: dense next to it.
    rise = np.linspace(0.0, 1.0, 300) ** 2
    for start, end, style in ((low, high, _LAW), (high, max(most, high), _UNSTABLE)):
        xi = start + (end - start) * rise
        xi = xi[xi > 0.0]
        ax.plot(xi, added(equivalent_damping(damper, xi * damper.clearance)), **style, zorder=3.0)
    if damper.restitution < 1.0:
        top = largest_damping(damper)
        ax.plot(top.amplitude / damper.clearance, added(top.damping_ratio), **_LARGEST, zorder=3.1)


def _scale(axes: list[Axes]) -> list[str]:
    """Let panels show all of the closed form; say how many points lie above or below."""
    lines = [line for ax in axes for line in ax.lines]
    laws = [line.get_ydata() for line in lines if line.get_color() == BLACK]
    top = _HEADROOM * max(np.nanmax(ys, initial=0.0) for ys in laws) or 1.0
    bottom = -_BELOW * top
    for ax in axes:
        ax.set_xlim(left=0.0)
        ax.set_ylim(bottom, top)
    points = np.concatenate([line.get_ydata() for line in lines if line.get_color() != BLACK])
    outside = int(((points < bottom) | (points > top)).sum())
    return [f"{outside} of {points.size} half cycles outside of the panels"] if outside else []


def _left_out(place: xr.Dataset) -> list[str]:
    """Say what the window did not have room for."""
    missing = float((place.half_cycles - place.sizes["half_cycle"]).max())
    return [f"up to {missing:.0f} half cycles not listed"] if missing > 0.0 else []

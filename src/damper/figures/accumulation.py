"""Errors of predicted accumulation of bursts over the rebound speed, with their slopes."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Annotated, Any, ClassVar

import numpy as np
from pydantic import Field

from damper.analysis import accumulation
from damper.analysis.accumulation import ORDERS, PREDICTED, SHARP, Errors, errors_of
from damper.figures.common import panels
from damper.figures.common.layout import select
from damper.figures.common.style import BLACK, BLUE, ORANGE, label
from damper.parameters.lazy import Artist, Axes, Figure, xr
from damper.parameters.units import units_of
from damper.study.fields import Text
from damper.study.products import MOST_ROWS, At, Caption, Each, FigureSettings, Role

#: Order -> colour, marker, exponent of the law, its dashes.
_ORDERS: dict[str, tuple[str, str, int, str]] = {
    "first": (ORANGE, "o", 2, "--"),
    "second": (BLUE, "^", 3, "-."),
}
_ROUNDOFF: dict[str, Any] = {"color": "#E4E4E4", "lw": 0.0}
_GUIDE: dict[str, Any] = {"color": BLACK, "lw": 0.8}
#: Part of a panel's height that is added above the points for its legend.
_HEADROOM = 0.25


class AccumulationFigure(FigureSettings):
    """Errors of the predicted accumulation of bursts over the rebound speed, log-log.

    Accumulation time on the left, accumulation point on the right; theory of both orders, the first
    impact of each burst apart, and the expected slopes 2 and 3.
    """

    needs = ("accumulation",)
    roles: ClassVar[Mapping[str, Role]] = {"each": Role(), "rows": Role(most=MOST_ROWS)}
    overlays: ClassVar[bool] = True

    each: Each = None
    rows: Annotated[
        Text | None,
        Field(description=f"Axis of whose values each makes a row of panels; {MOST_ROWS} at most."),
    ] = None
    at: At = None
    caption: Caption = None


def draw(results: Mapping[str, Any], settings: AccumulationFigure) -> Figure:
    """Draw the errors of accumulation time (left) and point (right) over the rebound speed.

    All bursts of a point are drawn over each other, and so are directions and random states.
    """
    cube, rows, at = results["cube"], settings.rows, settings.at
    branches = [dim for dim in ("direction", "draw") if dim in cube.dims and dim not in (at or {})]
    place = select(
        cube, accumulation.VARIABLES, at, (rows, accumulation.BURST, accumulation.IMPACT, *branches)
    )
    shown = panels.parts(place, rows)
    figure, axes = panels.panel_grid(len(shown), 2, height=1.0 + 2.1 * len(shown))
    for row, (text, panel) in zip(axes, shown, strict=True):
        for ax, quantity in zip(row, PREDICTED, strict=True):
            _panel(ax, panel, quantity)
        panels.title(row[0], text)
    units = units_of(place.rebound_speed.attrs)
    for ax in axes[-1]:
        ax.set_xlabel(label("rebound speed", "$w$", units))
    return panels.finish(figure, place, settings.caption, _handles())


def _panel(ax: Axes, panel: xr.Dataset, quantity: str) -> None:
    units = units_of(panel[f"remaining_{quantity}"].attrs)
    name = "time" if quantity == "time" else "point"
    ax.set_ylabel(label(f"error of accumulation {name}", "", units))
    drawn = {order: errors_of(panel, quantity, order) for order in ORDERS}
    shown = [found for found in drawn.values() if _visible(found).any()]
    if not shown:
        panels.note_empty_panel(ax, "no complete burst with a prediction here")
        return
    ax.set_xscale("log")
    ax.set_yscale("log")
    for order, found in drawn.items():
        _points(ax, found, order)
    roundoff = float(np.nanmedian(panel[f"accumulation_{quantity}_uncertainty"]))
    sizes = np.concatenate([np.abs(found.error[_visible(found)]) for found in shown])
    low = 0.1 * SHARP * roundoff
    high = max(sizes.max(), 10.0 * low)
    ax.set_ylim(low, high * (high / low) ** _HEADROOM)
    ax.axhspan(low, SHARP * roundoff, zorder=0.5, **_ROUNDOFF)
    ax.margins(x=0.04)
    ax.minorticks_off()  # over ten decades they show nothing, and take most of the time to draw
    handles = [_guide(ax, found, order) for order, found in drawn.items()]
    ax.legend(handles=handles, loc="upper left", frameon=False, handlelength=2.2)


def _visible(found: Errors) -> np.ndarray:
    """Errors that a logarithmic axis can show."""
    with np.errstate(invalid="ignore"):
        return (found.speed > 0.0) & (np.abs(found.error) > 0.0)


def _points(ax: Axes, found: Errors, order: str) -> None:
    colour, marker, _, _ = _ORDERS[order]
    visible = _visible(found)
    first = np.zeros_like(visible)
    first[:, :1] = True
    for mask, style in (
        (visible & ~first, {"ms": 2.2, "mew": 0.0, "zorder": 2.0}),
        (visible & first, {"ms": 4.5, "mew": 0.7, "mec": BLACK, "zorder": 2.5}),
    ):
        speed, size = found.speed[mask], np.abs(found.error[mask])
        ax.plot(speed, size, marker, color=colour, rasterized=True, **style)


def _guide(ax: Axes, found: Errors, order: str) -> Artist:
    """Draw the law through the errors in which it can be seen; return what the legend says."""
    colour, marker, exponent, dashes = _ORDERS[order]
    slope, points = found.slope()
    style: dict[str, Any] = {"ls": dashes, **_GUIDE}
    if points:
        speed = found.speed[found.asymptotic]
        ends = np.array([0.3 * speed.min(), 3.0 * speed.max()])
        law = found.factor(exponent) * ends**exponent
        ax.plot(ends, law, zorder=2.8, scalex=False, scaley=False, **style)
    fitted = "no slope" if math.isnan(slope) else f"fitted slope {slope:.2f}"
    text = f"{order} order: {fitted} ({points} points)"
    return panels.legend_line(text, marker=marker, ms=3.5, mew=0.0, mfc=colour, **style)


def _handles() -> list[Artist]:
    rim: dict[str, Any] = {"ls": "", "marker": "o", "ms": 4.5, "mew": 0.7, "mec": BLACK}
    slopes = [
        (f"law of the {order} order, slope {exponent}", dashes)
        for order, (_, _, exponent, dashes) in _ORDERS.items()
    ]
    return [
        panels.legend_line("first impact of a burst (black rim)", color="#BBBBBB", **rim),
        *(panels.legend_line(text, ls=dashes, **_GUIDE) for text, dashes in slopes),
        panels.legend_patch(
            f"below {SHARP:.0f} times the uncertainty of the simulation", **_ROUNDOFF
        ),
    ]

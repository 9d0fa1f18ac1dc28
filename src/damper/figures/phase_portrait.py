"""Phase portraits of the primary and of the relative motion, and the section, side by side."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Annotated, Any, ClassVar

import numpy as np
from pydantic import Field

from damper.analysis.sections import period_of
from damper.analysis.stretches import MOTION_VARIABLES, half_gap, sides
from damper.figures.common.layout import section_text, select
from damper.figures.common.panels import finish, note_empty_panel, panel_grid, parts, title
from damper.figures.common.style import PRIMARY, RELATIVE, VARIABLE_SYMBOLS, label
from damper.parameters.lazy import Axes, Figure, xr
from damper.parameters.names import counted
from damper.parameters.units import units_of
from damper.study.fields import Text
from damper.study.products import MOST_COLUMNS, At, Caption, Each, FigureSettings, Role
from damper.study.settings import SECTIONS

_SECTION = ("displacement", "velocity")
_PRIMARY: dict[str, Any] = {"color": PRIMARY, "lw": 0.4}
_RELATIVE: dict[str, Any] = {"color": RELATIVE, "lw": 0.4}
_WALL: dict[str, Any] = {"color": "#777777", "lw": 0.8}
_BEYOND: dict[str, Any] = {"facecolor": "#E8E8E8", "lw": 0.0}
#: Part of the clearance that is shown beyond each wall.
_MARGIN = 0.15
#: Points of a motion up to which its lines stay vectors.
_MOST_POINTS = 5_000
#: Columns -> most steps between ticks of their abscissas: values on the section are long.
_STEPS = {1: 9, 2: 5, 3: 3}
#: Distinct points of a section up to which each is drawn large.
_FEW = 16
#: Size of the marks of other sections times the root of their number.
_INK = 60.0


class PhasePortrait(FigureSettings):
    """Phase portraits of the primary and of the relative motion, and the Poincaré map."""

    needs = ("trajectory", SECTIONS)
    roles: ClassVar[Mapping[str, Role]] = {
        "columns": Role(most=MOST_COLUMNS, bodies=True),
        "each": Role(),
    }

    columns: Annotated[
        Text | None,
        Field(
            description="Axis, or body, of whose values each makes a column of panels; "
            f"{MOST_COLUMNS} at most."
        ),
    ] = None
    each: Each = None
    at: At = None
    caption: Caption = None


def draw(results: Mapping[str, Any], settings: PhasePortrait) -> Figure:
    """Draw phase portraits and the Poincaré map, a column of panels for each value of an axis.

    Above the primary's phase portrait, then that of the free mass relative to the primary between
    its walls, then the points of the section and their number. All columns share their scales.
    """
    keep = settings.columns, "instant", "sample"
    place = select(results["cube"], [*MOTION_VARIABLES, *_SECTION], settings.at, keep)
    shown = parts(place, settings.columns)
    figure, axes = panel_grid(3, len(shown), height=7.4, sharex="row", sharey="row")
    _frame_section(axes[2, 0], place)
    for column, (text, run) in zip(axes.T, shown, strict=True):
        text = f"{text}: " if text else ""
        _portrait(column[0], run, text)
        _relative(column[1], run, text)
        _section(column[2], run, text)
    _label(axes, place)
    return finish(figure, place, settings.caption, remarks=section_text(place.displacement))


def _portrait(ax: Axes, run: xr.Dataset, text: str) -> None:
    x, v = run.trajectory_displacement.values, run.trajectory_velocity.values
    _line(ax, x, v, _PRIMARY)
    title(ax, f"{text}primary")
    if left_out := int(run.trajectory_events_left_out):
        note_empty_panel(ax, f"{left_out} events did not fit\n(observers: trajectory: events)")


def _relative(ax: Axes, run: xr.Dataset, text: str) -> None:
    gap = run.trajectory_free_displacement.values - run.trajectory_displacement.values
    rate = run.trajectory_free_velocity.values - run.trajectory_velocity.values
    clearance = half_gap(run)
    _line(ax, gap, rate, _RELATIVE)
    if clearance > 0.0:
        edge = (1.0 + _MARGIN) * clearance
        for side in sides(run):
            ax.axvspan(side * clearance, side * edge, zorder=0.5, **_BEYOND)
            ax.axvline(side * clearance, zorder=1.0, **_WALL)
        low, high = ax.get_xlim() if ax.has_data() else (-edge, edge)
        ax.set_xlim(min(low, -edge), max(high, edge))
    title(ax, f"{text}free mass between the walls")


def _line(ax: Axes, x: np.ndarray, v: np.ndarray, style: Mapping[str, Any]) -> None:
    known = np.isfinite(x)
    if not known.any():
        note_empty_panel(ax)
        return
    many = bool(known.sum() > _MOST_POINTS)
    ax.plot(x[known], v[known], zorder=2.0, rasterized=many, **style)


def _section(ax: Axes, run: xr.Dataset, text: str) -> None:
    points = np.column_stack([run[name].values for name in _SECTION])
    points = points[np.isfinite(points).all(axis=1)]
    if not len(points):
        note_empty_panel(ax)
        return
    period = period_of(points)
    few = 0 < period <= _FEW
    # A single point is seen, and thousands do not make one.
    size = 6.0 if few else float(np.clip(_INK / np.sqrt(len(points)), 2.2, 6.0))
    ax.plot(*points.T, ".", ms=size, mew=0.0, color=PRIMARY, rasterized=True)
    found = counted(period, "point") if period else "no period found"
    title(ax, f"{text}Poincaré map, {found} ({len(points)} taken)")


def _frame_section(ax: Axes, place: xr.Dataset) -> None:
    """Set scales on which a single point does not fill a panel with its rounding errors."""
    setters: tuple[Callable[..., Any], ...] = (ax.set_xlim, ax.set_ylim)
    for name, set_limits in zip(_SECTION, setters, strict=True):
        values = place[name].values
        values = values[np.isfinite(values)]
        if not values.size:
            continue
        low, high, size = values.min(), values.max(), np.abs(values).max()
        margin = 0.08 * (high - low) if high - low > 1e-3 * size else 0.1 * (size or 1.0)
        set_limits(low - margin, high + margin)


def _label(axes: np.ndarray, place: xr.Dataset) -> None:
    from matplotlib.ticker import MaxNLocator

    length, speed = (units_of(place[name].attrs) for name in _SECTION)
    primary = (
        label("displacement", VARIABLE_SYMBOLS["displacement"], length),
        label("velocity", VARIABLE_SYMBOLS["velocity"], speed),
    )
    relative = (
        label("relative displacement", "$(y - x)$", length),
        label("relative velocity", r"$(\dot y - \dot x)$", speed),
    )
    steps = _STEPS.get(axes.shape[1], 2)
    for row, (x, y) in zip(axes, (primary, relative, primary), strict=True):
        row[0].set_ylabel(y)
        row[0].xaxis.set_major_locator(MaxNLocator(steps))  # shared along the row
        for ax in row:
            ax.set_xlabel(x)

"""Trajectories: displacements and velocities of both masses over time."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Annotated, Any, ClassVar

import numpy as np
from pydantic import Field

from damper.analysis import stretches
from damper.figures.common import style
from damper.figures.common.layout import select
from damper.figures.common.panels import finish, legend_line, legend_patch, panel_grid, parts, title
from damper.figures.common.undamped import REFERENCE
from damper.parameters.lazy import Artist, Axes, Figure, xr
from damper.parameters.units import units_of
from damper.study.messages import Mistakes
from damper.study.products import At, Caption, Each, FigureSettings, Role, StudyContents
from damper.study.yaml_file import display
from damper.sweep.record import force_settings, unused_quantities

_DRIVE, _ALONE = "trajectory_drive", "trajectory_alone"
#: Height of the panel of what drives, in inches.
_DRIVE_HEIGHT = 0.95
_FORCE: dict[str, Any] = {"color": "#555555", "lw": 0.7}
#: Points up to which lines stay vectors.
_MOST_POINTS = 20_000
_PRIMARY: dict[str, Any] = {"color": style.PRIMARY, "lw": 0.9}
_FREE: dict[str, Any] = {"color": style.FREE_MASS, "lw": 0.9, "ls": "-"}
#: Of several free masses in turn.
_COLOURS = (style.FREE_MASS, style.BLUE, style.PURPLE, style.SKY, style.ORANGE)
#: Heights of a panel of displacements, and of all that is not one, in inches.
_PANEL, _REST = 1.4, 2.5
_WALL: dict[str, Any] = {"color": "#777777", "lw": 0.5}
_BETWEEN: dict[str, Any] = {"color": "#E8E8E8", "lw": 0.0}


class TrajectoryFigure(FigureSettings):
    """Displacements and velocities of both masses over time, at one point.

    Of several free masses each has its displacement in a panel of its own, or body in at chooses.
    """

    draws_bodies = True
    needs = ("trajectory",)
    roles: ClassVar[Mapping[str, Role]] = {"each": Role()}

    each: Each = None
    at: At = None
    start: Annotated[
        float,
        Field(
            ge=0,
            description="Where the figure starts, in cycles since the start of the "
            "stretch that the observer samples.",
        ),
    ] = 0.0
    stop: Annotated[
        float | None,
        Field(gt=0, description="Where it ends, likewise; the end of the stretch when not given."),
    ] = None
    caption: Caption = None

    def check_against(self, study: StudyContents, mistakes: Mistakes) -> None:
        super().check_against(study, mistakes)
        length = study.stretch
        if length is None:  # the observer's own check reports it
            return
        if self.start >= length:
            message = f"starts {self.start:g} cycles into a sampled stretch of {length:g}"
            mistakes.add(("start",), message, f"number >= 0 and < {length:g}")
        elif self.stop is not None and self.stop > length:
            message = f"stops {self.stop:g} cycles into a sampled stretch of {length:g}"
            mistakes.add(("stop",), message, f"number <= {length:g}")

    def check_together(self, mistakes: Mistakes) -> None:
        if self.stop is not None and self.stop <= self.start:
            start = display(self.start)
            message = f"start ({start}) must be less than stop ({display(self.stop)})"
            mistakes.add(("stop",), message, f"number > {start}")


def draw(results: Mapping[str, Any], settings: TrajectoryFigure) -> Figure:
    """Draw all masses' displacements (above) and velocities (below) over time.

    ValueError where the sampled stretch does not reach to the start.
    """
    start, stop = settings.start, settings.stop
    cube, at = results["cube"], settings.at or {}
    axis = "body" if cube.sizes.get("body", 0) > 1 and "body" not in at else None
    place = select(cube, shown_in(cube), at, ("instant", axis))
    piece = place.isel(instant=stretches.rows_between(in_periods(place), start, stop))
    unit = units_in_a_cycle(place)
    time = in_periods(piece) * unit
    masses = parts(piece, axis)
    height = 3.9 if axis is None else _PANEL * len(masses) + _REST
    figure, top, (*above, below) = driven_grid(place, len(masses) + 1, height=height)
    if top is not None:
        draw_drive(top, time, piece)
    raster: dict[str, Any] = {"rasterized": time.size > _MOST_POINTS}
    lines, stuck = dict[str, dict[str, Any]](), False
    for k, (ax, (text, run)) in enumerate(zip(above, masses, strict=True)):
        free = _FREE | {"color": _COLOURS[k % len(_COLOURS)]}
        primary, mass = _symbols(text)
        lines[f"{text or 'free mass'} {mass}"] = free
        title(ax, text, pad=3.0)
        _walls(ax, time, run, raster)
        if _ALONE in run:
            alone = np.isfinite(run[_ALONE].values)
            ax.plot(time[alone], run[_ALONE].values[alone], zorder=1.0, **REFERENCE, **raster)
        _motions(ax, time, run, "displacement", free, raster)
        _motions(below, time, run, "velocity", free, raster)
        # Of several masses the panels are low.
        words = "" if text else "displacement"
        units = units_of(run.trajectory_displacement.attrs)
        ax.set_ylabel(style.label(words, f"{primary}, {mass}", units))
        stuck |= _shade_sticking(ax, time, run)
    symbols = r"$\dot x$, $\dot y$" if axis is None else r"$\dot x$, $\dot y_k$"
    below.set_ylabel(style.label("velocity", symbols, units_of(piece.trajectory_velocity.attrs)))
    if axis is None:
        _shade_sticking(below, time, piece)
    below.set_xlim(start * unit, time[-1] if stop is None else min(stop * unit, time[-1]))
    below.set_xlabel(time_label(place))
    if left_out := int(place.trajectory_events_left_out):
        text = f"{left_out} events did not fit: corners may be cut (observers: trajectory: events)"
        above[0].set_title(text, loc="right")
    handles = [legend_line("primary without damper", **REFERENCE)] if _ALONE in piece else []
    both = len(stretches.sides(piece)) == 2
    return finish(figure, place, settings.caption, [*handles, *_handles(lines, stuck, both)])


def _symbols(mass: str) -> tuple[str, str]:
    """Symbols of the displacements of the primary, and of a mass by its title."""
    number = mass.removeprefix("mass ")
    return "$x$", f"$y_{{{number}}}$" if number else "$y$"


def _motions(
    ax: Axes,
    time: np.ndarray,
    run: xr.Dataset,
    name: str,
    free: Mapping[str, Any],
    raster: Mapping[str, Any],
) -> None:
    """Draw displacements or velocities of the primary and of a free mass."""
    ax.plot(time, run[f"trajectory_{name}"].values, **_PRIMARY, **raster)
    ax.plot(time, run[f"trajectory_free_{name}"].values, **free, **raster)


def in_periods(run: xr.Dataset) -> np.ndarray:
    """Time since the start of the sampled stretch, in cycles."""
    return run.trajectory_time.values / stretches.cycle(run)


def units_in_a_cycle(run: xr.Dataset) -> float:
    """Length of a cycle as a time axis shows it: 1, but under a force without a frequency."""
    return stretches.cycle(run) if unused_quantities(run) else 1.0


def time_label(place: xr.Dataset) -> str:
    """Label of an axis of this time; t0 is where the stretch begins, if not with the run."""
    at_once = place.attrs.get("transient_periods") == 0 and not place.trajectory_start.values.any()
    clock = "t" if at_once else "t - t_0"
    if unused_quantities(place):
        return style.label("time", f"${clock}$", units_of(place.trajectory_time.attrs))
    frequency = style.SYMBOLS[stretches.forcing_frequency(place)]
    over = f"({clock})/T" if " " in clock else f"{clock}/T"
    return f"time ${over}$ (cycle $T$ = $2\\pi$/{frequency})"


def shown_in(cube: xr.Dataset) -> tuple[str, ...]:
    """Variables of the motion, and those beside them that the cube has."""
    return (*stretches.MOTION_VARIABLES, *(name for name in (_DRIVE, _ALONE) if name in cube))


def driven_grid(
    place: xr.Dataset, rows: int, height: float, **shared: Any
) -> tuple[Figure, Axes | None, list[Axes]]:
    """Return a figure with a column of panels, and the panel of the force on top, if any."""
    if _DRIVE not in place:
        figure, grid = panel_grid(rows, height=height, **shared)
        return figure, None, list(grid.ravel())
    figure, grid = panel_grid(
        rows + 1,
        height=height + _DRIVE_HEIGHT + 0.25,  # of its title
        height_ratios=[_DRIVE_HEIGHT, *[(height - 0.9) / rows] * rows],
    )
    top, *panels = grid.ravel()
    for ax in panels[1:] if shared.get("sharey") else ():
        ax.sharey(panels[0])
    return figure, top, panels


def draw_drive(ax: Axes, time: np.ndarray, piece: xr.Dataset) -> None:
    """Draw what drives the primary: the base's acceleration, or the force over its mass."""
    drive = piece[_DRIVE]
    of_base = force_settings(piece).get("of") == "base_acceleration"
    ax.axhline(0.0, **_WALL)
    ax.plot(time, -drive.values if of_base else drive.values, **_FORCE)
    title(ax, "acceleration of the base" if of_base else "force over the primary's mass", pad=3.0)
    ax.set_ylabel(style.label("", r"$\ddot z$" if of_base else "$F/M$", units_of(drive.attrs)))


def _walls(ax: Axes, time: np.ndarray, piece: xr.Dataset, raster: Mapping[str, Any]) -> None:
    x, clearance = piece.trajectory_displacement.values, stretches.half_gap(piece)
    walls = [x + side * clearance for side in stretches.sides(piece)]
    if len(walls) == 2:
        ax.fill_between(time, walls[0], walls[1], zorder=0.5, **_BETWEEN, **raster)
    for wall in walls:
        ax.plot(time, wall, zorder=1.0, **_WALL, **raster)


def _shade_sticking(ax: Axes, time: np.ndarray, piece: xr.Dataset) -> bool:
    """Shade where the masses stick; return whether they do."""
    spans = stretches.sticking(time, piece.trajectory_mode.values)
    for first, last in spans:
        ax.axvspan(first, last, zorder=0.7, **style.STUCK)
    return bool(spans)


def _handles(free: Mapping[str, Mapping[str, Any]], stuck: bool, both: bool) -> list[Artist]:
    between = legend_patch("between the walls", facecolor="#E8E8E8", edgecolor="#777777", lw=0.5)
    return [
        legend_line("primary $x$", **_PRIMARY),
        *(legend_line(text, **line) for text, line in free.items()),
        between if both else legend_line("wall", **_WALL),
        *([legend_patch("sticking", **style.STUCK)] if stuck else []),
    ]

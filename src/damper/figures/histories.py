"""Time histories one above the other: the free mass between the walls, chatter shaded."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Annotated, Any, ClassVar

import numpy as np
from pydantic import Field

from damper.analysis import stretches
from damper.figures import trajectory
from damper.figures.common import panels
from damper.figures.common.layout import select
from damper.figures.common.style import BLUE, ORANGE, RELATIVE, STUCK, SYMBOLS, label
from damper.parameters.lazy import Artist, Axes, Figure, xr
from damper.study.fields import Text
from damper.study.messages import Mistakes
from damper.study.products import MOST_PANELS, Role, StudyContents, require_listed_bursts
from damper.sweep.record import length_text

_BURSTS = ("chatter", "visible_impacts", *stretches.BURST_VARIABLES)
_CLASSES = {0: "no chatter", 1: "incomplete chatter", 2: "complete chatter"}
#: Whether a burst completes -> its shade. Hatched as well: orange on paper is close to yellow.
_SHADES: dict[bool, dict[str, Any]] = {
    True: {"facecolor": BLUE, "alpha": 0.3, "lw": 0.0},
    False: {"facecolor": "#FBE7C2", "edgecolor": ORANGE, "hatch": "////", "lw": 0.0},
}
_RELATIVE: dict[str, Any] = {"color": RELATIVE, "lw": 0.8}
_WALL: dict[str, Any] = {"color": "#777777", "lw": 0.6}
#: Height of a panel in inches.
_PANEL = 0.82
#: Points in all panels up to which lines stay vectors.
_MOST_POINTS = 20_000


class Histories(trajectory.TrajectoryFigure):
    """The free mass between the walls over time, with a panel for each value of an axis.

    Bursts of chatter and stretches of sticking are shaded.
    """

    marks_chatter: ClassVar[bool] = True
    roles: ClassVar[Mapping[str, Role]] = {
        "panels": Role(most=MOST_PANELS, bodies=True),
        "each": Role(),
    }

    panels: Annotated[Text, Field(description="Axis, or body, of whose values each makes a panel.")]

    def check_against(self, study: StudyContents, mistakes: Mistakes) -> None:
        super().check_against(study, mistakes)
        require_listed_bursts(study, mistakes)


def draw(results: Mapping[str, Any], settings: Histories) -> Figure:
    """Draw the free mass's place between the walls over time, a panel for each value of an axis.

    The relative displacement is drawn over the clearance, so the walls are at -1 and 1. Bursts with
    at least five visible impacts are shaded from their first impact to sticking, or to their last
    impact where they do not complete; so are the stretches in which the masses stick. Each panel
    says how the whole window, of which it shows a part, is classed. ValueError where a stretch does
    not reach to the start, or the list of bursts is missing.
    """
    cube = results["cube"]
    if "burst_onset" not in cube:
        raise ValueError("the bursts are not listed one by one (observers: bursts: records)")
    names = (*trajectory.shown_in(cube), *_BURSTS)
    place = select(cube, names, settings.at, (settings.panels, "instant", "burst"))
    unit = trajectory.units_in_a_cycle(place)
    start, stop = settings.start * unit, settings.stop and settings.stop * unit
    runs = panels.parts(place, settings.panels)
    height = 1.15 + _PANEL * len(runs)
    figure, top, axes = trajectory.driven_grid(place, len(runs), height=height, sharey=True)
    for _, run in runs if top is not None else ():
        trajectory.draw_drive(top, trajectory.in_periods(run) * unit, run)  # type: ignore[arg-type]
    shown: dict[str, Artist] = {}
    end, points = start, place.sizes["instant"] * len(runs)
    for ax, (text, run) in zip(axes, runs, strict=True):
        panels.title(ax, text, pad=3.0)
        last, handles = _history(ax, run, start, stop, points)
        ax.set_title(_class(run, handles), loc="right", pad=3.0)
        end = max(end, last)
        shown |= handles
    if end > start:  # some run got there
        axes[-1].set_xlim(start, end)
    axes[-1].set_ylim(-1.2, 1.2)
    axes[-1].set_yticks([-1, 0, 1])
    axes[-1].set_xlabel(trajectory.time_label(place))
    figure.supylabel(_ordinate(place), fontsize=8.0)
    listed = [shown[name] for name in _ORDER if name in shown]
    return panels.finish(figure, place, settings.caption, listed, _remarks(place))


_ORDER = ("free", "walls", "complete", "incomplete", "sticking")


def _class(run: xr.Dataset, shown: Mapping[str, Artist]) -> str:
    if np.isnan(run.chatter):
        return "run stopped"
    kind, visible = int(run.chatter), int(run.visible_impacts)
    elsewhere = " (at other times)" if kind and not {"complete", "incomplete"} & set(shown) else ""
    return f"{_CLASSES[kind]}{elsewhere}, most visible impacts in a burst: {visible}"


def _remarks(place: xr.Dataset) -> list[str]:
    length = length_text(place)
    return [f"each panel classed from {length}"] if length else []


def _ordinate(place: xr.Dataset) -> str:
    si = stretches.forcing_frequency(place) != "frequency_ratio"
    gap = f"({SYMBOLS['gap']}/2)" if si else SYMBOLS["clearance"]
    return label("relative displacement", f"$(y - x)$ / {gap}", "1")


def _history(
    ax: Axes, run: xr.Dataset, start: float, stop: float | None, points: int
) -> tuple[float, dict[str, Artist]]:
    """Draw one run; return where it ends, and legend entries of what it shows."""
    unit = trajectory.units_in_a_cycle(run)
    period = stretches.cycle(run) / unit
    time = trajectory.in_periods(run) * unit
    if not np.isfinite(time).any():
        panels.note_empty_panel(ax)
        return start, {}
    piece = run.isel(instant=stretches.rows_between(time, start, stop))
    time = trajectory.in_periods(piece) * unit
    end = float(time[-1]) if stop is None else min(stop, float(time[-1]))
    shown: dict[str, Artist] = {
        "free": panels.legend_line("free mass relative to the primary", **_RELATIVE),
        "walls": panels.legend_line("walls", **_WALL),
    }
    for wall in (-1.0, 1.0):
        ax.axhline(wall, zorder=1.0, **_WALL)
    relative = piece.trajectory_free_displacement.values - piece.trajectory_displacement.values
    clearance = stretches.half_gap(run)
    if clearance > 0.0:  # else the free mass is on both walls at once
        relative = relative / clearance
    # More vector points make files that no reader opens.
    ax.plot(time, relative, zorder=2.0, rasterized=points > _MOST_POINTS, **_RELATIVE)
    for burst in stretches.listed_bursts(run):
        first = burst.onset - float(run.trajectory_start)
        last = first + burst.duration
        if burst.chatter and first / period < end and last / period > start:
            name = "complete" if burst.complete else "incomplete"
            ax.axvspan(first / period, last / period, zorder=0.7, **_SHADES[burst.complete])
            shown[name] = panels.legend_patch(f"{name} chatter", **_SHADES[burst.complete])
    for first, last in stretches.sticking(time, piece.trajectory_mode.values):
        ax.axvspan(first, last, zorder=0.7, **STUCK)
        shown["sticking"] = panels.legend_patch("sticking", **STUCK)
    _note_what_is_missing(ax, run, end * period)
    return end, shown


def _note_what_is_missing(ax: Axes, run: xr.Dataset, end: float) -> None:
    """Write into the panel what did not fit into the cube."""
    missing = []
    if left_out := int(run.trajectory_events_left_out):
        missing.append(f"{left_out} events did not fit (observers: trajectory: events)")
    if stretches.listed_until(run) - float(run.trajectory_start) < end:
        missing.append("later bursts are not listed (observers: bursts: records)")
    if missing:
        paper = {"facecolor": "white", "edgecolor": "none", "alpha": 0.8, "pad": 1.5}
        panels.note_empty_panel(ax, "\n".join(missing), bbox=paper)

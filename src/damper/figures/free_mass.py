"""The free mass in time, absolute and relative: the whole history beside one burst enlarged."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Annotated, Any, ClassVar

import numpy as np
from pydantic import Field

from damper.analysis import stretches
from damper.analysis.stretches import Burst
from damper.figures.common import panels
from damper.figures.common.layout import select
from damper.figures.common.style import (
    BLACK,
    BLUE,
    FREE_MASS,
    ORANGE,
    PURPLE,
    RELATIVE,
    YELLOW,
    label,
    units_text,
)
from damper.parameters.lazy import Artist, Axes, Figure, xr
from damper.parameters.names import counted
from damper.parameters.units import units_of
from damper.parameters.variables import SI_UNITS, TIME
from damper.study import products
from damper.study.fields import Pair, Unit
from damper.study.messages import Mistakes

_VARIABLES = (*stretches.MOTION_VARIABLES, *stretches.BURST_VARIABLES)
_IMPACT, _STICKING = 0, 1
#: Points up to which lines stay vectors.
_MOST_POINTS = 5_000
#: Part of a burst's length that is shown before and after it.
_MARGIN = 0.12
#: Of the free mass and of its relative motion, in turn.
_COLOURS = (FREE_MASS, RELATIVE)
_WIDTH = 0.6
#: Over hundreds of units of time, so that single bounces are seen.
_THIN = 0.25
_WALL: dict[str, Any] = {"color": "#777777", "lw": 0.6, "zorder": 1.0}
_CHATTER = {True: ("complete chatter", BLUE), False: ("incomplete chatter", ORANGE)}
_DURATIONS: dict[bool, dict[str, Any]] = {
    complete: {"ls": "", "marker": marker, "ms": 3.2, "mec": BLACK, "mew": 0.4}
    for complete, marker in ((True, "o"), (False, "s"))
}
_SHADE: dict[str, Any] = {"alpha": 0.22, "lw": 0.0, "zorder": 0.4}
_STUCK: dict[str, Any] = {"color": YELLOW, "alpha": 0.75, "lw": 0.0, "zorder": 0.5}
_STATED: dict[str, Any] = {"color": PURPLE, "marker": "|", "lw": 1.8, "mew": 1.8}
_MARK: dict[str, Any] = {"color": "#555555", "lw": 0.8}


class FreeMass(products.FigureSettings):
    """The free mass in time, absolute and relative: the whole history beside one burst.

    Onset, duration and sticking of that burst are annotated, chatter and sticking are shaded.
    """

    needs = ("trajectory",)
    marks_chatter: ClassVar[bool] = True
    roles: ClassVar[Mapping[str, products.Role]] = {"each": products.Role()}

    each: products.Each = None
    at: products.At = None
    near: Annotated[
        float | None,
        Unit(f"{TIME}, {SI_UNITS[TIME]}"),
        Field(
            ge=0,
            description="Time since the start of the window: the burst of chatter with the onset "
            "nearest to it is shown enlarged; the first one of the stretch when not given. Where "
            "nothing is chatter, any burst counts.",
        ),
    ] = None
    stop: Annotated[
        float | None,
        Unit(f"{TIME}, {SI_UNITS[TIME]}"),
        Field(
            gt=0,
            description="Where the whole history ends, likewise; with the stretch that the "
            "observer samples when not given.",
        ),
    ] = None
    stated: Annotated[
        Pair[float] | None,
        Unit(f"{TIME}, {SI_UNITS[TIME]}"),
        Field(description="Onset and end of a burst that the source states, to draw beside ours."),
    ] = None
    caption: products.Caption = None

    def check_against(self, study: products.StudyContents, mistakes: Mistakes) -> None:
        super().check_against(study, mistakes)
        products.require_listed_bursts(study, mistakes)


def draw(results: Mapping[str, Any], settings: FreeMass) -> Figure:
    """Draw the free mass's displacement and velocity, absolute and relative, over time.

    On the left the whole history, and below it the duration of every burst of chatter; on the right
    one burst with its onset, duration and sticking, and below it the approach speed of each of its
    impacts on a logarithmic scale: the bounces shrink geometrically, and only there can all of
    them be seen. ValueError where the stretch is empty or begins at `stop` or later.
    """
    place = select(results["cube"], _VARIABLES, settings.at, ("instant", "burst"))
    run = place.isel(instant=np.isfinite(place.trajectory_time.values))
    time = run.trajectory_time.values + float(run.trajectory_start)
    if not time.size:
        raise ValueError("no motion was sampled: the run stopped before the stretch began")
    start, end = float(time[0]), float(time[-1])
    stop = end if settings.stop is None else min(settings.stop, end)
    if not start < stop:
        raise ValueError(f"stop = {stop:g}: the sampled stretch begins at {start:g} only")
    run = run.assign(time=("instant", time))
    bursts = stretches.listed_bursts(place)
    within = [burst for burst in bursts if burst.onset >= start and burst.end <= end]
    chosen = _nearest(within, settings.near)
    figure, axes = panels.panel_grid(5, 2, height=8.4, sharex="col")
    left, right = axes.T
    shown = zip(_panels(run).items(), _COLOURS * 2, left[:4], right[:4], strict=True)
    for (name, values), colour, whole, large in shown:
        look: dict[str, Any] = {"color": colour}
        whole.set_ylabel(name)
        _motion(whole, run, values, bursts, (start, stop), look | {"lw": _THIN})
        if chosen is not None:
            _motion(large, run, values, bursts, _window(chosen), look | {"lw": _WIDTH})
    for ax in (left[1], right[1]):
        for wall in (-stretches.half_gap(place), stretches.half_gap(place)):
            ax.axhline(wall, **_WALL)
    units = units_of(place.trajectory_time.attrs)
    _durations(left[4], [burst for burst in bursts if burst.chatter], (start, stop), units)
    panels.title(left[0], "whole history")
    left[0].set_xlim(start, stop)
    if chosen is None:
        for ax in right:
            panels.note_empty_panel(ax, "no burst in this stretch")
    else:
        _dimensions(right[0], chosen, units_text(units))
        _impacts(right[4], run, chosen)
        right[0].set_xlim(*_window(chosen))
    for ax in (left[4], right[4]):
        ax.set_xlabel(label("time", "$t$", units))
    handles = _handles(bursts, bool((run.trajectory_mode == _STICKING).any()))
    if settings.stated is not None:
        handles.append(_draw_stated(left[4], right, settings.stated, units_text(units)))
    return panels.finish(figure, place, settings.caption, handles, _left_out(place))


def _draw_stated(
    durations: Axes, large: Sequence[Axes], stated: tuple[float, float], units: str
) -> Artist:
    """Draw the stated burst among the durations and as a bracket; return its legend entry."""
    onset, end = stated
    durations.plot(onset, end - onset, ls="", zorder=5.0, **_STATED | {"ms": 7.0})
    low, high = durations.get_ylim()
    durations.set_ylim(low, max(high, 1.12 * (end - onset)))
    for ax in (large[0], large[-1]):  # elsewhere it would lie on a wall
        ax.plot([onset, end], [0.04, 0.04], transform=ax.get_xaxis_transform(), **_STATED)
    times = (
        f"{word} {value:g} {units}" for word, value in (("onset", onset), ("duration", end - onset))
    )
    return panels.legend_line(f"as the paper's text states: {', '.join(times)}", **_STATED)


def _panels(run: xr.Dataset) -> dict[str, np.ndarray]:
    """Return the label and the values of the panels one below the other."""
    x, v = run.trajectory_displacement, run.trajectory_velocity
    y, u = run.trajectory_free_displacement, run.trajectory_free_velocity
    length, speed = units_of(y.attrs), units_of(u.attrs)
    return {
        label("free mass\ndisplacement", "$y$\n", length): y.values,
        label("relative\ndisplacement", "$y-x$\n", length): (y - x).values,
        label("free mass\nvelocity", "$\\dot y$\n", speed): u.values,
        label("relative\nvelocity", "$\\dot y-\\dot x$\n", speed): (u - v).values,
    }


def _nearest(bursts: Sequence[Burst], near: float | None) -> Burst | None:
    """Return the burst to show enlarged."""
    among = [burst for burst in bursts if burst.chatter] or bursts
    if not among:
        return None
    return among[0] if near is None else min(among, key=lambda burst: abs(burst.onset - near))


def _window(burst: Burst) -> tuple[float, float]:
    """Return the time to show of a burst."""
    margin = _MARGIN * (burst.release - burst.onset) or 1.0
    return burst.onset - margin, burst.release + margin


def _motion(
    ax: Axes,
    run: xr.Dataset,
    values: np.ndarray,
    bursts: Sequence[Burst],
    span: tuple[float, float],
    line: Mapping[str, Any],
) -> None:
    """Draw a quantity over a span of time; shade chatter by its kind, and sticking."""
    time, (start, stop) = run.time.values, span
    # A row beyond each end, so that lines reach the edges.
    rows = slice(max(int(np.searchsorted(time, start)) - 1, 0), np.searchsorted(time, stop) + 1)
    shown = values[rows]
    ax.plot(time[rows], shown, rasterized=shown.size > _MOST_POINTS, **line)
    for complete, (_, colour) in _CHATTER.items():
        kind = [b for b in bursts if b.chatter and b.complete is complete]
        _shade(ax, [(b.onset, b.end) for b in kind], span, _SHADE | {"color": colour})
    _shade(ax, stretches.sticking(time, run.trajectory_mode.values), span, _STUCK)


def _shade(
    ax: Axes,
    spans: Sequence[tuple[float, float]],
    span: tuple[float, float],
    style: Mapping[str, Any],
) -> None:
    """Shade those that reach into a span, as one artist: there may be hundreds of them."""
    shown = [(a, b - a) for a, b in spans if a < span[1] and b > span[0]]
    ax.broken_barh(shown, (0.0, 1.0), transform=ax.get_xaxis_transform(), **style)


def _dimensions(ax: Axes, burst: Burst, units: str) -> None:
    """Write onset, duration and sticking of the burst above the panel, all from the window."""
    wall = "right" if burst.wall > 0 else "left"
    first = f"onset $t$ = {burst.onset:.3f} {units}, {wall} wall"
    first += "" if burst.complete else ", no sticking"
    kind = "complete " if burst.complete else "incomplete "
    kind += "chatter" if burst.chatter else "burst, no chatter"
    kind += f", {counted(burst.visible, 'visible impact')}"
    panels.title(ax, f"{first}\n{kind}", fontsize=7.0, pad=23.0)
    over = ax.get_xaxis_transform()
    for moment in (burst.onset, burst.end):
        ax.plot([moment, moment], [0.0, 1.1], transform=over, clip_on=False, **_MARK)
    spans = [(burst.onset, burst.end, f"duration {burst.duration:.3f} {units}", "left")]
    if burst.release > burst.end:
        spans.append((burst.end, burst.release, f"sticking {burst.sticking:.3f} {units}", "right"))
        ax.plot([burst.release] * 2, [0.0, 1.1], transform=over, clip_on=False, **_MARK)
    for start, end, words, place in spans:
        arrow = {"arrowstyle": "<->", "shrinkA": 0.0, "shrinkB": 0.0, "mutation_scale": 6.0}
        ends: dict[str, Any] = {"xycoords": over, "textcoords": over, "annotation_clip": False}
        ax.annotate("", (end, 1.08), (start, 1.08), arrowprops=arrow | _MARK, **ends)
        at = start if place == "left" else _window(burst)[1]
        ax.text(at, 1.13, words, transform=over, ha=place, va="bottom", fontsize=7.0)


def _impacts(ax: Axes, run: xr.Dataset, burst: Burst) -> None:
    """Draw the approach speed of every resolved impact of a burst on a logarithmic scale."""
    rows = np.flatnonzero(run.trajectory_event.values == _IMPACT)[::2]  # just before each impact
    time = run.time.values[rows]
    relative = run.trajectory_free_velocity.values - run.trajectory_velocity.values
    slack = 1e-9 * (1.0 + burst.end)  # both times are rounded
    inside = (time >= burst.onset - slack) & (time <= burst.end + slack)
    speeds = np.abs(relative[rows[inside]])
    seen = speeds > 0.0
    style: dict[str, Any] = {"ls": "", "marker": "o", "ms": 2.4, "mew": 0.5, "mec": BLACK}
    ax.plot(time[inside][seen], speeds[seen], mfc=BLACK, **style)
    if seen.any():
        ax.set_yscale("log")
    else:
        panels.note_empty_panel(ax, "its impacts are not among the listed events")
    units = units_of(run.trajectory_velocity.attrs)
    ax.set_ylabel(label("approach speed\nof each impact", "\n", units))


def _durations(ax: Axes, chatter: Sequence[Burst], span: tuple[float, float], units: str) -> None:
    """Draw how long every burst of chatter lasts."""
    shown = [burst for burst in chatter if span[0] <= burst.onset <= span[1]]
    for complete, (_, colour) in _CHATTER.items():
        some = [burst for burst in shown if burst.complete is complete]
        onsets, durations = [b.onset for b in some], [b.duration for b in some]
        ax.plot(onsets, durations, mfc=colour, **_DURATIONS[complete])
    ax.set_ylabel(label("duration of each\nburst of chatter", "\n", units))
    if shown:
        ax.set_ylim(0.0, 1.12 * max(burst.duration for burst in shown))
    else:
        ax.set_yticks([])
        panels.note_empty_panel(ax, "no chatter in this stretch")


def _left_out(place: xr.Dataset) -> list[str]:
    """Say what the window did not have room for."""
    listed = []
    if missing := int(place.trajectory_events_left_out):
        listed.append(f"{missing} events did not fit (observers: trajectory: events)")
    if (end := stretches.listed_until(place)) < np.inf:
        listed.append(f"bursts listed to $t$ = {end:.0f} (observers: bursts: records)")
    return listed


def _handles(bursts: Sequence[Burst], stuck: bool) -> list[Artist]:
    kinds = {burst.complete for burst in bursts if burst.chatter}
    shades, durations = [], []
    for complete, (text, colour) in _CHATTER.items():
        if complete in kinds:
            shades.append(panels.legend_patch(text, color=colour, alpha=_SHADE["alpha"], lw=0.0))
            duration = f"its duration ({text.split()[0]})"
            durations.append(panels.legend_line(duration, mfc=colour, **_DURATIONS[complete]))
    if stuck:
        shades.append(panels.legend_patch("sticking", **_STUCK))
    return [*shades, panels.legend_line(r"walls $y-x = \pm d$", **_WALL), *durations]

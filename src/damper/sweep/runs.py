"""Many points of a study through engine and observers, one lane each.

The loop over lanes is plain Python (some ten microseconds a lane); everything inside a lane is
compiled. Memory is one reused log buffer plus what the observers were asked to keep.
"""

from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from typing import Any

import numpy as np

from damper.engine.segment import COLUMNS, FINISHED
from damper.engine.trajectory import (
    DEFAULT_ACCURACY,
    DEFAULT_MAX_EVENTS,
    LOG_ROWS,
    Trajectory,
    check_engine_settings,
    check_state,
)
from damper.observers import make_observers
from damper.observers.base import Observer, Window
from damper.parameters import State
from damper.sweep.points import Point, read_point


def run_lanes(
    points: Iterable[Mapping[str, float]],
    observers: Iterable[str] | Mapping[str, Mapping[str, Any] | None],
    *,
    transient: int,
    periods: int,
    primary: str = "rest",
    state: State | None = None,
    after: Sequence[int] | None = None,
    accuracy: float = DEFAULT_ACCURACY,
    max_events: int = DEFAULT_MAX_EVENTS,
    progress: Callable[[int], None] | None = None,
) -> tuple[dict[str, np.ndarray], list[Observer]]:
    """Run every point and observe it.

    Parameters
    ----------
    points : iterable of mapping
        Name -> value of each lane: the parameters, dimensionless or in SI units, and what is not
        zero of the initial quantities; see `damper.parameters.quantities`.
    observers : iterable of str, or mapping of str to settings
        As for `damper.observers.make_observers`.
    transient, periods : int
        Forcing periods to discard, then to record.
    primary : {"rest", "steady"}
        Where the primary starts: at rest, or on its steady linear response.
    state : State, optional
        Start of every lane, in place of all that.
    after : sequence of int, optional
        For each lane the number of the one from whose end it starts instead, or -1: continuation.
        Primary and relative velocity go on; the free mass keeps its place *between* the walls, as
        a part of the clearance, so that contact stays contact. A lane whose predecessor stopped
        early starts as the first ones do.
    accuracy, max_events
        As for `damper.events`.
    progress : callable, optional
        Called with the number of lanes done after each one.

    Returns
    -------
    arrays : dict of str to ndarray
        Each observer's variables with the lane as first axis, and `status`. Dimensionless, also
        for points in SI units.
    observers : list of Observer
        The observers, for their descriptions.

    Raises
    ------
    ValueError, TypeError
        For values out of range, before anything is run.
    """
    lanes = [read_point(values, primary) for values in points]
    if after is not None and sorted(_order(after, len(lanes))) != list(range(len(lanes))):
        raise ValueError(f"after: must make chains of all {len(lanes)} lanes, each run once")
    transient = _whole("transient", transient, 0)
    periods = _whole("periods", periods, 1)
    check_engine_settings(accuracy, max_events)
    if state:
        for lane in lanes:
            check_state(lane.parameters, state.over(lane.units), lane.units)
    made = make_observers(observers)
    for observer in made:
        observer.allocate(len(lanes), periods)
    status = np.zeros(len(lanes), dtype="i1")
    buffer = np.empty((LOG_ROWS, COLUMNS))
    previous: tuple[Point, State] | None = None
    for done, lane in enumerate(_order(after, len(lanes)), start=1):
        point = lanes[lane]
        if after is None or after[lane] < 0 or previous is None:
            start = state.over(point.units) if state else point.start()
        else:
            start = point.carried_over(*previous)
        trajectory = Trajectory(point.parameters, start, accuracy, max_events)
        trajectory.units = point.units
        first, time = trajectory.start
        window = Window(first + transient, time, periods)
        if transient:
            trajectory.skip(window.period, time)
        for observer in made:
            observer.begin(lane, trajectory, window)
        if not made:
            trajectory.skip(window.period + periods, time)
        else:
            for log in trajectory.segments(window.period + periods, time, buffer):
                for observer in made:
                    observer.observe(log)
        finished = trajectory.status == FINISHED
        for observer in made:
            observer.finish(finished)
        status[lane] = trajectory.status
        if after is not None:
            end = trajectory.state_at(window.period + periods, time) if finished else None
            previous = (point, end) if end else None
        if progress:
            progress(done)
    arrays = {"status": status}
    for observer in made:
        arrays |= observer.arrays
    return arrays, made


def _order(after: Sequence[int] | None, count: int) -> Iterator[int]:
    """Lanes in an order in which each follows at once the one from whose end it starts."""
    if after is None:
        yield from range(count)
        return
    following = {previous: lane for lane, previous in enumerate(after) if previous >= 0}
    for first in range(min(count, len(after))):
        if after[first] < 0:
            lane: int | None = first
            while lane is not None:
                yield lane
                lane = following.get(lane)


def _whole(name: str, value: float, least: int) -> int:
    if value < least or int(value) != value:
        raise ValueError(f"{name} = {value!r}: must be a whole number of periods >= {least}")
    return int(value)

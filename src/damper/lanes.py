"""Many parameter sets through engine and observers, one after the other.

The loop over lanes is plain Python (some ten microseconds a lane); everything inside a lane is
compiled. Memory is one reused log buffer plus what the observers were asked to keep.
"""

from collections.abc import Callable, Iterable, Mapping
from typing import Any

import numpy as np

from damper.engine import (
    COLUMNS,
    DEFAULT_ACCURACY,
    DEFAULT_MAX_EVENTS,
    FINISHED,
    LOG_ROWS,
    Trajectory,
    check_engine_settings,
    check_state,
)
from damper.observers import make_observers
from damper.observers.base import Observer, Window
from damper.parameters import Parameters, State


def run_lanes(
    parameters: Iterable[Mapping[str, float]],
    observers: Iterable[str] | Mapping[str, Mapping[str, Any] | None],
    *,
    transient: int,
    periods: int,
    state: State | None = None,
    accuracy: float = DEFAULT_ACCURACY,
    max_events: int = DEFAULT_MAX_EVENTS,
    progress: Callable[[int], None] | None = None,
) -> tuple[dict[str, np.ndarray], list[Observer]]:
    """Run every parameter set and observe it.

    Parameters
    ----------
    parameters : iterable of mapping
        Parameter name -> value of each lane (phase may be missing).
    observers : iterable of str, or mapping of str to settings
        As for `damper.observers.make_observers`.
    transient, periods : int
        Forcing periods to discard, then to record.
    state : State, optional
        Start of every lane; from rest with y = 0 when not given.
    accuracy, max_events
        As for `damper.events`.
    progress : callable, optional
        Called with the number of lanes done after each one.

    Returns
    -------
    arrays : dict of str to ndarray
        Each observer's variables with the lane as first axis, and `status`.
    observers : list of Observer
        The observers, for their descriptions.

    Raises
    ------
    ValueError, TypeError
        For values out of range, before anything is run.
    """
    lanes = [Parameters(**values) for values in parameters]
    if transient < 0 or int(transient) != transient:
        raise ValueError(f"transient = {transient!r}: must be a whole number of periods >= 0")
    if periods < 1 or int(periods) != periods:
        raise ValueError(f"periods = {periods!r}: must be a whole number of periods >= 1")
    transient, periods = int(transient), int(periods)
    check_engine_settings(accuracy, max_events)
    if state:
        for values in lanes:
            check_state(values, state)
    made = make_observers(observers)
    for observer in made:
        observer.allocate(len(lanes), periods)
    status = np.zeros(len(lanes), dtype="i1")
    buffer = np.empty((LOG_ROWS, COLUMNS))
    for lane, values in enumerate(lanes):
        trajectory = Trajectory(values, state, accuracy, max_events)
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
        for observer in made:
            observer.finish(trajectory.status == FINISHED)
        status[lane] = trajectory.status
        if progress:
            progress(lane + 1)
    arrays = {"status": status}
    for observer in made:
        arrays |= observer.arrays
    return arrays, made


def product(axes: Mapping[str, Iterable[float]], fixed: Mapping[str, float]) -> list[dict]:
    """Parameter sets of a grid: the product of the axes, the last one fastest.

    Examples
    --------
    >>> [p["restitution"] for p in product({"restitution": (0.2, 0.4)}, {"clearance": 1.0})]
    [0.2, 0.4]
    """
    sets: list[dict] = [dict(fixed)]
    for name, values in axes.items():
        sets = [{**given, name: value} for given in sets for value in values]
    return sets

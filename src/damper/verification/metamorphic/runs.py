"""Short runs of one point for the stress study: the segment log, and the same with noise."""

from dataclasses import replace
from typing import NamedTuple

import numpy as np

from damper.engine import segment
from damper.engine.loop import FINISHED, TOO_MANY_EVENTS, run
from damper.engine.trajectory import DEFAULT_ACCURACY, Trajectory
from damper.models import model_of, start_run
from damper.models.walls import slack
from damper.parameters import Parameters, State

#: Rows of the log beyond which a short run stops, for each of its events: long flights are cut.
ROWS_PER_EVENT = 2
#: Kind of the last entry of `Events`: the end of the run.
END = 9
#: Where a run starts that is given no state.
REST = State(0.0, 0.0, 0.0, 0.0)


class ShortRun(NamedTuple):
    """The first segments of a run."""

    parameters: Parameters
    log: np.ndarray
    """(segments, COLUMNS), see `damper.engine.segment`."""
    end: tuple[float, float] | None
    """Displacement and velocity of the primary at the end time; None where the run stopped before,
    for too many events or a full log."""


class Events(NamedTuple):
    """What two runs are compared by: their events, and the end where it was reached."""

    kind: np.ndarray
    side: np.ndarray
    periods: np.ndarray
    time: np.ndarray
    values: np.ndarray
    """(3, events): displacement and velocity of the primary just after, and approach speed."""


def short_run(
    parameters: Parameters,
    state: State | None,
    *,
    periods: float,
    events: int,
    accuracy: float = DEFAULT_ACCURACY,
) -> ShortRun:
    """Run a point over whole cycles, or fewer if that takes more than `events` events.

    The log ends at `ROWS_PER_EVENT` times as many segments.
    """
    trajectory = start_run(parameters, state, accuracy, events)
    first, time = trajectory.start
    buffer = np.empty((ROWS_PER_EVENT * events, segment.COLUMNS))
    log = next(trajectory.segments(first + periods, time, buffer))
    whole = trajectory.status == FINISHED and len(log) < len(buffer)
    return ShortRun(parameters, log, _end_of(trajectory, log) if whole else None)


def _end_of(trajectory: Trajectory, log: np.ndarray) -> tuple[float, float]:
    x, v, _, _ = trajectory.motion_in(log[-1], log[-1, segment.DURATION])
    return x, v


def noisy_run(
    parameters: Parameters,
    state: State | None,
    *,
    periods: float,
    events: int,
    size: float,
    random: np.random.Generator,
) -> ShortRun:
    """Run a point as `short_run` does, with what roundoff does to it, larger.

    Each parameter is changed by a random part of itself of at most `size` before the run, and after
    each event the state and the phase of the forcing are. What is zero, and restitution 1, stay.
    """
    before, parameters = parameters, perturbed(parameters, size, random)
    state = state or REST
    x, v = np.array((state.x, state.v)) * _factors(2, size, random)
    # Position and velocity of the free mass are given as such: their differences move by more.
    moves = np.array((abs(state.x) + abs(state.y), abs(state.v) + abs(state.u)))
    moves *= _factors(2, size, random) - 1.0
    room, relative = state.y - state.x, state.u - state.v
    if before.clearance - abs(room) <= slack(before.clearance, state.x, state.y):
        # Contact with a wall remains contact, and no relative velocity none.
        room = np.copysign(parameters.clearance, room)
        relative += moves[1] if relative else 0.0
    else:
        room = min(max(room + moves[0], -parameters.clearance), parameters.clearance)
        relative += moves[1]
    start = State(float(x), float(v), float(x + room), float(v + relative), state.time)
    trajectory = Trajectory(model_of(parameters), start)
    model, (first, time) = trajectory.model, trajectory.start
    # The initial segment.
    [row] = next(trajectory.segments(first, time, np.empty((1, segment.COLUMNS))))
    log = np.empty((ROWS_PER_EVENT * events, segment.COLUMNS))
    counts = np.zeros(3, dtype=np.int64)
    factors = _factors((events, 4), size, random)
    shifts = size * model.cycle * random.uniform(-1.0, 1.0, events)
    latest = model.cycle * (1.0 - size)
    done = 0
    code = FINISHED
    for event in range(1, events + 1):
        code, rows = run(model, row, first + periods, time, event, log[done:], counts)
        done += rows
        if code != TOO_MANY_EVENTS or event == events:
            break
        # The segment in which it stopped is run again, from a start that is a little off.
        done -= 1
        row[segment.X : segment.GAP_RATE + 1] *= factors[event]
        row[segment.TIME] = min(max(row[segment.TIME] + shifts[event], 0.0), latest)
    log = log[:done]
    return ShortRun(parameters, log, _end_of(trajectory, log) if code == FINISHED else None)


def perturbed(parameters: Parameters, size: float, random: np.random.Generator) -> Parameters:
    """Change each parameter of every model by a random part of itself; a restitution of 1 stays.

    At the edge of its range the change goes inwards.
    """
    names = [q.name for q in parameters.quantities if not q.option]
    for name, factor in zip(names, _factors(len(names), size, random).tolist(), strict=True):
        value = getattr(parameters, name)
        if name == "restitution" and value == 1.0:
            continue
        try:
            parameters = replace(parameters, **{name: value * factor})
        except ValueError:
            parameters = replace(parameters, **{name: value / factor})
    return parameters


def _factors(count: int | tuple[int, ...], size: float, random: np.random.Generator) -> np.ndarray:
    """Random factors near 1, away from 1 itself: none of them may happen to change nothing."""
    return 1.0 + size * random.choice((-1.0, 1.0), count) * random.uniform(0.5, 1.0, count)


def events_of(run: ShortRun) -> Events:
    """List the events of a run, and its end if it came that far."""
    log = run.log
    rows = log[log[:, segment.CAUSE] >= segment.IMPACT]
    kind, side = rows[:, segment.CAUSE], rows[:, segment.SIDE]
    periods, time = rows[:, segment.PERIODS], rows[:, segment.TIME]
    values = rows[:, [segment.X, segment.V, segment.SPEED]].T
    if run.end is not None:
        kind = np.append(kind, END)
        side = np.append(side, log[-1, segment.SIDE])
        # The end is a given time: it is not compared.
        periods, time = np.append(periods, 0.0), np.append(time, 0.0)
        values = np.column_stack((values, (*run.end, 0.0)))
    return Events(kind, side, periods, time, values)

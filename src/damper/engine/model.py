"""Functions that every model implements, for the event loop, the run and the observers.

A model is a NamedTuple of constants with at least the fields ``mass_ratio``, ``clearance``,
``law`` (`damper.engine.impact`), ``cycle`` (in which the clock counts; a force that repeats does so
in it), ``tolerance`` and ``free`` (the primary's oscillator in flight). Each of `damper.models`
implements these functions for its class.
"""

from functools import singledispatch
from typing import Any, NamedTuple

import numpy as np

from damper.engine.compiled import compiled
from damper.engine.dispatch import by_class, by_class_or_default
from damper.engine.segment import COLUMNS, FLIGHT, Segment, segment_at, write_segment
from damper.parameters import State

#: In place of a time, for `masses_at`: the start of a segment.
BEFORE, AFTER = -2.0, -1.0


class Step(NamedTuple):
    """The answer of a model to the loop: how a segment ends, and which comes next."""

    duration: float
    is_event: bool
    gave_up: bool
    """Whether the search for the end did."""
    steps: int
    """Evaluations of the motion that it took."""
    next: Segment
    start: Any
    """What `begin` returns for the next segment."""


@by_class
def initial_segment(
    model: Any, periods: float, time: float, x: float, v: float, y: float, u: float
) -> Segment:
    """Initial segment of a run, from the state of both masses (`damper.parameters.State`)."""


@by_class
def begin(model: Any, segment: Segment) -> Any:
    """Return a NamedTuple that determines the motion in a segment; the loop hands it on."""


@by_class
def following(model: Any, segment: Segment, start: Any) -> Step:
    """How a segment ends, and which one comes next."""


@by_class
def motion(model: Any, segment: Segment, tau: float) -> tuple[float, float, float, float]:
    """State a time `tau` after a segment's start.

    Returns
    -------
    x, v, gap, gap_rate : float
        Of the primary, and of the gap at the segment's wall.
    """


@by_class
def speeds_in_tail(model: Any, segment: Segment) -> tuple[float, float]:
    """Approach speed of the next impact in a TAIL, and each one's over that of the one before.

    Both to first order in the speed.
    """


@by_class
def mass_ratio_at(model: Any, periods: float, time: float) -> float:
    """Mass ratio at a moment."""


@singledispatch
def columns_of(model: Any) -> int:
    """Columns of the log. This and the next three never run compiled."""
    return COLUMNS


@singledispatch
def masses_in(model: Any, state: State) -> tuple[Any, Any]:
    """Displacement and velocity of the free mass in a state, or those of each of several."""
    ([y], [u]) = state.of_each(1)
    return y, u


@singledispatch
def primary_in(model: Any, state: State) -> tuple[Any, Any]:
    """Displacement and velocity of the primary in a state, or those of each of its coordinates."""
    return state.x, state.v


@singledispatch
def count_masses(model: Any) -> int:
    """How many free masses there are. This and the next three never run compiled."""
    return 1


@singledispatch
def view_of_mass(model: Any, body: int) -> Any:
    """Constants for what observes one of several free masses alone."""
    return model


@singledispatch
def with_walls_at(model: Any, clearance: float) -> Any:
    """Constants of the damper whose walls are this far from the centre, those of each mass."""
    return model._replace(clearance=clearance)


@singledispatch
def log_of_mass(model: Any, log: np.ndarray, body: int) -> np.ndarray:
    """Return the log as one of several free masses has it: others' events begin segments only."""
    return log


@by_class_or_default
def read_segment(model: Any, row: np.ndarray) -> Any:
    """Read a row of the log: a `Segment`, or what has its fields and more."""
    return segment_at(row)


@by_class_or_default
def write_row(model: Any, row: np.ndarray, segment: Any, duration: float) -> None:
    """Write a segment of this duration into a row of the log."""
    write_segment(row, segment, duration)


@by_class_or_default
def masses_at(model: Any, segment: Any, tau: float, masses: np.ndarray) -> tuple[float, float]:
    """Displacement and velocity of the primary; each free mass in a row of `masses`.

    Displacement, velocity and mode of the mass, a time `tau` after the segment's start, or at its
    very start, `AFTER` what begins it or just `BEFORE`.
    """
    s = segment
    x, v, gap, rate, mode = s.x, s.v, s.gap, s.gap_rate, s.mode
    if tau == BEFORE:
        v, gap, rate, mode = s.v_before, 0.0, -s.speed, FLIGHT
    elif tau != AFTER:
        x, v, gap, rate = motion(model, s, tau)
    masses[0, 0] = x + s.side * (model.clearance - gap)
    masses[0, 1] = v - s.side * rate
    masses[0, 2] = mode
    return x, v


@by_class_or_default
def state_in(model: Any, segment: Any, tau: float) -> tuple[float, float, Any, Any]:
    """Displacement and velocity of the primary and of the free mass, or of each of several."""
    return state_by_gap(model, segment, tau)


@compiled
def state_by_gap(model: Any, segment: Any, tau: float) -> tuple[float, float, float, float]:
    """Displacement and velocity of the primary and of the free mass, from the gap."""
    x, v, gap, rate = motion(model, segment, tau)
    side = segment.side
    return x, v, x + side * (model.clearance - gap), v - side * rate


@by_class_or_default
def begin_samples(model: Any, segment: Any) -> Any:
    """Constants of a segment that `motion_sample` and `state_sample` take for each of its times."""
    return 0.0


@by_class_or_default
def motion_sample(
    model: Any, segment: Any, begun: Any, tau: float
) -> tuple[float, float, float, float]:
    """As `motion`, one of many times."""
    return motion(model, segment, tau)


@by_class_or_default
def state_sample(model: Any, segment: Any, begun: Any, tau: float) -> tuple[float, float, Any, Any]:
    """As `state_in`, one of many times."""
    return state_in(model, segment, tau)

"""Segments, the pieces of a run between events, and the log that holds one of them a row.

The log *is* the solution: between events every model's motion is known in closed form or to
roundoff. The event loop writes rows, observers read them as `Segment` by field name.
"""

import math
from enum import IntEnum
from typing import NamedTuple

import numpy as np

from damper.engine.compiled import compiled
from damper.engine.impact import share_of
from damper.engine.tuples import changed, reader, writer


class Segment(NamedTuple):
    """One segment, described at its start; a row of the log holds these fields in this order.

    Gap and gap rate belong to the segment's wall, `side` (+1 right, -1 left): the gap is
    clearance - side (y - x), zero in contact.
    """

    periods: float
    """Whole cycles of the clock before the start."""
    time: float
    """Time since then, in [0, cycle)."""
    x: float
    v: float
    """Displacement and velocity of the primary, just after what began the segment."""
    gap: float
    gap_rate: float
    side: float
    mode: float
    """How the masses move: FLIGHT, TAIL, STICKING, CONTACT or RESTING."""
    cause: float
    """What began the segment: NOTHING, SEPARATION, or one of the codes of `damper.events`."""
    speed: float
    """Approach speed of the impact that began it, else 0."""
    v_before: float
    """Velocity of the primary just before what began it."""
    first_speed: float
    """Approach speed of the first impact of the burst under way, 0 if there is none."""
    accumulation: float
    """Time to the accumulation point of a TAIL; of a CONTACT that of the touch to here; else 0."""
    duration: float
    """Length of the segment; where the run stops, up to there."""
    y: float
    u: float
    """Displacement and velocity of the free mass at the start of the run, and at the cut of a long
    flight in which no force of the primary acts on it; of a fixed stop in every segment; else 0.
    Gap and x do not have their digits.
    """


(PERIODS, TIME, X, V, GAP, GAP_RATE, SIDE, MODE, CAUSE, SPEED, V_BEFORE) = range(11)
(FIRST_SPEED, ACCUMULATION, DURATION, Y, U) = range(11, 16)
COLUMNS = len(Segment._fields)

#: How the masses move in a segment. A tail is the closed rest of a complete chatter sequence.
FLIGHT, TAIL, STICKING = 0.0, 1.0, 2.0
#: Compliant contact that has not lasted yet. An impact that begins one does not jump.
CONTACT = 3.0
#: Dry friction holds the free mass at rest in the box, off the walls.
RESTING = 4.0


class EventKind(IntEnum):
    """Kinds of events: numbers in `damper.events`, and causes of segments.

    Under dry friction, off the walls, a rest begins or ends, or sliding turns round.
    """

    IMPACT = 0
    STICK = 1
    RELEASE = 2
    STOPPED = 3
    REST = 4
    SLIP = 5
    REVERSAL = 6


#: The same as floats: the log has what began a segment as one.
IMPACT, STICK, RELEASE, STOPPED, REST, SLIP, REVERSAL = map(float, EventKind)
#: Cause of a segment at a start, or where a long flight is cut.
NOTHING = -1.0
#: The end of a compliant contact that has not lasted; `damper.events` does not list it.
SEPARATION = -2.0


_read, _write = reader(Segment, of_row=True), writer(Segment, of_row=True)
_lasting = changed(Segment, "duration")


@compiled
def segment_at(row: np.ndarray) -> Segment:
    """Read a row of the log."""
    return _read(row)


@compiled
def write_segment(row: np.ndarray, segment: Segment, duration: float) -> None:
    """Write a segment of this duration into a row of the log."""
    _write(row, _lasting(segment, duration))


@compiled
def centre_velocity(segment: Segment, mass_ratio: float) -> float:
    """Velocity of both masses' centre at the start of a segment."""
    return segment.v - segment.side * share_of(mass_ratio) * segment.gap_rate


@compiled
def first_speed_of(before: Segment, side: float, speed: float) -> float:
    """Approach speed of the first impact of the burst that an impact continues, or begins."""
    return speed if before.first_speed == 0.0 or side != before.side else before.first_speed


@compiled
def segment_after(
    s: Segment,
    period: float,
    duration: float,
    x: float,
    v: float,
    gap: float,
    gap_rate: float,
    side: float,
    mode: float,
    cause: float,
    speed: float,
) -> Segment:
    """The segment that follows `s` without a jump of the velocity; `speed` is that of an impact."""
    periods, time = clock_after(period, s.periods, s.time, duration)
    first_speed = s.first_speed
    if cause == IMPACT:
        first_speed = first_speed_of(s, side, speed)
    elif cause == STICK:
        first_speed = 0.0
    return Segment(
        periods,
        time,
        x,
        v,
        gap,
        gap_rate,
        side,
        mode,
        cause,
        speed,
        v,
        first_speed,
        0.0,
        0.0,
        0.0,
        0.0,
    )


@compiled
def clock_after(period: float, periods: float, time: float, duration: float) -> tuple[float, float]:
    """Whole cycles and local time after a duration."""
    turns, rest = 0.0, duration
    if duration >= period:
        rest = duration % period
        turns = math.floor((duration - rest) / period + 0.5)
    after = time + rest
    if after < period:
        return periods + turns, after
    # Exact, as the larger one is at least half a period.
    after = min(time, rest) - (period - max(time, rest))
    return periods + (turns + 1.0), max(after, 0.0)

"""The closed rest of a chatter sequence, asked of a model directly, and in many digits."""

from collections.abc import Mapping
from typing import Any

from mpmath import mp, mpf

from damper.engine.compiled import compiled
from damper.engine.model import begin
from damper.engine.segment import FLIGHT, IMPACT, TAIL, Segment
from damper.models.walls import centre, time_to_accumulation
from damper.verification.reference import GUARD_DIGITS, Event, exact_run


@compiled
def tail(model, time, side, x, v, rate):
    """Time to the accumulation point after an impact, its error, and x and v there.

    The impact is at the local time `time` on the wall `side`; `x`, `v` and the gap's `rate` are
    those just after it.
    """
    s = Segment(0.0, time, x, v, 0.0, rate, side, FLIGHT, IMPACT, 0.0, v, 0.0, 0.0, 0.0, 0.0, 0.0)
    start = begin(model, s)
    duration, error = time_to_accumulation(model, s, start)
    s = Segment(
        0.0, time, x, v, 0.0, rate, side, TAIL, IMPACT, 0.0, v, 0.0, duration, 0.0, 0.0, 0.0
    )
    dx, end_v = centre(model, s, duration)
    return duration, error, x + dx, end_v


def largest_rate(model, time, side, x, v, target):
    """Rebound speed at which the error is just below `target`; 0 if there is none."""
    low, high = 1e-14, 1e3
    for _ in range(60):
        middle = (low * high) ** 0.5
        error = tail(model, time, side, x, v, middle)[1]
        low, high = (low, middle) if error > target else (middle, high)
    return low if 0.5 * target < tail(model, time, side, x, v, low)[1] <= target else 0.0


def completed(
    values: Mapping[str, Any],
    time: float,
    side: float,
    x: float,
    v: float,
    rate: float,
    *,
    within: float,
    digits: int = 25,
) -> Event:
    """Return the accumulation point in many digits, with the time since the impact.

    The arguments are those of `tail`; `within` is a time in which nothing else happens.
    """
    with mp.workdps(digits + GUARD_DIGITS):
        start, x, v = mpf(time), mpf(x), mpf(v)
        state = x, v, x + int(side) * mpf(values["clearance"]), v - int(side) * mpf(rate)
        found = exact_run(
            values, state, start_time=start, until=start + within, digits=digits
        ).events
        stick = found[-1]
        assert stick.kind == "stick"
        assert {event.side for event in found} == {side}
        return stick._replace(time=stick.time - start)

"""The highest displacement along a motion, for sure and to roundoff.

What moves is a NamedTuple; its class implements `moment_at` and `bounds_of`.
"""

from typing import Any, NamedTuple

from damper.engine.compiled import compiled
from damper.engine.dispatch import by_class, by_class_or_default
from damper.engine.roundoff import EPSILON

#: Newton steps for an extremum; even bisection alone gets to roundoff in fewer.
_MAX_ITERATIONS = 60


class Moment(NamedTuple):
    """A displacement that moves, at one time."""

    tau: float
    x: float
    v: float
    a: float
    motion: Any
    """Further state that determines the motion."""


@by_class
def moment_at(moving: Any, tau: float) -> Moment:
    """The motion at the time `tau`."""


@by_class
def bounds_of(moving: Any, moment: Moment, span: float) -> tuple[float, float]:
    """Bounds on |x''| and |x'''| over the coming time `span`."""


@by_class_or_default
def stays_below(moving: Any, start: Moment, end: Moment, limit: float) -> bool:
    """Whether something else than the bounds proves that |x| has no peak above `limit` between."""
    return False


@compiled
def highest(moving: Any, start: Moment, end: Moment, peak: float) -> float:
    """Largest of `peak` and |x| from one moment of a motion to another.

    With B a bound on |x''| and J one on |x'''|, a step h is settled if

    - |x| <= max(|x0|, |x1|) + B h^2 / 8 is no more than the peak (or more by roundoff only);
    - v, which is within J h^2 / 8 of its chord, cannot vanish: |x| is largest at an end;
    - v changes sign and v' does not, |a0| > J h: it has one zero, which is found.

    Otherwise it is halved.
    """
    p = start
    step = end.tau - start.tau
    while p.tau < end.tau and p.tau + step > p.tau:
        q = end
        if p.tau + step < end.tau:
            q = moment_at(moving, p.tau + step)
        else:
            step = end.tau - p.tau
        peak = max(peak, abs(p.x), abs(q.x))
        bound2, bound3 = bounds_of(moving, p, step)
        eighth = 0.125 * step * step
        limit = peak * (1.0 + EPSILON)
        if max(abs(p.x), abs(q.x)) + bound2 * eighth > limit:
            one_way = (p.v > 0.0 and q.v > 0.0) or (p.v < 0.0 and q.v < 0.0)
            if not one_way and abs(p.a) > bound3 * step:
                peak = max(peak, _turning_point(moving, p, q))
            elif not (
                (one_way and min(abs(p.v), abs(q.v)) > bound3 * eighth)
                or stays_below(moving, p, q, limit)
            ):
                step *= 0.5
                continue
        p = q
        step *= 2.0
    return peak


@compiled
def _turning_point(moving, start, end):
    """|x| where the velocity vanishes between two moments, once and with v' of one sign.

    Newton's iteration, kept in the bracket. It ends where v^2 / |2 a|, the distance in x to the
    extremum, is below roundoff.
    """
    low = start.tau
    high = end.tau
    tau = low - start.v / start.a
    p = start
    for _ in range(_MAX_ITERATIONS):
        if not low < tau < high:
            tau = 0.5 * (low + high)
        p = moment_at(moving, tau)
        if p.v * p.v <= EPSILON * abs(p.x * p.a) or p.a == 0.0:
            break
        if (p.v > 0.0) == (start.v > 0.0):
            low = tau
        else:
            high = tau
        tau -= p.v / p.a
    return abs(p.x)

"""The certified search: the first time at which a smooth quantity leaves [0, width].

What moves is a NamedTuple; `point_at` says where it is at a time, with five derivatives and a bound
on the fourth. Each step aims a little short of the root that the Taylor polynomial predicts, and
is kept only if the values and slopes at its two ends prove that the quantity stays inside in
between. So no root can be skipped. docs/method.md has the proof.
"""

import math
from typing import Any, NamedTuple

from damper.engine.compiled import compiled
from damper.engine.dispatch import by_class, by_class_or_default
from damper.engine.forcing import HORIZON
from damper.engine.roundoff import EPSILON

#: Roundoff of a quantity, relative to the sizes of its terms.
ROUNDOFF = 4.0 * EPSILON
#: First longest step, in units of one over the quantity's rate.
SPAN = 1.5
#: Parts of a step by which it stops short of the root it aims at: the largest and the smallest
#: one, and their growth with the fourth power of step times rate. They steer only.
MARGIN, LEAST_MARGIN, MARGIN_GROWTH = 0.1, 1e-7, 0.01
#: Bound for a close root, where the truncated part of the series is small.
NEAR_MARGIN = 1e-3
#: Largest correction by its second or third term for which the series of the root is used.
NEAR_BEND = 0.2
#: Steps in one search before it gives up and says so.
MAX_STEPS = 100_000
#: Wall of a search that ran out of steps.
GAVE_UP = 2.0


class EventPoint(NamedTuple):
    """A quantity at one time of a search."""

    tau: float
    value: float
    slope: float
    second: float
    third: float
    fourth: float
    fifth: float
    bound4: float
    growth: float
    """|fourth derivative| <= bound4 + growth span over a coming span."""
    roundoff: float
    """Of the value."""
    state: Any
    """State of the motion there, for the caller."""


class Root(NamedTuple):
    """What a search found."""

    point: EventPoint
    """The last point that was looked at."""
    step: float
    """From there to the root: short enough for a Taylor polynomial of the fourth order."""
    side: float
    """1 where the value vanishes, -1 where it fills the width, 0 for neither, or GAVE_UP."""
    steps: int
    """How often the quantity was looked at."""


@by_class
def point_at(moving: Any, tau: float) -> EventPoint:
    """Where the quantity is a time `tau` after the start of the search."""


@by_class
def rates_of(moving: Any) -> tuple[float, float, float]:
    """Rates of what moves: of the forcing (sets the first step), the fastest, and the coupling.

    The coupling is the factor from a bound on one derivative to that on the next.
    """


@by_class_or_default
def longer_step(moving: Any, point: EventPoint) -> float:
    """A longer step that `proves_inside` may accept; 0 if there is none."""
    return 0.0


@by_class_or_default
def shorter_step(moving: Any, point: EventPoint, width: float, step: float) -> float:
    """A shorter step, where the bound is too large to prove this one; else this one."""
    return step


@by_class_or_default
def proves_inside(moving: Any, start: EventPoint, end: EventPoint, width: float) -> bool:
    """Whether something else than the bound proves that a step stays inside."""
    return False


@compiled
def first_root(
    moving: Any, start: EventPoint, width: float, lifts_off: bool, limit: float, hint: float
) -> Root:
    """First time at which a quantity falls through 0 or rises through `width`.

    Parameters
    ----------
    moving : NamedTuple
        What moves: `point_at` and `rates_of` are implemented for its class.
    start : EventPoint
        At tau = 0.
    width : float
        May be infinite.
    lifts_off : bool
        The value, its slope and second derivative are zero at the start, and it is about to rise.
    limit : float
        Time up to which the search goes; a root that is already in reach there is found.
    hint : float
        First step, where the caller knows that the value falls through 0 a little later; else 0.

    Returns
    -------
    Root
    """
    forcing_rate, rate, coupling = rates_of(moving)
    shortest = SPAN / max(1.0, forcing_rate)
    longest = shortest
    p = start
    facing = 1.0
    if lifts_off:
        aimed = False
        step = _leave(p, coupling, longest)
    elif hint > 0.0:
        aimed = True
        step = hint
    else:
        step, facing, aimed = _aim(moving, p, rate, width, longest)
    for steps in range(1, MAX_STEPS):
        end = p.tau + step
        if end == p.tau:
            # The root is nearer than time can resolve. Without a width it is both.
            lower = p.value < 0.5 * width or (width == 0.0 and p.slope < 0.0)
            return Root(p, 0.0, 1.0 if lower else -1.0, steps)
        if p.tau < limit < end:
            end = limit
            step = limit - p.tau
        q = point_at(moving, end)
        # On leaving zero the quantity surely grows throughout the step.
        sure = (lifts_off and q.value < width) or stays_inside(p, q, width)
        if not (sure or proves_inside(moving, p, q, width)):
            # Aimed too far: twice the excess back; else the step was too bold.
            excess = 0.0
            if aimed and q.slope != 0.0:
                excess = 2.0 * (q.value if facing > 0.0 else q.value - width) / q.slope
            aimed = 0.0 < excess < 0.5 * step
            step -= excess if aimed else 0.5 * step
            continue
        if step == longest:
            longest = min(2.0 * longest, max(shortest, HORIZON - end))
        lifts_off = False
        p = q
        if aimed:
            distance, slope, turn = p.value, p.slope, facing
            if facing < 0.0:
                distance = width - p.value
                slope = -p.slope
            step = near_root(distance, slope, turn * p.second, turn * p.third, turn * p.fourth)
            if step < math.inf:
                if _reaches(p, distance, slope, turn, width, step, coupling):
                    return Root(p, step, facing, steps)
                if step > 0.0 and p.tau < limit:
                    step -= NEAR_MARGIN * step
                    continue
        if p.tau >= limit:
            return Root(p, 0.0, 0.0, steps)
        step, facing, aimed = _aim(moving, p, rate, width, longest)
        far = longer_step(moving, p)
        if far > step:
            step = far
            aimed = False
    return Root(p, 0.0, GAVE_UP, MAX_STEPS)


@compiled
def _reaches(p, distance, slope, turn, width, step, coupling):
    """Whether the Taylor polynomial carries over `step` to the one root ahead, to roundoff."""
    roundoff = p.roundoff
    if turn < 0.0:
        roundoff += ROUNDOFF * width
    if distance <= roundoff:
        return True
    ahead = 2.0 * abs(step)
    bound3 = abs(p.third) + (p.bound4 + p.growth * ahead) * ahead
    if not falls_through(distance, slope, turn * p.second, bound3, ahead):
        return False
    bend = 0.5 * p.second + step * (p.third * (1.0 / 6.0) + step * p.fourth * (1.0 / 24.0))
    left = distance + step * (slope + step * turn * bend)
    bound5 = p.growth + coupling * (p.bound4 + p.growth * abs(step))
    square = step * step
    return abs(left) <= 0.25 * roundoff and bound5 * square * square * p.tau <= 24.0 * roundoff


@compiled
def stays_inside(start: EventPoint, end: EventPoint, width: float) -> bool:
    """Whether a quantity surely stays inside (0, width) on a step.

    Known are its values and slopes at both ends, and a bound on its fourth derivative. Cubic
    Hermite interpolation errs by at most bound4 t^2 (step - t)^2 / 24, and the interpolant is a
    mean of its four Bernstein coefficients.
    """
    step = end.tau - start.tau
    third = step / 3.0
    second = start.value + third * start.slope
    third = end.value - third * end.slope
    middle = second + third
    error = (start.bound4 + start.growth * step) * step * step * step * step / 72.0
    return (
        min(second, third, end.value) >= -end.roundoff
        and max(second, third, end.value) <= width + end.roundoff
        and error < middle < 2.0 * width - error
    )


@compiled
def _leave(p, coupling, longest):
    """Time for which value, slope and curvature surely grow from zero."""
    bound4 = p.bound4 + p.growth * longest
    if p.third != 0.0:
        # A cubic, as in a prescribed box between samples, has no fourth derivative.
        return min(longest, 2.0 * p.third / bound4) if bound4 > 0.0 else longest
    return min(longest, 3.0 * p.fourth / (p.growth + coupling * bound4))


@compiled
def _aim(moving, p, rate, width, longest):
    """Step towards the next root as the Taylor polynomial has it, its side, whether in reach."""
    lower = parabola_root(p.value, p.slope, p.second)
    upper = math.inf
    if width < math.inf:
        upper = parabola_root(width - p.value, -p.slope, -p.second)
    facing = 1.0 if lower <= upper else -1.0
    step = _short_of_root(
        min(lower, upper),
        longest,
        rate,
        p.value if lower <= upper else width - p.value,
        facing * p.slope,
        facing * p.second,
        facing * p.third,
        facing * p.fourth,
        facing * p.fifth,
    )
    shorter = shorter_step(moving, p, width, step)
    return shorter, facing, shorter == step < longest


@compiled
def _short_of_root(root, longest, rate, value, slope, second, third, fourth, fifth):
    """Step that stops a little before a root of a Taylor polynomial; `longest` if that is less.

    `root` is the one of the parabola, which two Newton steps improve.
    """
    if root > 2.0 * longest:
        return longest
    second *= 0.5
    third *= 1.0 / 6.0
    fourth *= 1.0 / 24.0
    fifth *= 1.0 / 120.0
    t = root
    for _ in range(2):
        square = t * t
        value_t = (value + t * slope) + square * (
            (second + t * third) + square * (fourth + t * fifth)
        )
        slope_t = (slope + 2.0 * t * second) + square * (
            (3.0 * third + 4.0 * t * fourth) + 5.0 * square * fifth
        )
        if slope_t < 0.0:
            t = min(max(t - value_t / slope_t, 0.25 * t), 2.0 * t)
    reach = rate * t
    reach *= reach
    return min(t - t * max(LEAST_MARGIN, min(MARGIN, MARGIN_GROWTH * reach * reach)), longest)


@compiled
def falls_through(value: float, slope: float, second: float, bound3: float, span: float) -> bool:
    """Whether a function surely falls throughout the coming span, and through zero.

    Its second derivative is known now, and |third derivative| <= bound3 on the span.
    """
    steepest = slope + span * (second + 0.5 * span * bound3)
    least = value + span * (slope + span * (0.5 * second + span * bound3 / 6.0))
    return slope < 0.0 and steepest < 0.0 and least < 0.0


@compiled
def near_root(value: float, slope: float, second: float, third: float, fourth: float) -> float:
    """Signed root near zero of a function falling through zero; inf where its bend matters much.

    The series of the inverse function to the fourth order.
    """
    if not slope < 0.0:
        return math.inf
    inverse = -1.0 / slope
    u = value * inverse
    b = 0.5 * second * inverse
    c = third * inverse * (1.0 / 6.0)
    d = fourth * inverse * (1.0 / 24.0)
    if not max(abs(u * b), abs(u * u * c)) < NEAR_BEND:
        return math.inf
    square = b * b
    root = u + u * u * (b + u * ((2.0 * square + c) + u * (5.0 * b * (square + c) + d)))
    # Of slopes below 1e-102 the last factors are beyond the largest number.
    return root if abs(root) < math.inf else math.inf


@compiled
def parabola_root(value: float, slope: float, curvature: float) -> float:
    """Smallest root >= 0 of value + slope t + curvature t^2 / 2 for value >= 0; inf if none.

    A value below zero, which only roundoff can make, counts as zero.
    """
    value = max(value, 0.0)
    discriminant = slope * slope - 2.0 * curvature * value
    if discriminant < 0.0:
        return math.inf
    root = math.sqrt(discriminant)
    if slope < 0.0:
        return 2.0 * value / (root - slope)
    if curvature < 0.0:
        return (root + slope) / -curvature
    return math.inf

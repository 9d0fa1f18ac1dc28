"""Classical Runge-Kutta with a fixed step that impacts cut: they are located inside the step.

A step that ends beyond a wall is cut short there: the length of a Runge-Kutta step whose end lies
on the wall is found by Newton's iteration in a bracket, to roundoff. The law of impact is applied,
and what is left of the step is done from there, as often as need be. A release is located alike, by
the force between the masses. A step that goes out and comes back is not noticed.

The gap is held as such and is exactly zero after an impact. So bounces far below the roundoff of
y - x are resolved as well.

**Sticking** begins after an impact with the rebound speed w if the contact force is positive,
a > 0, and the flight back, 2 w / a, takes no more than h^2 max(1, omega), h the step. Up to O(w^3)
the masses after that follow the motion of the stuck pair (docs/method.md), that is up to O(h^6):
motion after a burst keeps the fourth order. Sticking itself begins too early
by 2 w / (a (1 - r)), O(h^2) / (1 - r): second order.

With a step so short that a bounce no longer moves the time, before sticking sets in, the run has
stalled.
"""

from typing import NamedTuple

from damper.engine.compiled import compiled
from damper.engine.roundoff import EPSILON
from damper.engine.segment import IMPACT, NOTHING, RELEASE, STICK
from damper.models.walls import slack
from damper.verification.comparison import fixed_step as steps

_ITERATIONS = 100


class Located(NamedTuple):
    """The method."""

    damper: steps.Damper
    shortest: float
    """Duration of the flight back up to which masses stay together after an impact."""


class RelativeState(NamedTuple):
    """State relative to a wall, as far as the masses are not stuck."""

    x: float
    v: float
    gap: float
    rate: float
    side: float
    stuck: bool
    due: float
    """What is about to happen: NOTHING, IMPACT, RELEASE, or STICK for a start in touch."""


@steps.begin.of(Located)
def _begin(method, start, time):
    p = method.damper
    x, v, y, u = start
    side = steps.nearer_wall(x, y)
    gap = p.d - side * (y - x)
    rate = -side * (u - v)
    if gap <= slack(p.d, x, y):
        gap = 0.0
    if p.d == 0.0:
        # Together for good, with no wall to leave.
        return RelativeState(x, steps.common_velocity(p.mu, v, u), gap, 0.0, side, True, NOTHING)
    due = NOTHING
    if gap == 0.0 and rate <= 0.0:
        due = IMPACT if rate < 0.0 else STICK
    return RelativeState(x, v, gap, rate, side, False, due)


@steps.take_events.of(Located)
def _take_events(method, state, time, index, notes, counts):
    if state.due == NOTHING:
        return state, counts
    p = method.damper
    x, v, gap, rate, side, _, due = state
    if due == RELEASE:
        counts = steps.note(notes, counts, time, RELEASE, side, 0.0)
        return RelativeState(x, v, gap, rate, side, False, NOTHING), counts
    arrived = max(-rate, 0.0)
    rate = p.r * arrived
    if due == IMPACT:
        counts = steps.note(notes, counts, time, IMPACT, side, arrived)
        v += side * p.mu * (1.0 + p.r) / (1.0 + p.mu) * arrived
    common = v - side * p.mu / (1.0 + p.mu) * rate
    counts = steps.count_evaluations(counts, 1)
    a, j = steps.wall_acceleration(p, 1.0, x, common, time, side)
    if not steps.sticks(a, j, rate, method.shortest):
        return RelativeState(x, v, gap, rate, side, False, NOTHING), counts
    counts = steps.note(notes, counts, time, STICK, side, 0.0)
    return RelativeState(x, common, gap, 0.0, side, True, NOTHING), counts


@steps.advance.of(Located)
def _advance(method, state, piece, counts):
    p = method.damper
    x, v, gap, rate, side, stuck, _ = state
    time, tau = piece.time, piece.left
    mass = 1.0 + p.mu if stuck else 1.0
    curve, dv = steps.rk4(p, mass, x, v, time, tau)
    evaluations = 4
    due = NOTHING
    if stuck:
        if p.d > 0.0:
            evaluations += 1
            a, _ = steps.wall_acceleration(p, mass, x + (v * tau + curve), v + dv, time + tau, side)
            if a < 0.0:
                due = RELEASE
    else:
        near = gap + (rate * tau + side * curve)
        if near < 0.0 or near > 2.0 * p.d:
            due = IMPACT
            if near > 2.0 * p.d:
                side, gap, rate = -side, 2.0 * p.d - gap, -rate
    if due != NOTHING:
        before = RelativeState(x, v, gap, rate, side, stuck, due)
        tau, more = _find_end(p, before, time, piece.left)
        curve, dv = steps.rk4(p, mass, x, v, time, tau)
        evaluations += more + 4
    counts = steps.count_evaluations(counts, evaluations)
    if not stuck:
        gap += rate * tau + side * curve
        rate += side * dv
        counts = steps.record_penetration(counts, -gap)
    if due == RELEASE:
        rate = 0.0
    if due != NOTHING:
        gap = 0.0
    after = RelativeState(x + (v * tau + curve), v + dv, gap, rate, side, stuck, due)
    return after, counts, tau, due != NOTHING


@steps.masses.of(Located)
def _masses(method, state):
    y = state.x + state.side * (method.damper.d - state.gap)
    return steps.Masses(state.x, state.v, y, state.v - state.side * state.rate)


@compiled
def _find_end(damper, state, time, left):
    """Length of the step that ends on the wall, or where the contact force of stuck masses is zero.

    For a step that would end beyond that. A start on the wall counts as before it: the root sought
    is the later one.
    """
    x, v, gap, rate, side, stuck, _ = state
    mass = 1.0 + damper.mu if stuck else 1.0
    low = 0.0
    high = left
    evaluations = 0
    tau = high
    for iteration in range(_ITERATIONS):
        curve, dv = steps.rk4(damper, mass, x, v, time, tau)
        if stuck:
            x1 = x + (v * tau + curve)
            value, slope = steps.wall_acceleration(damper, mass, x1, v + dv, time + tau, side)
        else:
            value = gap + (rate * tau + side * curve)
            slope = rate + side * dv
        evaluations += 5 if stuck else 4
        if value < 0.0:
            high = tau
        else:
            low = tau
        following = tau - value / slope if slope < 0.0 else low
        if not low < following < high or iteration > _ITERATIONS // 2:
            if value == 0.0 or (slope < 0.0 and abs(value / slope) <= 2.0 * EPSILON * tau):
                break
            following = 0.5 * (low + high)
        if abs(following - tau) <= 2.0 * EPSILON * tau:
            break
        tau = following
    return tau, evaluations


SOLVER = steps.fixed_step(
    3e7, lambda damper, step, until: Located(damper, step * step * max(1.0, damper.omega))
)

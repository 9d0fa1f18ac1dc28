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
all that comes after a burst keeps the fourth order of the rest. Sticking itself begins too early
by 2 w / (a (1 - r)), O(h^2) / (1 - r): second order.

With a step so short that a bounce no longer moves the time, before sticking sets in, the run has
stalled.

States inside a step come from a shorter Runge-Kutta step, of local order five.
"""

from typing import NamedTuple

from damper.engine.compiled import compiled
from damper.engine.segment import IMPACT, NOTHING, RELEASE, STICK
from damper.models.walls import slack
from damper.verification.comparison.fixed_step import (
    Damper,
    Masses,
    advance,
    begin,
    common_velocity,
    damper_of,
    deepen,
    fixed_step,
    impact_loss,
    inside,
    lose,
    masses,
    nearer_wall,
    note,
    rk4,
    settle,
    spend,
    sticks,
    transfer,
    wall_acceleration,
)
from damper.verification.comparison.scene import Scene
from damper.verification.comparison.solvers import Solver

_ITERATIONS = 100
_ROUNDOFF = 2.220446049250313e-16


class Located(NamedTuple):
    """The method."""

    damper: Damper
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


@begin.of(Located)
def _begin(method, start, time, tally):
    p = method.damper
    x, v, y, u = start
    side = nearer_wall(x, y)
    gap = p.d - side * (y - x)
    rate = -side * (u - v)
    if gap <= slack(p.d, x, y):
        gap = 0.0
    if p.d == 0.0:
        # Together for good, with no wall to leave.
        tally = lose(tally, impact_loss(p.mu, rate, 0.0))
        return RelativeState(x, common_velocity(p.mu, v, u), gap, 0.0, side, True, NOTHING), tally
    due = NOTHING
    if gap == 0.0 and rate <= 0.0:
        due = IMPACT if rate < 0.0 else STICK
    return RelativeState(x, v, gap, rate, side, False, due), tally


@settle.of(Located)
def _settle(method, state, time, index, notes, tally):
    if state.due == NOTHING:
        return state, tally
    p = method.damper
    x, v, gap, rate, side, _, due = state
    if due == RELEASE:
        tally = note(notes, tally, time, RELEASE, side, 0.0)
        return RelativeState(x, v, gap, rate, side, False, NOTHING), tally
    arrived = max(-rate, 0.0)
    rate = p.r * arrived
    if due == IMPACT:
        tally = note(notes, tally, time, IMPACT, side, arrived)
        tally = lose(tally, impact_loss(p.mu, arrived, rate))
        v += side * p.mu * (1.0 + p.r) / (1.0 + p.mu) * arrived
    common = v - side * p.mu / (1.0 + p.mu) * rate
    tally = spend(tally, 1)
    a, j = wall_acceleration(p, 1.0, x, common, time, side)
    if not sticks(a, j, rate, method.shortest):
        return RelativeState(x, v, gap, rate, side, False, NOTHING), tally
    tally = lose(tally, impact_loss(p.mu, rate, 0.0))
    tally = note(notes, tally, time, STICK, side, 0.0)
    return RelativeState(x, common, gap, 0.0, side, True, NOTHING), tally


@advance.of(Located)
def _advance(method, state, piece, tally):
    p = method.damper
    x, v, gap, rate, side, stuck, _ = state
    time, left = piece.time, piece.left
    mass = 1.0 + p.mu if stuck else 1.0
    curve, dv, work, loss = rk4(p, mass, x, v, time, left)
    evaluations = 4
    tau = left
    due = NOTHING
    if stuck:
        if p.d > 0.0:
            evaluations += 1
            a, _ = wall_acceleration(p, mass, x + (v * left + curve), v + dv, time + left, side)
            if a < 0.0:
                due = RELEASE
                tau, more = _find_release(p, state, time, left)
                evaluations += more
    else:
        near = gap + (rate * left + side * curve)
        if near < 0.0 or near > 2.0 * p.d:
            due = IMPACT
            if near > 2.0 * p.d:
                side, gap, rate = -side, 2.0 * p.d - gap, -rate
            tau, more = _find_impact(
                p, RelativeState(x, v, gap, rate, side, stuck, due), time, left
            )
            evaluations += more
    if due != NOTHING:
        curve, dv, work, loss = rk4(p, mass, x, v, time, tau)
        evaluations += 4
    tally = spend(tally, evaluations)
    tally = transfer(tally, work, loss)
    if not stuck:
        gap += rate * tau + side * curve
        rate += side * dv
        tally = deepen(tally, -gap)
    if due == RELEASE:
        rate = 0.0
    if due != NOTHING:
        gap = 0.0
    after = RelativeState(x + (v * tau + curve), v + dv, gap, rate, side, stuck, due)
    return after, tally, tau, due != NOTHING


@inside.of(Located)
def _inside(method, state, after, piece, part):
    p = method.damper
    mass = 1.0 + p.mu if state.stuck else 1.0
    curve, dv, _, _ = rk4(p, mass, state.x, state.v, piece.time, part)
    gap, rate = state.gap, state.rate
    if after.side != state.side:
        gap, rate = 2.0 * p.d - gap, -rate
    if not state.stuck:
        gap += rate * part + after.side * curve
        rate += after.side * dv
    x, v = state.x + (state.v * part + curve), state.v + dv
    return masses(method, RelativeState(x, v, gap, rate, after.side, state.stuck, NOTHING))


@masses.of(Located)
def _masses(method, state):
    y = state.x + state.side * (method.damper.d - state.gap)
    return Masses(state.x, state.v, y, state.v - state.side * state.rate)


@compiled
def _find_impact(damper, state, time, left):
    """Length of the step that ends on the wall, for one that would end beyond it.

    A start on the wall counts as before it: the root sought is the later one.
    """
    x, v, gap, rate, side, _, _ = state
    low = 0.0
    high = left
    evaluations = 0
    tau = high
    for iteration in range(_ITERATIONS):
        curve, dv, _, _ = rk4(damper, 1.0, x, v, time, tau)
        evaluations += 4
        value = gap + (rate * tau + side * curve)
        slope = rate + side * dv
        if value < 0.0:
            high = tau
        else:
            low = tau
        following = tau - value / slope if slope < 0.0 else low
        if not low < following < high or iteration > _ITERATIONS // 2:
            if value == 0.0 or (slope < 0.0 and abs(value / slope) <= 2.0 * _ROUNDOFF * tau):
                break
            following = 0.5 * (low + high)
        if abs(following - tau) <= 2.0 * _ROUNDOFF * tau:
            break
        tau = following
    return tau, evaluations


@compiled
def _find_release(damper, state, time, left):
    """Length of the step at whose end the contact force vanishes, for one that goes beyond that."""
    x, v, side = state.x, state.v, state.side
    mass = 1.0 + damper.mu
    low = 0.0
    high = left
    evaluations = 0
    tau = high
    for _ in range(_ITERATIONS):
        curve, dv, _, _ = rk4(damper, mass, x, v, time, tau)
        value, slope = wall_acceleration(
            damper, mass, x + (v * tau + curve), v + dv, time + tau, side
        )
        evaluations += 5
        if value < 0.0:
            high = tau
        else:
            low = tau
        following = tau - value / slope if slope < 0.0 else low
        if not low < following < high:
            following = 0.5 * (low + high)
        if abs(following - tau) <= 2.0 * _ROUNDOFF * tau or value == 0.0:
            break
        tau = following
    return tau, evaluations


def _method(scene: Scene, step: float) -> Located:
    damper = damper_of(scene)
    return Located(damper, step * step * max(1.0, damper.omega))


SOLVERS = {"rk4_located": Solver("steps_per_period", +1, ("rigid",), 3e7, fixed_step(_method))}

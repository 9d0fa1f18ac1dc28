"""The law of motion: distances are weighted sums of oscillators and a constant acceleration.

Between events a free mass in flight is a body by itself: `Ballistic`, or an `Oscillator` where a
support or the force act on it. The gap to a wall, and whatever else decides an event, is then

    value + slope tau + acceleration tau^2 / 2 + sum of weight (x - x0 - v0 tau)

over the oscillators under one shared force. Its points, bounds and arrival are written once, here.
"""

import math
from typing import Any, NamedTuple

from damper.engine.bounds import energy_norm
from damper.engine.compiled import compiled
from damper.engine.dispatch import by_class
from damper.engine.forcing import bound_of, rate_of, turn_over, turned
from damper.engine.oscillator import (
    Motion,
    Oscillator,
    advance,
    arrive,
    displaced,
    free_flow,
    higher_derivatives,
    motion_from,
    moved,
)
from damper.engine.search import ROUNDOFF, EventPoint, point_at, rates_of

#: Rate of an oscillator times a time, above which its way is formed as such: as increments, the
#: way back and forth would round in units of its speed times the time.
_LONG = 3.0


class Ballistic(NamedTuple):
    """A body that nothing acts on but a constant acceleration."""

    acceleration: float


class Flow(NamedTuple):
    """Linear flow of displacement and velocity."""

    xx: float
    xv: float
    vx: float
    vv: float


@by_class
def body_motion(body: Any, y: float, u: float, phase: Any) -> Motion:
    """Complete a body's state by its second and third derivative."""


@by_class
def acceleration_of(body: Any, y: float, u: float, phase: Any) -> float:
    """Acceleration of a body in a state."""


@by_class
def body_at(body: Any, y: float, u: float, phase: Any, tau: float) -> tuple[float, float]:
    """Change of a body's displacement over a time `tau`, and its velocity then."""


@by_class
def flow_of(body: Any, tau: float) -> Flow:
    """Linear flow of a body over a time `tau`."""


@by_class
def damping_of(body: Any) -> float:
    """Half of the rate at which a body's volumes of (y, u) shrink."""


@by_class
def body_rates(body: Any, motion: Motion) -> tuple[float, float, float]:
    """Second to fourth derivative of a body's displacement."""


@body_motion.of(Ballistic)
def _ballistic_motion(body, y, u, phase):
    return Motion(y, u, body.acceleration, 0.0, phase)


@acceleration_of.of(Ballistic)
def _ballistic_acceleration(body, y, u, phase):
    return body.acceleration


@body_at.of(Ballistic)
def _ballistic_at(body, y, u, phase, tau):
    gained = body.acceleration * tau
    return (u + 0.5 * gained) * tau, u + gained


@flow_of.of(Ballistic)
def _ballistic_flow(body, tau):
    return Flow(1.0, tau, 0.0, 1.0)


@damping_of.of(Ballistic)
def _ballistic_damping(body):
    return 0.0


@body_rates.of(Ballistic)
def _ballistic_rates(body, motion):
    return motion.a, 0.0, 0.0


body_motion.of(Oscillator)(motion_from)


@acceleration_of.of(Oscillator)
def _oscillator_acceleration(body, y, u, phase):
    return motion_from(body, y, u, phase).a


@body_at.of(Oscillator)
def _oscillator_at(body, y, u, phase, tau):
    return advance(body, motion_from(body, y, u, phase), tau)


@flow_of.of(Oscillator)
def _oscillator_flow(body, tau):
    flow = free_flow(body, tau)
    return Flow(1.0 + flow.c_less_1, flow.s, -body.stiffness * flow.s, 1.0 + flow.s_dot_less_1)


@damping_of.of(Oscillator)
def _oscillator_damping(body):
    return body.damping


@body_rates.of(Oscillator)
def _oscillator_rates(body, motion):
    snap, _, _ = higher_derivatives(body, motion)
    return motion.a, motion.j, snap


class Term(NamedTuple):
    """One oscillator of a sum."""

    weight: float
    osc: Oscillator
    start: Motion


class WeightedSum(NamedTuple):
    """A distance, as the search sees it. The first term is the primary."""

    value: float
    slope: float
    """At the start."""
    acceleration: float
    """The constant one."""
    longest: float
    """Time up to which it is formed by increments, infinite where there is none."""
    terms: tuple[Term, ...]
    """All oscillators have the same force."""


class Primary(NamedTuple):
    """How the primary moves at a point of a search."""

    dx: float
    """Displacement less that at the start."""
    v: float
    a: float
    j: float
    snap: float
    crackle: float


@compiled
def longest_increments(osc: Oscillator) -> float:
    """Time up to which the way of an oscillator that is no primary is formed by increments."""
    return _LONG / osc.rate if osc.rate > 0.0 else math.inf


@compiled
def start_point(moving: WeightedSum) -> EventPoint:
    """Where a distance is at the start."""
    return _point(moving, 0.0, True)


@point_at.of(WeightedSum)
def _point_at(moving, tau):
    return _point(moving, tau, False)


@compiled
def _point(moving, tau, at_start):
    forcing = moving.terms[0].osc.forcing
    phase = moving.terms[0].start.phase
    turn = turn_over(forcing, tau)
    if not at_start:
        phase = turned(forcing, phase, turn)
    value = moving.value
    slope = moving.slope
    size = abs(moving.value)
    as_such = tau > moving.longest
    if not (at_start or as_such):
        value += moving.slope * tau + 0.5 * moving.acceleration * tau * tau
        size += abs(moving.slope) * tau
        slope += moving.acceleration * tau
    elif as_such:
        slope = 0.0
    second = moving.acceleration
    third = fourth = fifth = 0.0
    bound4 = growth = 0.0
    primary = Primary(0.0, 0.0, 0.0, 0.0, 0.0, 0.0)
    for k in range(len(moving.terms)):
        term = moving.terms[k]
        osc, start, weight = term.osc, term.start, term.weight
        motion = start
        way = 0.0
        if not at_start:
            if as_such and k > 0:
                way, v, sizes = displaced(osc, start, turn, tau)
                value += weight * way
                slope += weight * v
                size += abs(weight) * sizes
            else:
                dx, dv = moved(osc, start, turn, tau)
                way = dx + start.v * tau
                v = start.v + dv
                value += weight * (way if as_such else dx)
                slope += weight * (v if as_such else dv)
                size += abs(weight) * abs(way if as_such else dx)
            motion = motion_from(osc, start.x + way, v, phase)
        snap, crackle, _ = higher_derivatives(osc, motion)
        second += weight * motion.a
        third += weight * motion.j
        fourth += weight * snap
        fifth += weight * crackle
        bound4 += abs(weight) * energy_norm(osc, motion.j, snap)
        growth += abs(weight) * osc.strength * bound_of(forcing, 3)
        if k == 0:
            primary = Primary(way, motion.v, motion.a, motion.j, snap, crackle)
    roundoff = 0.0 if at_start else ROUNDOFF * size
    return EventPoint(
        tau, value, slope, second, third, fourth, fifth, bound4, growth, roundoff, primary
    )


@rates_of.of(WeightedSum)
def _rates_of(moving):
    forcing_rate = rate_of(moving.terms[0].osc.forcing)
    fastest = forcing_rate
    coupling = 0.0
    for k in range(len(moving.terms)):
        osc = moving.terms[k].osc
        fastest = max(fastest, osc.rate)
        coupling = max(coupling, osc.coupling)
    return forcing_rate, fastest, coupling


@compiled
def sum_after(moving: WeightedSum, tau: float) -> tuple[float, float, float, float]:
    """Displacement and velocity of the primary, the distance and its rate after a long time.

    Formed as such: how the errors of many such times add up is all that matters.
    """
    first = moving.terms[0]
    x, v = arrive(first.osc, first.start, tau)
    way = x - first.start.x
    as_such = tau > moving.longest
    distance = way if as_such else way - first.start.v * tau
    rate = v if as_such else v - first.start.v
    passed = 0.0 if as_such else moving.slope * tau + 0.5 * moving.acceleration * tau * tau
    begun = 0.0 if as_such else moving.slope + moving.acceleration * tau
    passed += first.weight * distance
    begun += first.weight * rate
    turn = turn_over(first.osc.forcing, tau)
    for k in range(1, len(moving.terms)):
        term = moving.terms[k]
        if as_such:
            way, change, _ = displaced(term.osc, term.start, turn, tau)
        else:
            way, change = moved(term.osc, term.start, turn, tau)
        passed += term.weight * way
        begun += term.weight * change
    return x, v, moving.value + passed, begun


@compiled
def carried(p: EventPoint, step: float) -> tuple[float, float, float]:
    """Way and velocity of the primary a short step after a point, and the distance's rate."""
    a = p.state
    dx = step * (
        a.v + step * (0.5 * a.a + step * (a.j * (1.0 / 6.0) + step * a.snap * (1.0 / 24.0)))
    )
    dv = step * (
        a.a + step * (0.5 * a.j + step * (a.snap * (1.0 / 6.0) + step * a.crackle * (1.0 / 24.0)))
    )
    # One term more than the distance needs: it is what is left of the rate's error.
    gained = step * (
        p.second
        + step * (0.5 * p.third + step * (p.fourth * (1.0 / 6.0) + step * p.fifth * (1.0 / 24.0)))
    )
    return a.dx + dx, a.v + dv, p.slope + gained

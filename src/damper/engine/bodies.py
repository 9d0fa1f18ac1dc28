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
from damper.engine.forcing import bound_of, rate_of, strength_of, turn_over, turned, weight_of
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
    damping: float = 0.0
    """As in `Oscillator`, whose fields this class shares, so callers need not ask for the class."""
    stiffness: float = 0.0
    strength: float = 0.0


class FixedStop(NamedTuple):
    """A free mass of infinite mass, at rest where the run's state has it."""

    primary: Oscillator
    """That hits it: what holds it in place is the force that this oscillator asks for."""
    acceleration: float = 0.0
    damping: float = 0.0
    stiffness: float = 0.0
    strength: float = 0.0
    """As in `Ballistic`."""


class Prescribed(NamedTuple):
    """The box whose motion is prescribed, as an oscillator without stiffness and damping.

    Its forcing is the acceleration. The other fields are those of `Oscillator`.
    """

    damping: float
    stiffness: float
    strength: float
    regime: float
    split: float
    slow: float
    fast: float
    rate: float
    coupling: float
    forcing: Any
    gain: Any
    place: Any
    """Function of `damper.engine.forcing` that the displacement is, but for its `size`."""
    size: float


class Flow(NamedTuple):
    """Linear flow of displacement and velocity."""

    xx: float
    xv: float
    vx: float
    vv: float


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
def strength_on(body: Any) -> float:
    """Factor of the common force on a body."""


@by_class
def weight_on(body: Any) -> float:
    """Constant acceleration of a body beside what the force does."""


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


@strength_on.of(Ballistic)
def _no_strength_on(body):
    return 0.0


@weight_on.of(Ballistic)
def _weight_on_ballistic(body):
    return body.acceleration


@strength_on.of(Oscillator)
def _strength_on(body):
    return strength_of(body.forcing, body.strength)


@weight_on.of(Oscillator)
def _weight_on(body):
    return weight_of(body.forcing)


for _function in (acceleration_of, body_at, strength_on, weight_on):
    _function.like(FixedStop, Ballistic)


@flow_of.of(FixedStop)
def _no_flow(body, tau):
    # No deviation moves a stop.
    return Flow(0.0, 0.0, 0.0, 0.0)


@flow_of.of(Prescribed)
def _no_flow_of_box(body, tau):
    # Nor does one move a prescribed box.
    return Flow(0.0, 0.0, 0.0, 0.0)


@acceleration_of.of(Oscillator)
def _oscillator_acceleration(body, y, u, phase):
    return motion_from(body, y, u, phase).a


acceleration_of.like(Prescribed, Oscillator)


@body_at.of(Oscillator)
def _oscillator_at(body, y, u, phase, tau):
    return advance(body, motion_from(body, y, u, phase), tau)


@flow_of.of(Oscillator)
def _oscillator_flow(body, tau):
    flow = free_flow(body, tau)
    return Flow(1.0 + flow.c_less_1, flow.s, -body.stiffness * flow.s, 1.0 + flow.s_dot_less_1)


class Alone(NamedTuple):
    """The end of the terms of a sum."""

    value: float


class Term(NamedTuple):
    """An oscillator of a sum, linked to the terms after it."""

    weight: float
    osc: Oscillator
    start: Motion
    rest: Any
    """A `Term`, or `Alone`. Compiled code takes them one by one; a loop over a tuple is slower."""


class WeightedSum(NamedTuple):
    """A distance, as the search sees it."""

    value: float
    slope: float
    """At the start."""
    acceleration: float
    """The constant one."""
    longest: float
    """Time up to which it is formed by increments, infinite where there is none."""
    rate: float
    coupling: float
    """Largest of the oscillators."""
    terms: Term
    """The first one is the primary. All oscillators have the same force."""


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


class TermSums(NamedTuple):
    """The terms of a sum, added up at a time."""

    value: float
    slope: float
    second: float
    third: float
    fourth: float
    fifth: float
    bound4: float
    growth: float
    size: float


class Instant(NamedTuple):
    """A time of a search, and the force then."""

    tau: float
    turn: Any
    phase: Any
    as_such: bool
    """Whether ways are formed as such, not as increments."""


@by_class
def add_terms(terms: Any, sums: TermSums, at: Instant) -> TermSums:
    """Add further oscillators at a time > 0."""


@by_class
def add_starts(terms: Any, sums: TermSums) -> TermSums:
    """Add further oscillators at the start."""


@by_class
def add_ways(terms: Any, way: float, rate: float, at: Instant) -> tuple[float, float]:
    """Add the ways and velocities of further oscillators, or their increments."""


@add_terms.of(Alone)
def _add_none(terms, sums, at):
    return sums


@add_starts.of(Alone)
def _add_no_starts(terms, sums):
    return sums


@add_ways.of(Alone)
def _add_no_ways(terms, way, rate, at):
    return way, rate


@add_terms.of(Term)
def _add_term(term, sums, at):
    osc, start = term.osc, term.start
    if at.as_such:
        way, v, size = displaced(osc, start, at.turn, at.tau)
        value, slope = way, v
    else:
        value, slope = moved(osc, start, at.turn, at.tau)
        way = value + start.v * at.tau
        v = start.v + slope
        size = abs(value)
    motion = motion_from(osc, start.x + way, v, at.phase)
    sums = added(osc, term.weight, sums, motion, value, slope, size)
    return add_terms(term.rest, sums, at)


@add_starts.of(Term)
def _add_start(term, sums):
    sums = added(term.osc, term.weight, sums, term.start, 0.0, 0.0, 0.0)
    return add_starts(term.rest, sums)


@compiled
def added(
    osc: Oscillator,
    weight: float,
    sums: TermSums,
    motion: Motion,
    value: float,
    slope: float,
    size: float,
) -> TermSums:
    """Add an oscillator to a sum: how it moves, and its part of value and slope."""
    snap, crackle, _ = higher_derivatives(osc, motion)
    return TermSums(
        sums.value + weight * value,
        sums.slope + weight * slope,
        sums.second + weight * motion.a,
        sums.third + weight * motion.j,
        sums.fourth + weight * snap,
        sums.fifth + weight * crackle,
        sums.bound4 + abs(weight) * energy_norm(osc, motion.j, snap),
        sums.growth + abs(weight) * osc.strength * bound_of(osc.forcing, 3),
        sums.size + abs(weight) * size,
    )


@add_ways.of(Term)
def _add_way(term, way, rate, at):
    if at.as_such:
        own, change, _ = displaced(term.osc, term.start, at.turn, at.tau)
    else:
        own, change = moved(term.osc, term.start, at.turn, at.tau)
    return add_ways(term.rest, way + term.weight * own, rate + term.weight * change, at)


@compiled
def start_point(moving: WeightedSum) -> EventPoint:
    """Where a distance is at the start."""
    sums = TermSums(moving.value, moving.slope, moving.acceleration, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0)
    return _event_point(0.0, add_starts(moving.terms, sums), moving.terms, 0.0, moving.terms.start)


@point_at.of(WeightedSum)
def _point_at(moving, tau):
    primary = moving.terms
    osc, start = primary.osc, primary.start
    turn = turn_over(osc.forcing, tau)
    at = Instant(tau, turn, turned(osc.forcing, start.phase, turn), tau > moving.longest)
    dx, dv = moved(osc, start, turn, tau)
    way = dx + start.v * tau
    motion = motion_from(osc, start.x + way, start.v + dv, at.phase)
    a, slope = moving.acceleration, moving.slope
    if at.as_such:
        own, rate, size = way, motion.v, 0.0
        begun = TermSums(moving.value, 0.0, a, 0.0, 0.0, 0.0, 0.0, 0.0, abs(moving.value))
    else:
        own, rate = dx, dv
        value = moving.value + slope * tau + 0.5 * a * tau * tau
        size = abs(moving.value) + abs(slope) * tau
        begun = TermSums(value, slope + a * tau, a, 0.0, 0.0, 0.0, 0.0, 0.0, size)
    begun = added(osc, primary.weight, begun, motion, own, rate, abs(own))
    sums = add_terms(primary.rest, begun, at)
    return _event_point(tau, sums, primary, way, motion)


@compiled
def _event_point(tau, sums, primary, way, motion):
    snap, crackle, _ = higher_derivatives(primary.osc, motion)
    state = Primary(way, motion.v, motion.a, motion.j, snap, crackle)
    return event_point(tau, sums, state)


@compiled
def event_point(tau: float, sums: TermSums, state: Any) -> EventPoint:
    """The point of a search at which the terms add up to `sums`; `state` is for the caller."""
    return EventPoint(
        tau,
        sums.value,
        sums.slope,
        sums.second,
        sums.third,
        sums.fourth,
        sums.fifth,
        sums.bound4,
        sums.growth,
        ROUNDOFF * sums.size,
        state,
    )


@rates_of.of(WeightedSum)
def _rates_of(moving):
    forcing_rate = rate_of(moving.terms.osc.forcing)
    return forcing_rate, max(forcing_rate, moving.rate), moving.coupling


@compiled
def sum_after(moving: WeightedSum, tau: float) -> tuple[float, float, float, float]:
    """Displacement and velocity of the primary, the distance and its rate after a long time.

    Formed as such: how the errors of many such times add up is all that matters.
    """
    primary = moving.terms
    start = primary.start
    x, v = arrive(primary.osc, start, tau)
    at = Instant(tau, turn_over(primary.osc.forcing, tau), start.phase, tau > moving.longest)
    if at.as_such:
        way = primary.weight * (x - start.x)
        way, rate = add_ways(primary.rest, way, primary.weight * v, at)
        return x, v, moving.value + way, rate
    way = moving.slope * tau + primary.weight * ((x - start.x) - start.v * tau)
    way += 0.5 * moving.acceleration * tau * tau
    rate = moving.slope + primary.weight * (v - start.v) + moving.acceleration * tau
    way, rate = add_ways(primary.rest, way, rate, at)
    return x, v, moving.value + way, rate


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

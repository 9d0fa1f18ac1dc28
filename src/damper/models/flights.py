"""Flight between rigid walls, for all models, by the law of motion alone.

`damper.engine.bodies` has the law; the free mass in flight is the model's field ``mass``.
"""

import math
from functools import singledispatch
from typing import Any, NamedTuple

import numpy as np

from damper.engine.accumulation import accumulation, accumulation_rubbing, sticks
from damper.engine.accumulation import bounce_at as frictionless_bounce_at
from damper.engine.bodies import (
    Alone,
    Ballistic,
    FixedStop,
    Primary,
    Term,
    WeightedSum,
    carried,
    longest_increments,
    start_point,
    strength_on,
    sum_after,
    weight_on,
)
from damper.engine.compiled import compiled, plain
from damper.engine.dispatch import by_class, by_class_or_default
from damper.engine.forcing import bound_of, horizon, is_odd, may_jump, phase_at
from damper.engine.impact import law_at, mean_of, restitution_at
from damper.engine.oscillator import (
    Motion,
    Oscillator,
    higher_derivatives,
    motion_at_release,
    motion_from,
)
from damper.engine.search import GAVE_UP, HORIZON, ROUNDOFF, EventPoint, Root, first_root, point_at
from damper.engine.segment import RELEASE, SLIP, Segment

#: Outcomes of a flight or sticking, as those of a search; STOPS: the relative velocity vanishes.
NO_EVENT, EVENT, STOPS = 0.0, 1.0, 3.0
#: Roundoffs of an acceleration, up to which one at a release vanishes although the force may jump.
VANISHES = 64.0


class End(NamedTuple):
    """How a flight or sticking ends."""

    duration: float
    outcome: float
    """EVENT, an impact or a release; STOPS; NO_EVENT where it only is cut; or GAVE_UP."""
    wall: float
    """Of the impact."""
    x: float
    v: float
    gap: float
    gap_rate: float
    steps: int


class Both(NamedTuple):
    """Motion of the primary and of the free mass."""

    primary: Motion
    mass: Motion
    phase: Any
    """Of the force, as in `Motion`."""


@by_class_or_default
def travel_of(model: Any) -> float:
    """The free mass's whole travel between the walls; infinite where there is one."""
    return 2.0 * float(model.clearance)


@singledispatch
def has_mirror(model: Any) -> bool:
    """Whether a motion's mirror image half a cycle later is a motion, too. Never compiled."""
    left, right = (plain(law_at)(model.law, side) for side in (-1.0, 1.0))
    # Both masses together feel gravity, too.
    odd = plain(is_odd)(model.stuck.forcing) and not plain(weight_on)(model.mass)
    alike = all(map(np.array_equal, left, right))
    return bool(odd and alike and plain(travel_of)(model) < math.inf)


@by_class_or_default
def only_wall_of(model: Any) -> float:
    """Side of the wall where there is one alone; 0 where there are two."""
    return 0.0


@by_class
def begin_flight(mass: Any, model: Any, segment: Segment, shift: float) -> Any:
    """What a flight follows from: the primary's `Motion`, or `Both` where the free mass has one.

    The primary swings about the displacement `shift`, where friction deflects it.
    """


@by_class_or_default
def course_of(start: Any, model: Any) -> tuple[Any, float]:
    """The free mass as a body in a flight, and the displacement `shift` of `begin_flight`."""
    return model.mass, 0.0


@by_class
def rest_shift(mass: Any, mass_ratio: float, offset: float) -> float:
    """How far a support pulls both masses, joined, from where they would rest without it.

    `offset` is the free mass's displacement less the primary's; positive where it pulls left.
    """


@rest_shift.of(Ballistic)
def _no_shift(mass, mass_ratio, offset):
    return 0.0


@rest_shift.of(Oscillator)
def _shift_by_support(mass, mass_ratio, offset):
    stiffness = mass_ratio * mass.stiffness
    return stiffness / (1.0 + stiffness) * offset


@by_class
def gap_of(start: Any, model: Any, segment: Segment, sign: float) -> WeightedSum:
    """The gap at the segment's wall, times a sign."""


@by_class
def relative_rates(start: Any, model: Any) -> tuple[float, float, float, float]:
    """Second to fourth derivative of the primary's displacement less the free mass's.

    The last number is the size of the fourth one by its terms, which need not cancel ahead.
    """


@begin_flight.of(Ballistic)
def _begin_ballistic(mass, model, segment, shift):
    s = segment
    phase = phase_at(model.free.forcing, s.periods, s.time)
    start = motion_from(model.free, s.x - shift, s.v, phase)
    if s.cause in (RELEASE, SLIP) and _is_smooth(model.free, start, mass.acceleration):
        return motion_at_release(model.free, s.x - shift, s.v, mass.acceleration, phase)
    return start


begin_flight.like(FixedStop, Ballistic)
rest_shift.like(FixedStop, Ballistic)


@compiled
def free_mass_of(model: Any, segment: Segment) -> tuple[float, float]:
    """Displacement and velocity of the free mass at the start of a segment, from the gap."""
    s = segment
    return s.x + s.side * (model.clearance - s.gap), s.v - s.side * s.gap_rate


@begin_flight.of(Oscillator)
def _begin_both(mass, model, segment, shift):
    s = segment
    phase = phase_at(model.free.forcing, s.periods, s.time)
    y, u = free_mass_of(model, s)
    primary = motion_from(model.free, s.x - shift, s.v, phase)
    other = motion_from(mass, y, u, phase)
    if s.cause in (RELEASE, SLIP) and _is_smooth(model.free, primary, other.a):
        # The contact force is zero: both masses have the same acceleration, exactly.
        other = motion_at_release(mass, y, u, primary.a, phase)
    return Both(primary, other, phase)


@compiled
def _is_smooth(osc, start, a):
    """Whether a release has come about without a jump of the force, to roundoff."""
    if not may_jump(osc.forcing):
        return True
    size = osc.strength * bound_of(osc.forcing, 0) + osc.stiffness * abs(start.x)
    size += 2.0 * osc.damping * abs(start.v)
    return abs(start.a - a) <= VANISHES * ROUNDOFF * size


@gap_of.of(Motion)
def _gap_of_one(start, model, segment, sign):
    weight = sign * segment.side
    return WeightedSum(
        sign * segment.gap,
        sign * segment.gap_rate,
        -weight * model.mass.acceleration,
        math.inf,
        model.free.rate,
        model.free.coupling,
        Term(weight, model.free, start, Alone(0.0)),
    )


@gap_of.of(Both)
def _gap_of_both(start, model, segment, sign):
    weight = sign * segment.side
    mass = Term(-weight, model.mass, start.mass, Alone(0.0))
    return WeightedSum(
        sign * segment.gap,
        sign * segment.gap_rate,
        0.0,
        longest_increments(model.mass),
        max(model.free.rate, model.mass.rate),
        max(model.free.coupling, model.mass.coupling),
        Term(weight, model.free, start.primary, mass),
    )


@relative_rates.of(Motion)
def _rates_of_one(start, model):
    free = model.free
    snap, _, _ = higher_derivatives(free, start)
    size = free.strength * bound_of(free.forcing, 2)
    size += 2.0 * free.damping * abs(start.j) + free.stiffness * abs(start.a)
    return start.a - model.mass.acceleration, start.j, snap, size


@relative_rates.of(Both)
def _rates_of_both(start, model):
    free, mass = model.free, model.mass
    p, q = start.primary, start.mass
    snap, _, _ = higher_derivatives(free, p)
    other, _, _ = higher_derivatives(mass, q)
    size = (
        (free.strength + strength_on(mass)) * bound_of(free.forcing, 2)
        + 2.0 * free.damping * abs(p.j)
        + abs(p.a)
        + 2.0 * mass.damping * abs(q.j)
        + mass.stiffness * abs(q.a)
        + (free.stiffness + mass.stiffness) * abs(p.a - q.a)
    )
    return p.a - q.a, p.j - q.j, snap - other, size


@compiled
def begin(model: Any, segment: Segment) -> Any:
    """Start of the motion in a segment, as `damper.engine.model.begin`."""
    return begin_flight(model.mass, model, segment, 0.0)


@compiled
def first_wall(gap: WeightedSum, travel: float, last: float) -> Root:
    """When a gap closes, or is as wide as the way between the walls, up to a time."""
    point = start_point(gap)
    lifts_off = gap.value == 0.0 and gap.slope == 0.0 and point.second == 0.0
    return first_root(gap, point, travel, lifts_off, last, 0.0)


@by_class_or_default
def fly(start: Any, model: Any, segment: Segment) -> End:
    """The next impact of a flight, by what it follows from; gap and rate at the segment's wall."""
    s = segment
    moving = gap_of(start, model, s, 1.0)
    limit = min(HORIZON, horizon(model.free.forcing, start.phase))
    root = first_wall(moving, travel_of(model), limit)
    p = root.point
    tau = p.tau + root.step
    if root.side == 0.0 and limit == HORIZON:
        x, v, gap, gap_rate = sum_after(moving, p.tau)
        return End(p.tau, NO_EVENT, 0.0, x, v, gap, gap_rate, root.steps)
    if limit < HORIZON and (root.side == 0.0 or tau > limit):
        # Where the force ceases to be smooth; a root behind that is one of another motion.
        step = limit - p.tau
        dx, v, gap_rate = carried(p, step)
        bend = p.second + step * (p.third * (1.0 / 3.0) + step * p.fourth * (1.0 / 12.0))
        gap = p.value + step * (p.slope + 0.5 * step * bend)
        return End(limit, NO_EVENT, 0.0, s.x + dx, v, gap, gap_rate, root.steps)
    dx, v, gap_rate = carried(p, root.step)
    outcome = GAVE_UP if root.side == GAVE_UP else EVENT
    wall = root.side * s.side
    return End(tau, outcome, wall, s.x + dx, v, 0.0, gap_rate, root.steps)


@compiled
def is_thrown_off(force: EventPoint, forcing: Any) -> bool:
    """Whether a force that has jumped pulls the masses apart at once: a contact force below 0."""
    return may_jump(forcing) and force.value < -VANISHES * force.roundoff


@compiled
def rests(force: EventPoint) -> bool:
    """Whether a contact force is zero, and stays so up to where the force ceases to be smooth."""
    largest = max(abs(force.value), abs(force.slope), abs(force.second), abs(force.third))
    return largest == 0.0 and force.fourth == 0.0 and force.bound4 == 0.0 and force.growth == 0.0


@compiled
def is_balanced(here: EventPoint, width: float) -> bool:
    """Whether all that holds a mass is just enough, and stays so."""
    least = min(abs(here.value), abs(width - here.value))
    largest = max(least, abs(here.slope), abs(here.second), abs(here.third))
    return here.growth == 0.0 and largest <= here.roundoff


@compiled
def stays(model: Any, segment: Segment, start: Any) -> bool:
    """Whether masses in contact with no relative velocity stay together."""
    a, j, snap, _ = relative_rates(start, model)
    return sticks(segment.side, a, j, snap)


@compiled
def completes(model: Any, mass_ratio: float, segment: Segment, start: Any) -> tuple[float, float]:
    """Time to the accumulation point after the impact that begins a segment, and its error."""
    free = model.free
    side = segment.side
    a, j, _, scale = relative_rates(start, model)
    force = -side * a
    damping = model.mass.damping
    impact_damping = mean_of(mass_ratio, damping, free.damping)
    dashpot_rate = 2.0 * (free.damping + damping)
    law = law_at(model.law, side)
    left, error = accumulation(
        law, impact_damping, dashpot_rate, scale, force, side * j, segment.gap_rate
    )
    if left > horizon(free.forcing, start.phase):
        return 0.0, math.inf
    if j == 0.0 and scale == 0.0:
        # A constant acceleration: the closed form is exact, and what it closes would not be seen.
        error = max(error, left)
    return left, error


class Bounce(NamedTuple):
    """The bounces of a complete chatter sequence, to first order in their speed."""

    out: float
    """Relative acceleration towards the wall on the way out, friction with it."""
    back: float
    """On the way back, friction against it; not positive where they do not reach the wall."""
    shrinks: float
    """Speed of a rebound over that of the one before."""


@compiled
def rubbed_part(bounce: Bounce) -> float:
    """Part of the energy of a complete chatter sequence that friction takes, to first order."""
    eased = bounce.back / bounce.out
    return (1.0 - eased) / (1.0 - bounce.shrinks * bounce.shrinks) if eased < 1.0 else 0.0


@compiled
def bounce_from(start: Any, flight: Any, segment: Segment, friction: float) -> Bounce:
    """How a free mass bounces that slides away from a wall, in the flight that begins there."""
    a, _, _, _ = relative_rates(start, flight)
    out = -segment.side * a
    back = out - 2.0 * (1.0 + flight.mass_ratio) * friction
    shrinks = 0.0
    if back > 0.0:
        law = law_at(flight.law, segment.side)
        shrinks = restitution_at(law, 0.0) * math.sqrt(back / out)
    return Bounce(out, back, shrinks)


@compiled
def completes_rubbing(
    start: Any, flight: Any, segment: Segment, friction: float
) -> tuple[float, float]:
    """Time to the accumulation point after an impact, to first order, and its error.

    The arguments are those of `bounce_from`. An infinite error says that the sequence need not
    complete from here. docs/models.md.
    """
    out, back, _ = bounce_from(start, flight, segment, friction)
    # By how much the pressing acceleration changes meanwhile: with the force and the springs, and
    # with what impacts and friction do to the primary's velocity.
    _, jerk, _, snap = relative_rates(start, flight)
    mu = flight.mass_ratio
    drag = 2.0 * (flight.free.damping * mu + flight.mass.damping)
    jerk, brake = abs(jerk) + 2.0 * drag * friction, 2.0 * drag / (1.0 + mu)
    law = law_at(flight.law, segment.side)
    left, error = accumulation_rubbing(law, out, back, jerk, brake, snap, segment.gap_rate)
    if left > horizon(flight.free.forcing, start.phase):
        return 0.0, math.inf
    return left, error


@compiled
def bounce_at(bounce: Bounce, duration: float, gap_rate: float, tau: float) -> tuple[float, float]:
    """Gap and gap rate in the closed rest of a sequence: its bounces are self-similar."""
    if bounce.out == bounce.back:
        return frictionless_bounce_at(bounce.shrinks, duration, gap_rate, tau)
    left = 1.0 - tau / duration if duration > 0.0 else 0.0
    if bounce.shrinks == 0.0 or left <= 0.0:
        return 0.0, 0.0
    count = math.floor(math.log(left) / math.log(bounce.shrinks))
    shrink = math.exp(count * math.log(bounce.shrinks))
    speed = gap_rate * shrink
    now = (1.0 - left / shrink) * duration * shrink
    turn = speed / bounce.out
    if now <= turn:
        return max(now, 0.0) * (speed - 0.5 * bounce.out * max(now, 0.0)), speed - bounce.out * now
    height, fallen = 0.5 * speed * turn, now - turn
    return max(height - 0.5 * bounce.back * fallen * fallen, 0.0), -bounce.back * fallen


@compiled
def unclipped(
    model: Any, segment: Segment, start: Any, tau: float
) -> tuple[float, float, float, float]:
    """As `flight`, with the gap as it rounds, from what the flight follows from."""
    s = segment
    p: EventPoint = point_at(gap_of(start, model, s, 1.0), tau)
    primary: Primary = p.state
    return s.x + primary.dx, primary.v, p.value, p.slope

"""What one segment adds to the response: integrals, energy lost, and the peak displacement.

Each model implements `integrate_segment` in its own `response` module, which only the observers
`response` and `laws` load; models with rigid walls share what is here.

**Integrals** of x^2, v^2 and force times velocity are Gauss-Legendre sums over steps of a segment
(`damper.engine.quadrature`). The motion from a known state is an entire function: at complex time z
it is at most (its present size + force |z|) exp(rate |z|), rate = max(that of the force, 2 beta +
sqrt(kappa)), so that the integrands are of exponential type 2 rate. An overdamped motion has a fast
mode exp(-R tau) that soon decays; steps h <= tau are enough for it, because
max over tau of exp(-R tau) (e R tau / (8 n))^(2 n) = 4^(-2 n). So steps grow until only omega and
the slow mode count.

**The peak** comes from the same nodes: between two of them, a time h apart, |x| is at most
max(|x0|, |x1|) + B h^2 / 8 with |x''| <= B. Nearly always that is no more than the peak so far.
Where it is more, `damper.engine.peak.highest` looks closer until it is certain.

**In the tail of a burst** the centre of both masses follows the sticking flow and the bounces go
on about it (`damper.engine.model.motion`). The integrals are taken along the centre: complete
bounces add O(w^3), w the rebound speed at the tail's start, which is what the tail itself neglects.
A bounce that an end of the window cuts adds O(w^2) to work, losses and stored energy and is
accounted for; so is the O(w^2) by which bounces carry the primary out, in the peak.

**In the frame of a base that moves** the force of inertia acts on the free mass as well, in flight
as in contact. Work, losses and stored energy are those of the motion relative to the base.
"""

import math
from importlib import import_module
from typing import Any, NamedTuple

from damper.engine.accumulation import bounce_at
from damper.engine.bodies import Ballistic, FixedStop, strength_on, weight_on
from damper.engine.bounds import bounds_ahead
from damper.engine.compiled import compiled
from damper.engine.dispatch import by_class, by_class_or_default
from damper.engine.forcing import HORIZON, common, force_rates, phase_at, rate_of
from damper.engine.forcing.weighed import WeighedForce
from damper.engine.impact import inertia_of, law_at, restitution_at, share_of
from damper.engine.model import begin, mass_ratio_at, motion
from damper.engine.oscillator import OVERDAMPED, Motion, Oscillator, increments, motion_from
from damper.engine.peak import Moment, bounds_of, highest, moment_at
from damper.engine.quadrature import FEWEST, LONGEST_REACH, NODES, WEIGHTS, nodes_for
from damper.engine.roundoff import EPSILON
from damper.engine.segment import FLIGHT, IMPACT, TAIL, Segment, centre_velocity
from damper.engine.tuples import changed
from damper.models.flights import Bounce, course_of, rest_shift
from damper.models.flights import bounce_at as bounce_of_tail
from damper.models.walls import bounce_of
from damper.parameters.models import models_of, room_of


class ResponseIntegrals(NamedTuple):
    """Contribution of a part of a segment to the response."""

    square: float
    """Integral of x^2."""
    speed_square: float
    """Integral of v^2."""
    work: float
    """Work of the force on both masses."""
    loss: float
    """Energy lost in contact after the impact itself."""
    support: float
    """Energy lost in a support of the free mass."""
    friction: float
    """Energy lost in dry friction of the free mass."""
    modulation: float
    """Energy that a time-varying free mass gains by its variation."""
    peak: float
    """Largest |x| so far."""


#: The integrals with other ones of these, in this order.
with_energies = changed(ResponseIntegrals, "work", "loss", "support", "friction", "modulation")


def prepare_tables(model: Any) -> tuple:
    """Load a model's module `response`, and return what it works out once for a run."""
    module = import_module(f"damper.models.{room_of(models_of(model)[0])}.response")
    prepare = getattr(module, "prepare", lambda model: ())
    return prepare(model)  # type: ignore[no-any-return]


@by_class
def integrate_segment(
    model: Any, tables: Any, segment: Segment, low: float, high: float, peak: float
) -> ResponseIntegrals:
    """Contribution of a segment on [low, high] after its start.

    `tables` is the result of the module's function `prepare` for the model; () without a function.
    `peak` is the largest |x| so far; with infinity none is sought.
    """


@by_class
def impact_loss(model: Any, segment: Segment) -> float:
    """Energy lost in the impact that begins a segment."""


@by_class_or_default
def lost_at_start(model: Any, segment: Segment) -> float:
    """Energy lost in all impacts at a segment's start, whichever mass the segment speaks of."""
    return impact_loss(model, segment) if segment.cause == IMPACT else 0.0


@by_class_or_default
def own_loss(model: Any, segment: Segment) -> float:
    """Part of the loss in the impacts at a segment's start that is of its own mass."""
    return impact_loss(model, segment)


@by_class_or_default
def own_share(model: Any, segment: Segment) -> float:
    """Part of the loss in a tail, after the impact that begins it, that is of its own mass."""
    return 1.0


@by_class_or_default
def drag_of(model: Any) -> float:
    """Power lost in the dashpot of the primary, over the integrand of `speed_square`."""
    return 2.0 * model.free.damping  # type: ignore[no-any-return]


@by_class_or_default
def is_of_box(model: Any) -> bool:
    """Whether the integrals of x^2 and v^2 are those of the box, which is the primary."""
    return True


@by_class_or_default
def fastest_rate(model: Any) -> float:
    """Fastest rate of the motion of a box, in flight as in contact."""
    return max(model.free.rate, model.stuck.rate)


@by_class_or_default
def inertias_of(model: Any, body: int) -> tuple[float, float]:
    """Mass of a free mass, and the reduced mass of it and its box."""
    return inertia_of(model.mass_ratio), share_of(model.mass_ratio)


@by_class_or_default
def longest_product(model: Any, segment: Segment, tau: float) -> float:
    """Longest step that one rule integrates, of products of a free mass's motion and its box's."""
    rate = 2.0 * model.mass.damping + math.sqrt(model.mass.stiffness)
    whole = longest_step(primary_of(model, segment), tau)
    return min(whole, 0.5 * LONGEST_REACH / rate) if rate > 0.0 else whole


@by_class
def own_impulse(model: Any, segment: Segment) -> float:
    """Impulse on the mass whose impact begins a segment."""


@by_class_or_default
def primary_of(model: Any, segment: Segment) -> Oscillator:
    """The primary's oscillator in a segment in which the segment's mass flies."""
    return model.free  # type: ignore[no-any-return]


def have_rigid_walls(kind: type) -> None:
    """Let the response of a model be that of one with rigid walls."""
    impact_loss.of(kind)(_lost_at_a_rigid_wall)
    own_impulse.of(kind)(_impulse_at_a_rigid_wall)
    energy_in.of(kind)(_energy_between_rigid_walls)
    integrate_segment.of(kind)(_integrate_between_rigid_walls)


@compiled
def _lost_at_a_rigid_wall(model: Any, segment: Segment) -> float:
    """Energy lost in the impact on a rigid wall that begins a segment."""
    mass_ratio = mass_ratio_at(model, segment.periods, segment.time)
    reduced = share_of(mass_ratio)
    return 0.5 * reduced * (segment.speed - segment.gap_rate) * (segment.speed + segment.gap_rate)


@compiled
def _impulse_at_a_rigid_wall(model: Any, segment: Segment) -> float:
    mass_ratio = mass_ratio_at(model, segment.periods, segment.time)
    return share_of(mass_ratio) * (segment.speed + segment.gap_rate)


@by_class_or_default
def stored_energy(model: Any, segment: Segment, tau: float) -> float:
    """Energy stored in masses and springs a time `tau` after a segment's start."""
    mass_ratio = mass_ratio_at(model, segment.periods, segment.time + tau)
    return energy_in(model, segment, mass_ratio, motion(model, segment, tau))


@by_class
def energy_in(model: Any, segment: Segment, mass_ratio: float, state: tuple) -> float:
    """Energy in a state of a segment, which `damper.engine.model.motion` gives."""


@compiled
def _energy_between_rigid_walls(model, segment, mass_ratio, state):
    x, v, gap, rate = state
    side = segment.side
    u = v - side * rate
    inertia = inertia_of(mass_ratio)
    energy = 0.5 * (v * v + x * x + inertia * u * u)
    stiffness = inertia * model.mass.stiffness
    damping = inertia * model.mass.damping
    if stiffness > 0.0:
        y = x + side * (model.clearance - gap)
        energy += 0.5 * stiffness * y * y
    energy = with_height(model.stuck.forcing, model, energy, mass_ratio, segment, state)
    if segment.mode == TAIL:
        # The bounce under way changes the loss in the dashpots; `motion` leaves this change out.
        drag = 2.0 * model.free.damping * share_of(mass_ratio)
        energy -= drag * v * side * gap
        energy += 2.0 * damping * v * side / (1.0 + mass_ratio) * gap
    return energy


@by_class_or_default
def with_height(
    forcing: Any, model: Any, energy: float, mass_ratio: float, segment: Segment, state: tuple
) -> float:
    """Add the energy of the free mass's height; `forcing` is that of both masses in contact."""
    return energy


@with_height.of(WeighedForce)
def _with_height(forcing, model, energy, mass_ratio, segment, state):
    x, _, gap, _ = state
    y = x + segment.side * (model.clearance - gap)
    return energy - mass_ratio * weight_on(model.mass) * y


@by_class
def integrands(moving: Any, moment: Moment) -> tuple[float, float, float, float]:
    """x^2, v^2, force times v, and a power of the model's own; see `oscillation` for the force."""


class Sums(NamedTuple):
    """Integrals of the `integrands`, and the largest |x| so far."""

    square: float
    speed_square: float
    work: float
    own: float
    peak: float


@compiled
def gauss_sums(moving: Any, start: float, end: float, nodes: int, peak: float) -> Sums:
    """Integrals over a step by one Gauss rule, and the largest |x| on it."""
    rule = nodes - FEWEST
    step = end - start
    square = 0.0
    speed_square = 0.0
    work = 0.0
    own = 0.0
    bound2 = 0.0
    # Before the first node the start of the step, and after the last one its end.
    for k in range(-1, nodes + 1):
        tau = start if k < 0 else end
        if 0 <= k < nodes:
            tau = start + step * float(NODES[rule, k])
        q = moment_at(moving, tau)
        peak = max(peak, abs(q.x))
        if k < 0:
            bound2, _ = bounds_of(moving, q, step)
            p = q
            continue
        if k < nodes:
            weight = step * float(WEIGHTS[rule, k])
            one, two, three, four = integrands(moving, q)
            square += weight * one
            speed_square += weight * two
            work += weight * three
            own += weight * four
        apart = q.tau - p.tau
        if max(abs(p.x), abs(q.x)) + 0.125 * bound2 * apart * apart > peak:
            peak = highest(moving, p, q, peak)
        p = q
    return Sums(square, speed_square, work, own, peak)


class ShiftedOscillator(NamedTuple):
    """Motion of an oscillator from a segment's start; the primary's x is its own less `shift`."""

    osc: Oscillator
    start: Motion
    shift: float


@moment_at.of(ShiftedOscillator)
def _moment_at(moving, tau):
    start = moving.start
    dx, dv, phase = increments(moving.osc, start, tau)
    now = motion_from(moving.osc, start.x + (start.v * tau + dx), start.v + dv, phase)
    return Moment(tau, now.x - moving.shift, now.v, now.a, now)


@bounds_of.of(ShiftedOscillator)
def _bounds_of(moving, moment, span):
    return bounds_ahead(moving.osc, moment.motion, span)


@integrands.of(ShiftedOscillator)
def _integrands(moving, moment):
    force, _, _, _, _ = force_rates(common(moving.osc.forcing), moment.motion.phase)
    return moment.x * moment.x, moment.v * moment.v, force * moment.v, 0.0


@by_class
def longest_rule(moving: Any, tau: float) -> float:
    """Longest step that one rule integrates, a time `tau` after a segment's start."""


@longest_rule.of(ShiftedOscillator)
def _longest_rule(moving, tau):
    return longest_step(moving.osc, tau)


@compiled
def longest_step(osc: Oscillator, tau: float) -> float:
    """As `longest_rule`, for an oscillator."""
    forcing_rate = rate_of(osc.forcing)
    # A motion that is a polynomial has no rate.
    step = 0.5 * LONGEST_REACH / max(osc.rate, forcing_rate, 1.0 / HORIZON)
    if osc.regime == OVERDAMPED:
        step = min(max(step, tau), 0.5 * LONGEST_REACH / max(forcing_rate, -osc.slow))
    return step


@compiled
def oscillation(moving: Any, low: float, high: float, peak: float) -> ResponseIntegrals:
    """Contribution of a motion on [low, high]: a `ShiftedOscillator` or a similar class.

    The work is that of the force's shape. The last of the `integrands` makes the modulation.
    """
    square = 0.0
    speed_square = 0.0
    work = 0.0
    own = 0.0
    tau = low
    while True:
        whole = longest_rule(moving, tau)
        step = min(whole, high - tau)
        end = high if step < whole else min(tau + step, high)
        nodes = nodes_for(LONGEST_REACH * (step / whole))
        sums = gauss_sums(moving, tau, end, nodes, peak)
        square += sums.square
        speed_square += sums.speed_square
        work += sums.work
        own += sums.own
        peak = sums.peak
        tau = end
        if not tau < high:
            return ResponseIntegrals(square, speed_square, work, 0.0, 0.0, 0.0, own, peak)


@compiled
def primary_in_flight(
    model: Any, segment: Segment, low: float, high: float, peak: float
) -> ResponseIntegrals:
    """Contribution of the primary's motion on [low, high] of a flight."""
    found = oscillation(flying_primary(model, segment), low, high, peak)
    return with_energies(found, model.free.strength * found.work, 0.0, 0.0, 0.0, 0.0)


# Two functions: with gravity the oscillators of flight and contact are of different classes.
@compiled
def flying_primary(model: Any, segment: Segment) -> ShiftedOscillator:
    """Motion of the primary in a flight."""
    s, osc = segment, model.free
    _, deflected = course_of(begin(model, s), model)
    start = motion_from(osc, s.x - deflected, s.v, phase_at(osc.forcing, s.periods, s.time))
    return ShiftedOscillator(osc, start, -deflected)


@compiled
def centre_in_contact(model: Any, segment: Segment) -> ShiftedOscillator:
    """Motion of the masses' centre in contact."""
    s, osc = segment, model.stuck
    shift = rest_shift(model.mass, model.mass_ratio, s.side * (model.clearance - s.gap))
    v, phase = centre_velocity(s, model.mass_ratio), phase_at(osc.forcing, s.periods, s.time)
    return ShiftedOscillator(osc, motion_from(osc, s.x + shift, v, phase), shift)


@compiled
def mass_in_flight(model: Any, segment: Segment) -> ShiftedOscillator:
    """The free mass in flight, where it is an oscillator."""
    s = segment
    mass, _ = course_of(begin(model, s), model)
    y = s.x + s.side * (model.clearance - s.gap)
    phase = phase_at(mass.forcing, s.periods, s.time)
    return ShiftedOscillator(mass, motion_from(mass, y, s.v - s.side * s.gap_rate, phase), 0.0)


@by_class
def work_in_flight(mass: Any, model: Any, segment: Segment, low: float, high: float) -> float:
    """Work of the force on the free mass over a part of a flight."""


@work_in_flight.of(Ballistic)
def _no_work_in_flight(mass, model, segment, low, high):
    return 0.0


work_in_flight.like(FixedStop, Ballistic)


@work_in_flight.of(Oscillator)
def _work_in_flight(mass, model, segment, low, high):
    strength = strength_on(mass)
    if strength == 0.0:
        return 0.0
    found = oscillation(mass_in_flight(model, segment), low, high, math.inf)
    return model.mass_ratio * strength * found.work


@compiled
def integrate_flight(
    model: Any, segment: Segment, low: float, high: float, peak: float
) -> ResponseIntegrals:
    """Contribution of a flight on [low, high], with a constant mass ratio."""
    found = primary_in_flight(model, segment, low, high, peak)
    on_mass = work_in_flight(model.mass, model, segment, low, high)
    inertia = inertia_of(model.mass_ratio)
    stiffness = inertia * model.mass.stiffness
    damping = inertia * model.mass.damping
    # Friction on the primary, constant in a flight.
    _, push = course_of(begin(model, segment), model)
    support, friction = 0.0, 0.0
    if push != 0.0:
        _, _, before, _ = motion(model, segment, low)
        _, _, after, _ = motion(model, segment, high)
        friction = abs(push) * abs(after - before)
    if damping > 0.0:
        # The work on free mass and spring less their gain of energy.
        support = on_mass
        for k in range(2):
            x, v, gap, rate = motion(model, segment, high if k == 1 else low)
            y = x + segment.side * (model.clearance - gap)
            u = v - segment.side * rate
            energy = 0.5 * (stiffness * y * y + model.mass_ratio * u * u)
            energy = with_height(
                model.stuck.forcing, model, energy, model.mass_ratio, segment, (x, v, gap, rate)
            )
            energy += push * y
            support += energy if k == 0 else -energy
    return with_energies(found, found.work + on_mass, 0.0, support, friction, 0.0)


@compiled
def _integrate_between_rigid_walls(model, tables, segment, low, high, peak):
    if segment.mode == FLIGHT:
        return integrate_flight(model, segment, low, high, peak)
    return _integrate_contact(model, segment, low, high, peak)


@compiled
def _integrate_contact(model, s, low, high, peak):
    """Contribution of the masses' centre about its place of rest, and of bounces about it."""
    inertia = inertia_of(model.mass_ratio)
    damping = inertia * model.mass.damping
    bounce = bounce_of(begin(model, s), model, s)
    in_tail = s.mode == TAIL and s.gap_rate > 0.0
    smooth = in_tail and bounce.out == bounce.back
    moving = centre_in_contact(model, s)
    found = oscillation(moving, low, high, math.inf if smooth else peak)
    support = 0.0
    if damping > 0.0:
        support = 2.0 * damping * _mass_speed_square(model, s, low, high, found.speed_square)
    push = model.free.strength + inertia * strength_on(model.mass)
    found = with_energies(found, push * found.work, 0.0, support, 0.0, 0.0)
    if not in_tail:
        return found
    tail = tail_of(model, model.mass_ratio, s, moving.start, moving.shift)
    if smooth:
        return with_bounces(found, tail, low, high, peak)
    return with_rubbing_bounces(model, s, found, tail, bounce, low, high)


@compiled
def _mass_speed_square(model, s, low, high, speed_square):
    """Integral of the free mass's velocity squared in contact, from that of both masses' centre."""
    if s.mode == TAIL:
        heavier = 1.0 + model.mass_ratio
        for k in range(2):
            _, v, gap, rate = motion(model, s, high if k == 1 else low)
            # The bounce under way has carried the free mass back from the centre.
            centre = v - s.side * model.mass_ratio / heavier * rate
            speed_square -= (1.0 if k == 1 else -1.0) * 2.0 * centre * s.side / heavier * gap
    return speed_square


class Tail(NamedTuple):
    """The closed rest of a burst: bounces about the centre of both masses."""

    start: Motion
    """Of the centre, about its place of rest."""
    shift: float
    """As in `ShiftedOscillator`."""
    force: float
    force1: float
    """The force on the primary less that on a free mass of the same mass, and its derivative: what
    does work on a bounce."""
    share: float
    """Part of the gap by which a bounce carries the primary; negative on the left wall."""
    restitution: float
    rebound_speed: float
    """Of the first bounce."""
    duration: float


@compiled
def tail_of(model: Any, mass_ratio: float, segment: Segment, start: Motion, shift: float) -> Tail:
    """The tail that a segment is, from the motion of the masses' centre, with this mass ratio."""
    force, force1, _, _, _ = force_rates(model.free.forcing, start.phase)
    s = segment
    share = s.side * share_of(mass_ratio)
    restitution = restitution_at(law_at(model.law, s.side), 0.0)
    apart = model.free.strength - strength_on(model.mass)
    return Tail(
        start, shift, apart * force, apart * force1, share, restitution, s.gap_rate, s.accumulation
    )


@compiled
def with_bounces(
    centre: ResponseIntegrals, tail: Tail, low: float, high: float, peak: float
) -> ResponseIntegrals:
    """Add what the bounces of a tail lose on [low, high], and how far they carry the primary.

    `centre` is that of the masses' centre, and `peak` the largest |x| before.
    """
    speed_square = centre.speed_square
    work = centre.work
    loss = centre.loss
    if tail.rebound_speed > 0.0:
        # Bounce speed over bounce time, the same for all of them.
        slope = tail.rebound_speed / (tail.duration * (1.0 - tail.restitution))
        for k in range(2):
            tau = high if k == 1 else low
            sign = 1.0 if k == 1 else -1.0
            gap, bounce = bounce_at(tail.restitution, tail.duration, tail.rebound_speed, tau)
            # Until it ends, a bounce holds the square of its speed: bounce^2 + 4 slope gap.
            loss -= sign * 0.5 * abs(tail.share) * (bounce * bounce + 4.0 * slope * gap)
            # The bounce under way has carried the primary this far from the centre.
            carried = sign * tail.share * gap
            work += (tail.force + tau * tail.force1) * carried
            speed_square += 2.0 * (tail.start.v + tau * tail.start.a) * carried
        peak = _tail_peak(tail, low, high, peak)
    return _about(centre, speed_square, work, loss, peak)


_about = changed(ResponseIntegrals, "speed_square", "work", "loss", "peak")


@compiled
def with_rubbing_bounces(
    model: Any,
    segment: Segment,
    centre: ResponseIntegrals,
    tail: Tail,
    bounce: Bounce,
    low: float,
    high: float,
) -> ResponseIntegrals:
    """As `with_bounces`, of a mass that rubs on its box; `centre` has the peak so far.

    Of what all bounces lose, friction takes the same part of each.
    """
    pressing = bounce.out + bounce.back
    apart = model.free.strength - strength_on(model.mass)
    force, force1, _, _, _ = force_rates(model.free.forcing, tail.start.phase)
    speed_square, work, lost = centre.speed_square, centre.work, 0.0
    for k in range(2):
        tau = high if k == 1 else low
        sign = 1.0 if k == 1 else -1.0
        gap, rate = bounce_of_tail(bounce, tail.duration, tail.rebound_speed, tau)
        # Until it ends, a bounce holds what its height and its speed are worth without friction.
        lost -= sign * 0.5 * abs(tail.share) * (rate * rate + pressing * gap)
        carried = sign * tail.share * gap
        work += apart * (force + tau * force1) * carried
        speed_square += 2.0 * (tail.start.v + tau * tail.start.a) * carried
    # The first bounce on from here rises highest.
    top = min(max(tail.rebound_speed / bounce.out, low), high)
    x, _, _, _ = motion(model, segment, top)
    restitution = bounce.shrinks * math.sqrt(bounce.out / bounce.back)
    rubbed = bounce.out - bounce.back
    rubbed /= bounce.out - restitution * restitution * bounce.back
    found = _about(centre, speed_square, work, 0.0, max(centre.peak, abs(x)))
    return with_energies(found, work, (1.0 - rubbed) * lost, found.support, rubbed * lost, 0.0)


@compiled
def _tail_peak(tail, low, high, peak):
    """Largest of `peak` and |x| on [low, high] of a tail, to the tail's own accuracy O(w^3).

    x is the centre plus `share` times the gap. On one bounce centre and gap are parabolas up to
    O(w^3), so each bounce gives its ends and its vertex. Bounces below roundoff count as one flat
    bounce.
    """
    start = tail.start
    speed = tail.rebound_speed
    length = tail.duration * (1.0 - tail.restitution)
    height = 0.25 * abs(tail.share) * speed * length
    reach = high * (abs(start.v) + high * (abs(start.a) + high * abs(start.j)))
    if abs(start.x - tail.shift) + reach + height <= peak:
        return peak
    begin = 0.0
    while begin < high:
        if height <= EPSILON * peak:  # no bounce shows from here on
            speed = 0.0
            length = high - begin
        first = max((low - begin) / length, 0.0)
        last = min((high - begin) / length, 1.0)
        if first <= last:
            a = start.a + begin * start.j
            v = start.v + 0.5 * begin * (start.a + a)
            x = start.x + begin * (start.v + 0.5 * begin * (start.a + begin * start.j / 3.0))
            # x + length * part * (v + part * change / 2), part from 0 to 1 along the bounce.
            v += tail.share * speed
            change = a * length - 2.0 * tail.share * speed
            vertex = -v / change if change != 0.0 else first
            for part in (first, min(max(vertex, first), last), last):
                carried = length * part * (v + 0.5 * part * change)
                peak = max(peak, abs((x - tail.shift) + carried))
        begin += length
        speed *= tail.restitution
        length *= tail.restitution
        height *= tail.restitution * tail.restitution
    return peak

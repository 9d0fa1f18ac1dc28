"""The response of a damper with several free masses: what a segment of it adds.

The primary moves with all that sticks to it; the bounces of a tail are those of one mass, or of
several that bounce as one, about the centre of all.
"""

import math
from typing import Any

from damper.engine.bodies import Ballistic
from damper.engine.compiled import compiled
from damper.engine.dispatch import by_class
from damper.engine.forcing import force_rates
from damper.engine.oscillator import Oscillator
from damper.engine.search import point_at
from damper.engine.segment import FLIGHT, TAIL
from damper.models import extremes
from damper.models import response as declared
from damper.models.flights import Bounce, gap_of
from damper.models.friction import SLIP_DIRECTION, is_joined
from damper.models.many import ACCUMULATION, GAP, MODE, RATE, SIDE
from damper.models.several import bodies as several
from damper.models.several.motion import bodies_in, bounce_in, primary_after, state_in
from damper.models.several.pinch import is_pinched, lost_in_pinch, share_of_pinch
from damper.models.wall_laws import restitution_of


@declared.impact_loss.of(several.Several)
def _impact_loss(model, segment):
    return segment.loss


@declared.lost_at_start.of(several.Several)
def _lost_at_start(model, segment):
    return segment.loss


@declared.own_impulse.of(several.Several)
def _own_impulse(model, segment):
    s = segment
    ratio = float(model.masses[int(s.body), several.RATIO])
    return ratio * (s.speed + s.gap_rate + s.side * (s.v_before - s.v))


@declared.own_loss.of(several.Several)
def _own_loss(model, segment):
    return 0.5 * declared.own_impulse(model, segment) * (segment.speed - segment.gap_rate)


@declared.own_share.of(several.Several)
def _own_share(model, segment):
    body = int(segment.body)
    if is_pinched(segment.bodies):
        return share_of_pinch(model, segment.bodies, body)
    ratio, _, _ = _bouncing(model, segment)
    b = segment.bodies[body]
    bounces = b[MODE] == TAIL and b[RATE] > 0.0
    return float(model.masses[body, several.RATIO]) / ratio if bounces else 0.0


@declared.primary_of.of(several.Several)
def _primary_of(model, segment):
    return several.begin(model, segment).osc


@extremes.primary_extremes.of(several.Several)
def _primary_extremes(model, segment, low, high, through, most):
    start = several.begin(model, segment)
    extremes.extremes_of(model, start.osc, start.primary, 0.0, low, high, through, most)


@declared.stored_energy.of(several.Several)
def _stored_energy(model, segment, tau):
    x, v, y, u = state_in(model, segment, tau)
    energy = 0.5 * (v * v + x * x)
    for k in range(len(y)):
        energy += energy_of(model, k, float(y[k]), float(u[k]))
    # The dashpots' loss at the centre in the bounce under way, which motion leaves out.
    ratio, side, _ = _bouncing(model, segment)
    if ratio > 0.0:
        gap = _gap_of_tail(model, segment, tau)
        share = side * ratio / (1.0 + several.begin(model, segment).joined)
        energy -= 2.0 * model.free.damping * v * share * gap
        for k in range(len(y)):
            b = segment.bodies[k]
            if is_joined(b[MODE]):
                carried = share - (side if b[MODE] == TAIL else 0.0)
                energy -= 2.0 * _support_damping(model, k) * v * carried * gap
    return energy


@compiled
def energy_of(model: Any, k: int, y: float, u: float) -> float:
    """Energy of a mass in a state: its motion, its height and its support's spring."""
    m = model.masses[k]
    stored = 0.5 * u * u + float(m[several.GRAVITY]) * y + 0.5 * float(m[several.STIFFNESS]) * y * y
    return float(m[several.RATIO]) * stored


@compiled
def _support_damping(model, k):
    """Half of a support's dashpot, over the primary's mass."""
    return float(model.masses[k, several.RATIO] * model.masses[k, several.DAMPING])


@compiled
def _bouncing(model, segment):
    """Mass ratio of the masses that bounce in a tail, their wall, and the number of one mass."""
    ratio, side, number = 0.0, 0.0, 0
    if is_pinched(segment.bodies):
        return ratio, side, number
    for k in range(len(segment.bodies)):
        b = segment.bodies[k]
        if b[MODE] == TAIL and b[RATE] > 0.0:
            ratio += float(model.masses[k, several.RATIO])
            side, number = float(b[SIDE]), k
    return ratio, side, number


@compiled
def _gap_of_tail(model, segment, tau):
    _, _, number = _bouncing(model, segment)
    _, _, bodies = bodies_in(model, segment, tau)
    return float(bodies[number, GAP])


@compiled
def _rubbed_in(model, segment, start, low, high, carried):
    """Energy lost in dry friction in a part of a segment; `carried` is the primary's way."""
    lost = 0.0
    for k in range(len(segment.bodies)):
        b = segment.bodies[k]
        if b[MODE] == FLIGHT and b[SLIP_DIRECTION] != 0.0:
            # A slide goes one way.
            moved = _moved(model.mass, model, segment, start, k, low, high)
            slid = abs(moved + float(b[SIDE]) * carried)
            lost += float(model.masses[k, several.RATIO]) * several.friction_of(model, k) * slid
    return lost


@by_class
def _moved(mass: Any, model: Any, s: Any, start: Any, k: int, low: float, high: float) -> float:
    """By how much the gap of a mass in flight changes in a part of a segment, but for bounces."""


@_moved.of(Ballistic)
def _ballistic_moved(mass, model, s, start, k, low, high):
    # As a difference of gaps it would have the roundoff of a long box.
    b = s.bodies[k]
    _, _, before, _ = primary_after(start, low)
    _, _, after, _ = primary_after(start, high)
    rate = float(b[RATE]) + float(b[SIDE]) * (start.primary.v - s.v)
    m, way = several.mass_at(model, k), float(b[SLIP_DIRECTION])
    a = several.flying(model.single, m, way).acceleration
    fallen = 0.5 * a * (high - low) * (high + low)
    return rate * (high - low) + float(b[SIDE]) * ((after - before) - fallen)


@_moved.of(Oscillator)
def _driven_moved(mass, model, s, start, k, low, high):
    m, b = several.mass_at(model, k), several.body_in(s.bodies, k)
    seg, view, own = several.flight_of_body(model.single, m, b, start)
    moving = gap_of(own, view, seg, 1.0)
    return point_at(moving, high).value - point_at(moving, low).value


@compiled
def _given_up(model, s, k, low, high):
    """Energy that a mass in flight and its spring give to dashpot and force, not to friction."""
    b = s.bodies[k]
    rubs = float(b[SLIP_DIRECTION] * model.masses[k, several.RATIO])
    rubs *= several.friction_of(model, k)
    lost = 0.0
    for tau in (high, low):
        _, _, y, u = state_in(model, s, tau)
        place = float(y[k])
        lost = energy_of(model, k, place, float(u[k])) + rubs * place - lost
    return lost


@compiled
def _lost_by_joined(model, s, start, square, share, side, low, high):
    """Loss in the supports of masses that move with the primary, from the integral of its v^2."""
    # Bounces under way at the ends have carried primary and masses from the centre.
    carried = 0.0
    if share != 0.0:
        for tau, sign in ((low, -1.0), (high, 1.0)):
            v = start.primary.v + tau * start.primary.a
            carried += sign * 2.0 * v * _gap_of_tail(model, s, tau)
    lost = 0.0
    for k in range(len(s.bodies)):
        mode = s.bodies[k, MODE]
        if is_joined(mode):
            part = share - (side if mode == TAIL else 0.0)
            lost += 2.0 * _support_damping(model, k) * (square + part * carried)
    return lost


@declared.integrate_segment.of(several.Several)
def _integrate_segment(model, tables, segment, low, high, peak):
    s = segment
    start = several.begin(model, s)
    ratio, side, number = _bouncing(model, s)
    share, carried, bounce = side * ratio / (1.0 + start.joined), 0.0, Bounce(0.0, 0.0, 0.0)
    if ratio > 0.0:
        bounce = bounce_in(model, s, number)
        carried = share * (_gap_of_tail(model, s, high) - _gap_of_tail(model, s, low))
    smooth = ratio > 0.0 and bounce.out == bounce.back
    moving = declared.ShiftedOscillator(start.osc, start.primary, 0.0)
    found = declared.oscillation(moving, low, high, math.inf if smooth else peak)
    work = model.free.strength * (1.0 + start.joined * model.share) * found.work
    rubbed = _rubbed_in(model, s, start, low, high, carried)
    support = _lost_by_joined(model, s, start, found.speed_square, share, side, low, high)
    for k in range(len(s.bodies)):
        if not is_joined(s.bodies[k, MODE]):
            own = float(model.masses[k, several.RATIO]) * (1.0 + start.joined)
            m, b = several.mass_at(model, k), several.body_in(s.bodies, k)
            seg = several.segment_of(b, start)
            view = several.single_mass_view(model.single, m, start, own, b.side, b.slip)
            on_mass = declared.work_in_flight(view.mass, view, seg, low, high)
            work += on_mass
            if model.masses[k, several.DAMPING] > 0.0:
                support += on_mass + _given_up(model, s, k, low, high)
    lost = 0.0
    if is_pinched(s.bodies):
        for tau in (low, high):
            _, _, bodies = bodies_in(model, s, tau)
            lost = lost_in_pinch(model, start, bodies) - lost
    found = declared.with_energies(found, work, -lost, 0.0, 0.0, 0.0)
    # Of the reduced mass that bounces, as the primary carries what sticks.
    heavier = 1.0
    if ratio > 0.0:
        heavier += start.joined - ratio
        force, force1, _, _, _ = force_rates(model.free.forcing, start.primary.phase)
        apart = model.free.strength * (1.0 - model.share)
        tail = declared.Tail(
            start.primary,
            0.0,
            apart * force,
            apart * force1,
            share,
            restitution_of(several.mass_at(model, number), side),
            float(s.bodies[number, RATE]),
            float(s.bodies[number, ACCUMULATION]),
        )
        if smooth:
            found = declared.with_bounces(found, tail, low, high, peak)
        else:
            found = declared.with_rubbing_bounces(model, s, found, tail, bounce, low, high)
    loss, friction = heavier * found.loss, rubbed + heavier * found.friction
    return declared.with_energies(found, found.work, loss, support, friction, 0.0)

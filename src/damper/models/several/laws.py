"""Functions of several free masses for the observer `laws`."""

import numpy as np

from damper.engine.bodies import acceleration_of
from damper.engine.compiled import compiled
from damper.engine.forcing import phase_at
from damper.engine.impact import restitution_at
from damper.engine.search import ROUNDOFF
from damper.engine.segment import IMPACT, NOTHING, RESTING
from damper.models import laws as declared
from damper.models.friction import is_joined
from damper.models.laws import Begun, ObservedMass
from damper.models.many import CAUSE, GAP, MODE, RATE, SIDE
from damper.models.several.bodies import (
    CLEARANCE,
    DAMPING,
    GRAVITY,
    RATIO,
    STIFFNESS,
    Several,
    begin,
    body_in,
    flight_of_body,
    flying,
    friction_of,
    gap_after,
    mass_at,
)
from damper.models.several.motion import bodies_in, primary_after
from damper.models.wall_laws import law_of

declared.have_rigid_walls(Several)


@declared.free_mass.of(Several)
def _free_mass(model, segment, k):
    m = mass_at(model, k)
    # Masses that do not act back have no part in what the primary loses.
    share = m.ratio / model.mass_ratio if model.mass_ratio > 0.0 else 0.0
    body = flying(model.single, m, 0.0)
    return ObservedMass(m.ratio, share, m.clearance, 2.0 * m.clearance, body)


@declared.begun.of(Several)
def _begun(model, segment, k):
    b, s = body_in(segment.bodies, k), segment
    # An impact may still be to be told.
    is_hit = b.cause == IMPACT or (s.cause == IMPACT and k == int(s.body))
    return Begun(b.gap, b.rate, b.side, b.mode, is_hit, max(-b.speed, 0.0))


@declared.rebound_of.of(Several)
def _rebound_of(model, k, side, speed):
    return restitution_at(law_of(model.single, mass_at(model, k), side), speed) * speed


@declared.tells_all.of(Several)
def _tells_all(model, segment):
    return not np.any(segment.bodies[:, CAUSE] != NOTHING)


@declared.sample.of(Several)
def _sample(model, segment, start, tau, masses):
    s, p = segment, start.primary
    x, v, bodies = bodies_in(model, s, tau)
    centre, speed, way, change = primary_after(start, tau)
    for k in range(len(bodies)):
        b = bodies[k]
        if is_joined(b[MODE]):
            masses[k, declared.GAP], masses[k, declared.RATE] = b[GAP], b[RATE]
            masses[k, declared.TERMS] = abs(b[GAP]) + abs(b[RATE]) * tau
            continue
        m, c = mass_at(model, k), body_in(s.bodies, k)
        seg, view, own = flight_of_body(model.single, m, c, start)
        gap, rate, roundoff = gap_after(own, view, seg, way, change, tau)
        # The bounces of a tail move the primary about the centre that it follows.
        masses[k, declared.GAP] = gap + seg.side * (x - centre)
        masses[k, declared.RATE] = rate + seg.side * (v - speed)
        masses[k, declared.TERMS] = roundoff / ROUNDOFF + (abs(seg.gap_rate) + abs(p.v)) * tau
    return x, v


@declared.has_no_time.of(Several)
def _has_no_time(model, s, k, rebound):
    phase = phase_at(model.free.forcing, s.periods, s.time)
    y = s.x + float(s.bodies[k, SIDE] * model.masses[k, CLEARANCE])
    a = acceleration_of(model.free, s.x, s.v, phase)
    pressed = abs(a - acceleration_of(flying(model.single, mass_at(model, k), 0.0), y, s.v, phase))
    # Masses at rest pull the primary at most as their weight and their supports would.
    pressed += friction_of(model, k) + float(np.max(np.abs(model.masses[:, GRAVITY])))
    for j in range(len(s.bodies)):
        pull = support_size(model, j, s.x, s.v)
        pressed += pull if j == k else float(model.masses[j, RATIO]) * pull
    for j in range(len(s.bodies)):
        pressed += float(model.masses[j, RATIO]) * friction_of(model, j)
    return rebound <= model.tolerance * pressed


@compiled
def support_size(model: Several, k: int, x: float, v: float) -> float:
    """Size of the acceleration by the support of a mass that moves with the primary."""
    m = model.masses[k]
    place = abs(x) + float(m[CLEARANCE])
    return float(m[STIFFNESS]) * place + 2.0 * float(m[DAMPING]) * abs(v)


@declared.braked_by.of(Several)
def _braked_by(model, s, masses):
    heavier, pushed = 1.0, 0.0
    for k in range(len(s.bodies)):
        b, rate = declared.begun(model, s, k), 0.0
        ratio = float(model.masses[k, RATIO])
        if is_joined(b.mode):
            heavier += ratio
            if b.is_hit and b.rate == 0.0:
                rate = declared.rebound_of(model, k, b.side, abs(float(masses[k, declared.RATE])))
            else:
                rate = b.kick
        pushed += b.side * ratio * rate
    return -pushed / heavier


@declared.contact_force.of(Several)
def _contact_force(model, s, k, tau, at):
    b, m, osc = body_in(s.bodies, k), mass_at(model, k), begin(model, s).osc
    force, most = declared.largest_force(model), m.friction
    phase = declared.phase_in(osc.forcing, s, tau)
    y = at.x + b.side * (m.clearance - b.gap)
    pressed = acceleration_of(flying(model.single, m, 0.0), y, at.v, phase)
    pressed = b.side * (pressed - acceleration_of(osc, at.x, at.v, phase))
    if b.mode == RESTING:
        pressed = -abs(pressed)
    speed = abs(at.v) + abs(s.v) + (force + abs(s.x)) * min(s.duration, 1.0)
    size = force + abs(m.gravity) + most + 2.0 * model.free.damping * speed + abs(at.x) + abs(s.x)
    return pressed + most, size + support_size(model, k, max(abs(at.x), abs(s.x)), speed)

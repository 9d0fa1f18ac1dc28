"""Energies, work and losses of a structure and its masses in a segment, for responses.

In place of a primary's x and v the integrals have those of the whole structure: their squares are
twice its potential and twice its kinetic energy. The bounces of a tail are left to what they lose.
"""

from typing import Any, NamedTuple

import numpy as np

from damper.engine.compiled import compiled, compiled_apart
from damper.engine.forcing import force_rates, phase_at, rate_of
from damper.engine.model import begin_samples
from damper.engine.peak import Moment, bounds_of, moment_at
from damper.engine.quadrature import LONGEST_REACH
from damper.engine.search import HORIZON
from damper.engine.segment import FLIGHT, TAIL
from damper.models import response as declared
from damper.models.flights import bounce_at, rubbed_part
from damper.models.friction import SLIP_DIRECTION
from damper.models.many import ACCUMULATION, GAP, MODE, RATE, SIDE
from damper.models.structure.constants import (
    DISPLACEMENT,
    HEAD,
    PUSH,
    STIFFNESS,
    SYSTEM_RATE,
    VELOCITY,
    WEIGHTS,
    OnStructure,
    box_at,
    first_row,
    friction_of,
    mass_in,
    size_of,
)
from damper.models.structure.flow import impulses_to_rest
from damper.models.structure.motion import all_after, bounce_in


class StructureMotion(NamedTuple):
    """Motion of a structure and its free masses in a segment, without the bounces of a tail."""

    model: OnStructure
    segment: Any
    start: Any


class Powers(NamedTuple):
    """Twice the energies of a structure at a time, and what is put in and lost."""

    potential: float
    kinetic: float
    work: float
    drag: float


def prepare(model: OnStructure) -> tuple:
    """Nothing."""
    return ()


@declared.impact_loss.of(OnStructure)
def _impact_loss(model, segment):
    return segment.loss


@declared.lost_at_start.of(OnStructure)
def _lost_at_start(model, segment):
    return segment.loss


@declared.own_impulse.of(OnStructure)
def _own_impulse(model, segment):
    s = segment
    change = s.speed + s.gap_rate + s.side * (s.v_before - s.v)
    return mass_in(model.masses, int(s.body)).mass * change


@declared.own_loss.of(OnStructure)
def _own_loss(model, segment):
    return 0.5 * declared.own_impulse(model, segment) * (segment.speed - segment.gap_rate)


@declared.own_share.of(OnStructure)
def _own_share(model, segment):
    of_each, every = _relative(model, segment.bodies), 0.0
    for part in of_each:
        every += part
    own = float(of_each[int(segment.body)])
    return own / every if every != 0.0 else 0.0


@declared.drag_of.of(OnStructure)
def _drag_of(model):
    return 0.0


@declared.is_of_box.of(OnStructure)
def _is_of_box(model):
    return False


@declared.fastest_rate.of(OnStructure)
def _fastest_rate(model):
    return float(model.flying[HEAD, SYSTEM_RATE])


@declared.inertias_of.of(OnStructure)
def _inertias_of(model, body):
    own, box = mass_in(model.masses, body).mass, 0.0
    for i in range(size_of(model)):
        box += model.table[WEIGHTS + body, i] * model.table[WEIGHTS + body, i]
    return own, 1.0 / (1.0 / own + box)


@declared.longest_product.of(OnStructure)
def _longest_product(model, segment, tau):
    rate = max(declared.fastest_rate(model), rate_of(model.forcing), 1.0 / HORIZON)
    return 0.5 * LONGEST_REACH / rate


@declared.longest_rule.of(StructureMotion)
def _longest_rule(moving, tau):
    return _longest_product(moving.model, moving.segment, tau)


@moment_at.of(StructureMotion)
def _moment_at(moving, tau):
    model, segment = moving.model, moving.segment
    here, n = all_after(model, segment, moving.start, tau, len(segment.bodies), 0.0), size_of(model)
    force, _, _, _, _ = force_rates(
        model.forcing, phase_at(model.forcing, segment.periods, segment.time + tau)
    )
    potential, kinetic, work, drag, first = 0.0, 0.0, 0.0, 0.0, first_row(model.table, 0)
    for i in range(n):
        place, rate = here.modes[DISPLACEMENT, i], here.modes[VELOCITY, i]
        potential += model.table[STIFFNESS, i] * place * place
        kinetic += rate * rate
        work += model.table[PUSH, i] * rate
        for j in range(n):
            drag += rate * model.table[first + i, j] * here.modes[VELOCITY, j]
    for k in range(len(here.bodies)):
        m, b = mass_in(model.masses, k), here.bodies[k]
        apart = b[RATE] if b[MODE] == FLIGHT else 0.0
        work += m.mass * m.carried * (box_at(model, here, VELOCITY, k) - b[SIDE] * apart)
        drag += m.tie_damping * apart * apart
    return Moment(tau, 0.0, 0.0, 0.0, Powers(potential, kinetic, force * work, drag))


@bounds_of.of(StructureMotion)
def _bounds_of(moving, moment, span):
    # No peak is looked for: each box has one of its own.
    return 0.0, 0.0


@declared.integrands.of(StructureMotion)
def _integrands(moving, moment):
    p = moment.motion
    return p.potential, p.kinetic, p.work, p.drag


@declared.integrate_segment.of(OnStructure)
def _integrate_segment(model, tables, segment, low, high, peak):
    moving = StructureMotion(model, segment, begin_samples(model, segment))
    found = declared.oscillation(moving, low, high, 0.0)
    loss = _in_bounces(model, segment, low) - _in_bounces(model, segment, high)
    rubbed = loss * _part_rubbed(model, segment.bodies)
    slid = rubbed + _rubbed_in(model, segment, moving.start, low, high)
    return declared.with_energies(found, found.work, loss - rubbed, found.modulation, slid, 0.0)


@compiled
def _part_rubbed(model, bodies):
    """Part of what is lost in a tail that friction takes, to first order."""
    found = 0.0
    for k in range(len(bodies)):
        if bodies[k, MODE] == TAIL and bodies[k, RATE] > 0.0:
            found = rubbed_part(bounce_in(model, bodies, k))
    return found


@compiled_apart
def _rubbed_in(model, segment, start, low, high):
    """Energy lost in slides in a part of a segment; each goes one way."""
    lost, none = 0.0, len(segment.bodies)
    for k in range(none):
        way = segment.bodies[k, SLIP_DIRECTION]
        if way != 0.0:
            before = all_after(model, segment, start, low, none, 0.0).bodies[k, GAP]
            after = all_after(model, segment, start, high, none, 0.0).bodies[k, GAP]
            slid = -way * segment.bodies[k, SIDE] * (after - before)
            lost += mass_in(model.masses, k).mass * friction_of(model, k) * slid
    return lost


@compiled_apart
def _in_bounces(model, s, tau):
    """Energy of the bounces that are still to come in a tail."""
    bodies, held = s.bodies, 0.0
    for k in range(len(bodies)):
        b = bodies[k]
        if b[MODE] == TAIL and b[RATE] > 0.0 and b[ACCUMULATION] > 0.0:
            rate, bounce = float(b[RATE]), bounce_in(model, bodies, k)
            gap, speed = bounce_at(bounce, float(b[ACCUMULATION]), rate, tau)
            # Until it ends, a bounce holds the square of its speed, but for friction.
            held = (speed * speed + (bounce.out + bounce.back) * gap) / (rate * rate)
    if held == 0.0:
        return 0.0
    energy = 0.0
    for part in _relative(model, bodies):
        energy += part
    return held * energy


@compiled_apart
def _relative(model, bodies):
    """Energy of the motion of masses relative to their boxes, which rest would take of each."""
    found, joined = np.zeros(len(bodies)), np.zeros(len(bodies), dtype=np.bool_)
    for k in range(len(bodies)):
        joined[k] = bodies[k, MODE] != FLIGHT
    impulses = impulses_to_rest(model, bodies, joined)
    for k in range(len(bodies)):
        if joined[k]:
            found[k] = -0.5 * impulses[k] * bodies[k, RATE]
    return found


@declared.stored_energy.of(OnStructure)
def _stored_energy(model, segment, tau):
    start = begin_samples(model, segment)
    here = all_after(model, segment, start, tau, len(segment.bodies), 0.0)
    energy = _in_bounces(model, segment, tau)
    for i in range(size_of(model)):
        place, rate = here.modes[DISPLACEMENT, i], here.modes[VELOCITY, i]
        energy += 0.5 * (rate * rate + model.table[STIFFNESS, i] * place * place)
    for k in range(len(here.bodies)):
        m, b = mass_in(model.masses, k), here.bodies[k]
        flies = b[MODE] == FLIGHT
        apart = b[SIDE] * (m.clearance - (b[GAP] if flies else 0.0))
        y = box_at(model, here, DISPLACEMENT, k) + apart
        u = box_at(model, here, VELOCITY, k) - (b[SIDE] * b[RATE] if flies else 0.0)
        energy += m.mass * (0.5 * u * u + m.gravity * y) + 0.5 * m.tie_stiffness * apart * apart
    return energy

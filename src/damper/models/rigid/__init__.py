"""The rigid impact damper: a free mass that flies, rigid walls, Newton's restitution."""

import math
from typing import Any, NamedTuple

from damper.engine import model as declared
from damper.engine.bodies import Ballistic, Primary, carried, flow_of
from damper.engine.bounds import energy_norm
from damper.engine.compiled import compiled, plain
from damper.engine.dispatch import by_class
from damper.engine.forcing import bound_of, force_rates, horizon, phase_at, rate_of
from damper.engine.oscillator import (
    Motion,
    Oscillator,
    advance,
    arrive,
    higher_derivatives,
    increments,
    motion_from,
    oscillator,
)
from damper.engine.search import HORIZON, ROUNDOFF, EventPoint, first_root, point_at, rates_of
from damper.engine.segment import centre_velocity
from damper.models import tangent, walls
from damper.models.flights import EVENT, NO_EVENT, End, completes, is_thrown_off, rests
from damper.models.forces import drive_of, free_mass_of, weighed
from damper.parameters import Parameters


class Rigid(NamedTuple):
    """Constants of one run; the fields with which every model starts."""

    mass_ratio: float
    clearance: float
    law: Any
    """Contact law, from `damper.engine.impact`."""
    cycle: float
    """In which the clock counts."""
    tolerance: float
    """Error in time to which tails are closed."""
    free: Oscillator
    """The primary in flight."""
    stuck: Oscillator
    """Both masses together."""
    mass: Any
    """The free mass in flight: a body of `damper.engine.bodies`."""


@plain
def prepare(parameters: Parameters, law: Any, accuracy: float) -> Rigid:
    """Constants of one run; models that have more take them over."""
    p = parameters
    drive = drive_of(p)
    forcing, amplitude, share = drive
    heavier = 1.0 + p.mass_ratio
    stuck = amplitude * (1.0 + p.mass_ratio * share) / heavier
    pull = -p.mass_ratio * p.gravity / heavier
    return Rigid(
        p.mass_ratio,
        p.clearance,
        law,
        p.cycle,
        accuracy / max(1.0, rate_of(forcing)),
        oscillator(p.damping_ratio, 1.0, amplitude, forcing),
        weighed(p.damping_ratio / heavier, 1.0 / heavier, stuck, forcing, pull),
        free_mass_of(drive, p.gravity),
    )


walls.have_rigid_walls(Rigid)
tangent.have_rigid_walls(Rigid)


@declared.mass_ratio_at.of(Rigid)
def _mass_ratio_at(model, periods, time):
    return model.mass_ratio


class ContactForce(NamedTuple):
    """The contact force in sticking over the free mass, as the search sees it.

    -side (x'' less what the free mass's acceleration would be in flight), which neither spring nor
    dashpot gives.
    """

    osc: Oscillator
    mass: Any
    start: Motion
    side: float


@by_class
def pushed(mass: Any, phase: Any) -> tuple[float, ...]:
    """Acceleration of a free mass that nothing holds, four derivatives, a bound on the last."""


@pushed.of(Ballistic)
def _pushed_ballistic(mass, phase):
    return mass.acceleration, 0.0, 0.0, 0.0, 0.0, 0.0


@pushed.of(Oscillator)
def _pushed_driven(mass, phase):
    force, force1, force2, force3, force4 = force_rates(mass.forcing, phase)
    k = mass.strength
    most = k * bound_of(mass.forcing, 4)
    return k * force, k * force1, k * force2, k * force3, k * force4, most


@compiled
def force_point(moving: ContactForce, tau: float, dx: float, motion: Motion) -> EventPoint:
    """Where the contact force is, at a state of the motion."""
    osc = moving.osc
    snap, crackle, sixth = higher_derivatives(osc, motion)
    a, a1, a2, a3, a4, most = pushed(moving.mass, motion.phase)
    side = moving.side
    growth = osc.strength * bound_of(osc.forcing, 5)
    x = moving.start.x + dx
    size = osc.strength * bound_of(osc.forcing, 0) + 2.0 * osc.damping * abs(motion.v)
    return EventPoint(
        tau,
        -side * (motion.a - a),
        -side * (motion.j - a1),
        -side * (snap - a2),
        -side * (crackle - a3),
        -side * (sixth - a4),
        0.0,
        energy_norm(osc, crackle, sixth) + most,
        growth,
        ROUNDOFF * (size + osc.stiffness * abs(x) + abs(a)),
        Primary(dx, motion.v, motion.a, motion.j, snap, 0.0),
    )


@point_at.of(ContactForce)
def _point_of_force(moving, tau):
    start = moving.start
    dx, dv, phase = increments(moving.osc, start, tau)
    dx += start.v * tau
    motion = motion_from(moving.osc, start.x + dx, start.v + dv, phase)
    return force_point(moving, tau, dx, motion)


@rates_of.of(ContactForce)
def _rates_of_force(moving):
    osc = moving.osc
    forcing_rate = rate_of(osc.forcing)
    return forcing_rate, max(forcing_rate, osc.rate), osc.coupling


@walls.stick.of(Rigid)
def _stick(model, segment):
    s = segment
    phase = phase_at(model.stuck.forcing, s.periods, s.time)
    start = motion_from(model.stuck, s.x, s.v, phase)
    limit = min(HORIZON, horizon(model.stuck.forcing, phase))
    moving = ContactForce(model.stuck, model.mass, start, s.side)
    point = force_point(moving, 0.0, 0.0, start)
    if s.side == 0.0 or rests(point):
        x, v = arrive(model.stuck, start, limit)
        return End(limit, NO_EVENT, 0.0, x, v, 0.0, 0.0, 1)
    if is_thrown_off(point, model.stuck.forcing):
        return End(0.0, EVENT, 0.0, s.x, s.v, 0.0, 0.0, 1)
    lifts_off = point.value == 0.0 and point.slope == 0.0 and point.second == 0.0
    root = first_root(moving, point, math.inf, lifts_off, limit, 0.0)
    p = root.point
    tau = p.tau + root.step
    is_cut = limit < HORIZON and (root.side == 0.0 or tau > limit)
    if root.side == 0.0 and not is_cut:
        x, v = arrive(model.stuck, start, limit)
        return End(limit, NO_EVENT, 0.0, x, v, 0.0, 0.0, root.steps)
    dx, v, _ = carried(p, limit - p.tau if is_cut else root.step)
    if is_cut:
        return End(limit, NO_EVENT, 0.0, s.x + dx, v, 0.0, 0.0, root.steps)
    return End(tau, root.side, 0.0, s.x + dx, v, 0.0, 0.0, root.steps)


@walls.time_to_completion.of(Rigid)
def _time_to_completion(model, segment, start):
    return completes(model, model.mass_ratio, segment, start)


@walls.centre.of(Rigid)
def _centre(model, segment, tau):
    s = segment
    phase = phase_at(model.stuck.forcing, s.periods, s.time)
    together = motion_from(model.stuck, s.x, centre_velocity(s, model.mass_ratio), phase)
    dx, v = advance(model.stuck, together, tau)
    return s.x + dx, v


@tangent.contact_flow.of(Rigid)
def _contact_flow(model, periods, time, tau):
    return flow_of(model.stuck, tau)


@tangent.mass_ratio_rate.of(Rigid)
def _mass_ratio_rate(model, periods, time):
    return 0.0

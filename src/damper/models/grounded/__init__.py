"""The grounded free mass: a spring and a dashpot tie it to the frame; the walls are rigid.

Its equations, the completion time and what bounds the search: docs/models.md.
"""

import math
from typing import Any, NamedTuple

from damper.engine import forcing as forces
from damper.engine import model as declared
from damper.engine.bodies import longest_increments, strength_on
from damper.engine.bounds import energy_norm
from damper.engine.compiled import compiled, plain
from damper.engine.dispatch import by_class_or_default
from damper.engine.forcing.weighed import WeighedForce
from damper.engine.oscillator import (
    Motion,
    Oscillator,
    advance,
    displaced,
    higher_derivatives,
    motion_from,
    moved,
    oscillator,
)
from damper.engine.search import HORIZON, ROUNDOFF, EventPoint, first_root, point_at, rates_of
from damper.engine.segment import centre_velocity
from damper.models import tangent, walls
from damper.models.flights import EVENT, NO_EVENT, End, completes, is_thrown_off, rests
from damper.models.forces import drive_of, weighed
from damper.models.rigid import ContactForce, Rigid
from damper.parameters import Parameters


class Grounded(NamedTuple):
    """Constants of one run; the first eight are those of `damper.models.rigid.Rigid`."""

    mass_ratio: float
    clearance: float
    law: Any
    cycle: float
    tolerance: float
    free: Oscillator
    stuck: Oscillator
    """Both masses together, about their place of rest."""
    mass: Oscillator
    """The free mass in flight."""
    force: Oscillator
    """Contact force in sticking over the reduced mass, about its mean, to the left wall."""
    mean: float
    """Mean contact force over the reduced mass, without a weight; not positive."""
    stiffness: float
    """Stiffness of the support over that of the primary."""
    damping: float
    """Its damping ratio, with mass and stiffness of the primary."""


@plain
def prepare(parameters: Parameters, law: Any, accuracy: float) -> Grounded:
    """Constants of one run."""
    p = parameters
    forcing, amplitude, share = drive_of(p)
    heavier = 1.0 + p.mass_ratio
    beta = p.support_damping_ratio / p.mass_ratio
    # Without a spring the support is its dashpot alone; an oscillator needs some stiffness.
    kappa = p.support_stiffness_ratio / p.mass_ratio or 1e-100
    stuck_beta = (p.damping_ratio + p.support_damping_ratio) / heavier
    stuck_kappa = (1.0 + p.support_stiffness_ratio) / heavier
    # The contact force obeys the equation of sticking; this is what drives it.
    together = (1.0 + p.mass_ratio * share) / heavier
    pull = -p.mass_ratio * p.gravity / heavier
    first, zeroth = 2.0 * beta, kappa
    if share:
        first = 2.0 * (beta - p.damping_ratio) * together
        zeroth = (kappa - 1.0) * together
    driving, strength = forces.filtered(forcing, 1.0 - share, first, zeroth)
    return Grounded(
        p.mass_ratio,
        p.clearance,
        law,
        p.cycle,
        accuracy / max(1.0, forces.rate_of(forcing), 2.0 * beta + math.sqrt(kappa)),
        oscillator(p.damping_ratio, 1.0, amplitude, forcing),
        weighed(stuck_beta, stuck_kappa, amplitude * together, forcing, pull),
        weighed(beta, kappa, share * amplitude, forcing, -p.gravity),
        oscillator(stuck_beta, stuck_kappa, amplitude * strength, driving),
        -kappa * p.clearance * heavier / (1.0 + p.support_stiffness_ratio),
        p.support_stiffness_ratio,
        p.support_damping_ratio,
    )


walls.have_rigid_walls(Grounded)
tangent.have_rigid_walls(Grounded)
declared.mass_ratio_at.like(Grounded, Rigid)
tangent.contact_flow.like(Grounded, Rigid)
tangent.mass_ratio_rate.like(Grounded, Rigid)


class SupportedForce(NamedTuple):
    """The contact force in sticking over the reduced mass, as the search sees it."""

    osc: Oscillator
    mean: float
    start: Motion
    side: float
    roundoff: float


@compiled
def _force_point(moving, tau, motion):
    osc = moving.osc
    snap, crackle, _ = higher_derivatives(osc, motion)
    side = moving.side
    return EventPoint(
        tau,
        -side * motion.x + moving.mean,
        -side * motion.v,
        -side * motion.a,
        -side * motion.j,
        -side * snap,
        -side * crackle,
        energy_norm(osc, motion.j, snap),
        osc.strength * forces.bound_of(osc.forcing, 3),
        moving.roundoff,
        tau,
    )


@point_at.of(SupportedForce)
def _point_of_force(moving, tau):
    osc, start = moving.osc, moving.start
    turn = forces.turn_over(osc.forcing, tau)
    if tau > longest_increments(osc):
        # As increments the way back and forth would round in units of its rate times the time.
        way, v, _ = displaced(osc, start, turn, tau)
    else:
        dx, dv = moved(osc, start, turn, tau)
        way, v = start.v * tau + dx, start.v + dv
    motion = motion_from(osc, start.x + way, v, forces.turned(osc.forcing, start.phase, turn))
    return _force_point(moving, tau, motion)


rates_of.like(SupportedForce, ContactForce)


@walls.stick.of(Grounded)
def _stick(model, segment):
    s = segment
    phase = forces.phase_at(model.stuck.forcing, s.periods, s.time)
    together = motion_from(model.stuck, s.x + rest_shift(model, s.side), s.v, phase)
    limit = min(HORIZON, forces.horizon(model.stuck.forcing, phase))
    tau, outcome, steps = limit, NO_EVENT, 1
    moving = _contact_force(model, s, phase)
    point = _force_point(moving, 0.0, moving.start)
    if s.side != 0.0 and not rests(point):
        if is_thrown_off(point, model.stuck.forcing):
            return End(0.0, EVENT, 0.0, s.x, s.v, 0.0, 0.0, 1)
        lifts_off = point.value == 0.0 and point.slope == 0.0 and point.second == 0.0
        root = first_root(moving, point, math.inf, lifts_off, limit, 0.0)
        steps = root.steps
        if root.side != 0.0 and not (limit < HORIZON and root.point.tau + root.step > limit):
            tau, outcome = root.point.tau + root.step, root.side
    dx, v = advance(model.stuck, together, tau)
    return End(tau, outcome, 0.0, s.x + dx, v, 0.0, 0.0, steps)


@compiled
def _contact_force(model, s, phase):
    """The contact force at the start of sticking: -g'' of the flight that would begin then."""
    free = model.free
    mass = model.mass
    primary = motion_from(free, s.x, s.v, phase)
    y = s.x + s.side * model.clearance
    free_mass = motion_from(mass, y, s.v, phase)
    common = (primary.a + model.mass_ratio * free_mass.a) / (1.0 + model.mass_ratio)
    # Together they have one acceleration. Third derivatives in flight hold the square of a heavy
    # damping, which would have to cancel here.
    _, force1, _, _, _ = forces.force_rates(free.forcing, phase)
    slope = ((free.strength - strength_on(mass)) * force1 - 2.0 * free.damping * common) + (
        2.0 * mass.damping * common + (mass.stiffness - free.stiffness) * s.v
    )
    value = -s.side * (primary.a - free_mass.a)
    size = free.strength * forces.bound_of(free.forcing, 0) + abs(s.x)
    size += 2.0 * (free.damping + mass.damping) * abs(s.v)
    roundoff = ROUNDOFF * (size + mass.stiffness * abs(y))
    if not forces.may_jump(free.forcing):
        value = max(value, 0.0)
    driving = forces.phase_at(model.force.forcing, s.periods, s.time)
    mean = mean_force(mass.forcing, model, s.side)
    start = motion_from(model.force, s.side * (mean - value), slope, driving)
    return SupportedForce(model.force, mean, start, s.side, roundoff)


@by_class_or_default
def mean_force(forcing: Any, model: Any, side: float) -> float:
    """Mean contact force over the reduced mass, by what acts on the free mass in flight."""
    return float(model.mean)


@mean_force.of(WeighedForce)
def _mean_with_weight(forcing, model, side):
    return model.mean + side * forcing.weight * (1.0 + model.mass_ratio) / (1.0 + model.stiffness)


@walls.time_to_completion.of(Grounded)
def _time_to_completion(model, segment, start):
    return completes(model, model.mass_ratio, segment, start)


@walls.centre.of(Grounded)
def _centre(model, segment, tau):
    s = segment
    phase = forces.phase_at(model.stuck.forcing, s.periods, s.time)
    common = centre_velocity(s, model.mass_ratio)
    # The oscillator moves about the masses' place of rest.
    together = motion_from(model.stuck, s.x + rest_shift(model, s.side), common, phase)
    dx, v = advance(model.stuck, together, tau)
    return s.x + dx, v


@compiled
def rest_shift(model: Grounded, side: float) -> float:
    """What to add to the primary's displacement to get that of the oscillator `stuck`.

    That one moves about the masses' place of rest.
    """
    return model.stiffness / (1.0 + model.stiffness) * side * model.clearance

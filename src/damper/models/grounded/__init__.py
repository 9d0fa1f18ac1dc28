"""The grounded free mass: a spring and a dashpot tie it to the frame; the walls are rigid.

Its equations, the completion time and what bounds the search: docs/models.md.
"""

import math
from typing import Any, NamedTuple

from damper.engine import model as declared
from damper.engine.bounds import energy_norm
from damper.engine.compiled import compiled, plain
from damper.engine.completion import completion, sticks
from damper.engine.forcing import (
    bound_of,
    force_rates,
    phase_at,
    rate_of,
)
from damper.engine.forcing.harmonic import Phase
from damper.engine.oscillator import (
    Motion,
    Oscillator,
    advance,
    arrive,
    free_flow,
    higher_derivatives,
    increments,
    motion_from,
    oscillator,
)
from damper.engine.search import (
    GAVE_UP,
    HORIZON,
    ROUNDOFF,
    EventPoint,
    first_root,
    point_at,
    rates_of,
)
from damper.engine.segment import RELEASE, centre_velocity
from damper.models import tangent, walls
from damper.models.forces import drive_of
from damper.models.rigid import FlightGap, Primary, Rigid
from damper.models.tangent import oscillator_flow
from damper.models.walls import EVENT, NO_EVENT, End
from damper.parameters import Parameters

#: Rate of the support times a time, above which its motion is formed as such.
_LONG = 3.0


class Grounded(NamedTuple):
    """Constants of one run; the first seven are those of `damper.models.rigid.Rigid`."""

    mass_ratio: float
    clearance: float
    law: Any
    cycle: float
    tolerance: float
    free: Oscillator
    stuck: Oscillator
    """Both masses together, about their place of rest."""
    support: Oscillator
    """The free mass in flight."""
    force: Oscillator
    """Contact force in sticking over the reduced mass, about its mean; driven with a lead."""
    lead_cos: float
    lead_sin: float
    """Cosine and sine of the angle by which its driving leads the forcing."""
    mean: float
    """Mean contact force over the reduced mass; not positive."""
    stiffness: float
    """Stiffness of the support over that of the primary."""
    damping: float
    """Its damping ratio, with mass and stiffness of the primary."""


@plain
def prepare(parameters: Parameters, law: Any, accuracy: float) -> Grounded:
    """Constants of one run."""
    p = parameters
    forcing, amplitude, _share = drive_of(p)
    heavier = 1.0 + p.mass_ratio
    beta = p.support_damping / p.mass_ratio
    # Without a spring the support is its dashpot alone; an oscillator needs some stiffness.
    kappa = p.support_stiffness_ratio / p.mass_ratio or 1e-100
    stuck_beta = (p.damping_ratio + p.support_damping) / heavier
    stuck_kappa = (1.0 + p.support_stiffness_ratio) / heavier
    root = math.sqrt(kappa)
    omega = p.frequency_ratio
    # The contact force obeys the equation of sticking; this is what drives it.
    even = (root - omega) * (root + omega)
    odd = 2.0 * beta * omega
    size = math.sqrt(even * even + odd * odd)
    return Grounded(
        p.mass_ratio,
        p.clearance,
        law,
        p.cycle,
        accuracy / max(1.0, omega, 2.0 * beta + root),
        oscillator(p.damping_ratio, 1.0, amplitude, forcing),
        oscillator(stuck_beta, stuck_kappa, 1.0 / heavier, forcing),
        oscillator(beta, kappa, 0.0, forcing),
        oscillator(stuck_beta, stuck_kappa, size, forcing),
        even / size if size > 0.0 else 1.0,
        odd / size if size > 0.0 else 0.0,
        -kappa * p.clearance * heavier / (1.0 + p.support_stiffness_ratio),
        p.support_stiffness_ratio,
        p.support_damping,
    )


walls.have_rigid_walls(Grounded)
tangent.have_rigid_walls(Grounded)
declared.mass_ratio_at.share(Grounded, Rigid)
tangent.contact_flow.share(Grounded, Rigid)
tangent.mass_ratio_rate.share(Grounded, Rigid)


class BothMotions(NamedTuple):
    """Motion of the primary and of the free mass."""

    primary: Motion
    free_mass: Motion


@declared.begin.of(Grounded)
def _begin(model, segment):
    s = segment
    phase = phase_at(model.free.forcing, s.periods, s.time)
    y = s.x + s.side * (model.clearance - s.gap)
    u = s.v - s.side * s.gap_rate
    primary = motion_from(model.free, s.x, s.v, phase)
    free_mass = motion_from(model.support, y, u, phase)
    if s.cause == RELEASE:
        # The contact force is zero: both masses have the same acceleration, exactly.
        b = primary.a
        k = -2.0 * model.support.damping * b - model.support.stiffness * u
        free_mass = Motion(y, u, b, k, phase)
    return BothMotions(primary, free_mass)


class GroundedGap(NamedTuple):
    """The gap of a flight, as the search sees it."""

    free: Oscillator
    support: Oscillator
    start: BothMotions
    side: float
    gap: float
    gap_rate: float


@compiled
def _gap_point(moving, tau, gap, rate, roundoff, dx, primary, free_mass):
    free = moving.free
    side = moving.side
    snap, crackle, _ = higher_derivatives(free, primary)
    snap2, crackle2, _ = higher_derivatives(moving.support, free_mass)
    return EventPoint(
        tau,
        gap,
        rate,
        side * (primary.a - free_mass.a),
        side * (primary.j - free_mass.j),
        side * (snap - snap2),
        side * (crackle - crackle2),
        energy_norm(free, primary.j, snap) + energy_norm(moving.support, free_mass.j, snap2),
        free.strength * bound_of(free.forcing, 3),
        roundoff,
        Primary(dx, primary.v),
    )


@compiled
def _apart(free, support, start, side, gap0, rate0, tau):
    """Gap, its rate and roundoff, dx and dv of the primary, dy of the free mass, u, and phase.

    Short motions as increments: a bounce keeps its digits however small it is. After a swing of
    the support they would round in units of rate0 tau, the way back and forth.
    """
    primary = start.primary
    y = start.free_mass
    dx, dv, phase = increments(free, primary, tau)
    if support.rate * tau <= _LONG:
        dy, du, _ = increments(support, y, tau)
        gap = gap0 + rate0 * tau + side * (dx - dy)
        roundoff = ROUNDOFF * (gap0 + abs(rate0) * tau + abs(dx) + abs(dy))
        dy += y.v * tau
        u = y.v + du
        rate = rate0 + side * (dv - du)
        dx += primary.v * tau
    else:
        flow = free_flow(support, tau)
        own = y.x * flow.c_less_1
        carried = y.v * flow.s
        dy = own + carried
        u = y.v * (1.0 + flow.s_dot_less_1) - support.stiffness * flow.s * y.x
        dx += primary.v * tau
        gap = gap0 + side * (dx - dy)
        rate = side * (primary.v + dv - u)
        roundoff = ROUNDOFF * (gap0 + abs(dx) + abs(own) + abs(carried))
    return gap, rate, roundoff, dx, dv, dy, u, phase


@point_at.of(GroundedGap)
def _point_of_gap(moving, tau):
    start = moving.start
    gap, rate, roundoff, dx, dv, dy, u, phase = _apart(
        moving.free, moving.support, start, moving.side, moving.gap, moving.gap_rate, tau
    )
    primary = motion_from(moving.free, start.primary.x + dx, start.primary.v + dv, phase)
    free_mass = motion_from(moving.support, start.free_mass.x + dy, u, phase)
    return _gap_point(moving, tau, gap, rate, roundoff, dx, primary, free_mass)


@rates_of.of(GroundedGap)
def _rates_of_gap(moving):
    rate = rate_of(moving.free.forcing)
    fastest = max(rate, moving.free.rate, moving.support.rate)
    return rate, fastest, max(moving.free.coupling, moving.support.coupling)


@walls.fly.of(Grounded)
def _fly(model, segment, start):
    s = segment
    moving = GroundedGap(model.free, model.support, start, s.side, s.gap, s.gap_rate)
    point = _gap_point(
        moving, 0.0, s.gap, s.gap_rate, ROUNDOFF * s.gap, 0.0, start.primary, start.free_mass
    )
    lifts_off = s.gap == 0.0 and s.gap_rate == 0.0 and point.second == 0.0
    root = first_root(moving, point, 2.0 * model.clearance, lifts_off, HORIZON, 0.0)
    p = root.point
    if root.side == 0.0:
        x, v = arrive(model.free, start.primary, p.tau)
        # Not by the free mass's place, which rounds in units of the clearance.
        _, _, _, _, _, dy, u, _ = _apart(
            model.free, model.support, start, s.side, s.gap, s.gap_rate, p.tau
        )
        gap = s.gap + s.side * ((x - s.x) - dy)
        return End(p.tau, NO_EVENT, 0.0, x, v, gap, s.side * (v - u), root.steps)
    step = root.step
    # The gap's derivatives carry its rate; the primary's own are not in the point.
    gap_rate = p.slope + step * (
        p.second
        + step * (0.5 * p.third + step * (p.fourth * (1.0 / 6.0) + step * p.fifth * (1.0 / 24.0)))
    )
    dx, v = advance(model.free, start.primary, p.tau + step)
    outcome = GAVE_UP if root.side == GAVE_UP else EVENT
    wall = root.side * s.side
    return End(p.tau + step, outcome, wall, s.x + dx, v, 0.0, gap_rate, root.steps)


class SupportedForce(NamedTuple):
    """The contact force in sticking over the reduced mass, as the search sees it."""

    osc: Oscillator
    mean: float
    start: Motion
    roundoff: float


@compiled
def _force_point(moving, tau, motion):
    osc = moving.osc
    snap, crackle, _ = higher_derivatives(osc, motion)
    return EventPoint(
        tau,
        motion.x + moving.mean,
        motion.v,
        motion.a,
        motion.j,
        snap,
        crackle,
        energy_norm(osc, motion.j, snap),
        osc.strength * bound_of(osc.forcing, 3),
        moving.roundoff,
        tau,
    )


@point_at.of(SupportedForce)
def _point_of_force(moving, tau):
    start = moving.start
    dx, dv, phase = increments(moving.osc, start, tau)
    motion = motion_from(moving.osc, start.x + (start.v * tau + dx), start.v + dv, phase)
    return _force_point(moving, tau, motion)


rates_of.share(SupportedForce, FlightGap)


@walls.stick.of(Grounded)
def _stick(model, segment):
    s = segment
    phase = phase_at(model.stuck.forcing, s.periods, s.time)
    together = motion_from(model.stuck, s.x + rest_shift(model, s.side), s.v, phase)
    if s.side == 0.0:
        dx, v = advance(model.stuck, together, HORIZON)
        return End(HORIZON, NO_EVENT, 0.0, s.x + dx, v, 0.0, 0.0, 1)
    moving = _contact_force(model, s, phase)
    point = _force_point(moving, 0.0, moving.start)
    lifts_off = point.value == 0.0 and point.slope == 0.0 and point.second == 0.0
    root = first_root(moving, point, math.inf, lifts_off, HORIZON, 0.0)
    tau = root.point.tau + root.step
    dx, v = advance(model.stuck, together, tau)
    return End(tau, root.side, 0.0, s.x + dx, v, 0.0, 0.0, root.steps)


@compiled
def _contact_force(model, s, phase):
    """The contact force at the start of sticking: -g'' of the flight that would begin then."""
    free = model.free
    support = model.support
    primary = motion_from(free, s.x, s.v, phase)
    y = s.x + s.side * model.clearance
    free_mass = motion_from(support, y, s.v, phase)
    mean = (primary.a + model.mass_ratio * free_mass.a) / (1.0 + model.mass_ratio)
    # Together they have one acceleration. Third derivatives in flight hold the square of a heavy
    # damping, which would have to cancel here.
    _, force1, _, _, _ = force_rates(free.forcing, phase)
    slope = -s.side * (
        (free.strength * force1 - 2.0 * free.damping * mean - free.stiffness * s.v)
        + (2.0 * support.damping * mean + support.stiffness * s.v)
    )
    value = max(-s.side * (primary.a - free_mass.a), 0.0)
    turned = Phase(
        -s.side * (phase.sin * model.lead_cos + phase.cos * model.lead_sin),
        -s.side * (phase.cos * model.lead_cos - phase.sin * model.lead_sin),
    )
    size = 1.0 + abs(s.x) + 2.0 * (free.damping + support.damping) * abs(s.v)
    roundoff = ROUNDOFF * (size + support.stiffness * abs(y))
    start = motion_from(model.force, value - model.mean, slope, turned)
    return SupportedForce(model.force, model.mean, start, roundoff)


@walls.stays.of(Grounded)
def _stays(model, segment, start):
    a, b = start.primary, start.free_mass
    snap, _, _ = higher_derivatives(model.free, a)
    snap2, _, _ = higher_derivatives(model.support, b)
    return sticks(segment.side, a.a - b.a, a.j - b.j, snap - snap2)


@walls.time_to_completion.of(Grounded)
def _time_to_completion(model, segment, start):
    free = model.free
    support = model.support
    a, b = start.primary, start.free_mass
    side = segment.side
    force = -side * (a.a - b.a)
    snap_scale = (
        free.strength * bound_of(free.forcing, 2)
        + 2.0 * free.damping * abs(a.j)
        + abs(a.a)
        + 2.0 * support.damping * abs(b.j)
        + support.stiffness * abs(b.a)
        + (free.stiffness + support.stiffness) * force
    )
    impact_damping = (free.damping * model.mass_ratio + support.damping) / (1.0 + model.mass_ratio)
    dashpot_rate = 2.0 * (free.damping + support.damping)
    jerk = side * (a.j - b.j)
    return completion(
        model.law, impact_damping, dashpot_rate, snap_scale, force, jerk, segment.gap_rate
    )


@walls.flight.of(Grounded)
def _flight(model, segment, tau):
    s = segment
    start = _begin(model, s)
    gap, rate, _, dx, dv, _, _, _ = _apart(
        model.free, model.support, start, s.side, s.gap, s.gap_rate, tau
    )
    return s.x + dx, s.v + dv, min(max(gap, 0.0), 2.0 * model.clearance), rate


@walls.centre.of(Grounded)
def _centre(model, segment, tau):
    s = segment
    phase = phase_at(model.stuck.forcing, s.periods, s.time)
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


@tangent.free_mass_flow.of(Grounded)
def _free_mass_flow(model, tau):
    return oscillator_flow(model.support, tau)


@tangent.free_mass_acceleration.of(Grounded)
def _free_mass_acceleration(model, y, u):
    return -2.0 * model.support.damping * u - model.support.stiffness * y


@tangent.damping_in.of(Grounded)
def _damping_in(model, s):
    return 2.0 * (model.free.damping + model.support.damping)

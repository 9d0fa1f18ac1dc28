"""The rigid impact damper: a free mass that flies, rigid walls, Newton's restitution."""

import math
from typing import Any, NamedTuple

from damper.engine import model as declared
from damper.engine.bounds import energy_norm
from damper.engine.compiled import compiled, plain
from damper.engine.completion import completion, sticks
from damper.engine.forcing import bound_of, phase_at, rate_of
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
from damper.engine.search import (
    GAVE_UP,
    HORIZON,
    ROUNDOFF,
    EventPoint,
    first_root,
    point_at,
    rates_of,
)
from damper.engine.segment import Segment, centre_velocity
from damper.models import tangent, walls
from damper.models.forces import drive_of
from damper.models.walls import EVENT, NO_EVENT, End
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


@plain
def prepare(parameters: Parameters, law: Any, accuracy: float) -> Rigid:
    """Constants of one run; models that have more take them over."""
    p = parameters
    forcing, amplitude, share = drive_of(p)
    heavier = 1.0 + p.mass_ratio
    stuck = amplitude * (1.0 + p.mass_ratio * share) / heavier
    return Rigid(
        p.mass_ratio,
        p.clearance,
        law,
        p.cycle,
        accuracy / max(1.0, rate_of(forcing)),
        oscillator(p.damping_ratio, 1.0, amplitude, forcing),
        oscillator(p.damping_ratio / heavier, 1.0 / heavier, stuck, forcing),
    )


walls.have_rigid_walls(Rigid)
tangent.have_rigid_walls(Rigid)


@declared.mass_ratio_at.of(Rigid)
def _mass_ratio_at(model, periods, time):
    return model.mass_ratio


class FlightGap(NamedTuple):
    """The gap of a flight, as the search sees it."""

    osc: Oscillator
    start: Motion
    side: float
    gap: float
    gap_rate: float


class Primary(NamedTuple):
    """Where the primary is at a point of a search: displacement less that at the start."""

    dx: float
    v: float


@compiled
def flight_point(
    moving: FlightGap,
    tau: float,
    gap: float,
    gap_rate: float,
    roundoff: float,
    dx: float,
    motion: Motion,
) -> EventPoint:
    """Gap and derivatives where the primary moves like this."""
    snap, crackle, _ = higher_derivatives(moving.osc, motion)
    side = moving.side
    return EventPoint(
        tau,
        gap,
        gap_rate,
        side * motion.a,
        side * motion.j,
        side * snap,
        side * crackle,
        energy_norm(moving.osc, motion.j, snap),
        moving.osc.strength * bound_of(moving.osc.forcing, 3),
        roundoff,
        Primary(dx, motion.v),
    )


@point_at.of(FlightGap)
def _point_of_gap(moving, tau):
    start = moving.start
    side = moving.side
    dx, dv, phase = increments(moving.osc, start, tau)
    gap = moving.gap + moving.gap_rate * tau + side * dx
    roundoff = ROUNDOFF * (moving.gap + abs(moving.gap_rate) * tau + abs(dx))
    dx += start.v * tau
    motion = motion_from(moving.osc, start.x + dx, start.v + dv, phase)
    return flight_point(moving, tau, gap, moving.gap_rate + side * dv, roundoff, dx, motion)


@rates_of.of(FlightGap)
def _rates_of_gap(moving):
    osc = moving.osc
    forcing_rate = rate_of(osc.forcing)
    return forcing_rate, max(forcing_rate, osc.rate), osc.coupling


@walls.fly.of(Rigid)
def _fly(model, segment, start):
    return free_flight(model, segment, start)


@compiled
def free_flight(model: Any, segment: Segment, start: Motion) -> End:
    """The next impact of a free mass that nothing acts on."""
    s = segment
    moving = FlightGap(model.free, start, s.side, s.gap, s.gap_rate)
    point = flight_point(moving, 0.0, s.gap, s.gap_rate, 0.0, 0.0, start)
    lifts_off = s.gap == 0.0 and s.gap_rate == 0.0 and start.a == 0.0
    root = first_root(moving, point, 2.0 * model.clearance, lifts_off, HORIZON, 0.0)
    p = root.point
    if root.side == 0.0:
        # Formed as such: how the errors of many such segments add up is all that matters.
        x, v = arrive(model.free, start, p.tau)
        gap = s.gap + ((s.gap_rate * p.tau) + s.side * ((x - s.x) - s.v * p.tau))
        gap_rate = s.gap_rate + s.side * (v - s.v)
        return End(p.tau, NO_EVENT, 0.0, x, v, gap, gap_rate, root.steps)
    dx, dv = carry(p, s.side, root.step)
    # Not by a difference of velocities: the rate of a small bounce keeps its digits.
    gap_rate = p.slope + s.side * dv
    outcome = GAVE_UP if root.side == GAVE_UP else EVENT
    tau, wall = p.tau + root.step, root.side * s.side
    return End(tau, outcome, wall, s.x + dx, p.state.v + dv, 0.0, gap_rate, root.steps)


@compiled
def carry(p: EventPoint, side: float, step: float) -> tuple[float, float]:
    """Displacement of the primary a short step after a point of its flight; change of velocity."""
    a = side * p.second
    j = side * p.third
    snap = side * p.fourth
    crackle = side * p.fifth
    # One term more than the gap needs: it is what is left of the velocity's error.
    dv = step * (a + step * (0.5 * j + step * (snap * (1.0 / 6.0) + step * crackle * (1.0 / 24.0))))
    dx = step * (
        p.state.v + step * (0.5 * a + step * (j * (1.0 / 6.0) + step * snap * (1.0 / 24.0)))
    )
    return p.state.dx + dx, dv


class Force(NamedTuple):
    """The contact force in sticking over the free mass, -side x'', as the search sees it."""

    osc: Oscillator
    start: Motion
    side: float


@compiled
def _force_point(moving, tau, dx, motion):
    osc = moving.osc
    snap, crackle, sixth = higher_derivatives(osc, motion)
    side = moving.side
    growth = osc.strength * bound_of(osc.forcing, 5)
    x = moving.start.x + dx
    return EventPoint(
        tau,
        -side * motion.a,
        -side * motion.j,
        -side * snap,
        -side * crackle,
        -side * sixth,
        0.0,
        energy_norm(osc, crackle, sixth),
        growth,
        ROUNDOFF * (osc.strength + 2.0 * osc.damping * abs(motion.v) + osc.stiffness * abs(x)),
        Primary(dx, motion.v),
    )


@point_at.of(Force)
def _point_of_force(moving, tau):
    start = moving.start
    dx, dv, phase = increments(moving.osc, start, tau)
    dx += start.v * tau
    motion = motion_from(moving.osc, start.x + dx, start.v + dv, phase)
    return _force_point(moving, tau, dx, motion)


rates_of.share(Force, FlightGap)


@walls.stick.of(Rigid)
def _stick(model, segment):
    s = segment
    phase = phase_at(model.stuck.forcing, s.periods, s.time)
    start = motion_from(model.stuck, s.x, s.v, phase)
    if s.side == 0.0:
        x, v = arrive(model.stuck, start, HORIZON)
        return End(HORIZON, NO_EVENT, 0.0, x, v, 0.0, 0.0, 1)
    moving = Force(model.stuck, start, s.side)
    point = _force_point(moving, 0.0, 0.0, start)
    lifts_off = point.value == 0.0 and point.slope == 0.0 and point.second == 0.0
    root = first_root(moving, point, math.inf, lifts_off, HORIZON, 0.0)
    p = root.point
    step = root.step
    if root.side == 0.0:
        x, v = arrive(model.stuck, start, p.tau)
        return End(p.tau, NO_EVENT, 0.0, x, v, 0.0, 0.0, root.steps)
    a = -s.side * p.value
    j = -s.side * p.slope
    snap = -s.side * p.second
    dx = step * (p.state.v + step * (0.5 * a + step * (j * (1.0 / 6.0) + step * snap / 24.0)))
    v = p.state.v + step * (a + step * (0.5 * j + step * snap * (1.0 / 6.0)))
    x = s.x + (p.state.dx + dx)
    return End(p.tau + step, root.side, 0.0, x, v, 0.0, 0.0, root.steps)


@walls.stays.of(Rigid)
def _stays(model, segment, start):
    snap, _, _ = higher_derivatives(model.free, start)
    return sticks(segment.side, start.a, start.j, snap)


@walls.time_to_completion.of(Rigid)
def _time_to_completion(model, segment, start):
    return rigid_completion(model, model.mass_ratio, segment, start)


@compiled
def rigid_completion(
    model: Any, mass_ratio: float, segment: Segment, start: Motion
) -> tuple[float, float]:
    """Time to the completion point and its error, for this mass ratio."""
    free = model.free
    side = segment.side
    force = -side * start.a
    snap_scale = (
        free.strength * bound_of(free.forcing, 2)
        + 2.0 * free.damping * abs(start.j)
        + free.stiffness * force
    )
    impact_damping = free.damping * mass_ratio / (1.0 + mass_ratio)
    dashpot_rate, jerk = 2.0 * free.damping, side * start.j
    return completion(
        model.law, impact_damping, dashpot_rate, snap_scale, force, jerk, segment.gap_rate
    )


@walls.flight.of(Rigid)
def _flight(model, segment, tau):
    return flight_at(model, segment, walls.primary_motion(model, segment), tau)


@walls.centre.of(Rigid)
def _centre(model, segment, tau):
    s = segment
    phase = phase_at(model.stuck.forcing, s.periods, s.time)
    together = motion_from(model.stuck, s.x, centre_velocity(s, model.mass_ratio), phase)
    dx, v = advance(model.stuck, together, tau)
    return s.x + dx, v


@compiled
def flight_at(
    model: Any, segment: Segment, start: Motion, tau: float
) -> tuple[float, float, float, float]:
    """As `damper.engine.model.motion`, in a flight of a free mass on which nothing acts."""
    s = segment
    dx, dv, _ = increments(model.free, start, tau)
    gap = min(max(s.gap + s.gap_rate * tau + s.side * dx, 0.0), 2.0 * model.clearance)
    return s.x + (s.v * tau + dx), s.v + dv, gap, s.gap_rate + s.side * dv


@tangent.free_mass_flow.of(Rigid)
def _free_mass_flow(model, tau):
    return tangent.Flow(1.0, tau, 0.0, 1.0)


@tangent.free_mass_acceleration.of(Rigid)
def _free_mass_acceleration(model, y, u):
    return 0.0


@tangent.contact_flow.of(Rigid)
def _contact_flow(model, periods, time, tau):
    return tangent.oscillator_flow(model.stuck, tau)


@tangent.mass_ratio_rate.of(Rigid)
def _mass_ratio_rate(model, periods, time):
    return 0.0


@tangent.damping_in.of(Rigid)
def _damping_in(model, s):
    return 2.0 * model.free.damping

"""Compliant contact: each wall is a spring and a dashpot, and an impact takes time.

While the gap g to a wall is negative, the contact force is N = -(k g + c g'). Either it cannot
be tensile, N = max(0, N), and the contact ends where N vanishes, or the contact lasts until the gap
reopens (`contact_tension`). Every regime is linear, so the motion is exact: free flight as in the
rigid model, contact by `damper.models.compliant.flow`.

The log has more kinds of row than the rigid one: CONTACT from the moment of contact, with the
approach speed and no jump; STICKING once a contact has lasted one period 2 pi / sqrt(k (1 + mu) /
mu) of its own oscillation; FLIGHT with the cause SEPARATION after a contact that ends sooner. A
contact without tension ends while the gap is negative still: that flight has a row of its own, up
to where the gap reopens, or to where the wall, springing back, has caught up. With no clearance
both walls touch at once, and the free mass goes from one to the other.
"""

import math
from typing import Any, NamedTuple

import numpy as np

from damper.engine import model as declared
from damper.engine.bodies import WeightedSum, start_point
from damper.engine.bounds import bounds_ahead, energy_norm
from damper.engine.compiled import compiled
from damper.engine.completion import sticks
from damper.engine.forcing import bound_of, phase_at
from damper.engine.model import Step
from damper.engine.oscillator import (
    Oscillator,
    higher_derivatives,
    increments,
    motion_at_release,
    motion_from,
)
from damper.engine.search import (
    GAVE_UP,
    HORIZON,
    ROUNDOFF,
    EventPoint,
    first_root,
    near_root,
    point_at,
    rates_of,
)
from damper.engine.segment import (
    CONTACT,
    FLIGHT,
    IMPACT,
    NOTHING,
    RELEASE,
    SEPARATION,
    STICK,
    STICKING,
    Segment,
    segment_after,
)
from damper.models import rigid
from damper.models import tangent as declared_tangent
from damper.models.compliant import tangent
from damper.models.compliant.flow import (
    ContactConstants,
    Pair,
    advance,
    contact_constants,
    derivative,
    propagators,
    unit_state,
)
from damper.models.compliant.restitution import contact_damping, contact_phase
from damper.models.compliant.search import (
    ContactMotion,
    EventFunction,
    Split,
    contact_point,
    dot,
    event_function,
    force_size,
    split_of,
)
from damper.models.flights import EVENT, fly, gap_of, unclipped
from damper.models.rigid import Rigid
from damper.models.walls import slack
from damper.parameters import Parameters

#: Part of the usual duration of a contact at which the search for its end begins where nothing
#: better is known, and the margin by which it begins before where it is expected.
_EARLY, _MARGIN = 0.97, 2e-5


class Compliant(NamedTuple):
    """Constants of one run; the first eight are those of `damper.models.rigid.Rigid`."""

    mass_ratio: float
    clearance: float
    law: Any
    """Of free bodies: the contact's damping is the one that gives it."""
    cycle: float
    tolerance: float
    free: Oscillator
    stuck: Oscillator
    mass: Any
    tension: float
    """Whether the contact force may be tensile."""
    lasting: float
    """Time after which a contact counts as sticking."""
    usual: float
    """Duration of a contact between free bodies; 0 where it lasts for ever."""
    after_usual: np.ndarray
    """(3, 6) event function and its first two derivatives then, from the state at touch."""
    contact: ContactConstants
    table: np.ndarray
    """Propagators of the contact."""
    split: Split
    ending: EventFunction
    """Event function of a contact: the depth, or the force."""


def prepare(parameters: Parameters, law: Any, accuracy: float) -> Compliant:
    """Constants of one run."""
    p = parameters
    tension = bool(p.contact_tension)
    damping = contact_damping(p.restitution, tension)
    frequency = math.sqrt(p.contact_stiffness_ratio * (1.0 + p.mass_ratio) / p.mass_ratio)
    *values, levels, shift = contact_constants(
        p.mass_ratio, p.damping_ratio, p.frequency_ratio, p.contact_stiffness_ratio, damping
    )
    contact = ContactConstants(*[*values, int(levels), shift])
    split = split_of(contact)
    ending = np.array([0.0, 0.0, -1.0, 0.0, 0.0, 0.0])
    if not tension:
        ending[2:4] = -contact.stiffness, -contact.damping
    usual = contact_phase(damping, tension) / frequency
    table = propagators(contact)
    after_usual = np.zeros((3, 6))
    _fill_rows(contact, table, ending, usual, after_usual)
    return Compliant(
        *rigid.prepare(p, law, accuracy),
        float(tension),
        min(2.0 * math.pi / frequency, HORIZON),
        usual,
        after_usual,
        contact,
        table,
        split,
        event_function(contact, split, ending),
    )


@compiled
def _fill_rows(contact, table, ending, tau, rows):
    for column in range(6):
        z = advance(contact, table, unit_state(column), tau)
        z1 = derivative(contact, z)
        z2 = derivative(contact, z1)
        rows[0, column] = ending[2] * z[2] + ending[3] * z[3]
        rows[1, column] = ending[2] * z1[2] + ending[3] * z1[3]
        rows[2, column] = ending[2] * z2[2] + ending[3] * z2[3]


@compiled
def _likely_end(model, z):
    """A little before the end of a contact that an impact begins, or 0: by Newton's method.

    Acceleration and springs change the duration of a contact between free bodies a little. The
    motion is linear in the state, so where it would be after that duration costs three products.
    """
    if model.usual == 0.0:
        return 0.0
    rows = model.after_usual
    value, slope, second = dot(rows[0], z), dot(rows[1], z), dot(rows[2], z)
    late = near_root(value, slope, second, 0.0, 0.0)
    if not abs(late) < 0.5 * model.usual:
        return _EARLY * model.usual
    return (1.0 - _MARGIN) * (model.usual + late)


@compiled
def pair_at(model: Compliant, segment: Segment) -> Pair:
    """State of the pair at the start of a segment, as `damper.models.compliant.flow` has it."""
    s = segment
    phase = phase_at(model.free.forcing, s.periods, s.time)
    beta = model.contact.reduced
    return (
        s.side * s.x - beta * s.gap,
        s.side * s.v - beta * s.gap_rate,
        s.gap,
        s.gap_rate,
        s.side * phase.sin,
        s.side * phase.cos,
    )


declared.mass_ratio_at.share(Compliant, Rigid)


@declared.motion.of(Compliant)
def _motion(model, segment, tau):
    s = segment
    if s.mode == FLIGHT:
        x, v, gap, rate = unclipped(model, s, _begin(model, s), tau)
        if s.gap >= 0.0:
            gap = min(max(gap, 0.0), 2.0 * model.clearance)
        return x, v, gap, rate
    return _of_pair(model, s.side, advance(model.contact, model.table, pair_at(model, s), tau))


@compiled
def _of_pair(model, side, z):
    """Displacement and velocity of the primary, gap and its rate in a state of the pair."""
    beta = model.contact.reduced
    return side * (z[0] + beta * z[2]), side * (z[1] + beta * z[3]), z[2], z[3]


@declared.initial_segment.of(Compliant)
def _initial_segment(model, periods, time, x, v, y, u):
    relative = y - x
    side = 1.0 if relative >= 0.0 else -1.0
    gap = model.clearance - side * relative
    rate = -side * (u - v)
    if abs(gap) <= slack(model.clearance, x, y):
        gap = 0.0
    new = Segment(periods, time, x, v, gap, rate, side, FLIGHT, NOTHING, 0.0, v, 0.0, 0.0, 0.0)
    return _settled(model, new)


@declared.begin.of(Compliant)
def _begin(model, segment):
    """The primary's motion in flight, where an x'' at the wall of no more than roundoff is zero.

    A force that vanishes ends a contact; what roundoff leaves of it must not begin the next one.
    """
    phase = phase_at(model.free.forcing, segment.periods, segment.time)
    motion = motion_from(model.free, segment.x, segment.v, phase)
    if segment.gap == 0.0:
        drag = 2.0 * model.free.damping
        size = force_size(drag, segment.x, segment.v, phase.sin, phase.cos)
        if abs(motion.a) <= ROUNDOFF * size:
            return motion_at_release(model.free, segment.x, segment.v, 0.0, phase)
    return motion


@compiled
def _touches(model, segment):
    """Whether the contact acts from now on; an approach from gap 0 is still a flight."""
    s = segment
    if s.gap < 0.0:
        pull = model.contact.stiffness * s.gap + model.contact.damping * s.gap_rate
        return model.tension != 0.0 or pull < 0.0
    if s.gap > 0.0 or s.gap_rate != 0.0:
        return False
    motion = _begin(model, s)
    snap, _, _ = higher_derivatives(model.free, motion)
    return sticks(s.side, motion.a, motion.j, snap)


@compiled
def _settled(model, segment):
    """The segment itself, or a contact where a flight would begin in one."""
    s = segment
    side = s.side
    mode = s.mode
    if mode == FLIGHT and s.gap <= 0.0:
        if _touches(model, s):
            mode = CONTACT
        elif model.clearance == 0.0 and s.gap == 0.0 and s.gap_rate == 0.0:
            # At rest between walls without a clearance: where one draws away the other acts.
            side = -side
            mode = CONTACT
    return Segment(
        s.periods,
        s.time,
        s.x,
        s.v,
        s.gap,
        s.gap_rate,
        side,
        mode,
        s.cause,
        s.speed,
        s.v_before,
        s.first_speed,
        0.0,
        0.0,
    )


@declared.following.of(Compliant)
def _following(model, segment, start):
    s = segment
    if s.mode == FLIGHT:
        if s.gap >= 0.0:
            return _fly(model, s, start)
        return _spring_back(model, s, start)
    return _touch(model, s)


@compiled
def _fly(model, s, start):
    """A flight between the walls, up to the touch of one."""
    end = fly(model, s, start)
    if end.outcome != EVENT:
        gave_up = end.outcome == GAVE_UP
        tau, gap, rate = end.duration, end.gap, end.gap_rate
        new = segment_after(
            s, model.cycle, tau, end.x, end.v, gap, rate, s.side, FLIGHT, NOTHING, 0.0
        )
        return Step(end.duration, False, gave_up, end.steps, new, _begin(model, new))
    speed = abs(end.gap_rate)
    mode = CONTACT if speed > 0.0 else FLIGHT
    cause = IMPACT if speed > 0.0 else NOTHING
    new = segment_after(
        s, model.cycle, end.duration, end.x, end.v, 0.0, -speed, end.wall, mode, cause, speed
    )
    new = _settled(model, new)
    return Step(end.duration, True, False, end.steps, new, _begin(model, new))


@compiled
def _touch(model, s):
    """A contact, up to its end; or to where it has lasted, and so counts as sticking."""
    z = pair_at(model, s)
    moving = ContactMotion(model.contact, model.table, model.ending, z)
    point = contact_point(moving, 0.0, z)
    limit = model.lasting if s.mode == CONTACT else HORIZON
    hint = _likely_end(model, z) if s.cause == IMPACT else 0.0
    lifts_off = point.value == 0.0 and point.slope == 0.0 and point.second == 0.0
    root = first_root(moving, point, math.inf, lifts_off, limit, hint)
    tau = root.point.tau + root.step
    if root.side != 1.0 or tau > limit:
        z = advance(model.contact, model.table, z, limit)
        x, v, gap, rate = _of_pair(model, s.side, z)
        lasted = s.mode == CONTACT
        cause = STICK if lasted else NOTHING
        new = segment_after(s, model.cycle, limit, x, v, gap, rate, s.side, STICKING, cause, 0.0)
        return Step(limit, lasted, root.side == GAVE_UP, root.steps + 1, new, _begin(model, new))
    z = _carry(model.contact, root.point.state.z, root.step)
    x, v, gap, rate = _of_pair(model, s.side, z)
    # What is left of the force, or of the gap, is roundoff.
    gap = 0.0 if model.tension != 0.0 else -model.contact.damping / model.contact.stiffness * rate
    if gap >= 0.0:
        gap = 0.0
        rate = max(rate, 0.0)
    cause = RELEASE if s.mode == STICKING else SEPARATION
    new = segment_after(s, model.cycle, tau, x, v, gap, rate, s.side, FLIGHT, cause, 0.0)
    is_event = s.mode == STICKING
    if gap == 0.0 and rate == 0.0:
        new = _settled(model, new)
        is_event = True
    return Step(tau, is_event, False, root.steps, new, _begin(model, new))


@compiled
def _carry(contact, z, step):
    """State a short step later, by a Taylor polynomial."""
    z1 = derivative(contact, z)
    z2 = derivative(contact, z1)
    z3 = derivative(contact, z2)
    z4 = derivative(contact, z3)
    a = 0.5 * step
    b = step / 3.0
    c = 0.25 * step
    return (
        z[0] + step * (z1[0] + a * (z2[0] + b * (z3[0] + c * z4[0]))),
        z[1] + step * (z1[1] + a * (z2[1] + b * (z3[1] + c * z4[1]))),
        z[2] + step * (z1[2] + a * (z2[2] + b * (z3[2] + c * z4[2]))),
        z[3] + step * (z1[3] + a * (z2[3] + b * (z3[3] + c * z4[3]))),
        z[4],
        z[5],
    )


class WallForce(NamedTuple):
    """k g + c g' in a flight below the wall's surface: until it is negative the wall lags."""

    flight: WeightedSum
    stiffness: float
    damping: float


@point_at.of(WallForce)
def _point_of_wall(moving, tau):
    return _wall_point(moving, point_at(moving.flight, tau))


@rates_of.of(WallForce)
def _rates_of_wall(moving):
    return rates_of(moving.flight)


@compiled
def _wall_point(moving, p):
    """Of the depth -g, as a flight has it with its sides changed, make -(k g + c g')."""
    k = -moving.stiffness
    c = -moving.damping
    flight = moving.flight
    osc = flight.terms[0].osc
    # One derivative more than a flight's point has, for the damping.
    sixth = (
        osc.strength * bound_of(osc.forcing, 4)
        + 2.0 * osc.damping * abs(p.fifth)
        + osc.stiffness * abs(p.fourth)
    )
    weight = abs(c)
    return EventPoint(
        p.tau,
        k * p.value + c * p.slope,
        k * p.slope + c * p.second,
        k * p.second + c * p.third,
        k * p.third + c * p.fourth,
        k * p.fourth + c * p.fifth,
        0.0,
        abs(k) * p.bound4 + weight * energy_norm(osc, p.fourth, p.fifth),
        abs(k) * p.growth + weight * osc.strength * bound_of(osc.forcing, 4),
        abs(k) * p.roundoff + weight * ROUNDOFF * (abs(p.slope) + p.tau * sixth),
        p.state,
    )


@compiled
def _spring_back(model, s, start):
    """A flight that began below the wall's surface: the gap reopens, or the wall catches up."""
    below = gap_of(start, model, s, -s.side)
    point = start_point(below)
    opening = first_root(below, point, math.inf, False, HORIZON, 0.0)
    wall = WallForce(below, model.contact.stiffness, model.contact.damping)
    opens = opening.point.tau + opening.step if opening.side == 1.0 else math.inf
    catches = math.inf
    steps = opening.steps
    gave_up = opening.side == GAVE_UP
    force = _wall_point(wall, point)
    if not _lags(model, s, start, force.slope, opens):
        catching = first_root(wall, force, math.inf, False, min(opens, HORIZON), 0.0)
        steps += catching.steps
        gave_up = gave_up or catching.side == GAVE_UP
        if catching.side == 1.0:
            catches = catching.point.tau + catching.step
    tau = min(opens, catches, HORIZON)
    dx, dv, _ = increments(model.free, start, tau)
    gap = s.gap + s.gap_rate * tau + s.side * dx
    rate = s.gap_rate + s.side * dv
    caught = catches < opens
    if tau == opens:
        # What is left of either is roundoff.
        gap = 0.0
        rate = max(rate, 0.0)
    mode = CONTACT if caught else FLIGHT
    x = s.x + (s.v * tau + dx)
    new = segment_after(s, model.cycle, tau, x, s.v + dv, gap, rate, s.side, mode, NOTHING, 0.0)
    if gap == 0.0 and rate == 0.0:
        new = _settled(model, new)
        caught = True
    return Step(tau, caught, gave_up, steps, new, _begin(model, new))


@compiled
def _lags(model, s, start, slope, span):
    """Whether the wall surely stays behind the free mass for a time, by bounds on its force.

    At the start the force is zero and grows by `slope`.
    """
    bound2, bound3 = bounds_ahead(model.free, start, min(span, HORIZON))
    second = model.contact.stiffness * bound2 + model.contact.damping * bound3
    return slope > 0.5 * span * second


declared_tangent.joins.of(Compliant)(tangent.joins)
declared_tangent.shrunk_by.of(Compliant)(tangent.shrunk_by)
declared_tangent.velocities_after.of(Compliant)(tangent.velocities_after)
declared_tangent.damping_in.of(Compliant)(tangent.damping_in)
declared_tangent.over_event.of(Compliant)(tangent.over_event)
declared_tangent.stay_on.of(Compliant)(tangent.stay_on)

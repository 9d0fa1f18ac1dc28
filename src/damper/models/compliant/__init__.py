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
from dataclasses import replace
from typing import Any, NamedTuple

import numpy as np

from damper.engine import model as declared
from damper.engine.bodies import WeightedSum, start_point
from damper.engine.compiled import compiled, plain
from damper.engine.dispatch import ByClass
from damper.engine.forcing import horizon, phase_at
from damper.engine.impact import DifferingWalls, law_at
from damper.engine.model import Step
from damper.engine.oscillator import Oscillator
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
from damper.engine.tuples import changed
from damper.models import masses
from damper.models import tangent as declared_tangent
from damper.models.compliant import flow, tangent
from damper.models.compliant.pairs import carried, pair_rates
from damper.models.compliant.restitution import contact_damping, contact_phase
from damper.models.compliant.search import (
    ContactMotion,
    EventFunction,
    Split,
    contact_point,
    event_function,
    force_size,
    split_of,
)
from damper.models.flights import (
    EVENT,
    begin_flight,
    fly,
    free_mass_of,
    gap_of,
    relative_rates,
    stays,
    unclipped,
)
from damper.models.forces import drive_of
from damper.models.masses import Rigid
from damper.models.walls import fly_on, slack, state_by_start
from damper.parameters import Parameters

#: Part of the usual duration of a contact at which the search for its end begins where nothing
#: better is known, and the margin by which it begins before where it is expected.
_EARLY, _MARGIN = 0.97, 2e-5


class Compliant(NamedTuple):
    """Constants of one run; the first eight are those of `damper.models.masses.Rigid`."""

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
    """(3, row length) event function and two derivatives then, from the state at touch."""
    contact: flow.ContactConstants
    table: np.ndarray
    """Propagators of the contact."""
    split: Split
    ending: EventFunction
    """Event function of a contact: the depth, or the force."""


class CompliantPair(NamedTuple):
    """Constants of a run whose walls differ; a segment has those of its wall, as `law_at` gives.

    This class is separate so that equal walls cost no more. Where a segment goes on at the other
    wall the gap is 0, and nothing asks for that wall's dashpot before the segment begins.
    """

    mass_ratio: float
    clearance: float
    law: DifferingWalls
    cycle: float
    tolerance: float
    free: Oscillator
    stuck: Oscillator
    mass: Any
    left: Compliant
    right: Compliant


def of_a_wall(function: ByClass) -> None:
    """Let a function of a model, a segment and more take the constants of the segment's wall."""

    @function.of(CompliantPair)
    def of_one(model, segment, *rest):  # type: ignore[no-untyped-def]
        return function(law_at(model, segment.side), segment, *rest)


def prepare(parameters: Parameters, law: Any, accuracy: float) -> Compliant | CompliantPair:
    """Constants of one run."""
    right = _alike(parameters, law, accuracy)
    if not isinstance(law, DifferingWalls):
        return right
    left = replace(parameters, restitution=parameters.restitution_left)
    return CompliantPair(*right[:8], _alike(left, law, accuracy), right)


def _alike(parameters: Parameters, law: Any, accuracy: float) -> Compliant:
    p = parameters
    tension = bool(p.contact_tension)
    damping = contact_damping(p.restitution, tension)
    frequency = math.sqrt(p.contact_stiffness_ratio * (1.0 + p.mass_ratio) / p.mass_ratio)
    forcing, amplitude, share = plain(drive_of)(p)
    contact = flow.contact_constants(
        p.mass_ratio,
        p.damping_ratio,
        p.contact_stiffness_ratio,
        damping,
        forcing,
        amplitude,
        share,
        p.pull,
    )
    split = split_of(contact)
    ending = np.array([0.0, 0.0, -1.0, 0.0])
    if not tension:
        ending[2:] = -contact.stiffness, -contact.damping
    usual = contact_phase(damping, tension) / frequency
    table = flow.propagators(contact)
    after_usual = np.zeros((3, flow.row_length(contact)))
    _fill_rows(contact, table, ending, usual, after_usual)
    return Compliant(
        *masses.prepare(p, law, accuracy)[:8],
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
    for column in range(len(rows[0])):
        unit, pair = flow.unit_state(column)
        z = flow.advance_under(contact, table, pair, flow.shifted(contact, unit), tau)
        z = flow.unshifted(contact, z)
        up, _ = pair_rates(contact.forcing, pair)
        z1 = flow.derivative(contact, z, contact.strength * z[4])
        z2 = flow.derivative(contact, z1, contact.strength * up * z[5])
        rows[0, column] = ending[2] * z[2] + ending[3] * z[3]
        rows[1, column] = ending[2] * z1[2] + ending[3] * z1[3]
        rows[2, column] = ending[2] * z2[2] + ending[3] * z2[3]


@compiled
def _likely_end(model, side, z):
    """A little before the end of a contact that an impact begins, or 0: by Newton's method.

    Acceleration and springs change the duration of a contact between free bodies a little. The
    motion is linear in the state, so where it would be after that duration costs three products.
    """
    if model.usual == 0.0:
        return 0.0
    contact = model.contact
    rows = model.after_usual
    z = flow.from_rest(contact.rest, z)
    value = side * (flow.dot(contact, rows[0], z) + model.ending.at_rest)
    slope = side * flow.dot(contact, rows[1], z)
    late = near_root(value, slope, side * flow.dot(contact, rows[2], z), 0.0, 0.0)
    if not abs(late) < 0.5 * model.usual:
        return _EARLY * model.usual
    return (1.0 - _MARGIN) * (model.usual + late)


@compiled
def pair_at(model: Compliant, segment: Segment) -> flow.Pair:
    """State of the pair at the start of a segment, as `damper.models.compliant.flow` has it."""
    s = segment
    forcing = model.contact.forcing
    p, q = carried(forcing, phase_at(forcing, s.periods, s.time))
    beta = model.contact.reduced
    gap, rate = s.side * s.gap, s.side * s.gap_rate
    return s.x - beta * gap, s.v - beta * rate, gap, rate, p, q


law_at.like(CompliantPair, DifferingWalls)
for _kind in (Compliant, CompliantPair):
    declared.mass_ratio_at.like(_kind, Rigid)
    # It has no tail.
    declared.speeds_in_tail.like(_kind, Rigid)


@declared.motion.of(Compliant)
def _motion(model, segment, tau):
    s = segment
    if s.mode == FLIGHT:
        x, v, gap, rate = unclipped(model, s, _begin(model, s), tau)
        if s.gap >= 0.0:
            gap = min(max(gap, 0.0), 2.0 * model.clearance)
        return x, v, gap, rate
    return _of_pair(model, s.side, flow.advance(model.contact, model.table, pair_at(model, s), tau))


@declared.state_in.of(Compliant)
def _state_in(model, segment, tau):
    return state_by_start(_begin(model, segment), model, segment, tau)


@compiled
def _of_pair(model, side, z):
    """Displacement and velocity of the primary, gap and its rate in a state of the pair."""
    beta = model.contact.reduced
    return z[0] + beta * z[2], z[1] + beta * z[3], side * z[2], side * z[3]


@declared.initial_segment.of(Compliant)
def _initial_segment(model, periods, time, x, v, y, u):
    relative = y - x
    side = 1.0 if relative >= 0.0 else -1.0
    gap = model.clearance - side * relative
    rate = -side * (u - v)
    if abs(gap) <= slack(model.clearance, x, y):
        gap = 0.0
    new = Segment(
        periods, time, x, v, gap, rate, side, FLIGHT, NOTHING, 0.0, v, 0.0, 0.0, 0.0, y, u
    )
    return _settled(model, new)


@declared.initial_segment.of(CompliantPair)
def _initial_segment_of_pair(model, periods, time, x, v, y, u):
    return _initial_segment(law_at(model, y - x), periods, time, x, v, y, u)


@declared.with_walls_at.register(CompliantPair)
def _with_walls_at(model, clearance):
    left, right = (each._replace(clearance=clearance) for each in (model.left, model.right))
    return model._replace(clearance=clearance, left=left, right=right)


@declared.begin.of(Compliant)
def _begin(model, segment):
    """What a flight follows from; at the wall a relative x'' of no more than roundoff is zero.

    A force that vanishes ends a contact; its roundoff must not begin the next contact.
    """
    s = segment
    # By the force that is left, and not by what ended the contact.
    start = begin_flight(model.mass, model, _as(s, s.side, s.mode, NOTHING, 0.0), 0.0)
    if s.gap == 0.0:
        a, _, _, _ = relative_rates(start, model)
        contact = model.contact
        if abs(a) <= ROUNDOFF * force_size(contact.drag, s.x, s.v, contact.largest):
            return begin_flight(model.mass, model, _as(s, s.side, s.mode, RELEASE, 0.0), 0.0)
    return start


@compiled
def _as(s, side, mode, cause, accumulation):
    """A segment with another side, mode, cause and accumulation."""
    return _renewed(s, side, mode, cause, accumulation, 0.0, 0.0, 0.0)


_renewed = changed(Segment, "side", "mode", "cause", "accumulation", "duration", "y", "u")


@compiled
def _touches(model, segment):
    """Whether the contact acts from now on; an approach from gap 0 is still a flight."""
    s = segment
    if s.gap < 0.0:
        pull = model.contact.stiffness * s.gap + model.contact.damping * s.gap_rate
        return model.tension != 0.0 or pull < 0.0
    if s.gap > 0.0 or s.gap_rate != 0.0:
        return False
    return stays(model, s, _begin(model, s))


@compiled
def _settled(model, segment):
    """The segment itself, or a contact where a flight would begin in one."""
    s = segment
    if s.mode != FLIGHT or s.gap > 0.0:
        return s
    if _touches(model, s):
        return _as(s, s.side, CONTACT, s.cause, 0.0)
    if model.clearance == 0.0 and s.gap == 0.0 and s.gap_rate == 0.0:
        # At rest between walls without a clearance: where one draws away the other acts.
        return _as(s, -s.side, CONTACT, s.cause, 0.0)
    return s


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
    end = fly(start, model, s)
    if end.outcome != EVENT:
        return fly_on(start, model, s, end)
    speed = abs(end.gap_rate)
    mode = CONTACT if speed > 0.0 else FLIGHT
    cause = IMPACT if speed > 0.0 else NOTHING
    new = segment_after(
        s, model.cycle, end.duration, end.x, end.v, 0.0, -speed, end.wall, mode, cause, speed
    )
    new = _settled(model, _flying(model, new))
    return Step(end.duration, True, False, end.steps, new, _begin(model, new))


@compiled
def _flying(model, s):
    """A segment with the free mass's own state where it flies, so that nothing acts on it."""
    if s.mode != FLIGHT:
        return s
    y, u = free_mass_of(model, s)
    return _with_own(s, y, u)


_with_own = changed(Segment, "y", "u")


@compiled
def _touch(model, s):
    """A contact, up to its end; or to where it has lasted, and so counts as sticking."""
    z = pair_at(model, s)
    moving = ContactMotion(model.contact, model.table, model.ending, s.side, z)
    point = contact_point(moving, 0.0, z)
    lasting = model.lasting - s.accumulation if s.mode == CONTACT else math.inf
    limit = min(lasting, span_of(model, s))
    hint = _likely_end(model, s.side, z) if s.cause == IMPACT else 0.0
    lifts_off = point.value == 0.0 and point.slope == 0.0 and point.second == 0.0
    if lifts_off and point.bound4 == 0.0 and point.growth == 0.0:
        return _stay(model, s, z, limit, lasting, 1, False)  # at rest, and nothing acts
    root = first_root(moving, point, math.inf, lifts_off, limit, hint)
    tau = root.point.tau + root.step
    if root.side != 1.0 or tau > limit:
        return _stay(model, s, z, limit, lasting, root.steps + 1, root.side == GAVE_UP)
    z = _carry(model.contact, root.point.state.z, root.step)
    x, v, gap, rate = _of_pair(model, s.side, z)
    # The rest of the force, or of the gap, is roundoff.
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
def span_of(model: Compliant, segment: Segment) -> float:
    """Longest time that a segment may take."""
    forcing = model.contact.forcing
    return min(HORIZON, horizon(forcing, phase_at(forcing, segment.periods, segment.time)))


@compiled
def _stay(model, s, z, tau, lasting, steps, gave_up):
    """A contact that is cut after a time; from `lasting` on it sticks."""
    x, v, gap, rate = _of_pair(model, s.side, flow.advance(model.contact, model.table, z, tau))
    sticks_now = s.mode == CONTACT and tau == lasting
    cause = STICK if sticks_now else NOTHING
    new = segment_after(s, model.cycle, tau, x, v, gap, rate, s.side, STICKING, cause, 0.0)
    if s.mode == CONTACT and not sticks_now:
        new = _as(new, s.side, CONTACT, NOTHING, s.accumulation + tau)
    return Step(tau, sticks_now, gave_up, steps, new, _begin(model, new))


@compiled
def _carry(contact, z, step):
    """Masses a short step later, by a Taylor polynomial."""
    f0, f1, f2, f3, _ = flow.force_rates_in(contact, z)
    z1 = flow.derivative(contact, flow.from_rest(contact.rest, z), f0)
    z2 = flow.derivative(contact, z1, f1)
    z3 = flow.derivative(contact, z2, f2)
    z4 = flow.derivative(contact, z3, f3)
    a = 0.5 * step
    b = step / 3.0
    c = 0.25 * step
    return (
        z[0] + step * (z1[0] + a * (z2[0] + b * (z3[0] + c * z4[0]))),
        z[1] + step * (z1[1] + a * (z2[1] + b * (z3[1] + c * z4[1]))),
        z[2] + step * (z1[2] + a * (z2[2] + b * (z3[2] + c * z4[2]))),
        z[3] + step * (z1[3] + a * (z2[3] + b * (z3[3] + c * z4[3]))),
    )


class WallForce(NamedTuple):
    """k g + c g' in a flight below the wall's surface: until it is negative the wall lags."""

    flight: WeightedSum
    """The depth -g."""
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
    """Of the depth make -(k g + c g')."""
    k = -moving.stiffness
    c = -moving.damping
    _, _, coupling = rates_of(moving.flight)
    weight = abs(c)
    return EventPoint(
        p.tau,
        k * p.value + c * p.slope,
        k * p.slope + c * p.second,
        k * p.second + c * p.third,
        k * p.third + c * p.fourth,
        k * p.fourth + c * p.fifth,
        0.0,
        # The bound on the fourth derivative makes one on the fifth.
        abs(k) * p.bound4 + weight * (p.growth + coupling * p.bound4),
        (abs(k) + weight * coupling) * p.growth,
        abs(k) * p.roundoff + weight * ROUNDOFF * (abs(moving.flight.slope) + abs(p.slope)),
        p.state,
    )


@compiled
def _spring_back(model, s, start):
    """A flight that began below the wall's surface: the gap reopens, or the wall catches up."""
    below = gap_of(start, model, s, -1.0)
    point = start_point(below)
    limit = span_of(model, s)
    opening = first_root(below, point, math.inf, False, limit, 0.0)
    wall = WallForce(below, model.contact.stiffness, model.contact.damping)
    opens = opening.point.tau + opening.step if opening.side == 1.0 else math.inf
    catches = math.inf
    steps = opening.steps
    gave_up = opening.side == GAVE_UP
    force = _wall_point(wall, point)
    if not _lags(force, min(opens, limit)):
        catching = first_root(wall, force, math.inf, False, min(opens, limit), 0.0)
        steps += catching.steps
        gave_up = gave_up or catching.side == GAVE_UP
        if catching.side == 1.0:
            catches = catching.point.tau + catching.step
    tau = min(opens, catches, limit)
    x, v, gap, rate = unclipped(model, s, start, tau)
    caught = catches < opens and catches <= limit
    if tau == opens:
        # What is left of either is roundoff.
        gap = 0.0
        rate = max(rate, 0.0)
    mode = CONTACT if caught else FLIGHT
    new = segment_after(s, model.cycle, tau, x, v, gap, rate, s.side, mode, NOTHING, 0.0)
    new = _flying(model, new)
    if gap == 0.0 and rate == 0.0:
        new = _settled(model, new)
        caught = True
    return Step(tau, caught, gave_up, steps, new, _begin(model, new))


@compiled
def _lags(force, span):
    """Whether the wall surely stays behind the free mass for a time; `force` is that at the start.

    The force is not negative at the start and stays above a parabola that opens downwards, so its
    slope decides.
    """
    bound3 = abs(force.third) + span * (force.bound4 + span * force.growth)
    last = force.slope + span * (0.5 * force.second - span * bound3 / 6.0)
    return force.slope > 0.0 and last > 0.0


for _name in ("joins", "shrunk_by", "velocities_after", "damping_in", "over_event", "stay_on"):
    getattr(declared_tangent, _name).of(Compliant)(getattr(tangent, _name))
    of_a_wall(getattr(declared_tangent, _name))
for _kind in (Compliant, CompliantPair):
    declared_tangent.friction_in.of(_kind)(declared_tangent.no_friction)
for _function in (declared.motion, declared.begin, declared.following, declared.state_in):
    of_a_wall(_function)

"""The free mass slides in the box with dry (Coulomb) friction; the walls are rigid.

While it slides in one direction friction is constant: the flight is that of a rigid damper whose
free mass is ballistic and whose primary moves about a shifted place of rest. So the gap's search is
that of every flight, and the relative velocity, its rate, is searched for the stop. Where that
vanishes the masses move as one as long as friction holds them. Equations, and the time in which
infinitely many bounces complete: docs/models.md.
"""

import math
from typing import Any, NamedTuple

from damper.engine import model as declared
from damper.engine.bodies import start_point
from damper.engine.compiled import compiled, plain
from damper.engine.forcing import horizon, may_jump, phase_at
from damper.engine.forcing.weighed import WeighedForce
from damper.engine.impact import impact, law_at, restitution_at
from damper.engine.model import Step
from damper.engine.oscillator import Oscillator, advance, motion_from, oscillator
from damper.engine.search import GAVE_UP, HORIZON, first_root, point_at
from damper.engine.segment import (
    FLIGHT,
    NOTHING,
    RELEASE,
    REST,
    RESTING,
    REVERSAL,
    SLIP,
    STICK,
    STICKING,
    TAIL,
    Segment,
    clock_after,
    first_speed_of,
    segment_after,
)
from damper.models import flights, rigid, walls
from damper.models.friction import (
    Bounce,
    Hold,
    Speed,
    bounce_at,
    bounce_from,
    completes_rubbing,
    hold_at_start,
    pushed_by,
    speed_point,
)
from damper.models.rigid import ContactForce, Rigid
from damper.parameters import Parameters


class Sliding(NamedTuple):
    """Constants of one run; the first eight are those of `damper.models.rigid.Rigid`."""

    mass_ratio: float
    clearance: float
    law: Any
    cycle: float
    tolerance: float
    free: Oscillator
    stuck: Oscillator
    mass: Any
    """The free mass where nothing rubs."""
    friction: float
    """Acceleration that friction gives the free mass while it slides."""


class Slide(NamedTuple):
    """What a slide follows from."""

    sigma: float
    """Sign of the free mass's velocity less the primary's."""
    flight: Rigid
    """The rigid damper whose flight it is."""
    shifted: Segment
    """The segment, with the displacement from where the primary would rest."""
    start: Any
    """As of `damper.models.flights.begin_flight`."""


@plain
def prepare(parameters: Parameters, law: Any, accuracy: float) -> Sliding:
    """Constants of one run."""
    made = rigid.prepare(parameters, law, accuracy)
    mass = made.mass
    if isinstance(mass, Oscillator) and not isinstance(mass.forcing, WeighedForce):
        mass = oscillator(0.0, 0.0, 1.0, WeighedForce(mass.forcing, mass.strength, 0.0))
    return Sliding(*made._replace(mass=mass), parameters.friction)


declared.mass_ratio_at.like(Sliding, Rigid)
walls.centre.like(Sliding, Rigid)


@compiled
def hold_of(model: Sliding, s: Segment) -> Hold:
    """What holds the free mass at rest in a state without a relative velocity."""
    phase = phase_at(model.stuck.forcing, s.periods, s.time)
    start = motion_from(model.stuck, s.x, s.v, phase)
    return Hold(ContactForce(model.stuck, model.mass, start, s.side), model.friction)


@compiled
def _room(model: Sliding, gap: float) -> float:
    """Width within which what is left of friction holds: a wall holds whatever presses on it."""
    return math.inf if gap == 0.0 else 2.0 * model.friction


@compiled
def _holds(point, width):
    """Whether the free mass stays at rest; on the brink the first derivative decides that acts."""
    if point.value > 0.0 and point.value < width:
        return True
    if point.value < 0.0 or point.value > width:
        return False
    inwards = 1.0 if point.value == 0.0 else -1.0
    rate = point.slope
    if rate == 0.0:
        rate = point.second
    if rate == 0.0:
        rate = point.third
    return inwards * rate >= 0.0


@compiled
def direction(model: Sliding, s: Segment) -> float:
    """Sign of the free mass's velocity less the primary's, also just after it was zero."""
    if s.gap_rate != 0.0:
        return -s.side if s.gap_rate > 0.0 else s.side
    # The masses' common acceleration leaves the free mass behind.
    force = hold_at_start(hold_of(model, s)).value - model.friction
    if s.gap == 0.0 or force < 0.0:
        return -s.side
    return s.side


@compiled
def _moved_by(s, shift, cause):
    """A segment with another displacement and cause."""
    return Segment(
        s.periods,
        s.time,
        s.x + shift,
        s.v,
        s.gap,
        s.gap_rate,
        s.side,
        s.mode,
        cause,
        s.speed,
        s.v_before,
        s.first_speed,
        s.completion,
        s.duration,
    )


@declared.begin.of(Sliding)
def _begin(model, segment):
    s = segment
    sigma = direction(model, s)
    flight = Rigid(
        model.mass_ratio,
        model.clearance,
        model.law,
        model.cycle,
        model.tolerance,
        model.free,
        model.stuck,
        pushed_by(model.mass, -(sigma * model.friction)),
    )
    # At a breakaway both accelerations are the same, as at a release.
    smooth = s.cause == SLIP
    shifted = _moved_by(s, -shift_of(model, sigma), RELEASE if smooth else s.cause)
    return Slide(sigma, flight, shifted, flights.begin_flight(flight.mass, flight, shifted))


@compiled
def shift_of(model: Sliding, sigma: float) -> float:
    """Where the primary would rest in a slide."""
    return sigma * model.mass_ratio * model.friction


@declared.initial_segment.of(Sliding)
def _initial_segment(model, periods, time, x, v, y, u):
    # Where the masses are is told as for the rigid damper; who stays at rest is not.
    bare = Rigid(
        model.mass_ratio,
        model.clearance,
        model.law,
        model.cycle,
        model.tolerance,
        model.free,
        model.stuck,
        model.mass,
    )
    s = walls.initial_segment_of(bare, periods, time, x, v, y, u)
    if s.gap_rate != 0.0 or s.side == 0.0:
        return s
    flies = Segment(
        s.periods, s.time, s.x, s.v, s.gap, 0.0, s.side, FLIGHT, NOTHING, 0.0, s.v, 0.0, 0.0, 0.0
    )
    return _settled(model, flies)


@compiled
def _settled(model, s):
    """A segment that begins without a relative velocity: the masses rest, or slide."""
    if not _holds(hold_at_start(hold_of(model, s)), _room(model, s.gap)):
        return s
    on_wall = s.gap == 0.0
    mode = STICKING if on_wall else RESTING
    cause = STICK if on_wall else REST
    # Impacts on one wall are a burst until the masses stick there, also where they rest between.
    first_speed = 0.0 if on_wall else s.first_speed
    return Segment(
        s.periods,
        s.time,
        s.x,
        s.v,
        s.gap,
        0.0,
        s.side,
        mode,
        cause,
        0.0,
        s.v,
        first_speed,
        0.0,
        0.0,
    )


@declared.following.of(Sliding)
def _following(model, segment, start):
    s = segment
    if s.mode == FLIGHT:
        return _slide(model, s, start)
    if s.mode == TAIL:
        x, v = walls.centre(model, s, s.completion)
        return walls.go_on(
            model,
            s,
            flights.End(s.completion, flights.EVENT, 0.0, x, v, 0.0, 0.0, 1),
            STICKING,
            STICK,
        )
    end = _rest(model, s)
    if end.outcome != flights.EVENT:
        return walls.go_on(model, s, end, s.mode, NOTHING)
    return walls.go_on(model, s, end, FLIGHT, RELEASE if s.mode == STICKING else SLIP)


@compiled
def _rest(model, s):
    """The end of a rest on a wall or off the walls; none without a clearance."""
    hold = hold_of(model, s)
    start = hold.force.start
    limit = min(HORIZON, horizon(model.stuck.forcing, start.phase))
    width = _room(model, s.gap)
    tau, outcome, steps = limit, flights.NO_EVENT, 1
    if s.side != 0.0:
        point = hold_at_start(hold)
        if not _holds(point, width) and _is_over(point, width, model.stuck.forcing):
            return flights.End(0.0, flights.EVENT, 0.0, s.x, s.v, s.gap, 0.0, 1)
        root = first_root(hold, point, width, False, limit, 0.0)
        steps = root.steps
        if root.side != 0.0 and root.point.tau + root.step <= limit:
            tau = root.point.tau + root.step
            outcome = GAVE_UP if root.side == GAVE_UP else flights.EVENT
    dx, v = advance(model.stuck, start, tau)
    return flights.End(tau, outcome, 0.0, s.x + dx, v, s.gap, 0.0, steps)


@compiled
def _is_over(point, width, forcing):
    """Whether friction is overcome at once by more than roundoff, as where the force jumps."""
    slack = flights.VANISHES * point.roundoff if may_jump(forcing) else 0.0
    return point.value < -slack or point.value > width + slack


@compiled
def _slide(model, s, slide):
    """A slide, up to an impact or to where the relative velocity vanishes."""
    limit = min(HORIZON, horizon(model.free.forcing, slide.start.phase))
    speed = Speed(flights.gap_of(slide, model, s, -slide.sigma * s.side))
    first = speed_point(speed, start_point(speed.gap))
    stop = first_root(speed, first, math.inf, False, limit, 0.0)
    stops = math.inf
    if stop.side == 1.0 and stop.point.tau + stop.step <= limit:
        stops = stop.point.tau + stop.step
    last = min(stops, limit)
    gap = flights.gap_of(slide, model, s, 1.0)
    point = start_point(gap)
    lifts_off = s.gap == 0.0 and s.gap_rate == 0.0 and point.second == 0.0
    root = first_root(gap, point, 2.0 * model.clearance, lifts_off, last, 0.0)
    tau = root.point.tau + root.step
    steps = stop.steps + root.steps
    gave_up = stop.side == GAVE_UP or root.side == GAVE_UP
    hits = abs(root.side) == 1.0 and tau <= last
    if not hits:
        tau = last
    p = point_at(gap, tau)
    x, v = s.x + p.state.dx, p.state.v
    if hits:
        end = flights.End(tau, flights.EVENT, root.side * s.side, x, v, 0.0, p.slope, steps)
        return _over_impact(model, s, end, gave_up)
    # What is left of the gap, or of the other one, is roundoff where it is below zero.
    left = min(max(p.value, 0.0), 2.0 * model.clearance)
    if tau < stops or gave_up:
        outcome = GAVE_UP if gave_up else flights.NO_EVENT
        rate = -slide.sigma * s.side * max(-slide.sigma * s.side * p.slope, 0.0)
        return walls.go_on(
            model, s, flights.End(tau, outcome, 0.0, x, v, left, rate, steps), FLIGHT, NOTHING
        )
    new = segment_after(s, model.cycle, tau, x, v, left, 0.0, s.side, FLIGHT, REVERSAL, 0.0)
    new = _settled(model, new)
    return Step(tau, True, False, steps, new, _begin(model, new))


@compiled
def _over_impact(model, s, end, gave_up):
    """Step over an impact."""
    side = end.wall
    periods, time = clock_after(model.cycle, s.periods, s.time, end.duration)
    speed = abs(end.gap_rate)
    first_speed = first_speed_of(s, side, speed)
    restitution = restitution_at(law_at(model.law, side), speed)
    v, rate = impact(model.mass_ratio, restitution, side, end.v, speed)
    new = walls.after_impact(periods, time, end, v, rate, speed, first_speed, FLIGHT, 0.0)
    start = _begin(model, new)
    if rate == 0.0:
        if _holds(hold_at_start(hold_of(model, new)), math.inf):
            new = walls.after_impact(periods, time, end, v, rate, speed, first_speed, TAIL, 0.0)
    else:
        left, error = completes_rubbing(start.start, start.flight, new, model.friction)
        if error <= model.tolerance and rate * left <= model.clearance:
            new = walls.after_impact(periods, time, end, v, rate, speed, first_speed, TAIL, left)
    return Step(end.duration, True, gave_up, end.steps, new, start)


@flights.gap_of.of(Slide)
def _gap_of_slide(start, model, segment, sign):
    return flights.gap_of(start.start, start.flight, start.shifted, sign)


@compiled
def bounce_of(model: Sliding, s: Segment, slide: Slide) -> Bounce:
    """How a free mass bounces that slides away from a wall."""
    return bounce_from(slide.start, slide.flight, s, model.friction)


@declared.speeds_in_tail.of(Sliding)
def _speeds_in_tail(model, segment):
    bounce = bounce_of(model, segment, _begin(model, segment))
    # A free mass that an impact leaves at rest may be held by friction alone: none follows.
    if bounce.shrinks == 0.0:
        return 0.0, 0.0
    return segment.gap_rate * math.sqrt(bounce.back / bounce.out), bounce.shrinks


@declared.motion.of(Sliding)
def _motion(model, segment, tau):
    s = segment
    if s.mode == FLIGHT:
        x, v, gap, rate = flights.unclipped(model, s, _begin(model, s), tau)
        return x, v, min(max(gap, 0.0), 2.0 * model.clearance), rate
    x, v = walls.centre(model, s, tau)
    if s.mode != TAIL or s.gap_rate == 0.0:
        return x, v, s.gap, 0.0
    gap, rate = bounce_at(bounce_of(model, s, _begin(model, s)), s.completion, s.gap_rate, tau)
    # The centre follows the sticking flow; the bounces go on about it.
    share = s.side * model.mass_ratio / (1.0 + model.mass_ratio)
    return x + share * gap, v + share * rate, gap, rate


# What deviations become is a part of this model that needs all the above.
from damper.models.sliding import tangent  # noqa: E402, F401

"""Rigid walls: the order of segments, for all models with rigid walls.

A flight ends at an impact; an impact begins a flight, or the closed rest of a complete chatter
sequence (a TAIL); that ends in sticking, and sticking in a release. Under dry friction a flight
also ends where the relative velocity vanishes: the free mass rests there, or slides on. The motions
are those of each model, declared below.
"""

import math
from typing import Any, NamedTuple

from damper.engine import model as declared
from damper.engine.bodies import FixedStop, Prescribed, body_at
from damper.engine.compiled import compiled
from damper.engine.dispatch import by_class, by_class_or_default
from damper.engine.forcing import derivative_of, phase_at
from damper.engine.impact import impact, law_at, mean_of, restitution_at, share_of
from damper.engine.model import Step, begin, mass_ratio_at
from damper.engine.oscillator import Motion
from damper.engine.search import GAVE_UP, ROUNDOFF
from damper.engine.segment import (
    FLIGHT,
    IMPACT,
    NOTHING,
    RELEASE,
    SLIP,
    STICK,
    STICKING,
    TAIL,
    Segment,
    centre_velocity,
    clock_after,
    first_speed_of,
    segment_after,
)
from damper.engine.tuples import changed, made_of
from damper.models import flights
from damper.models.flights import (
    EVENT,
    Bounce,
    End,
    bounce_at,
    fly,
    free_mass_of,
    only_wall_of,
    travel_of,
    unclipped,
)


@by_class
def stick(model: Any, segment: Segment) -> End:
    """The end of sticking, or of a rest; no release without a clearance, where `side` is 0."""


@by_class_or_default
def stays(start: Any, model: Any, segment: Segment) -> bool:
    """Whether a free mass on a wall, with no relative velocity, stays there.

    The flight that would begin follows from `start`.
    """
    return flights.stays(model, segment, start)


@by_class_or_default
def rest_or_slide(start: Any, model: Any, segment: Segment) -> Segment:
    """The segment that begins without a relative velocity, where dry friction may hold it."""
    return segment


@by_class_or_default
def fly_on(start: Any, model: Any, segment: Segment, end: End) -> Step:
    """Step over the end of a flight without an impact; under friction it may have stopped."""
    return go_on(model, segment, end, FLIGHT, NOTHING)


@by_class_or_default
def bounce_of(start: Any, model: Any, segment: Segment) -> Bounce:
    """How a free mass bounces in a tail: without friction as fast back as out."""
    return Bounce(1.0, 1.0, restitution_at(law_at(model.law, segment.side), 0.0))


@by_class_or_default
def exactly(part: Any, model: Any, before: Segment, new: Segment) -> Segment:
    """A new segment with what a part of the damper, such as a fixed stop, knows exactly of it."""
    return new


@by_class_or_default
def own_state(mass: Any, segment: Segment, y: float, u: float) -> tuple[float, float]:
    """Displacement and velocity of a free mass in a segment, where it knows them exactly."""
    return y, u


@by_class
def time_to_accumulation(model: Any, segment: Segment, start: Any) -> tuple[float, float]:
    """Time to the accumulation point after the impact that begins a segment, and its error."""


@by_class
def centre(model: Any, segment: Segment, tau: float) -> tuple[float, float]:
    """Travel and velocity of both masses' centre, a time `tau` after a contact's start."""


@by_class_or_default
def alone(model: Any, segment: Segment) -> tuple:
    """The damper of the free mass of a segment alone, its segment, and the start of its flight."""
    return model, segment, begin(model, segment)


class ChatterAhead(NamedTuple):
    """How a chatter sequence goes on after an impact."""

    force: float
    """As `jerk`, of `damper.engine.accumulation.accumulation_times`."""
    jerk: float
    restitution: float
    damping: float
    """As in `damper.engine.accumulation.accumulation_times`."""
    error: float
    """Of the time to accumulation."""
    velocity: float
    """Of the primary, if the mass stuck just after the impact."""


@by_class_or_default
def chatter_of(model: Any, segment: Segment) -> ChatterAhead:
    """The chatter sequence of the mass whose impact begins a segment."""
    view, s, start = alone(model, segment)
    a, j, _, _ = flights.relative_rates(start, view)
    mass_ratio = mass_ratio_at(view, s.periods, s.time)
    damping = mean_of(mass_ratio, view.mass.damping, view.free.damping)
    restitution = restitution_at(law_at(view.law, s.side), 0.0)
    _, error = time_to_accumulation(view, s, start)
    velocity = centre_velocity(s, mass_ratio)
    return ChatterAhead(-s.side * a, s.side * j, restitution, damping, error, velocity)


@by_class_or_default
def law_of_mass(model: Any, body: int, side: float) -> Any:
    """Contact law of a mass at one of its walls."""
    return law_at(model.law, side)


@by_class_or_default
def travel_together(model: Any, segment: Segment, tau: float) -> float:
    """Displacement, in a time, of all that moves together once the mass of a segment sticks."""
    return centre(model, segment, tau)[0]


def have_rigid_walls(kind: type) -> None:
    """Let a model answer as one with rigid walls; what it implements itself afterwards replaces."""
    declared.initial_segment.of(kind)(initial_segment_of)
    declared.begin.of(kind)(flights.begin)
    declared.following.of(kind)(_following)
    declared.motion.of(kind)(_motion)
    declared.speeds_in_tail.of(kind)(_speeds_in_tail)


@compiled
def _speeds_in_tail(model, segment):
    bounce = bounce_of(begin(model, segment), model, segment)
    if bounce.shrinks == 0.0:  # friction alone may hold it
        return 0.0, 0.0
    return segment.gap_rate * math.sqrt(bounce.back / bounce.out), bounce.shrinks


@compiled
def _following(model: Any, segment: Segment, start: Any) -> Step:
    s = segment
    if s.mode == FLIGHT:
        end = fly(start, model, s)
        if end.outcome == EVENT:
            return _over_impact(model, s, end)
        return fly_on(start, model, s, end)
    if s.mode != TAIL:
        end = stick(model, s)
        if end.outcome == EVENT:
            return go_on(model, s, end, FLIGHT, RELEASE if s.mode == STICKING else SLIP)
        return go_on(model, s, end, s.mode, NOTHING)
    dx, v = centre(model, s, s.accumulation)
    end = End(s.accumulation, EVENT, s.side, s.x + dx, v, 0.0, 0.0, 1)
    return go_on(model, s, end, STICKING, STICK)


@compiled
def go_on(model: Any, s: Segment, end: End, mode: float, cause: float) -> Step:
    """Step over an end without an impact."""
    tau, gap, rate = end.duration, end.gap, end.gap_rate
    new = segment_after(s, model.cycle, tau, end.x, end.v, gap, rate, s.side, mode, cause, 0.0)
    gave_up = end.outcome == GAVE_UP
    new = exactly(model.free, model, s, exactly(model.mass, model, s, new))
    return Step(tau, end.outcome == EVENT, gave_up, end.steps, new, begin(model, new))


@exactly.of(FixedStop)
def _beside_a_stop(part, model, before, new):
    x, v = new.x, new.v
    if new.gap == 0.0:
        x, v = before.y - new.side * model.clearance, new.side * new.gap_rate + 0.0
    return _placed(new, x, v, before.y)


@exactly.of(Prescribed)
def _as_prescribed(part, model, before, new):
    x, v = box_at(part, new.periods, new.time, new.x, new.v)
    return _placed(new, x, v, new.y)


@by_class_or_default
def box_at(primary: Any, periods: float, time: float, x: float, v: float) -> tuple[float, float]:
    """Displacement and velocity of the box at a moment, where its motion is prescribed."""
    return x, v


@box_at.of(Prescribed)
def _prescribed_at(primary, periods, time, x, v):
    phase, size = phase_at(primary.place, periods, time), primary.size
    return size * derivative_of(primary.place, phase, 0), size * derivative_of(
        primary.place, phase, 1
    )


@own_state.of(FixedStop)
def _state_of_stop(mass, segment, y, u):
    return segment.y, 0.0


_placed = changed(Segment, "x", "v", "y")


@fly_on.of(Motion)
def _fly_on(start, model, segment, end):
    s, tau, gap, rate = segment, end.duration, end.gap, end.gap_rate
    y, u = free_flight(model, s, tau)
    own_gap, own_rate = model.clearance - s.side * (y - end.x), s.side * (end.v - u)
    # The increments of gap and rate add up their roundoff, so each is replaced where it has
    # drifted; not the gap near a wall, which has more digits there than y.
    if abs(y) < gap and abs(own_gap - gap) > ROUNDOFF * (model.clearance + abs(y) + abs(end.x)):
        gap = min(max(own_gap, 0.0), travel_of(model))
    if abs(own_rate - rate) > ROUNDOFF * (abs(end.v) + abs(u)):
        rate = own_rate
    new = segment_after(s, model.cycle, tau, end.x, end.v, gap, rate, s.side, FLIGHT, NOTHING, 0.0)
    x, v = box_at(model.free, new.periods, new.time, end.x, end.v)
    new = _flown(new, x, v, v, y, u)
    return Step(tau, False, end.outcome == GAVE_UP, end.steps, new, begin(model, new))


_flown = changed(Segment, "x", "v", "v_before", "y", "u")


@compiled
def free_flight(model: Any, segment: Segment, tau: float) -> tuple[float, float]:
    """Displacement and velocity of a free mass on which nothing acts, a time `tau` later."""
    s = segment
    y, u = s.y, s.u
    if s.cause != NOTHING:
        y, u = free_mass_of(model, s)
    way, u = body_at(model.mass, y, u, 0.0, tau)
    return own_state(model.mass, s, y + way, u)


@by_class_or_default
def state_by_start(start: Any, model: Any, segment: Segment, tau: float) -> tuple:
    """As `damper.engine.model.state_in`, by the start of a flight."""
    return declared.state_by_gap(model, segment, tau)


@state_by_start.of(Motion)
def _state_by_start(start, model, segment, tau):
    x, v, y, u = declared.state_by_gap(model, segment, tau)
    if segment.mode == FLIGHT and segment.cause == NOTHING:
        y, u = free_flight(model, segment, tau)
    return x, v, y, u


@compiled
def _motion(model, segment, tau):
    s = segment
    if s.mode == FLIGHT:
        x, v, gap, rate = unclipped(model, s, begin(model, s), tau)
        return x, v, min(max(gap, 0.0), travel_of(model)), rate
    dx, v = centre(model, s, tau)
    x = s.x + dx
    if s.mode != TAIL or s.gap_rate == 0.0:
        return x, v, s.gap, 0.0
    bounce = bounce_of(begin(model, s), model, s)
    gap, rate = bounce_at(bounce, s.accumulation, s.gap_rate, tau)
    # The centre follows the sticking flow; the bounces go on about it.
    mass_ratio = mass_ratio_at(model, s.periods, s.time + tau)
    share = s.side * share_of(mass_ratio)
    return x + share * gap, v + share * rate, gap, rate


@compiled
def _over_impact(model, s, end):
    """Step over an impact."""
    side = end.wall
    periods, time = clock_after(model.cycle, s.periods, s.time, end.duration)
    speed = abs(end.gap_rate)
    first_speed = first_speed_of(s, side, speed)
    law = law_at(model.law, side)
    v, rate = impact(
        mass_ratio_at(model, periods, time), restitution_at(law, speed), side, end.v, speed
    )
    new = after_impact(
        periods, time, end.x, v, rate, side, FLIGHT, IMPACT, speed, end.v, first_speed
    )
    new = exactly(model.free, model, s, exactly(model.mass, model, s, new))
    start = begin(model, new)
    if rate == 0.0:
        if stays(start, model, new):
            new = _as(new, TAIL, 0.0)
    else:
        left, error = time_to_accumulation(model, new, start)
        # The next bounce must turn before the other wall; a constant force lets it rise this high.
        rise = 0.25 * rate * left * (1.0 - restitution_at(law, 0.0))
        if error <= model.tolerance and rise <= 0.5 * travel_of(model):
            new = _as(new, TAIL, left)
    return Step(end.duration, True, False, end.steps, new, start)


after_impact = made_of(
    Segment,
    *("periods", "time", "x", "v", "gap_rate", "side", "mode", "cause", "speed", "v_before"),
    "first_speed",
)
_as = changed(Segment, "mode", "accumulation")


#: Relative velocity, over the terms of which a box's velocity is the sum, that is roundoff.
TOUCHES = 4.0 * ROUNDOFF


@compiled
def slack(clearance: float, x: float, y: float) -> float:
    """Distance to a wall within which the free mass counts as in contact at the start."""
    return ROUNDOFF * (clearance + abs(x) + abs(y))


@compiled
def initial_segment_of(
    model: Any, periods: float, time: float, x: float, v: float, y: float, u: float
) -> Segment:
    """The rules for a start on a wall are those of an impact.

    Approaching is an impact at once, and separating a flight from gap 0. With no relative velocity
    the masses stick or part as after an impact without a rebound, and none is counted.
    """
    clearance = model.clearance
    x, v = box_at(model.free, periods, time, x, v)
    relative = y - x
    side = 1.0 if relative >= 0.0 else -1.0
    if only_wall_of(model) != 0.0:
        side = only_wall_of(model)
    gap = clearance - side * relative
    rate = -side * (u - v)
    mode = FLIGHT
    if travel_of(model) == 0.0:
        # Stuck between both walls for good, with the common velocity that keeps the momentum.
        v = mean_of(mass_ratio_at(model, periods, time), v, u)
        side, gap, rate, mode = 0.0, 0.0, 0.0, STICKING
    elif gap <= slack(clearance, x, y):
        gap = 0.0
    new = Segment(periods, time, x, v, gap, rate, side, mode, NOTHING, 0.0, v, 0.0, 0.0, 0.0, y, u)
    touches = gap == 0.0 and rate == 0.0 and mode == FLIGHT
    if touches and stays(begin(model, new), model, new):
        new = _joined(new, STICKING, STICK)
    new = exactly(model.mass, model, new, new)
    if rate == 0.0 and new.mode == FLIGHT:
        return rest_or_slide(begin(model, new), model, new)
    return new


_joined = changed(Segment, "mode", "cause")

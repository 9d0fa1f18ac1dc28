"""A free mass between rigid walls; a support may tie it to the frame, friction to its box.

While the free mass slides in one direction friction is constant: the flight is that of a mass with
another weight, beside a primary that moves about a shifted place of rest. So the gap's search is
that of every flight, and the relative velocity, its rate, is searched for the stop. Where that
vanishes the masses move as one as long as friction holds them. Equations, and the time in which
infinitely many bounces complete: docs/models.md.
"""

import math
from typing import Any, NamedTuple

from damper.engine import model as declared
from damper.engine.bodies import carried
from damper.engine.compiled import compiled, plain
from damper.engine.dispatch import by_class, by_class_or_default
from damper.engine.forcing import horizon, may_jump, phase_at, rate_of
from damper.engine.model import Step
from damper.engine.oscillator import Oscillator, advance, arrive, motion_from, oscillator
from damper.engine.search import GAVE_UP, HORIZON, EventPoint, first_root, point_at
from damper.engine.segment import (
    FLIGHT,
    NOTHING,
    REST,
    RESTING,
    REVERSAL,
    STICK,
    STICKING,
    Segment,
    centre_velocity,
    segment_after,
)
from damper.engine.tuples import changed, made_of
from damper.models import flights, walls
from damper.models.flights import (
    EVENT,
    NO_EVENT,
    STOPS,
    VANISHES,
    Bounce,
    End,
    bounce_from,
    completes,
    completes_rubbing,
    is_thrown_off,
    rest_shift,
    rests,
)
from damper.models.forces import Drive, drive_of, free_mass_of, primary_of, weighed
from damper.models.masses.holds import (
    Hold,
    first_stop,
    hold_at_start,
    holds,
    pushed_by,
)
from damper.parameters import Parameters


class NoFriction(NamedTuple):
    """The free mass does not rub on its box."""


class Friction(NamedTuple):
    """Dry friction of the free mass and its box."""

    acceleration: float
    """Of the free mass, while it slides."""


class Rigid(NamedTuple):
    """Constants of one run; models with other walls start with the same fields."""

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
    """The two masses joined, about their place of rest."""
    mass: Any
    """The free mass in flight, but for friction: a body of `damper.engine.bodies`."""
    friction: Any = NoFriction()
    walls: float = 0.0
    """The side of the only wall; 0 where there are both."""

    @property
    def features(self) -> tuple[str, ...]:
        """Names in `damper.parameters.models`: carrier, support, friction, or none of them."""
        supported = self.mass.stiffness or self.mass.damping
        found = ["prescribed"] * (self.free.stiffness == 0.0) + ["grounded"] * bool(supported)
        found += ["sliding"] * isinstance(self.friction, Friction)
        return tuple(found) or ("rigid",)


@plain
def prepare(
    parameters: Parameters, law: Any, accuracy: float, along_friction: bool = False
) -> Rigid:
    """Constants of one run; along friction slides stop also where there is none yet."""
    p = parameters
    drive = drive_of(p)
    forcing = drive.forcing
    free = primary_of(p, drive)
    mass = free_mass_of(p, drive, free)
    friction = Friction(p.friction) if p.friction or along_friction else NoFriction()
    if isinstance(friction, Friction) and isinstance(mass, Oscillator):
        mass = pushed_by(mass, 0.0)
    return Rigid(
        p.mass_ratio,
        p.clearance,
        law,
        p.cycle,
        accuracy / max(1.0, rate_of(forcing), 2.0 * mass.damping + math.sqrt(mass.stiffness)),
        free,
        free if p.carrier else _joined(p, drive),
        mass,
        friction,
        p.walls,
    )


def _joined(p: Parameters, drive: Drive) -> Oscillator:
    """Both masses together, about their place of rest: on a fixed stop, at rest."""
    if p.mass_ratio == math.inf:
        return oscillator(0.0, 0.0, 0.0, drive.forcing)
    heavier = 1.0 + p.mass_ratio
    damping, stiffness = p.damping_ratio + p.support_damping_ratio, 1.0 + p.support_stiffness_ratio
    strength = drive.amplitude * (1.0 + p.mass_ratio * drive.share) / heavier
    pull = -p.mass_ratio * p.pull / heavier
    return weighed(damping / heavier, stiffness / heavier, strength, drive.forcing, pull)


walls.have_rigid_walls(Rigid)


@flights.only_wall_of.of(Rigid)
def _only_wall_of(model):
    return model.walls


@flights.travel_of.of(Rigid)
def _travel_of(model):
    return 2.0 * model.clearance if model.walls == 0.0 else math.inf


_without_friction = changed(Rigid, "mass", "friction")


@declared.state_in.of(Rigid)
def _state_in(model, segment, tau):
    x, v, y, u = walls.state_by_start(declared.begin(model, segment), model, segment, tau)
    y, u = walls.own_state(model.mass, segment, y, u)
    return x, v, y, u


@declared.mass_ratio_at.of(Rigid)
def _mass_ratio_at(model, periods, time):
    return model.mass_ratio


# --- the common motion


@compiled
def offset_in(model: Any, s: Segment) -> float:
    """Displacement of the free mass less the primary's in contact or at rest."""
    return s.side * (model.clearance - s.gap)


@compiled
def hold_in(model: Rigid, s: Segment) -> Hold:
    """Hold of the free mass in a state without a relative velocity."""
    offset = offset_in(model, s)
    shift = rest_shift(model.mass, model.mass_ratio, offset)
    phase = phase_at(model.stuck.forcing, s.periods, s.time)
    start = motion_from(model.stuck, s.x + shift, s.v, phase)
    most = friction_of(model.friction)
    return Hold(model.stuck, model.mass, start, s.side, offset - shift, most)


@by_class
def friction_of(friction: Any) -> float:
    """Acceleration that friction gives the free mass while it slides."""


@friction_of.of(NoFriction)
def _none(friction):
    return 0.0


@friction_of.of(Friction)
def _acceleration(friction):
    return friction.acceleration


class Grip(NamedTuple):
    """How a hold is searched."""

    width: float
    """Within which it lasts: a wall holds whatever presses on it."""
    lifts_off: bool
    """Whether it begins at zero and is about to rise."""
    fails: bool
    """Whether it has failed by more than roundoff, as where the force jumps."""


@by_class
def grip_of(friction: Any, point: EventPoint, gap: float, forcing: Any) -> Grip:
    """How a hold is searched that begins at a point, this far from the wall."""


@grip_of.of(NoFriction)
def _grip_of_wall(friction, point, gap, forcing):
    lifts_off = point.value == 0.0 and point.slope == 0.0 and point.second == 0.0
    return Grip(math.inf, lifts_off, is_thrown_off(point, forcing))


@grip_of.of(Friction)
def _grip_of_friction(friction, point, gap, forcing):
    width = math.inf if gap == 0.0 else 2.0 * friction.acceleration
    slack = VANISHES * point.roundoff if may_jump(forcing) else 0.0
    beyond = point.value < -slack or point.value > width + slack
    return Grip(width, False, beyond and not holds(point, width))


@walls.stick.of(Rigid)
def _stick(model, segment):
    s = segment
    hold = hold_in(model, s)
    start = hold.start
    limit = min(HORIZON, horizon(model.stuck.forcing, start.phase))
    point = hold_at_start(hold)
    if s.side != 0.0 and not rests(point):
        grip = grip_of(model.friction, point, s.gap, model.stuck.forcing)
        if grip.fails:
            return End(0.0, EVENT, 0.0, s.x, s.v, s.gap, 0.0, 1)
        root = first_root(hold, point, grip.width, grip.lifts_off, limit, 0.0)
        p, tau, steps = root.point, root.point.tau + root.step, root.steps
        is_cut = limit < HORIZON and (root.side == 0.0 or tau > limit)
        if is_cut or root.side != 0.0:
            dx, v, _ = carried(p, limit - p.tau if is_cut else root.step)
            outcome = GAVE_UP if root.side == GAVE_UP else EVENT
            if is_cut:
                tau, outcome = limit, NO_EVENT
            return End(tau, outcome, 0.0, s.x + dx, v, s.gap, 0.0, steps)
    else:
        steps = 1
    x, v = arrive(model.stuck, start, limit)
    return End(limit, NO_EVENT, 0.0, x - (start.x - s.x), v, s.gap, 0.0, steps)


@walls.centre.of(Rigid)
def _centre(model, segment, tau):
    s = segment
    shift = rest_shift(model.mass, model.mass_ratio, offset_in(model, s))
    phase = phase_at(model.stuck.forcing, s.periods, s.time)
    common = centre_velocity(s, model.mass_ratio)
    together = motion_from(model.stuck, s.x + shift, common, phase)
    return advance(model.stuck, together, tau)


# --- slides


class Slide(NamedTuple):
    """What a slide follows from."""

    sigma: float
    """Sign of the free mass's velocity less the primary's."""
    shift: float
    """Displacement about which friction lets the primary swing."""
    flight: Rigid
    """The damper without friction whose flight it is."""
    start: Any
    """As of `damper.models.flights.begin_flight`."""
    phase: Any
    """Of the force, as in `Motion`."""


@compiled
def direction(model: Rigid, s: Segment) -> float:
    """Sign of the free mass's velocity less the primary's, also just after it was zero."""
    if s.gap_rate != 0.0:
        return -s.side if s.gap_rate > 0.0 else s.side
    # The masses' common acceleration leaves the free mass behind.
    force = hold_at_start(hold_in(model, s)).value - friction_of(model.friction)
    if s.gap == 0.0 or force < 0.0:
        return -s.side
    return s.side


@by_class
def begin_by(friction: Any, model: Rigid, segment: Segment) -> Any:
    """What a flight follows from: with friction a `Slide`."""


@begin_by.of(NoFriction)
def _begin_flight(friction, model, segment):
    return flights.begin(model, segment)


@begin_by.of(Friction)
def _begin_slide(friction, model, segment):
    sigma = direction(model, segment)
    mass = pushed_by(model.mass, -(sigma * friction.acceleration))
    flight = _without_friction(model, mass, NoFriction())
    shift = sigma * model.mass_ratio * friction.acceleration
    start = flights.begin_flight(mass, flight, segment, shift)
    return Slide(sigma, shift, flight, start, start.phase)


@declared.begin.of(Rigid)
def _begin(model, segment):
    return begin_by(model.friction, model, segment)


@flights.course_of.of(Slide)
def _course_of_slide(start, model):
    return start.flight.mass, start.shift


@flights.gap_of.of(Slide)
def _gap_of_slide(start, model, segment, sign):
    return flights.gap_of(start.start, start.flight, segment, sign)


@flights.relative_rates.of(Slide)
def _relative_rates_of_slide(start, model):
    return flights.relative_rates(start.start, start.flight)


@flights.fly.of(Slide)
def _fly(start, model, segment):
    """A slide, up to an impact or to where the relative velocity vanishes."""
    s, slide = segment, start
    limit = min(HORIZON, horizon(model.free.forcing, slide.phase))
    stop = first_stop(flights.gap_of(slide, model, s, -slide.sigma * s.side), limit)
    last = min(stop.tau, limit)
    gap = flights.gap_of(slide, model, s, 1.0)
    root = flights.first_wall(gap, flights.travel_of(model), last)
    tau = root.point.tau + root.step
    gave_up = stop.gave_up or root.side == GAVE_UP
    hits = abs(root.side) == 1.0 and tau <= last
    if not hits:
        tau = last
    p = point_at(gap, tau)
    x, v, steps = s.x + p.state.dx, p.state.v, stop.steps + root.steps
    if hits and not gave_up:
        return End(tau, EVENT, root.side * s.side, x, v, 0.0, p.slope, steps)
    # Below zero a gap is roundoff.
    left = min(max(p.value, 0.0), flights.travel_of(model))
    if tau < stop.tau or gave_up:
        outcome = GAVE_UP if gave_up else NO_EVENT
        rate = -slide.sigma * s.side * max(-slide.sigma * s.side * p.slope, 0.0)
        return End(tau, outcome, 0.0, x, v, left, rate, steps)
    return End(tau, STOPS, 0.0, x, v, left, 0.0, steps)


@walls.stays.of(Slide)
def _stays(start, model, segment):
    return holds(hold_at_start(hold_in(model, segment)), math.inf)


@walls.rest_or_slide.of(Slide)
def _rest_or_slide(start, model, segment):
    s = segment
    point = hold_at_start(hold_in(model, s))
    on_wall = s.gap == 0.0
    if not holds(point, math.inf if on_wall else 2.0 * friction_of(model.friction)):
        return s
    mode, cause = (STICKING, STICK) if on_wall else (RESTING, REST)
    # Impacts on one wall are a burst until the masses stick there, also where they rest between.
    first_speed = 0.0 if on_wall else s.first_speed
    return at_rest(s.periods, s.time, s.x, s.v, s.gap, s.side, mode, cause, s.v, first_speed)


at_rest = made_of(
    Segment,
    *("periods", "time", "x", "v", "gap", "side", "mode", "cause", "v_before", "first_speed"),
)


@walls.fly_on.of(Slide)
def _fly_on(start, model, segment, end):
    s, tau = segment, end.duration
    if end.outcome != STOPS:
        return walls.go_on(model, s, end, FLIGHT, NOTHING)
    new = segment_after(
        s, model.cycle, tau, end.x, end.v, end.gap, 0.0, s.side, FLIGHT, REVERSAL, 0.0
    )
    new = _rest_or_slide(start, model, new)
    return Step(tau, True, False, end.steps, new, _begin(model, new))


@walls.bounce_of.of(Slide)
def bounce_of_slide(slide: Slide, model: Rigid, segment: Segment) -> Bounce:
    """How a free mass bounces in a tail that begins with a slide."""
    return bounce_from(slide.start, slide.flight, segment, friction_of(model.friction))


@walls.time_to_accumulation.of(Rigid)
def _time_to_accumulation(model, segment, start):
    return time_left(start, model, segment)


@by_class_or_default
def time_left(start: Any, model: Rigid, segment: Segment) -> tuple[float, float]:
    """As `time_to_accumulation`, by what the flight follows from."""
    return completes(model, model.mass_ratio, segment, start)


@time_left.of(Slide)
def _time_left_rubbing(start, model, segment):
    most = friction_of(model.friction)
    left, error = completes_rubbing(start.start, start.flight, segment, most)
    within = segment.gap_rate * left <= 0.5 * flights.travel_of(model)
    return left, error if within else math.inf


# Deviations are a part of this model that needs all of the above.
from damper.models.masses import tangent  # noqa: E402, F401

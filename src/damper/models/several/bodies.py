"""Constants of several free masses, the segment with all masses, and the motion of each mass.

The number of masses is a run-time value; the code is compiled once.
"""

from typing import Any, NamedTuple

import numpy as np

from damper.engine import model as declared
from damper.engine.bodies import Ballistic, acceleration_of, body_at, strength_on, sum_after
from damper.engine.compiled import compiled, plain
from damper.engine.dispatch import by_class
from damper.engine.forcing import common, phase_at
from damper.engine.forcing.weighed import WeighedForce
from damper.engine.oscillator import (
    Motion,
    Oscillator,
    motion_at_release,
    motion_from,
    oscillator,
)
from damper.engine.search import HORIZON, ROUNDOFF, point_at
from damper.engine.segment import NOTHING, TAIL, Segment
from damper.engine.tuples import changed, made_of, reader, writer
from damper.models.flights import Both, gap_of
from damper.models.forces import drive_of, oscillator_under
from damper.models.friction import (
    LEAST_FRICTION,
    SLIP_DIRECTION,
    Frictions,
    NoFriction,
    is_joined,
    known_friction,
)
from damper.models.many import (
    LIFTS,
    MODE,
    MassesSegment,
)
from damper.models.masses import Rigid
from damper.models.masses import prepare as prepare_one
from damper.models.masses.holds import pushed_by
from damper.models.wall_laws import law_of, wall_laws
from damper.parameters import Parameters

#: Columns of `Several.masses`.
RATIO, CLEARANCE, GRAVITY, STIFFNESS, DAMPING, FRICTION = range(6)
#: Further ones, of the walls: `damper.models.wall_laws`.
LEFT, RIGHT, YIELDS, EXPONENT, LEFT_TABLE, RIGHT_TABLE = range(6, 12)
#: Columns of `MassesSegment.bodies` beside the first ones. A speed here may also be minus that of a
#: kick whose mass is back at its wall at once. An accumulation may also be minus the time left of a
#: tail in which all speeds vanish.
#:
#: `PREVIOUS_STATE`, after `SLIP_DIRECTION`: slip direction before this instant, `JOINED`, or
#: `REPORTED` in a further row of the same instant.
PREVIOUS_STATE = 9
#: Displacement and velocity of a mass in flight by itself, which have no digits of the primary's,
#: and the time for which nothing has happened to it: 0 where they are not known.
PLACE, VELOCITY, ALONE = range(10, 13)
#: Columns of the log for a mass.
BODY = 13
#: Further columns, which the log does not have: what an event is decided by.
#:
#: - arrives: wall at which the mass arrives, or 0;
#: - wall, level, most: as for `damper.models.several.contacts.balance`;
#: - follows: 1 for a mass that follows the primary in that balance, else 0.
ARRIVES, WALL, LEVEL, MOST, FOLLOWS = range(13, 18)
WIDTH = 18
JOINED, REPORTED = 2.0, 3.0


class MassConstants(NamedTuple):
    """Constants of a free mass, a row of `Several.masses`."""

    ratio: float
    clearance: float
    gravity: float
    stiffness: float
    damping: float
    """Of the support, as of an oscillator of its own."""
    friction: float
    """Acceleration by dry friction while it slides."""
    left: float
    """Of the walls, from here on: `damper.models.wall_laws`."""
    right: float
    yields: float
    exponent: float
    left_table: float
    right_table: float


class MassState(NamedTuple):
    """State of a free mass, the first columns of `MassesSegment.bodies`."""

    gap: float
    rate: float
    side: float
    mode: float
    cause: float
    speed: float
    first: float
    accumulation: float
    slip: float
    previous: float
    place: float
    velocity: float
    alone: float
    arrives: float


class Several(NamedTuple):
    """Constants of one run; the first eight are those of `damper.models.masses.Rigid`."""

    mass_ratio: float
    """Of all free masses together."""
    clearance: float
    """The largest."""
    law: Any
    cycle: float
    tolerance: float
    free: Oscillator
    stuck: Oscillator
    """All masses together."""
    mass: Any
    """A free mass in flight, but for its weight and friction."""
    share: float
    """Acceleration of a free mass by the force, over that of the primary."""
    single: Rigid
    """A damper of one of the masses, for what all masses share."""
    alone: Oscillator
    """The primary without a mass, of the same class as with masses."""
    masses: np.ndarray
    """A `MassConstants` in each row."""
    friction: Any
    """`Frictions`, or `NoFriction` where no mass rubs on its box."""

    @property
    def features(self) -> tuple[str, ...]:
        """Features of the masses, by their names in `damper.parameters.models`."""
        supported = np.any(self.masses[:, STIFFNESS] > 0.0)
        rubs = isinstance(self.friction, Frictions)
        return ("several", *["sliding"] * rubs, *["grounded"] * int(supported))


class Load(NamedTuple):
    """Effect of the masses on the primary's motion."""

    joined: float
    """Mass ratio of all that move with the primary."""
    damping: float
    stiffness: float
    """Of the primary and of the supports that move with it."""
    pull: float
    """Constant force to the left."""


class Start(NamedTuple):
    """Start of the motion in a segment."""

    osc: Oscillator
    """The primary, with what sticks to it."""
    joined: float
    """Mass ratio of all that sticks."""
    primary: Motion
    """In a tail the centre of all that it joins."""
    load: Load
    """What `osc` has been made for."""
    periods: float
    time: float
    v: float
    """Clock, and velocity of the primary, of the segment."""


@plain
def prepare(
    parameters: Parameters, law: Any, accuracy: float, along_friction: bool = False
) -> Several:
    """Constants of one run; along friction slides stop also where there is none yet."""
    p = parameters
    each = p.each
    ones = [prepare_one(q, law, accuracy) for q in each]
    made = ones[0]
    drive = drive_of(p)
    masses = np.array(
        [
            (q.mass_ratio, q.clearance, q.pull, m.stiffness, m.damping)
            for q, m in zip(each, [one.mass for one in ones], strict=True)
        ]
    )
    least = LEAST_FRICTION if along_friction else 0.0
    friction = np.array([max(q.friction, least) for q in each])
    walls, of_walls = wall_laws(each)
    masses = np.column_stack([masses, friction, of_walls])
    total = float(np.sum(masses[:, RATIO]))
    heavier = 1.0 + total
    strength = drive.amplitude * (1.0 + total * drive.share) / heavier
    damping = p.damping_ratio + sum(q.support_damping_ratio for q in each)
    stiffness = 1.0 + sum(q.support_stiffness_ratio for q in each)
    forcing, mass = drive.forcing, Ballistic(0.0)
    rubs = bool(friction.any())
    supported = bool(np.any(masses[:, STIFFNESS] > 0.0))
    if np.any(masses[:, GRAVITY] != 0.0) or rubs or supported:
        forcing = WeighedForce(forcing, strength, 0.0)
    if drive.share or supported:
        weighed = WeighedForce(drive.forcing, drive.share * drive.amplitude, 0.0)
        mass = oscillator(0.0, 0.0, 1.0, weighed)
    return Several(
        total,
        float(np.max(masses[:, CLEARANCE])),
        law,
        made.cycle,
        min(one.tolerance for one in ones),
        made.free,
        oscillator_under(forcing, damping / heavier, stiffness / heavier, strength, 0.0),
        mass,
        drive.share,
        Rigid(
            total,
            1.0,
            walls,
            made.cycle,
            min(one.tolerance for one in ones),
            made.free,
            made.free,
            mass,
            NoFriction(),
        ),
        oscillator_under(forcing, p.damping_ratio, 1.0, made.free.strength, 0.0),
        masses,
        Frictions() if rubs else NoFriction(),
    )


# The functions below take masses and bodies as numbers: for an array, each call would count two
# references, which costs as much as some twenty operations.


_read_mass, _with_friction = reader(MassConstants), changed(MassConstants, "friction")
body_in, put_body = reader(MassState), writer(MassState)


@compiled
def mass_at(model: Several, k: int) -> MassConstants:
    """Constants of a mass."""
    m = _read_mass(model.masses, k)
    return _with_friction(m, known_friction(model.friction, m.friction))


@compiled
def flying(single: Rigid, m: MassConstants, way: float) -> Any:
    """A free mass in flight, which rubs on its box where it goes a `way`."""
    return _with_weight(single.mass, m, -(m.gravity + way * m.friction))


@by_class
def _with_weight(mass: Any, m: MassConstants, acceleration: float) -> Any:
    """A free mass on its support, with a constant acceleration."""


@_with_weight.of(Ballistic)
def _ballistic_with_weight(mass, m, acceleration):
    return pushed_by(mass, acceleration)


@_with_weight.of(Oscillator)
def _supported_with_weight(mass, m, acceleration):
    if m.stiffness == 0.0:
        return pushed_by(mass, acceleration)
    weighed = WeighedForce(common(mass.forcing), strength_on(mass), acceleration)
    return oscillator(m.damping, m.stiffness, 1.0, weighed)


@compiled
def offset_of(m: MassConstants, b: MassState) -> float:
    """Displacement of a mass less the primary's."""
    return b.side * (m.clearance - b.gap)


@compiled
def own_acceleration(
    single: Rigid, m: MassConstants, b: MassState, x: float, v: float, phase: Any, way: float
) -> float:
    """Acceleration of a mass that nothing holds, beside the primary, sliding a way."""
    return acceleration_of(flying(single, m, way), x + offset_of(m, b), v, phase)


@compiled
def friction_of(model: Several, k: int) -> float:
    """Acceleration that friction gives a free mass while it slides."""
    return known_friction(model.friction, float(model.masses[k, FRICTION]))


@compiled
def primary_with(model: Several, load: Load) -> Oscillator:
    """The primary under a load."""
    heavier = 1.0 + load.joined
    strength = model.free.strength * (1.0 + load.joined * model.share) / heavier
    return oscillator_under(
        model.stuck.forcing,
        load.damping / heavier,
        load.stiffness / heavier,
        strength,
        -load.pull / heavier,
    )


@compiled
def load_in(model: Several, ways: np.ndarray, offsets: np.ndarray) -> Load:
    """Load by the masses that move with the primary (`JOINED`) and by the friction of slides."""
    load = Load(0.0, model.free.damping, 1.0, 0.0)
    for k in range(len(ways)):
        load = loaded(load, mass_at(model, k), float(ways[k]), float(offsets[k]))
    return load


@compiled
def loaded(load: Load, m: MassConstants, way: float, offset: float) -> Load:
    """Load with a mass more, which slides a way or is `JOINED` at an offset from the primary."""
    if way != JOINED:
        return Load(
            load.joined, load.damping, load.stiffness, load.pull - m.ratio * way * m.friction
        )
    return Load(
        load.joined + m.ratio,
        load.damping + m.ratio * m.damping,
        load.stiffness + m.ratio * m.stiffness,
        load.pull + m.ratio * (m.gravity + m.stiffness * offset),
    )


@compiled
def single_mass_view(
    single: Rigid, m: MassConstants, start: Start, ratio: float, side: float, way: float
) -> Rigid:
    """The damper of one free mass of this ratio; its primary carries the masses that stick.

    The contact law at this side is that of both walls.
    """
    osc, mass = start.osc, flying(single, m, way)
    weight = ratio / (1.0 + start.joined)
    return _view(single, weight, m.clearance, law_of(single, m, side), osc, osc, mass)


_view = changed(Rigid, "mass_ratio", "clearance", "law", "free", "stuck", "mass")


@compiled
def segment_of(b: MassState, start: Start) -> Segment:
    """The segment of one body, as a damper with this one alone has it.

    In a tail that is in the frame of the centre of all that it joins.
    """
    p, rate = start.primary, b.rate + b.side * (start.primary.v - start.v)
    periods, time, left = start.periods, start.time, b.accumulation
    return _segment(periods, time, p.x, p.v, b.gap, rate, b.side, b.mode, NOTHING, p.v, left)


_segment = made_of(
    Segment,
    *("periods", "time", "x", "v", "gap", "gap_rate", "side", "mode", "cause", "v_before"),
    "accumulation",
)


@by_class
def flight_of(mass: Any, start: Start, view: Rigid, segment: Segment) -> Any:
    """Start of the flight of a mass, as `damper.models.flights.begin_flight`."""


@flight_of.of(Ballistic)
def _flight_of_ballistic(mass, start, view, segment):
    return start.primary


@flight_of.of(Oscillator)
def _flight_of_driven(mass, start, view, segment):
    s, p = segment, start.primary
    y = s.x + s.side * (view.clearance - s.gap)
    own = motion_from(mass, y, s.v - s.side * s.gap_rate, p.phase)
    if s.accumulation == LIFTS:
        own = motion_at_release(mass, y, own.v, p.a, p.phase)
    return Both(p, own, p.phase)


@compiled
def flight_of_body(single: Rigid, m: MassConstants, b: MassState, start: Start) -> tuple:
    """The flight of one mass: its segment, its damper of one mass, the start of the flight."""
    seg = segment_of(b, start)
    view = single_mass_view(single, m, start, 0.0, b.side, b.slip)
    return seg, view, flight_of(view.mass, start, view, seg)


@by_class
def fly_alone(
    mass: Any, place: float, velocity: float, alone: float, tau: float
) -> tuple[float, float, float]:
    """Displacement and velocity of a free mass after a time, and the time for which it has flown.

    The last is 0 where the first two are not known.
    """


@fly_alone.of(Ballistic)
def _fly_alone(mass, place, velocity, alone, tau):
    way, velocity = body_at(mass, place, velocity, 0.0, tau)
    return place + way, velocity, alone + tau


@fly_alone.of(Oscillator)
def _is_driven(mass, place, velocity, alone, tau):
    return place, velocity, 0.0


@by_class
def gap_after(
    own: Any, view: Rigid, segment: Segment, way: float, change: float, tau: float
) -> tuple[float, float, float]:
    """Gap, its rate and its roundoff after a time, from the primary's increments."""


@gap_after.of(Motion)
def _gap_of_ballistic(own, view, segment, way, change, tau):
    s, a = segment, view.mass.acceleration
    fallen = 0.5 * a * tau * tau
    straight = s.gap_rate * tau
    size = abs(s.gap) + abs(straight) + abs(way) + abs(fallen)
    return (
        (s.gap + straight) + s.side * (way - fallen),
        s.gap_rate + s.side * (change - a * tau),
        ROUNDOFF * size,
    )


@gap_after.of(Both)
def _gap_of_driven(own, view, segment, way, change, tau):
    moving = gap_of(own, view, segment, 1.0)
    p = point_at(moving, tau)
    if tau < HORIZON:
        return p.value, p.slope, p.roundoff
    _, _, gap, rate = sum_after(moving, tau)
    return gap, rate, p.roundoff


@compiled
def ways_in(bodies: np.ndarray) -> np.ndarray:
    """Slip direction of each mass, `JOINED` where it moves with the primary."""
    ways = bodies[:, SLIP_DIRECTION].copy()
    for k in range(len(bodies)):
        if is_joined(bodies[k, MODE]):
            ways[k] = JOINED
    return ways


@declared.begin.of(Several)
def begin(model: Several, segment: MassesSegment) -> Start:
    """Start of the motion in a segment, as `damper.engine.model.begin`."""
    return begin_after(model, segment, model.alone, Load(0.0, model.free.damping, 1.0, 0.0))


@compiled
def begin_after(model: Several, s: MassesSegment, osc: Oscillator, load: Load) -> Start:
    """As `begin`; the primary's oscillator is known for a load, which may be the same still."""
    before, load, carried = load, Load(0.0, model.free.damping, 1.0, 0.0), 0.0
    lifting, way = -1, 0.0
    bodies = s.bodies
    for k in range(len(bodies)):
        m, b = mass_at(model, k), body_in(bodies, k)
        joined = is_joined(b.mode)
        load = loaded(load, m, JOINED if joined else b.slip, offset_of(m, b))
        if joined and b.mode == TAIL:
            carried += b.side * m.ratio * b.rate
        if b.accumulation == LIFTS and lifting < 0:
            lifting, way = k, b.slip
    if load != before:
        osc = primary_with(model, load)
    phase = phase_at(osc.forcing, s.periods, s.time)
    primary = motion_from(osc, s.x, s.v - carried / (1.0 + load.joined), phase)
    if lifting >= 0:
        mass = flying(model.single, mass_at(model, lifting), way)
        primary = _lifting(mass, osc, primary)
    return Start(osc, load.joined, primary, load, s.periods, s.time, s.v)


@by_class
def _lifting(mass: Any, osc: Oscillator, primary: Motion) -> Motion:
    """The primary's motion, with the very acceleration of a mass that leaves it just now."""


@_lifting.of(Ballistic)
def _lifting_ballistic(mass, osc, primary):
    return motion_at_release(osc, primary.x, primary.v, mass.acceleration, primary.phase)


@_lifting.of(Oscillator)
def _lifting_driven(mass, osc, primary):
    return primary

"""Constants of several free masses, the segment that holds them all, and how each of them moves.

How many there are is no type: one code serves any number.
"""

from typing import Any, NamedTuple

import numpy as np

from damper.engine import model as declared
from damper.engine.bodies import Ballistic, acceleration_of, body_at, strength_on, sum_after
from damper.engine.compiled import compiled, plain
from damper.engine.dispatch import by_class, by_class_or_default
from damper.engine.forcing import common, phase_at
from damper.engine.forcing.weighed import WeighedForce
from damper.engine.impact import YieldingRestitution
from damper.engine.oscillator import (
    Motion,
    Oscillator,
    motion_at_release,
    motion_from,
    oscillator,
)
from damper.engine.search import HORIZON, ROUNDOFF, point_at
from damper.engine.segment import NOTHING, RESTING, STICKING, TAIL, Segment
from damper.models.flights import Both, gap_of
from damper.models.forces import drive_of
from damper.models.masses import NoFriction, Rigid
from damper.models.masses import prepare as prepare_one
from damper.models.masses.holds import pushed_by
from damper.parameters import Parameters

#: Columns of `Several.masses`.
RATIO, CLEARANCE, GRAVITY, STIFFNESS, DAMPING, LEFT, RIGHT, YIELDS = range(8)
#: Columns of `SeveralSegment.bodies`, as the fields of a `Segment`, and more:
#:
#: - cause: event not yet written to the log;
#: - speed: approach speed of an impact at this instant; minus that of a kick whose mass is back at
#:   its wall at once;
#: - completion: minus the time left of a tail in which all speeds vanish, or `LIFTS`;
#: - slip direction: sign of the mass's velocity less the primary's where the mass rubs, else 0;
#: - previous state: slip direction before this instant, `JOINED`, or `REPORTED` in a further row of
#:   the same instant.
GAP, RATE, SIDE, MODE, CAUSE, SPEED, FIRST, COMPLETION, SLIP_DIRECTION, PREVIOUS_STATE = range(10)
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
#: In place of a completion: the body has left its wall without a jump of the force just now, so
#: both accelerations are the same, exactly.
LIFTS = -1.0
#: Friction that does nothing.
LEAST_FRICTION = 1e-300


class NoFrictions(NamedTuple):
    """No free mass rubs on its box."""

    accelerations: np.ndarray
    """All are 0."""


class Frictions(NamedTuple):
    """Dry friction of free masses and their boxes."""

    accelerations: np.ndarray
    """What it gives each of them while it slides."""


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
    alone: Oscillator
    """The primary without a mass, of the same class as with masses."""
    masses: np.ndarray
    """A row for each mass.

    Mass ratio, clearance and gravity; stiffness and damping of the support, as of an oscillator of
    its own; restitution of the left and of the right wall at low speeds, and the yield speed.
    """
    friction: Any
    """`Frictions`, or `NoFrictions` where no mass rubs on its box."""

    @property
    def features(self) -> tuple[str, ...]:
        """What the masses have, as `damper.parameters.models` calls it."""
        supported = np.any(self.masses[:, STIFFNESS] > 0.0)
        rubs = isinstance(self.friction, Frictions)
        return ("several", *["sliding"] * rubs, *["grounded"] * int(supported))


class SeveralSegment(NamedTuple):
    """A segment; the fields of `damper.engine.segment.Segment` are those of one body.

    Of events at one instant each begins a segment of its own; all but the last of them have no
    length.
    """

    periods: float
    time: float
    x: float
    v: float
    gap: float
    gap_rate: float
    side: float
    mode: float
    cause: float
    speed: float
    v_before: float
    first_speed: float
    completion: float
    duration: float
    y: float
    u: float
    body: float
    """Number of the free mass that the other fields speak of, from 0."""
    loss: float
    """Energy lost in all impacts of this instant; the first of their segments has it."""
    bodies: np.ndarray
    """A row for each free mass."""


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
    """What the motion in a segment follows from."""

    osc: Oscillator
    """The primary, with what sticks to it."""
    joined: float
    """Mass ratio of all that sticks."""
    primary: Motion
    """In a tail the centre of all that it joins."""
    load: Load
    """What `osc` has been made for."""


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
            (q.mass_ratio, q.clearance, q.gravity, m.stiffness, m.damping, *q.restitutions)
            for q, m in zip(each, [one.mass for one in ones], strict=True)
        ]
    )
    masses = np.column_stack([masses, [q.yield_speed for q in each]])
    total = float(np.sum(masses[:, RATIO]))
    heavier = 1.0 + total
    strength = drive.amplitude * (1.0 + total * drive.share) / heavier
    damping = p.damping_ratio + sum(q.support_damping_ratio for q in each)
    stiffness = 1.0 + sum(q.support_stiffness_ratio for q in each)
    forcing, mass = drive.forcing, Ballistic(0.0)
    least = LEAST_FRICTION if along_friction else 0.0
    friction = np.array([max(q.friction, least) for q in each])
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
        _driven(forcing, damping / heavier, stiffness / heavier, strength, 0.0),
        mass,
        drive.share,
        _driven(forcing, p.damping_ratio, 1.0, made.free.strength, 0.0),
        masses,
        Frictions(friction) if rubs else NoFrictions(friction),
    )


@by_class_or_default
def _driven(forcing: Any, damping: float, stiffness: float, strength: float, weight: float) -> Any:
    """Make an oscillator with a constant acceleration beside the force; here there is none."""
    return oscillator(damping, stiffness, strength, forcing)


@_driven.of(WeighedForce)
def _driven_weighed(forcing, damping, stiffness, strength, weight):
    return oscillator(damping, stiffness, 1.0, WeighedForce(forcing.forcing, strength, weight))


@compiled
def mass_of(model: Several, k: int, way: float) -> Any:
    """A free mass in flight, which rubs on its box where it goes a `way`."""
    slowed = way * friction_of(model.friction, k)
    return _with_weight(model.mass, model, k, -(float(model.masses[k, GRAVITY]) + slowed))


@by_class
def _with_weight(mass: Any, model: Several, k: int, acceleration: float) -> Any:
    """A free mass on its support, with a constant acceleration."""


@_with_weight.of(Ballistic)
def _ballistic_with_weight(mass, model, k, acceleration):
    return pushed_by(mass, acceleration)


@_with_weight.of(Oscillator)
def _supported_with_weight(mass, model, k, acceleration):
    stiffness, damping = float(model.masses[k, STIFFNESS]), float(model.masses[k, DAMPING])
    if stiffness == 0.0:
        return pushed_by(mass, acceleration)
    weighed = WeighedForce(common(mass.forcing), strength_on(mass), acceleration)
    return oscillator(damping, stiffness, 1.0, weighed)


@compiled
def offset_of(model: Several, b: np.ndarray, k: int) -> float:
    """Displacement of a mass less the primary's."""
    return float(b[SIDE]) * (float(model.masses[k, CLEARANCE]) - float(b[GAP]))


@compiled
def own_acceleration(model: Several, s: SeveralSegment, k: int, v: float, way: float) -> float:
    """Acceleration of a mass that nothing holds, at the primary's velocity `v`, sliding a way."""
    phase = phase_at(model.free.forcing, s.periods, s.time)
    return acceleration_of(mass_of(model, k, way), s.x + offset_of(model, s.bodies[k], k), v, phase)


@by_class
def friction_of(friction: Any, k: int) -> float:
    """Acceleration that friction gives a free mass while it slides."""


@friction_of.of(NoFrictions)
def _no_friction(friction, k):
    return 0.0


@friction_of.of(Frictions)
def _friction_of(friction, k):
    return float(friction.accelerations[k])


@compiled
def primary_with(model: Several, load: Load) -> Oscillator:
    """The primary under a load."""
    heavier = 1.0 + load.joined
    strength = model.free.strength * (1.0 + load.joined * model.share) / heavier
    return _driven(
        model.stuck.forcing,
        load.damping / heavier,
        load.stiffness / heavier,
        strength,
        -load.pull / heavier,
    )


@compiled
def pull_of(model: Several, k: int, offset: float) -> float:
    """Constant force to the left of a mass that moves with the primary at an offset."""
    m = model.masses[k]
    return float(m[RATIO]) * (float(m[GRAVITY]) + float(m[STIFFNESS]) * offset)


@compiled
def load_in(model: Several, ways: np.ndarray, offsets: np.ndarray) -> Load:
    """Load by the masses that move with the primary (`JOINED`) and by the friction of slides."""
    joined, damping, stiffness, pull = 0.0, model.free.damping, 1.0, 0.0
    for k in range(len(ways)):
        ratio = float(model.masses[k, RATIO])
        if ways[k] == JOINED:
            joined += ratio
            damping += ratio * float(model.masses[k, DAMPING])
            stiffness += ratio * float(model.masses[k, STIFFNESS])
            pull += pull_of(model, k, float(offsets[k]))
        else:
            pull -= ratio * float(ways[k]) * friction_of(model.friction, k)
    return Load(joined, damping, stiffness, pull)


@compiled
def single_mass_view(
    model: Several, start: Start, k: int, ratio: float, side: float, way: float
) -> Rigid:
    """The rigid damper whose free mass of this ratio is body `k`, and all that sticks primary.

    Its walls are as the one of this side.
    """
    osc = start.osc
    return Rigid(
        ratio / (1.0 + start.joined),
        float(model.masses[k, CLEARANCE]),
        law_of(model, k, side),
        model.cycle,
        model.tolerance,
        osc,
        osc,
        mass_of(model, k, way),
        NoFriction(),
    )


@compiled
def segment_of(s: SeveralSegment, start: Start, k: int) -> Segment:
    """The segment of one body, as a damper with this one alone has it.

    In a tail that is in the frame of the centre of all that it joins.
    """
    b = s.bodies[k]
    side = float(b[SIDE])
    v = start.primary.v
    rate = float(b[RATE]) + side * (v - s.v)
    mode = float(b[MODE])
    gap, left = float(b[GAP]), float(b[COMPLETION])
    return Segment(
        s.periods, s.time, s.x, v, gap, rate, side, mode, NOTHING, 0.0, v, 0.0, left, 0.0, 0.0, 0.0
    )


@by_class
def flight_of(mass: Any, start: Start, view: Rigid, segment: Segment) -> Any:
    """What the flight of a mass follows from, as `damper.models.flights.begin_flight`."""


@flight_of.of(Ballistic)
def _flight_of_ballistic(mass, start, view, segment):
    return start.primary


@flight_of.of(Oscillator)
def _flight_of_driven(mass, start, view, segment):
    s, p = segment, start.primary
    y = s.x + s.side * (view.clearance - s.gap)
    own = motion_from(mass, y, s.v - s.side * s.gap_rate, p.phase)
    if s.completion == LIFTS:
        own = motion_at_release(mass, y, own.v, p.a, p.phase)
    return Both(p, own, p.phase)


@compiled
def flight_of_body(model: Several, s: SeveralSegment, start: Start, k: int) -> tuple:
    """The flight of one body: its segment, the damper that it is one of, what it follows from."""
    seg = segment_of(s, start, k)
    view = single_mass_view(model, start, k, 0.0, seg.side, float(s.bodies[k, SLIP_DIRECTION]))
    return seg, view, flight_of(view.mass, start, view, seg)


@by_class
def fly_alone(mass: Any, body: np.ndarray, tau: float) -> None:
    """Take displacement and velocity of a free mass on, where they are known; in place."""


@fly_alone.of(Ballistic)
def _fly_alone(mass, body, tau):
    way, velocity = body_at(mass, float(body[PLACE]), float(body[VELOCITY]), 0.0, tau)
    body[PLACE] += way
    body[VELOCITY] = velocity
    body[ALONE] += tau


@fly_alone.of(Oscillator)
def _is_driven(mass, body, tau):
    body[ALONE] = 0.0


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
def is_on_wall(mode: float) -> bool:
    """Whether a free mass sticks to its wall, or will where its tail ends."""
    return mode in (STICKING, TAIL)


@compiled
def is_joined(mode: float) -> bool:
    """Whether a free mass moves with the primary, or about the centre that the tail has."""
    return is_on_wall(mode) or mode == RESTING


@compiled
def ways_in(bodies: np.ndarray) -> np.ndarray:
    """Which way each mass slides, `JOINED` where it moves with the primary."""
    ways = bodies[:, SLIP_DIRECTION].copy()
    for k in range(len(bodies)):
        if is_joined(bodies[k, MODE]):
            ways[k] = JOINED
    return ways


@declared.begin.of(Several)
def begin(model: Several, segment: SeveralSegment) -> Start:
    """What the motion in a segment follows from; see `damper.engine.model.begin`."""
    return begin_after(model, segment, model.alone, Load(0.0, model.free.damping, 1.0, 0.0))


@compiled
def begin_after(model: Several, s: SeveralSegment, osc: Oscillator, load: Load) -> Start:
    """As `begin`; the primary's oscillator is known for a load, which may be the same still."""
    joined, damping, stiffness, pull, carried = 0.0, model.free.damping, 1.0, 0.0, 0.0
    for k in range(len(s.bodies)):
        b = s.bodies[k]
        if is_joined(b[MODE]):
            ratio = float(model.masses[k, RATIO])
            joined += ratio
            damping += ratio * float(model.masses[k, DAMPING])
            stiffness += ratio * float(model.masses[k, STIFFNESS])
            pull += pull_of(model, k, offset_of(model, b, k))
            if b[MODE] == TAIL:
                carried += float(b[SIDE]) * ratio * float(b[RATE])
        else:
            rubs = float(b[SLIP_DIRECTION]) * friction_of(model.friction, k)
            pull -= float(model.masses[k, RATIO]) * rubs
    is_same = joined == load.joined and pull == load.pull
    if not (is_same and damping == load.damping and stiffness == load.stiffness):
        load = Load(joined, damping, stiffness, pull)
        osc = primary_with(model, load)
    phase = phase_at(osc.forcing, s.periods, s.time)
    primary = motion_from(osc, s.x, s.v - carried / (1.0 + joined), phase)
    return Start(osc, joined, _lifting(model.mass, model, s, osc, primary), load)


@by_class
def _lifting(mass: Any, model: Any, s: Any, osc: Any, primary: Motion) -> Motion:
    """The primary's motion, with the very acceleration of a mass that leaves it just now."""


@_lifting.of(Ballistic)
def _lifting_ballistic(mass, model, s, osc, primary):
    for k in range(len(s.bodies)):
        b = s.bodies[k]
        if b[COMPLETION] == LIFTS:
            a = mass_of(model, k, float(b[SLIP_DIRECTION])).acceleration
            return motion_at_release(osc, primary.x, primary.v, a, primary.phase)
    return primary


@_lifting.of(Oscillator)
def _lifting_driven(mass, model, s, osc, primary):
    return primary


@compiled
def law_of(model: Several, k: int, side: float) -> YieldingRestitution:
    """Contact law of a mass at one of its walls."""
    yields = float(model.masses[k, YIELDS])
    return YieldingRestitution(float(model.masses[k, LEFT if side < 0.0 else RIGHT]), yields)


@compiled
def restitution_of(model: Several, k: int, side: float) -> float:
    """Coefficient of restitution of a mass at one of its walls, at low speeds."""
    return float(model.masses[k, LEFT if side < 0.0 else RIGHT])

"""Several free masses in boxes of one primary; the walls are rigid.

They act on the primary alone. So each flies as the free mass of a rigid damper does, whose primary
carries those that stick just now: gaps, contact forces and completion times are asked of such a
damper (`view_of`). How many there are is no type: one code serves any number. Simultaneous contacts
are solved at once, as one problem of impulses and one of contact forces. docs/models.md.
"""

import math
from typing import Any, NamedTuple

import numpy as np

from damper.engine import model as declared
from damper.engine import segment as columns
from damper.engine.bodies import Ballistic, WeightedSum, acceleration_of, start_point, sum_after
from damper.engine.compiled import compiled, plain
from damper.engine.completion import bounce_at
from damper.engine.dispatch import by_class, by_class_or_default
from damper.engine.forcing import horizon, phase_at
from damper.engine.forcing.weighed import WeighedForce
from damper.engine.impact import ConstantRestitution, DifferingWalls
from damper.engine.model import Step
from damper.engine.oscillator import (
    Motion,
    Oscillator,
    arrive,
    increments,
    motion_at_release,
    motion_from,
    oscillator,
)
from damper.engine.search import GAVE_UP, HORIZON, ROUNDOFF, first_root, point_at
from damper.engine.segment import (
    COLUMNS,
    FLIGHT,
    IMPACT,
    NOTHING,
    RELEASE,
    STICK,
    STICKING,
    TAIL,
    Segment,
    clock_after,
    segment_at,
    write_segment,
)
from damper.models import rigid
from damper.models.flights import VANISHES, Both, completes, gap_of, rests
from damper.models.forces import drive_of
from damper.models.rigid import ContactForce, Rigid, force_point
from damper.models.walls import slack
from damper.parameters import Parameters

#: Columns of `Several.masses`.
RATIO, CLEARANCE, GRAVITY, LEFT, RIGHT = range(5)
#: Columns of `SeveralSegment.bodies`, as the fields of a `Segment`; the cause is one that is still
#: to be told in a row of its own, the speed that of an impact at this instant.
GAP, RATE, SIDE, MODE, CAUSE, SPEED, FIRST, COMPLETION = range(8)
_BODY = 8
#: Columns of the log -> those of a body.
_OF_BODY = (
    (columns.GAP, GAP),
    (columns.GAP_RATE, RATE),
    (columns.SIDE, SIDE),
    (columns.MODE, MODE),
    (columns.FIRST_SPEED, FIRST),
)
#: In place of a completion: the body has left its wall without a jump of the force just now, so
#: both accelerations are the same, exactly.
_LIFTS = -1.0
#: Roundoffs of a gap within which an approaching mass is at the wall together with another.
_TOGETHER = 4.0
#: Part of the tolerance that may be left of a sequence which others disturb: they prolong it.
_NOTHING_LEFT = 1e-2


class Several(NamedTuple):
    """Constants of one run; the first eight are those of `damper.models.rigid.Rigid`."""

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
    """A free mass in flight, but for its weight."""
    share: float
    """Acceleration of a free mass by the force, over that of the primary."""
    masses: np.ndarray
    """A row each: mass ratio, clearance, gravity, restitution of the left and of the right wall."""


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
    body: float
    """Number of the free mass that the other fields speak of, from 0."""
    loss: float
    """Energy lost in all impacts of this instant; the first of their segments has it."""
    bodies: np.ndarray
    """A row for each free mass."""


class Start(NamedTuple):
    """What the motion in a segment follows from."""

    osc: Oscillator
    """The primary, with what sticks to it."""
    joined: float
    """Mass ratio of all that sticks."""
    primary: Motion
    """In a tail the centre of all that it joins."""


@plain
def prepare(parameters: Parameters, law: Any, accuracy: float) -> Several:
    """Constants of one run."""
    p = parameters
    each = p.each
    made = rigid.prepare(each[0], law, accuracy)
    drive = drive_of(p)
    masses = np.array([(q.mass_ratio, q.clearance, q.gravity, *q.restitutions) for q in each])
    total = float(np.sum(masses[:, RATIO]))
    heavier = 1.0 + total
    strength = drive.amplitude * (1.0 + total * drive.share) / heavier
    forcing, mass = drive.forcing, made.mass
    if np.any(masses[:, GRAVITY] != 0.0):
        forcing = WeighedForce(forcing, strength, 0.0)
    if drive.share:
        weighed = WeighedForce(drive.forcing, drive.share * drive.amplitude, 0.0)
        mass = oscillator(0.0, 0.0, 1.0, weighed)
    return Several(
        total,
        float(np.max(masses[:, CLEARANCE])),
        law,
        made.cycle,
        made.tolerance,
        made.free,
        _driven(forcing, p.damping_ratio / heavier, 1.0 / heavier, strength, 0.0),
        mass,
        drive.share,
        masses,
    )


# --- one free mass of them, and the primary with those that stick


@by_class_or_default
def _driven(forcing: Any, damping: float, stiffness: float, strength: float, weight: float) -> Any:
    """Make an oscillator with a constant acceleration beside the force; here there is none."""
    return oscillator(damping, stiffness, strength, forcing)


@_driven.of(WeighedForce)
def _driven_weighed(forcing, damping, stiffness, strength, weight):
    return oscillator(damping, stiffness, 1.0, WeighedForce(forcing.forcing, strength, weight))


@by_class
def _weighing(mass: Any, gravity: float) -> Any:
    """A free mass in flight under its own gravity."""


@_weighing.of(Ballistic)
def _weighing_ballistic(mass, gravity):
    # Compiled code knows no defaults.
    return Ballistic(0.0 - gravity, 0.0, 0.0, 0.0)


@_weighing.of(Oscillator)
def _weighing_driven(mass, gravity):
    forcing = mass.forcing
    return oscillator(0.0, 0.0, 1.0, WeighedForce(forcing.forcing, forcing.share, -gravity))


@compiled
def mass_of(model: Several, k: int) -> Any:
    """A free mass in flight."""
    return _weighing(model.mass, float(model.masses[k, GRAVITY]))


@compiled
def primary_with(model: Several, joined: float, pull: float) -> Oscillator:
    """The primary with masses of the ratio `joined` and the weight `pull`."""
    heavier = 1.0 + joined
    strength = model.free.strength * (1.0 + joined * model.share) / heavier
    return _driven(
        model.stuck.forcing, model.free.damping / heavier, 1.0 / heavier, strength, -pull / heavier
    )


@compiled
def view_of(model: Several, start: Start, k: int, ratio: float, side: float) -> Rigid:
    """The rigid damper whose free mass of this ratio is body `k`, and all that sticks primary.

    Its walls are as the one of this side.
    """
    osc = start.osc
    return Rigid(
        ratio / (1.0 + start.joined),
        float(model.masses[k, CLEARANCE]),
        ConstantRestitution(restitution_of(model, k, side)),
        model.cycle,
        model.tolerance,
        osc,
        osc,
        mass_of(model, k),
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
        s.periods, s.time, s.x, v, gap, rate, side, mode, NOTHING, 0.0, v, 0.0, left, 0.0
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
    if s.completion == _LIFTS:
        own = motion_at_release(mass, y, own.v, p.a, p.phase)
    return Both(p, own, p.phase)


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


# --- segments


@declared.columns_of.register(Several)
def _columns_of(model):
    return COLUMNS + 2 + _BODY * len(model.masses)


@declared.masses_in.register(Several)
def _masses_in(model, state):
    y, u = state.of_each(len(model.masses))
    return np.array(y), np.array(u)


@declared.count_masses.register(Several)
def _count_masses(model):
    return len(model.masses)


@declared.view_of_mass.register(Several)
def _view_of_mass(model, body):
    own = model.masses[body]
    # No motion has a mirror image where the walls of any mass differ.
    unlike = model.masses[model.masses[:, LEFT] != model.masses[:, RIGHT]]
    left, right = (unlike if len(unlike) else model.masses[[body]])[0, [LEFT, RIGHT]].tolist()
    return model._replace(
        mass_ratio=float(own[RATIO]),
        clearance=float(own[CLEARANCE]),
        law=DifferingWalls(ConstantRestitution(left), ConstantRestitution(right)),
    )


@declared.log_of_mass.register(Several)
def _log_of_mass(model, log, body):
    made = log.copy()
    others = log[:, COLUMNS] != body
    rows = log[others]
    first = COLUMNS + 2 + _BODY * body
    for column, field in _OF_BODY:
        made[others, column] = rows[:, first + field]
    made[others, columns.CAUSE], made[others, columns.SPEED] = NOTHING, 0.0
    made[others, columns.COMPLETION] = np.maximum(rows[:, first + COMPLETION], 0.0)
    made[:, COLUMNS] = body
    return made


@declared.rows_of.register(Several)
def _rows_of(model, rows, body):
    # Gap, rate, side and mode stand together in both.
    found, gap, of_body = rows.copy(), Segment._fields.index("gap"), COLUMNS + 2 + _BODY * body
    found[:, gap : gap + CAUSE] = rows[:, of_body : of_body + CAUSE]
    found[:, COLUMNS] = body
    return found


@declared.read_segment.of(Several)
def _read_segment(model, row):
    count = len(model.masses)
    bodies = np.empty((count, _BODY))
    for k in range(count):
        for column in range(_BODY):
            bodies[k, column] = row[COLUMNS + 2 + _BODY * k + column]
    body, loss = float(row[COLUMNS]), float(row[COLUMNS + 1])
    return _segment(segment_at(row), body, loss, bodies)


@declared.write_row.of(Several)
def _write_row(model, row, segment, duration):
    write_segment(row, segment, duration)
    row[COLUMNS] = segment.body
    row[COLUMNS + 1] = segment.loss
    for k in range(len(segment.bodies)):
        for column in range(_BODY):
            row[COLUMNS + 2 + _BODY * k + column] = segment.bodies[k, column]


@compiled
def _segment(s, body, loss, bodies):
    return SeveralSegment(
        s.periods,
        s.time,
        s.x,
        s.v,
        s.gap,
        s.gap_rate,
        s.side,
        s.mode,
        s.cause,
        s.speed,
        s.v_before,
        s.first_speed,
        s.completion,
        s.duration,
        body,
        loss,
        bodies,
    )


@compiled
def _told(s, v_before, loss):
    """The same segment, with the fields of the first body whose cause is to be told."""
    k, bodies = 0, s.bodies.copy()
    for j in range(len(bodies) - 1, -1, -1):
        cause = bodies[j, CAUSE]
        # Impacts come first: those that they kick off a wall leave it by them.
        if cause == IMPACT or (cause != NOTHING and bodies[k, CAUSE] != IMPACT):
            k = j
    b = s.bodies[k]
    bodies[k, CAUSE] = NOTHING
    speed = float(b[SPEED])
    gap, rate, side, mode = float(b[GAP]), float(b[RATE]), float(b[SIDE]), float(b[MODE])
    first, completion = float(b[FIRST]), max(float(b[COMPLETION]), 0.0)
    told = Segment(
        s.periods,
        s.time,
        s.x,
        s.v,
        gap,
        rate,
        side,
        mode,
        float(b[CAUSE]),
        speed,
        v_before,
        first,
        completion,
        0.0,
    )
    return _segment(told, float(k), loss, bodies)


@compiled
def _at(model, periods, time, x, v, bodies):
    """A segment that starts here, before anything is told."""
    here = Segment(periods, time, x, v, 0.0, 0.0, 0.0, FLIGHT, NOTHING, 0.0, v, 0.0, 0.0, 0.0)
    return _segment(here, 0.0, 0.0, bodies)


@compiled
def is_joined(mode: float) -> bool:
    """Whether a free mass moves with the primary, or about the centre that the tail has."""
    return mode in (STICKING, TAIL)


@declared.begin.of(Several)
def begin(model: Several, segment: SeveralSegment) -> Start:
    """What the motion in a segment follows from; see `damper.engine.model.begin`."""
    s = segment
    joined, pull, carried = 0.0, 0.0, 0.0
    for k in range(len(s.bodies)):
        b = s.bodies[k]
        if is_joined(b[MODE]):
            ratio = float(model.masses[k, RATIO])
            joined += ratio
            pull += ratio * float(model.masses[k, GRAVITY])
            if b[MODE] == TAIL:
                carried += float(b[SIDE]) * ratio * float(b[RATE])
    osc = primary_with(model, joined, pull)
    phase = phase_at(osc.forcing, s.periods, s.time)
    primary = motion_from(osc, s.x, s.v - carried / (1.0 + joined), phase)
    return Start(osc, joined, _lifting(model.mass, model, s, osc, primary))


@by_class
def _lifting(mass: Any, model: Any, s: Any, osc: Any, primary: Motion) -> Motion:
    """The primary's motion, with the very acceleration of a mass that leaves it just now."""


@_lifting.of(Ballistic)
def _lifting_ballistic(mass, model, s, osc, primary):
    for k in range(len(s.bodies)):
        b = s.bodies[k]
        if b[COMPLETION] == _LIFTS:
            a = 0.0 - float(model.masses[k, GRAVITY])
            return motion_at_release(osc, primary.x, primary.v, a, primary.phase)
    return primary


@_lifting.of(Oscillator)
def _lifting_driven(mass, model, s, osc, primary):
    return primary


@declared.initial_segment.of(Several)
def _initial_segment(model, periods, time, x, v, y, u):
    count = len(model.masses)
    bodies = np.zeros((count, _BODY))
    for k in range(count):
        clearance = float(model.masses[k, CLEARANCE])
        place, speed = float(y[k]), float(u[k])
        side = 1.0 if place - x >= 0.0 else -1.0
        gap = clearance - side * (place - x)
        bodies[k, GAP] = 0.0 if gap <= slack(clearance, x, place) else gap
        bodies[k, RATE] = -side * (speed - v)
        bodies[k, SIDE] = side
        bodies[k, MODE] = FLIGHT
        bodies[k, CAUSE] = NOTHING
    _settle(model, _at(model, periods, time, x, v, bodies), STICKING)
    return _told(_at(model, periods, time, x, v, bodies), v, 0.0)


@declared.mass_ratio_at.of(Several)
def _mass_ratio_at(model, periods, time):
    return model.mass_ratio


@compiled
def restitution_of(model: Several, k: int, side: float) -> float:
    """Coefficient of restitution of a body at one of its walls."""
    return float(model.masses[k, LEFT if side < 0.0 else RIGHT])


@declared.speeds_in_tail.of(Several)
def _speeds_in_tail(model, segment):
    return segment.gap_rate, restitution_of(model, int(segment.body), segment.side)


# --- simultaneous contacts


@compiled
def balance(free: float, sides: np.ndarray, ratios: np.ndarray, levels: np.ndarray) -> np.ndarray:
    """Contacts that push, of those at the walls `sides`; a wall of 0 is none.

    Body i pushes with ratio_i (rests_i - side_i z) where that is positive, and all together make
    z = free + sum of side_i times that. For impulses z is the change of the primary's velocity
    and levels (1 + r) times the approach speed; for contact forces they are accelerations. What z
    must be less than this grows with z, in straight pieces from bend to bend, so there is one z.
    """
    lower, upper = -math.inf, math.inf
    count = len(sides)
    for k in range(count):
        if sides[k] != 0.0:
            z = float(sides[k] * levels[k])
            excess = z - free
            for i in range(count):
                if sides[i] != 0.0:
                    excess -= float(sides[i] * ratios[i] * max(0.0, levels[i] - sides[i] * z))
            if excess <= 0.0:
                lower = max(lower, z)
            if excess >= 0.0:
                upper = min(upper, z)
    pushes = np.zeros(count)
    for k in range(count):
        z = float(sides[k] * levels[k])
        if (sides[k] > 0.0 and z >= upper) or (sides[k] < 0.0 and z <= lower):
            pushes[k] = 1.0
    return pushes


@compiled
def balanced(
    free: float, sides: np.ndarray, ratios: np.ndarray, levels: np.ndarray, pushes: np.ndarray
) -> float:
    """The z of `balance`, where it is known who pushes."""
    z, heavier = free, 1.0
    for k in range(len(sides)):
        if pushes[k] == 1.0:
            z += float(sides[k] * ratios[k] * levels[k])
            heavier += float(ratios[k])
    return z / heavier


@compiled
def _hit(model, v, bodies, arriving):
    """Impacts of one instant, in place; the primary's velocity after them, the energy lost.

    `arriving` has the wall at which each body arrives, or 0; its rate is that at its own wall.
    """
    count = len(bodies)
    ratios, sides, levels = model.masses[:, RATIO], np.zeros(count), np.zeros(count)
    for k in range(count):
        b = bodies[k]
        if arriving[k] != 0.0:
            speed = abs(float(b[RATE]))
            if b[SIDE] != arriving[k]:
                b[FIRST] = 0.0
            b[GAP], b[SIDE], b[SPEED] = 0.0, arriving[k], speed
            sides[k] = b[SIDE]
            levels[k] = (1.0 + restitution_of(model, k, float(b[SIDE]))) * speed
        elif b[MODE] == STICKING:
            sides[k] = b[SIDE]
    pushes = balance(0.0, sides, ratios, levels)
    change, loss = balanced(0.0, sides, ratios, levels, pushes), 0.0
    for k in range(count):
        b = bodies[k]
        if arriving[k] != 0.0:
            r, speed = restitution_of(model, k, float(b[SIDE])), float(b[SPEED])
            if pushes[k] == 1.0:
                impulse = float(ratios[k] * (levels[k] - sides[k] * change))
                loss += 0.5 * impulse * (1.0 - r) * speed
                b[RATE], b[CAUSE] = r * speed, IMPACT
                b[FIRST] = b[FIRST] if b[FIRST] > 0.0 else speed
            else:  # another one's impact takes the wall away
                b[RATE], b[SPEED] = sides[k] * change - speed, 0.0
        elif b[MODE] == STICKING:
            if pushes[k] == 0.0 and b[SIDE] * change > 0.0:
                b[MODE], b[RATE], b[CAUSE], b[FIRST] = FLIGHT, b[SIDE] * change, RELEASE, 0.0
        else:
            b[RATE] += b[SIDE] * change
    return v + change, loss


@compiled
def _settle(model, s, mode):
    """Who stays on a wall and who leaves, of those with no relative velocity there; in place.

    Who stays that has not stuck before gets this mode. Only what is more than roundoff throws one
    off that has.
    """
    bodies, masses = s.bodies, model.masses
    count = len(bodies)
    sides, levels = np.zeros(count), np.zeros(count)
    phase = phase_at(model.free.forcing, s.periods, s.time)
    any_rests = False
    for k in range(count):
        b = bodies[k]
        if b[MODE] == STICKING or (b[GAP] == 0.0 and b[RATE] == 0.0 and b[CAUSE] != RELEASE):
            any_rests = True
            sides[k] = b[SIDE]
            y = s.x + b[SIDE] * masses[k, CLEARANCE]
            levels[k] = b[SIDE] * acceleration_of(mass_of(model, k), y, s.v, phase)
    if not any_rests:
        return
    alone = motion_from(model.free, s.x, s.v, phase)
    ratios = masses[:, RATIO]
    pushes = balance(alone.a, sides, ratios, levels)
    a = balanced(alone.a, sides, ratios, levels, pushes)
    size = abs(alone.a) + abs(s.x) + 2.0 * model.free.damping * abs(s.v)
    for k in range(count):
        b = bodies[k]
        if sides[k] == 0.0:
            continue
        force = levels[k] - sides[k] * a
        if b[MODE] == STICKING:
            if b[CAUSE] != STICK and force < -VANISHES * ROUNDOFF * (size + abs(levels[k])):
                b[MODE], b[CAUSE], b[FIRST] = FLIGHT, RELEASE, 0.0
        elif force >= 0.0:
            b[MODE] = mode
            b[COMPLETION] = 0.0
            if mode == STICKING:
                b[CAUSE] = STICK


# --- what follows


@declared.following.of(Several)
def _following(model, segment, start):
    s = segment
    tail = -1
    for k in range(len(s.bodies)):
        if s.bodies[k, CAUSE] != NOTHING:
            return Step(0.0, True, False, 1, _told(s, s.v_before, 0.0), start)
        if s.bodies[k, MODE] == TAIL:
            tail = k
    if tail >= 0:
        return _complete(model, s, start, float(s.bodies[tail, COMPLETION]))
    return _fly(model, s, start)


@compiled
def _moved(model, s, start, tau, arriving):
    """Where all are after a time: clock, state of the primary, bodies.

    `arriving` gets the walls that bodies are at by then, beside those that it has.
    """
    p = start.primary
    if tau == HORIZON:
        x, v = arrive(start.osc, p, tau)
        way, change = (x - p.x) - p.v * tau, v - p.v
    else:
        way, change, _ = increments(start.osc, p, tau)
        x, v = p.x + (p.v * tau + way), p.v + change
    bodies = s.bodies.copy()
    for k in range(len(bodies)):
        b = bodies[k]
        b[SPEED] = 0.0
        if is_joined(b[MODE]):
            continue
        seg = segment_of(s, start, k)
        view = view_of(model, start, k, 0.0, seg.side)
        own = flight_of(view.mass, start, view, seg)
        gap, rate, roundoff = gap_after(own, view, seg, way, change, tau)
        width = 2.0 * view.clearance
        if arriving[k] == 0.0:
            if gap <= _TOGETHER * roundoff and rate < 0.0:
                arriving[k] = seg.side
            elif width - gap <= _TOGETHER * (roundoff + ROUNDOFF * width) and rate > 0.0:
                arriving[k] = -seg.side
        b[GAP], b[RATE], b[COMPLETION] = min(max(gap, 0.0), width), rate, 0.0
    periods, time = clock_after(model.cycle, s.periods, s.time, tau)
    return periods, time, x, v, bodies


@compiled
def _complete(model, s, start, tau):
    """The end of a tail: all that it holds stick."""
    arriving = np.zeros(len(s.bodies))
    periods, time, x, v, bodies = _moved(model, s, start, tau, arriving)
    for k in range(len(bodies)):
        b = bodies[k]
        if b[MODE] == TAIL:
            b[MODE], b[CAUSE] = STICKING, STICK
            b[GAP], b[RATE], b[FIRST], b[COMPLETION] = 0.0, 0.0, 0.0, 0.0
    new = _at(model, periods, time, x, v, bodies)
    _settle(model, new, TAIL)
    new = _told(new, v, 0.0)
    return Step(tau, True, False, 1, new, begin(model, new))


class _Next(NamedTuple):
    """The first that happens to a body."""

    tau: float
    side: float
    """Of the search."""
    steps: int


@compiled
def _next(model, s, start, k, last, margin):
    """When a body arrives at a wall, or within a margin of it, or is released; up to a time."""
    seg = segment_of(s, start, k)
    view = view_of(model, start, k, 0.0, seg.side)
    if seg.mode == STICKING:
        force = ContactForce(start.osc, view.mass, start.primary, seg.side)
        here = force_point(force, 0.0, 0.0, start.primary)
        largest = max(abs(here.value), abs(here.slope), abs(here.second), abs(here.third))
        if rests(here) or (here.growth == 0.0 and largest <= here.roundoff):
            # All hang at rest: what is left of a force that others' weights do not let vanish.
            return _Next(last, 0.0, 1)
        lifts_off = here.value == 0.0 and here.slope == 0.0 and here.second == 0.0
        root = first_root(force, here, math.inf, lifts_off, last, 0.0)
    else:
        g = gap_of(flight_of(view.mass, start, view, seg), view, seg, 1.0)
        moving = WeightedSum(
            g.value - margin, g.slope, g.acceleration, g.longest, g.rate, g.coupling, g.terms
        )
        here = start_point(moving)
        lifts_off = seg.gap == 0.0 and seg.gap_rate == 0.0 and here.second == 0.0
        root = first_root(moving, here, 2.0 * (view.clearance - margin), lifts_off, last, 0.0)
    return _Next(root.point.tau + root.step, root.side, root.steps)


@compiled
def _fly(model, s, start):
    """Go to the first impact or release of all."""
    count = len(s.bodies)
    limit = min(HORIZON, horizon(start.osc.forcing, start.primary.phase))
    last, first, side, steps, gave_up = limit, -1, 0.0, 1, False
    for k in range(count):
        found = _next(model, s, start, k, last, 0.0)
        steps += found.steps
        gave_up = gave_up or found.side == GAVE_UP
        if abs(found.side) == 1.0 and found.tau <= last and (first < 0 or found.tau < last):
            last, first, side = found.tau, k, found.side
    arriving = np.zeros(count)
    hits = first >= 0 and s.bodies[first, MODE] == FLIGHT
    if hits:
        arriving[first] = side * s.bodies[first, SIDE]
    periods, time, x, v, bodies = _moved(model, s, start, last, arriving)
    if first >= 0 and not hits:
        _release(model, bodies, first)
    v_before, loss = v, 0.0
    hits = bool(np.any(arriving != 0.0))
    if hits:
        v, loss = _hit(model, v, bodies, arriving)
    if hits or first < 0:
        _settle(model, _at(model, periods, time, x, v, bodies), TAIL)
    if hits:
        v = _close(model, _at(model, periods, time, x, v, bodies))
    new = _told(_at(model, periods, time, x, v, bodies), v_before, loss)
    happened = new.cause != NOTHING
    return Step(last, happened, gave_up, steps, new, begin(model, new))


@compiled
def _release(model, bodies, k):
    """Let a mass leave its wall with all whose contact forces vanish with its own; in place."""
    for j in range(len(bodies)):
        alike = bodies[j, SIDE] == bodies[k, SIDE]
        alike = alike and model.masses[j, GRAVITY] == model.masses[k, GRAVITY]
        if bodies[j, MODE] == STICKING and alike:
            bodies[j, CAUSE] = RELEASE
    for j in range(len(bodies)):
        if bodies[j, CAUSE] == RELEASE:
            bodies[j, MODE], bodies[j, COMPLETION] = FLIGHT, _LIFTS


# --- the closed rest of complete chatter sequences


@compiled
def _close(model, s):
    """Close the chatter sequences that complete before anything else happens; in place.

    A sequence that has less than the tolerance left is at its end whatever the others do: masses
    that chatter on one wall kick each other off it, and come to rest at one instant. Returned is
    the primary's velocity.
    """
    bodies = s.bodies
    start = begin(model, s)
    v = s.v
    for k in range(len(bodies)):
        b = bodies[k]
        at_wall = b[MODE] == FLIGHT and b[GAP] == 0.0 and b[RATE] > 0.0
        if not at_wall or b[CAUSE] == NOTHING:
            continue
        ratio = _chattering_with(model, bodies, k)
        seg = segment_of(s, start, k)
        view = view_of(model, start, k, ratio, seg.side)
        own = flight_of(view.mass, start, view, seg)
        left, error = completes(view, view.mass_ratio, seg, own)
        # The next bounce must turn before the other wall; a constant force lets it rise this high.
        r = restitution_of(model, k, seg.side)
        rise = 0.25 * seg.gap_rate * left * (1.0 - r)
        if not (error <= model.tolerance and rise <= view.clearance):
            continue
        if left <= _NOTHING_LEFT * model.tolerance:
            ratio = float(model.masses[k, RATIO])
            change = -seg.side * ratio / (1.0 + start.joined + ratio) * seg.gap_rate
            v += change
            was_kicked = b[CAUSE] == RELEASE
            b[RATE], b[COMPLETION] = 0.0, 0.0
            b[MODE] = STICKING if was_kicked else TAIL
            b[CAUSE] = NOTHING if was_kicked else b[CAUSE]
            for j in range(len(bodies)):
                if bodies[j, MODE] == FLIGHT:
                    bodies[j, RATE] += bodies[j, SIDE] * change
        elif b[CAUSE] == IMPACT and _is_undisturbed(model, s, start, k, ratio, left, rise):
            for j in range(len(bodies)):
                if _chatters_with(model, bodies, k, j):
                    bodies[j, MODE] = TAIL
                    bodies[j, COMPLETION] = left
            return v
    return v


@compiled
def _chatters_with(model, bodies, k, j):
    """Whether two bodies chatter as one: what they do at a wall is the same number by number."""
    b, c = bodies[k], bodies[j]
    side = float(b[SIDE])
    return (
        c[CAUSE] == IMPACT
        and c[SIDE] == side
        and c[RATE] == b[RATE]
        and model.masses[j, GRAVITY] == model.masses[k, GRAVITY]
        and restitution_of(model, j, side) == restitution_of(model, k, side)
    )


@compiled
def _chattering_with(model, bodies, k):
    """Mass ratio of all that chatter as one with a body."""
    ratio = float(model.masses[k, RATIO])
    for j in range(len(bodies)):
        if j != k and _chatters_with(model, bodies, k, j):
            ratio += float(model.masses[j, RATIO])
    return ratio


@compiled
def _is_undisturbed(model, s, start, k, ratio, left, rise):
    """Whether nothing happens to any other body while the sequence of one completes."""
    bodies = s.bodies
    joined = start.joined + ratio
    side = float(bodies[k, SIDE])
    pull = ratio * float(model.masses[k, GRAVITY])
    for j in range(len(bodies)):
        if bodies[j, MODE] == STICKING:
            pull += float(model.masses[j, RATIO] * model.masses[j, GRAVITY])
    osc = primary_with(model, joined, pull)
    v = s.v - side * ratio / (1.0 + joined) * float(bodies[k, RATE])
    together = Start(osc, joined, motion_from(osc, s.x, v, start.primary.phase))
    # Bounces carry the primary this far from the centre, at most; twice that to be sure.
    margin = 2.0 * ratio / (1.0 + joined) * rise
    for j in range(len(bodies)):
        b = bodies[j]
        if j == k or _chatters_with(model, bodies, k, j):
            continue
        flies = b[MODE] == FLIGHT
        width = 2.0 * float(model.masses[j, CLEARANCE])
        near = flies and not margin < b[GAP] < width - margin
        if near or (b[MODE] == STICKING and b[SIDE] == side) or b[MODE] == TAIL:
            return False
        # Between impacts a contact force is what it is without the mass that bounces.
        found = _next(model, s, together if flies else start, j, left, margin if flies else 0.0)
        if found.side != 0.0 and found.tau <= left:
            return False
    return True


# --- the motion in a segment


@declared.state_in.of(Several)
def state_in(model: Several, segment: SeveralSegment, tau: float) -> tuple:
    """As `damper.engine.model.state_in`, with arrays of the free masses' states."""
    x, v, bodies = bodies_in(model, segment, tau)
    count = len(bodies)
    y, u = np.empty(count), np.empty(count)
    for k in range(count):
        side = float(bodies[k, SIDE])
        y[k] = x + side * (float(model.masses[k, CLEARANCE]) - float(bodies[k, GAP]))
        u[k] = v - side * float(bodies[k, RATE])
    return x, v, y, u


@compiled
def bodies_in(model: Several, s: SeveralSegment, tau: float) -> tuple[float, float, np.ndarray]:
    """State of the primary and of all bodies a time `tau` after a segment's start."""
    start = begin(model, s)
    _, _, x, v, bodies = _moved(model, s, start, tau, np.zeros(len(s.bodies)))
    carried, change = 0.0, 0.0
    for k in range(len(bodies)):
        b = bodies[k]
        if b[MODE] == TAIL and b[RATE] > 0.0:
            # The centre follows the sticking flow; the bounces go on about it.
            side = float(b[SIDE])
            r = restitution_of(model, k, side)
            gap, rate = bounce_at(r, float(b[COMPLETION]), float(b[RATE]), tau)
            share = side * float(model.masses[k, RATIO]) / (1.0 + start.joined)
            carried += share * gap
            change += share * rate
            b[GAP], b[RATE] = gap, rate
        elif is_joined(b[MODE]):
            b[GAP], b[RATE] = 0.0, 0.0
    for k in range(len(bodies)):
        b = bodies[k]
        if not is_joined(b[MODE]):
            b[GAP] += b[SIDE] * carried
            b[RATE] += b[SIDE] * change
    return x + carried, v + change, bodies


@declared.masses_at.of(Several)
def _masses_at(model, segment, tau, masses):
    s = segment
    x, v, bodies = s.x, s.v, s.bodies
    if tau >= 0.0:
        x, v, bodies = bodies_in(model, s, tau)
    for k in range(len(bodies)):
        b = bodies[k]
        side = float(b[SIDE])
        masses[k, 0] = x + side * (float(model.masses[k, CLEARANCE]) - float(b[GAP]))
        # What is not hit goes on as it was; what sticks, with the primary.
        masses[k, 1] = v - side * float(b[RATE])
        masses[k, 2] = float(s.bodies[k, MODE])
        if tau == declared.BEFORE:
            told = k == int(s.body) and s.cause == IMPACT
            if told or b[CAUSE] == IMPACT:
                masses[k, 1] = s.v_before + side * (s.speed if told else float(b[SPEED]))
                masses[k, 2] = FLIGHT
            elif b[MODE] == STICKING:
                masses[k, 1] = s.v_before
    return x, s.v_before if tau == declared.BEFORE else v


@declared.motion.of(Several)
def _motion(model, segment, tau):
    x, v, bodies = bodies_in(model, segment, tau)
    b = bodies[int(segment.body)]
    return x, v, float(b[GAP]), float(b[RATE])


# What deviations become is a part of this model; it needs all that is above.
from damper.models.several import sensitivity, tangent  # noqa: E402, F401

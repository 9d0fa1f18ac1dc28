"""The motion of several free masses in a segment."""

from typing import NamedTuple

import numpy as np

from damper.engine import model as declared
from damper.engine.compiled import compiled
from damper.engine.oscillator import arrive, increments
from damper.engine.search import HORIZON, ROUNDOFF
from damper.engine.segment import FLIGHT, RESTING, TAIL, clock_after
from damper.engine.tuples import changed
from damper.models.flights import Bounce, bounce_at, bounce_from
from damper.models.friction import SLIP_DIRECTION, is_joined
from damper.models.many import (
    ACCUMULATION,
    GAP,
    MODE,
    RATE,
    SIDE,
    SPEED,
    MassesSegment,
    before_event,
)
from damper.models.several.bodies import (
    ALONE,
    ARRIVES,
    CLEARANCE,
    JOINED,
    PLACE,
    PREVIOUS_STATE,
    RATIO,
    VELOCITY,
    MassState,
    Several,
    Start,
    begin,
    body_in,
    flight_of,
    flight_of_body,
    fly_alone,
    gap_after,
    mass_at,
    put_body,
    segment_of,
    single_mass_view,
)
from damper.models.several.log import segment_of_all
from damper.models.several.pinch import is_pinched
from damper.models.wall_laws import restitution_of

#: Roundoffs of a gap within which an approaching mass is at the wall together with another.
_TOGETHER = 4.0


class Moved(NamedTuple):
    """Motion of the primary over a time."""

    x: float
    v: float
    """Where it is then."""
    way: float
    change: float
    """Increments of displacement and velocity."""


@compiled
def primary_after(start: Start, tau: float) -> tuple[float, float, float, float]:
    """Where the primary is after a time, and its increments; in a tail the centre's."""
    p = start.primary
    if tau == HORIZON:
        x, v = arrive(start.osc, p, tau)
        return x, v, (x - p.x) - p.v * tau, v - p.v
    way, change, _ = increments(start.osc, p, tau)
    return p.x + (p.v * tau + way), p.v + change, way, change


@compiled
def all_after(
    model: Several, s: MassesSegment, start: Start, tau: float, first: int, wall: float
) -> tuple[float, float, float, float, np.ndarray]:
    """Where all are after a time: clock, state of the primary, bodies.

    The body `first` arrives at a wall then, or none if that is -1; others may be at walls with it.
    """
    x, v, way, change = primary_after(start, tau)
    bodies = s.bodies.copy()
    for k in range(len(bodies)):
        m, b = mass_at(model, k), body_in(bodies, k)
        if is_joined(b.mode):
            bodies[k, SPEED], bodies[k, ARRIVES] = 0.0, 0.0
            bodies[k, PREVIOUS_STATE], bodies[k, ALONE] = JOINED, 0.0
            continue
        moved = Moved(x, v, way, change)
        put_body(bodies, k, _body_after(model.single, m, b, start, moved, tau))
        if k == first:
            bodies[k, ARRIVES] = wall
    periods, time = clock_after(model.cycle, s.periods, s.time, tau)
    return periods, time, x, v, bodies


@compiled
def _body_after(single, m, b, start, moved, tau):
    """State of a mass in flight after a time; it may be at a wall then."""
    seg, view, own = flight_of_body(single, m, b, start)
    gap, rate, roundoff = gap_after(own, view, seg, moved.way, moved.change, tau)
    width = 2.0 * m.clearance
    place, velocity = b.place, b.velocity
    if b.alone == 0.0:
        place = start.primary.x + b.side * (m.clearance - b.gap)
        velocity = start.v - b.side * b.rate
    place, velocity, alone = fly_alone(view.mass, place, velocity, b.alone, tau)
    if b.alone >= HORIZON and alone > 0.0:
        # As increments its roundoff would add up.
        gap = m.clearance - b.side * (place - moved.x)
        rate = b.side * (moved.v - velocity)
    arrives = 0.0
    if gap <= _TOGETHER * roundoff and rate < 0.0:
        arrives = b.side
    elif width - gap <= _TOGETHER * (roundoff + ROUNDOFF * width) and rate > 0.0:
        arrives = -b.side
    gap = min(max(gap, 0.0), width)
    return _later(b, gap, rate, 0.0, 0.0, b.slip, place, velocity, alone, arrives)


_later = changed(
    MassState,
    *("gap", "rate", "speed", "accumulation", "previous", "place", "velocity", "alone", "arrives"),
)


@declared.state_in.of(Several)
def state_in(model: Several, segment: MassesSegment, tau: float) -> tuple:
    """As `damper.engine.model.state_in`, with arrays of the free masses' states."""
    x, v, bodies = bodies_in(model, segment, tau)
    count = len(bodies)
    y, u = np.empty(count), np.empty(count)
    for k in range(count):
        side = float(bodies[k, SIDE])
        y[k] = x + side * (float(model.masses[k, CLEARANCE]) - float(bodies[k, GAP]))
        u[k] = v - side * float(bodies[k, RATE])
        if bodies[k, ALONE] > 0.0:
            y[k], u[k] = bodies[k, PLACE], bodies[k, VELOCITY]
    return x, v, y, u


@compiled
def bodies_in(model: Several, s: MassesSegment, tau: float) -> tuple[float, float, np.ndarray]:
    """State of the primary and of all bodies a time `tau` after a segment's start."""
    start = begin(model, s)
    _, _, x, v, bodies = all_after(model, s, start, tau, -1, 0.0)
    carried, change = 0.0, 0.0
    pinched = is_pinched(bodies)
    for k in range(len(bodies)):
        b = bodies[k]
        if b[MODE] == TAIL and pinched:
            # Gap and speed fade away in no time, those of the masses that have some.
            accumulation = float(b[ACCUMULATION])
            left = max(1.0 + tau / accumulation, 0.0) if accumulation < 0.0 else 0.0
            b[GAP], b[RATE] = b[GAP] * left, b[RATE] * left
            change += float(b[SIDE] * model.masses[k, RATIO] * b[RATE]) / (1.0 + start.joined)
        elif b[MODE] == TAIL and b[RATE] > 0.0:
            # The centre follows the sticking flow; the bounces go on about it.
            side = float(b[SIDE])
            bounce = bounce_in(model, s, k)
            gap, rate = bounce_at(bounce, float(b[ACCUMULATION]), float(b[RATE]), tau)
            share = side * float(model.masses[k, RATIO]) / (1.0 + start.joined)
            carried += share * gap
            change += share * rate
            b[GAP], b[RATE] = gap, rate
        elif is_joined(b[MODE]) and b[MODE] != RESTING:
            b[GAP], b[RATE] = 0.0, 0.0
    for k in range(len(bodies)):
        b = bodies[k]
        if not is_joined(b[MODE]):
            b[GAP] += b[SIDE] * carried
            b[RATE] += b[SIDE] * change
    return x + carried, v + change, bodies


@compiled
def bounce_in(model: Several, s: MassesSegment, k: int) -> Bounce:
    """How a body bounces in a tail: as in the flight that has begun there."""
    m = mass_at(model, k)
    if m.friction == 0.0:
        # As fast back as out, whatever presses it.
        return Bounce(1.0, 1.0, restitution_of(m, float(s.bodies[k, SIDE])))
    bodies, ratio = s.bodies.copy(), 0.0
    for j in range(len(bodies)):
        if bodies[j, MODE] == TAIL:
            ratio += float(model.masses[j, RATIO])
            bodies[j, MODE], bodies[j, SLIP_DIRECTION] = FLIGHT, -bodies[j, SIDE]
    flight = segment_of_all(s.periods, s.time, s.x, s.v, bodies)
    start = begin(model, flight)
    seg = segment_of(body_in(bodies, k), start)
    view = single_mass_view(model.single, m, start, ratio, seg.side, -seg.side)
    own = flight_of(view.mass, start, view, seg)
    return bounce_from(own, view, seg, m.friction)


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
        u, mode = v - side * float(b[RATE]), float(s.bodies[k, MODE])
        if tau == declared.BEFORE:
            u, mode = before_event(s, k, mode, s.v_before, u)
        masses[k, 1], masses[k, 2] = u, mode
    return x, s.v_before if tau == declared.BEFORE else v


@declared.motion.of(Several)
def _motion(model, segment, tau):
    x, v, bodies = bodies_in(model, segment, tau)
    b = bodies[int(segment.body)]
    return x, v, float(b[GAP]), float(b[RATE])

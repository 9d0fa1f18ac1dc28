"""Simultaneous contacts of several free masses: impacts, and who stays on a wall and who leaves."""

import math
from typing import NamedTuple

import numpy as np

from damper.engine.compiled import compiled
from damper.engine.forcing import phase_at
from damper.engine.impact import restitution_at
from damper.engine.oscillator import motion_from
from damper.engine.search import ROUNDOFF
from damper.engine.segment import (
    FLIGHT,
    IMPACT,
    NOTHING,
    RELEASE,
    REST,
    RESTING,
    SLIP,
    STICKING,
)
from damper.models.flights import VANISHES
from damper.models.friction import SLIP_DIRECTION, is_joined, rest_or_part, turn
from damper.models.many import (
    ACCUMULATION,
    CAUSE,
    FIRST,
    GAP,
    LIFTS,
    MODE,
    RATE,
    SIDE,
    SPEED,
    MassesSegment,
    negligible,
)
from damper.models.several.bodies import (
    FOLLOWS,
    LEVEL,
    MOST,
    RATIO,
    WALL,
    Several,
    body_in,
    friction_of,
    mass_at,
    own_acceleration,
)
from damper.models.wall_laws import law_of


@compiled
def limits(wall: float, most: float) -> tuple[float, float]:
    """Least and largest acceleration beyond its own that friction and a wall give a mass.

    At an impact the limits are those of a velocity. A `wall` of 0 is none.
    """
    return -math.inf if wall > 0.0 else -most, math.inf if wall < 0.0 else most


@compiled
def balance(free: float, masses: np.ndarray, bodies: np.ndarray) -> float:
    """Motion z of the primary with all masses that walls and friction let follow it.

    Mass i follows where z - level_i is within its `limits`, and is at the nearer limit elsewhere:

        z = free - sum of ratio_i min(max(z - level_i, low_i), high_i)

    The sides part monotonically, in straight pieces from bend to bend, so there is one z. For
    impulses z is the change of the primary's velocity, and a level is that of a mass that rebounds;
    for contact forces and friction they are accelerations. Columns of `bodies` have level, wall
    and largest friction; `FOLLOWS` becomes 1 for a mass that follows, else 0. A mass without wall
    and friction never does.
    """
    lower, upper = -math.inf, math.inf
    for k in range(len(bodies)):
        low, high = limits(float(bodies[k, WALL]), float(bodies[k, MOST]))
        if low < high:
            level = float(bodies[k, LEVEL])
            lower, upper = _between(free, masses, bodies, level + low, lower, upper)
            lower, upper = _between(free, masses, bodies, level + high, lower, upper)
    z, heavier = free, 1.0
    for k in range(len(bodies)):
        low, high = limits(float(bodies[k, WALL]), float(bodies[k, MOST]))
        bodies[k, FOLLOWS] = 0.0
        if low == high:
            continue
        ratio, level = float(masses[k, RATIO]), float(bodies[k, LEVEL])
        if level + high <= lower:
            z -= ratio * high
        elif level + low >= upper:
            z -= ratio * low
        else:
            z += ratio * level
            heavier += ratio
        # A mass at its very limit follows as well: its impulse is zero.
        if level + high >= upper and level + low <= lower:
            bodies[k, FOLLOWS] = 1.0
    return z / heavier


@compiled
def _between(free, masses, bodies, bend, lower, upper):
    """Bounds on the root of `balance`, the nearer ones where a bend is one."""
    if math.isinf(bend):
        return lower, upper
    excess = bend - free
    for i in range(len(bodies)):
        low, high = limits(float(bodies[i, WALL]), float(bodies[i, MOST]))
        if low < high:
            asked = min(max(bend - float(bodies[i, LEVEL]), low), high)
            excess += float(masses[i, RATIO]) * asked
    if excess <= 0.0:
        lower = max(lower, bend)
    if excess >= 0.0:
        upper = min(upper, bend)
    return lower, upper


@compiled
def hit(model: Several, v: float, bodies: np.ndarray) -> tuple[float, float]:
    """Impacts of one instant, in place; the primary's velocity after them, the energy lost.

    The rate of a body that arrives is that at its own wall. Bodies that touch a wall with no
    relative velocity take part, whether or not they stick to it.
    """
    count, masses = len(bodies), model.masses
    for k in range(count):
        m, b = mass_at(model, k), body_in(bodies, k)
        wall, level = 0.0, 0.0
        if b.arrives != 0.0:
            wall, speed = b.arrives, abs(b.rate)
            if b.side != wall:
                bodies[k, FIRST] = 0.0
            bodies[k, GAP], bodies[k, SIDE], bodies[k, SPEED] = 0.0, wall, speed
            level = wall * (1.0 + restitution_at(law_of(model.single, m, wall), speed)) * speed
        elif b.mode == STICKING or (b.gap == 0.0 and b.rate == 0.0):
            wall = b.side
        bodies[k, WALL], bodies[k, LEVEL], bodies[k, MOST] = wall, level, 0.0
    change = balance(0.0, masses, bodies)
    loss = 0.0
    for k in range(count):
        m, b = mass_at(model, k), body_in(bodies, k)
        follows = bodies[k, FOLLOWS] == 1.0
        if b.arrives != 0.0:
            if follows:
                r = restitution_at(law_of(model.single, m, b.side), b.speed)
                impulse = m.ratio * b.arrives * (float(bodies[k, LEVEL]) - change)
                loss += 0.5 * impulse * (1.0 - r) * b.speed
                bodies[k, RATE], bodies[k, CAUSE] = r * b.speed, IMPACT
                bodies[k, FIRST] = b.first if b.first > 0.0 else b.speed
            else:  # another one's impact takes the wall away
                bodies[k, RATE], bodies[k, SPEED] = b.arrives * change - b.speed, 0.0
        elif b.mode == STICKING:
            if not follows and b.side * change > 0.0:
                bodies[k, MODE], bodies[k, RATE] = FLIGHT, b.side * change
                bodies[k, CAUSE], bodies[k, FIRST] = RELEASE, 0.0
        elif not follows:
            bodies[k, RATE] = b.rate + b.side * change
    return v + change, loss


class Common(NamedTuple):
    """Forces of an instant on masses that walls or friction may hold."""

    a: float
    """Acceleration of the primary."""
    size: float
    """Size of the terms of the primary's own acceleration."""


@compiled
def common_motion(model: Several, s: MassesSegment) -> Common:
    """Balance the forces of an instant on the masses that have a wall or a largest friction.

    Other masses fly, or slide their way. The column `LEVEL` becomes the acceleration of a mass that
    nothing holds.
    """
    phase = phase_at(model.free.forcing, s.periods, s.time)
    free = motion_from(model.free, s.x, s.v, phase).a
    for k in range(len(s.bodies)):
        m, b = mass_at(model, k), body_in(s.bodies, k)
        s.bodies[k, LEVEL] = 0.0
        if s.bodies[k, WALL] != 0.0 or s.bodies[k, MOST] > 0.0:
            s.bodies[k, LEVEL] = own_acceleration(model.single, m, b, s.x, s.v, phase, 0.0)
        else:
            free += b.slip * m.ratio * m.friction
    a = balance(free, model.masses, s.bodies)
    return Common(a, abs(free) + abs(s.x) + 2.0 * model.free.damping * abs(s.v))


@compiled
def decide_contacts(model: Several, s: MassesSegment, mode: float) -> None:
    """Let masses with no relative velocity rest, or part from the primary; in place.

    Masses newly at rest on a wall get `mode`. A mass that has been at rest stays, unless the forces
    that part it are more than roundoff.
    """
    bodies = s.bodies
    count = len(bodies)
    any_rests = False
    for k in range(count):
        friction = friction_of(model, k)
        if friction > 0.0 and bodies[k, RATE] != 0.0:
            turn(bodies[k])
        b = body_in(bodies, k)
        leaves = b.cause == RELEASE or b.cause == SLIP
        wall, most = 0.0, 0.0
        if is_joined(b.mode) or (b.rate == 0.0 and not leaves):
            if b.mode == FLIGHT and friction > 0.0 and _is_beside_wall(model, s, k):
                bodies[k, GAP] = 0.0
            on_wall = bodies[k, GAP] == 0.0
            if is_joined(b.mode) or on_wall or friction > 0.0:
                any_rests = True
                wall, most = b.side if on_wall else 0.0, friction
        bodies[k, WALL], bodies[k, MOST] = wall, most
    if not any_rests:
        return
    common = common_motion(model, s)
    for k in range(count):
        level, most = float(bodies[k, LEVEL]), float(bodies[k, MOST])
        low, high = limits(float(bodies[k, WALL]), most)
        if low < high:
            asked = common.a - level
            beyond = max(low - asked, asked - high)
            way = 0.0
            if friction_of(model, k) > 0.0:
                way = -1.0 if asked > high else 1.0
            size = common.size + abs(level) + most
            rest_or_part(bodies[k], beyond, VANISHES * ROUNDOFF * size, way, mode)


@compiled
def _is_beside_wall(model, s, k):
    """Whether a mass that rubs, and stops, would be at its wall in a negligible time."""
    m, b = mass_at(model, k), body_in(s.bodies, k)
    phase = phase_at(model.free.forcing, s.periods, s.time)
    scale = abs(motion_from(model.free, s.x, s.v, phase).a) + m.friction
    scale += abs(own_acceleration(model.single, m, b, s.x, s.v, phase, 0.0))
    return 2.0 * b.gap <= scale * negligible(model.tolerance) ** 2


@compiled
def release(model: Several, s: MassesSegment, k: int, side: float) -> None:
    """Let a mass that nothing holds any longer part from the primary, or stop; in place.

    All masses under the same acceleration part, or stop, together. `side` is that of the search.
    """
    bodies, phase = s.bodies, phase_at(model.free.forcing, s.periods, s.time)
    b = body_in(bodies, k)
    stops = b.mode == FLIGHT
    way = b.slip if stops else -side * b.side
    level = own_acceleration(model.single, mass_at(model, k), b, s.x, s.v, phase, way)
    for j in range(len(bodies)):
        m, c = mass_at(model, j), body_in(bodies, j)
        if own_acceleration(model.single, m, c, s.x, s.v, phase, way) != level:
            continue
        if stops:
            if c.mode == FLIGHT and c.slip == way and c.side * c.rate == b.side * b.rate:
                bodies[j, CAUSE] = REST
        elif is_joined(c.mode) and (c.mode == RESTING or way == -c.side):
            bodies[j, CAUSE] = RELEASE if c.mode == STICKING else SLIP
            bodies[j, SLIP_DIRECTION] = way if m.friction > 0.0 else 0.0
            bodies[j, MODE], bodies[j, ACCUMULATION] = FLIGHT, LIFTS
    for j in range(len(bodies)):
        if bodies[j, CAUSE] == REST:
            bodies[j, RATE], bodies[j, CAUSE] = 0.0, NOTHING

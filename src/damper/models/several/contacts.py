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
    REVERSAL,
    SLIP,
    STICK,
    STICKING,
)
from damper.models.flights import VANISHES
from damper.models.several.bodies import (
    ARRIVES,
    CAUSE,
    COMPLETION,
    FIRST,
    FOLLOWS,
    GAP,
    LEVEL,
    LIFTS,
    MODE,
    MOST,
    RATE,
    RATIO,
    SIDE,
    SLIP_DIRECTION,
    SPEED,
    WALL,
    Several,
    SeveralSegment,
    friction_of,
    is_joined,
    law_of,
    own_acceleration,
)
from damper.models.several.pinch import NOTHING_LEFT


@compiled
def limits(wall: float, most: float) -> tuple[float, float]:
    """Least and largest acceleration beyond its own that friction and a wall give a mass.

    The same number applies to velocities at an impact. A `wall` of 0 is none.
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
        b = bodies[k]
        b[WALL], b[LEVEL], b[MOST] = 0.0, 0.0, 0.0
        if b[ARRIVES] != 0.0:
            speed = abs(float(b[RATE]))
            if b[SIDE] != b[ARRIVES]:
                b[FIRST] = 0.0
            b[GAP], b[SIDE], b[SPEED], b[WALL] = 0.0, b[ARRIVES], speed, b[ARRIVES]
            r = restitution_at(law_of(model, k, float(b[SIDE])), speed)
            b[LEVEL] = float(b[WALL]) * (1.0 + r) * speed
        elif b[MODE] == STICKING or (b[GAP] == 0.0 and b[RATE] == 0.0):
            b[WALL] = b[SIDE]
    change = balance(0.0, masses, bodies)
    loss = 0.0
    for k in range(count):
        b = bodies[k]
        if b[ARRIVES] != 0.0:
            speed = float(b[SPEED])
            r = restitution_at(law_of(model, k, float(b[SIDE])), speed)
            if b[FOLLOWS] == 1.0:
                impulse = float(masses[k, RATIO] * b[WALL] * (b[LEVEL] - change))
                loss += 0.5 * impulse * (1.0 - r) * speed
                b[RATE], b[CAUSE] = r * speed, IMPACT
                b[FIRST] = b[FIRST] if b[FIRST] > 0.0 else speed
            else:  # another one's impact takes the wall away
                b[RATE], b[SPEED] = b[WALL] * change - speed, 0.0
        elif b[MODE] == STICKING:
            if b[FOLLOWS] == 0.0 and b[SIDE] * change > 0.0:
                b[MODE], b[RATE], b[CAUSE], b[FIRST] = FLIGHT, b[SIDE] * change, RELEASE, 0.0
        elif b[FOLLOWS] == 0.0:
            b[RATE] += b[SIDE] * change
    return v + change, loss


class Common(NamedTuple):
    """Forces of an instant on masses that walls or friction may hold."""

    a: float
    """Acceleration of the primary."""
    size: float
    """Size of the terms of the primary's own acceleration."""


@compiled
def common_motion(model: Several, s: SeveralSegment) -> Common:
    """Balance the forces of an instant on the masses that have a wall or a largest friction.

    Other masses fly, or slide their way. The column `LEVEL` becomes the acceleration of a mass that
    nothing holds.
    """
    phase = phase_at(model.free.forcing, s.periods, s.time)
    free = motion_from(model.free, s.x, s.v, phase).a
    for k in range(len(s.bodies)):
        b = s.bodies[k]
        b[LEVEL] = 0.0
        if b[WALL] != 0.0 or b[MOST] > 0.0:
            b[LEVEL] = own_acceleration(model, s, k, s.v, 0.0)
        else:
            friction = friction_of(model.friction, k)
            free += float(b[SLIP_DIRECTION] * model.masses[k, RATIO]) * friction
    a = balance(free, model.masses, s.bodies)
    return Common(a, abs(free) + abs(s.x) + 2.0 * model.free.damping * abs(s.v))


@compiled
def decide_contacts(model: Several, s: SeveralSegment, mode: float) -> None:
    """Let masses with no relative velocity rest, or part from the primary; in place.

    Masses newly at rest on a wall get `mode`. A mass that has been at rest stays, unless the forces
    that part it are more than roundoff.
    """
    bodies = s.bodies
    count = len(bodies)
    _turn(model.friction, bodies)
    any_rests = False
    for k in range(count):
        b = bodies[k]
        b[WALL], b[MOST] = 0.0, 0.0
        friction, leaves = friction_of(model.friction, k), b[CAUSE] in (RELEASE, SLIP)
        if b[MODE] == FLIGHT and b[RATE] == 0.0 and not leaves and _is_beside_wall(model, s, k):
            b[GAP] = 0.0
        on_wall = b[GAP] == 0.0
        if is_joined(b[MODE]) or (b[RATE] == 0.0 and (on_wall or friction > 0.0) and not leaves):
            any_rests = True
            b[WALL] = b[SIDE] if on_wall else 0.0
            b[MOST] = friction
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
            if friction_of(model.friction, k) > 0.0:
                way = -1.0 if asked > high else 1.0
            size = common.size + abs(level) + most
            _decide(bodies[k], beyond, VANISHES * ROUNDOFF * size, way, mode)


@compiled
def _is_beside_wall(model, s, k):
    """Whether a mass that rubs, and stops, would be at its wall in a negligible time."""
    most, b = friction_of(model.friction, k), s.bodies[k]
    if most == 0.0:
        return False
    phase = phase_at(model.free.forcing, s.periods, s.time)
    scale = abs(motion_from(model.free, s.x, s.v, phase).a) + most
    scale += abs(own_acceleration(model, s, k, s.v, 0.0))
    return bool(2.0 * b[GAP] <= scale * negligible(model) ** 2)


@compiled
def negligible(model: Several) -> float:
    """Longest time that counts as none."""
    return float(NOTHING_LEFT * model.tolerance)


@compiled
def _decide(b, beyond, slack, way, mode):
    """Let a mass rest, or slide that is asked for more than what holds it; in place."""
    on_wall = b[GAP] == 0.0
    if is_joined(b[MODE]):
        if b[CAUSE] == NOTHING and beyond > slack:
            b[MODE], b[SLIP_DIRECTION] = FLIGHT, way
            b[CAUSE] = RELEASE if on_wall else SLIP
            b[FIRST] = 0.0 if on_wall else b[FIRST]
    elif beyond > 0.0:
        if b[CAUSE] == NOTHING and way != 0.0 and b[SLIP_DIRECTION] == -way:
            b[CAUSE] = REVERSAL
        b[SLIP_DIRECTION] = way
    else:
        b[MODE] = mode if on_wall else RESTING
        b[SLIP_DIRECTION], b[COMPLETION] = 0.0, 0.0
        if not on_wall:
            b[CAUSE] = REST
        elif mode == STICKING:
            b[CAUSE] = STICK


@compiled
def _turn(friction, bodies):
    """Let all that move relative to the primary slide that way; in place."""
    for k in range(len(bodies)):
        b = bodies[k]
        if b[RATE] == 0.0 or friction_of(friction, k) == 0.0:
            continue
        way = -b[SIDE] if b[RATE] > 0.0 else b[SIDE]
        if b[MODE] == RESTING:  # another one's impact moves its box
            b[MODE], b[CAUSE] = FLIGHT, SLIP
        elif b[SLIP_DIRECTION] == -way and b[CAUSE] == NOTHING:
            b[CAUSE] = REVERSAL
        b[SLIP_DIRECTION] = way


@compiled
def clamp_slides(bodies: np.ndarray) -> None:
    """Let slides go one way up to their end, whatever roundoff makes of their speed; in place."""
    for k in range(len(bodies)):
        b = bodies[k]
        if b[MODE] == FLIGHT and b[SLIP_DIRECTION] * b[SIDE] * b[RATE] > 0.0:
            b[RATE] = 0.0


@compiled
def release(model: Several, s: SeveralSegment, k: int, side: float) -> None:
    """Let a mass that nothing holds any longer part from the primary, or stop; in place.

    The same happens to all masses under the same acceleration. `side` is that of the search.
    """
    bodies = s.bodies
    b = bodies[k]
    stops, rate = b[MODE] == FLIGHT, float(b[SIDE] * b[RATE])
    way = float(b[SLIP_DIRECTION] if stops else -side * b[SIDE])
    level = own_acceleration(model, s, k, s.v, way)
    for j in range(len(bodies)):
        c = bodies[j]
        if own_acceleration(model, s, j, s.v, way) != level:
            continue
        if stops:
            if c[MODE] == FLIGHT and c[SLIP_DIRECTION] == way and c[SIDE] * c[RATE] == rate:
                c[CAUSE] = REST
        elif is_joined(c[MODE]) and (c[MODE] == RESTING or way == -c[SIDE]):
            c[CAUSE] = RELEASE if c[MODE] == STICKING else SLIP
            c[SLIP_DIRECTION] = way if friction_of(model.friction, j) > 0.0 else 0.0
            c[MODE], c[COMPLETION] = FLIGHT, LIFTS
    for j in range(len(bodies)):
        if bodies[j, CAUSE] == REST:
            bodies[j, RATE], bodies[j, CAUSE] = 0.0, NOTHING

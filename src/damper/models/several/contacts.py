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
    CAUSE,
    COMPLETION,
    FIRST,
    GAP,
    LIFTS,
    MODE,
    RATE,
    RATIO,
    SIDE,
    SLIP_DIRECTION,
    SPEED,
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
def balance(
    free: float, ratios: np.ndarray, levels: np.ndarray, walls: np.ndarray, most: np.ndarray
) -> tuple[float, np.ndarray]:
    """Motion z of the primary with all masses that walls and friction let follow it.

    Mass i follows where z - level_i is within its `limits`, and is at the nearer limit elsewhere:

        z = free - sum of ratio_i min(max(z - level_i, low_i), high_i)

    The sides part monotonically, in straight pieces from bend to bend, so there is one z. For
    impulses z is the change of the primary's velocity, and a level is that of a mass that rebounds;
    for contact forces and friction they are accelerations.

    Returns
    -------
    z : float
    follows : ndarray
        1 for a mass that follows, else 0; a mass without wall and friction never does.
    """
    lower, upper = -math.inf, math.inf
    count = len(ratios)
    for k in range(2 * count):
        low, high = limits(walls[k // 2], most[k // 2])
        bend = float(levels[k // 2] + (low if k % 2 == 0 else high))
        if low == high or math.isinf(bend):
            continue
        excess = bend - free
        for i in range(count):
            low, high = limits(walls[i], most[i])
            excess += float(ratios[i] * min(max(bend - levels[i], low), high))
        if excess <= 0.0:
            lower = max(lower, bend)
        if excess >= 0.0:
            upper = min(upper, bend)
    z, heavier, follows = free, 1.0, np.zeros(count)
    for k in range(count):
        low, high = limits(walls[k], most[k])
        if levels[k] + high <= lower:
            z -= float(ratios[k] * high)
        elif levels[k] + low >= upper:
            z -= float(ratios[k] * low)
        elif low < high:
            z += float(ratios[k] * levels[k])
            heavier += float(ratios[k])
        # A mass at its very limit follows as well: its impulse is zero.
        within = low < high and levels[k] + high >= upper and levels[k] + low <= lower
        follows[k] = 1.0 if within else 0.0
    return z / heavier, follows


@compiled
def hit(model: Several, v: float, bodies: np.ndarray, arriving: np.ndarray) -> tuple[float, float]:
    """Impacts of one instant, in place; the primary's velocity after them, the energy lost.

    `arriving` has the wall at which each body arrives, or 0; its rate is that at its own wall.
    Bodies that touch a wall with no relative velocity take part, whether or not they stick to it.
    """
    count = len(bodies)
    ratios, walls, levels = model.masses[:, RATIO], np.zeros(count), np.zeros(count)
    for k in range(count):
        b = bodies[k]
        if arriving[k] != 0.0:
            speed = abs(float(b[RATE]))
            if b[SIDE] != arriving[k]:
                b[FIRST] = 0.0
            b[GAP], b[SIDE], b[SPEED] = 0.0, arriving[k], speed
            walls[k] = b[SIDE]
            r = restitution_at(law_of(model, k, float(b[SIDE])), speed)
            levels[k] = walls[k] * (1.0 + r) * speed
        elif b[MODE] == STICKING or (b[GAP] == 0.0 and b[RATE] == 0.0):
            walls[k] = b[SIDE]
    change, pushes = balance(0.0, ratios, levels, walls, np.zeros(count))
    loss = 0.0
    for k in range(count):
        b = bodies[k]
        if arriving[k] != 0.0:
            speed = float(b[SPEED])
            r = restitution_at(law_of(model, k, float(b[SIDE])), speed)
            if pushes[k] == 1.0:
                impulse = float(ratios[k] * walls[k] * (levels[k] - change))
                loss += 0.5 * impulse * (1.0 - r) * speed
                b[RATE], b[CAUSE] = r * speed, IMPACT
                b[FIRST] = b[FIRST] if b[FIRST] > 0.0 else speed
            else:  # another one's impact takes the wall away
                b[RATE], b[SPEED] = walls[k] * change - speed, 0.0
        elif b[MODE] == STICKING:
            if pushes[k] == 0.0 and b[SIDE] * change > 0.0:
                b[MODE], b[RATE], b[CAUSE], b[FIRST] = FLIGHT, b[SIDE] * change, RELEASE, 0.0
        elif pushes[k] == 0.0:
            b[RATE] += b[SIDE] * change
    return v + change, loss


class Common(NamedTuple):
    """Forces of an instant on masses that walls or friction may hold."""

    a: float
    """Acceleration of the primary."""
    levels: np.ndarray
    """Accelerations of the masses that nothing holds; 0 for a mass that nothing may hold."""
    size: float
    """Size of the terms of the primary's own acceleration."""


@compiled
def common_motion(model: Several, s: SeveralSegment, walls: np.ndarray, most: np.ndarray) -> Common:
    """Balance the forces of an instant, as for `balance`; other masses fly, or slide their way."""
    count = len(walls)
    phase = phase_at(model.free.forcing, s.periods, s.time)
    free = motion_from(model.free, s.x, s.v, phase).a
    levels = np.zeros(count)
    for k in range(count):
        if walls[k] != 0.0 or most[k] > 0.0:
            levels[k] = own_acceleration(model, s, k, s.v, 0.0)
        else:
            friction = friction_of(model.friction, k)
            free += float(s.bodies[k, SLIP_DIRECTION] * model.masses[k, RATIO]) * friction
    a, _ = balance(free, model.masses[:, RATIO], levels, walls, most)
    return Common(a, levels, abs(free) + abs(s.x) + 2.0 * model.free.damping * abs(s.v))


@compiled
def decide_contacts(model: Several, s: SeveralSegment, mode: float) -> None:
    """Let masses with no relative velocity rest, or part from the primary; in place.

    Masses newly at rest on a wall get `mode`. A mass that has been at rest stays, unless the forces
    that part it are more than roundoff.
    """
    bodies = s.bodies
    count = len(bodies)
    _turn(model.friction, bodies)
    walls, most, any_rests = np.zeros(count), np.zeros(count), False
    for k in range(count):
        b = bodies[k]
        friction, leaves = friction_of(model.friction, k), b[CAUSE] in (RELEASE, SLIP)
        if b[MODE] == FLIGHT and b[RATE] == 0.0 and not leaves and _is_beside_wall(model, s, k):
            b[GAP] = 0.0
        on_wall = b[GAP] == 0.0
        if is_joined(b[MODE]) or (b[RATE] == 0.0 and (on_wall or friction > 0.0) and not leaves):
            any_rests = True
            walls[k] = b[SIDE] if on_wall else 0.0
            most[k] = friction
    if not any_rests:
        return
    common = common_motion(model, s, walls, most)
    for k in range(count):
        low, high = limits(walls[k], most[k])
        if low < high:
            asked = common.a - float(common.levels[k])
            beyond = max(low - asked, asked - high)
            way = 0.0
            if friction_of(model.friction, k) > 0.0:
                way = -1.0 if asked > high else 1.0
            size = common.size + abs(common.levels[k]) + most[k]
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

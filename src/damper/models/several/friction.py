"""Dry friction of several free masses: who slides and which way, who rests, and until when.

All that rest, on a wall or off it, have the primary's acceleration a. What a mass does to the
primary is a monotone function of a: what moves with it as long as friction and wall hold it, and
the largest friction beyond that. So there is one a, and with it one set of masses that rest.
"""

import math

import numpy as np

from damper.engine.bodies import acceleration_of, start_point
from damper.engine.compiled import compiled
from damper.engine.forcing import phase_at
from damper.engine.oscillator import motion_from
from damper.engine.search import GAVE_UP, ROUNDOFF, first_root
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
    TAIL,
)
from damper.models.flights import VANISHES, gap_of
from damper.models.masses.holds import Speed, speed_point
from damper.models.several.bodies import (
    CAUSE,
    COMPLETION,
    FIRST,
    GAP,
    GRAVITY,
    LIFTS,
    MODE,
    RATE,
    RATIO,
    SIDE,
    SPEED,
    WAY,
    Friction,
    friction_of,
    is_joined,
    mass_of,
    restitution_of,
)
from damper.models.several.contacts import let_go, settle, slide_on
from damper.models.several.log import segment_of_all
from damper.models.several.pinch import NOTHING_LEFT, SHORTEST
from damper.models.several.tails import (
    NextEvent,
    fade,
    first_stop,
    has_nothing_left,
    is_over,
    less,
    settle_again,
)

# --- who rests


@compiled
def common_acceleration(
    free: float, ratios: np.ndarray, levels: np.ndarray, low: np.ndarray, high: np.ndarray
) -> float:
    """Acceleration of the primary and of all that rest relative to it.

    Parameters
    ----------
    free : float
        That of the primary without them.
    ratios, levels : ndarray
        Mass ratios, and accelerations of masses that nothing holds.
    low, high : ndarray
        Least and largest acceleration that friction and a wall can give a mass beyond its level.
        Equal ones are of a mass that is not asked.

    Notes
    -----
    It solves a = free - sum of ratio min(max(a - level, low), high), whose sides part
    monotonically, in straight pieces from bend to bend.
    """
    lower, upper = -math.inf, math.inf
    count = len(ratios)
    for k in range(2 * count):
        j = k // 2
        bend = float(levels[j] + (low[j] if k % 2 == 0 else high[j]))
        if low[j] == high[j] or math.isinf(bend):
            continue
        excess = bend - free
        for i in range(count):
            excess += float(ratios[i] * min(max(bend - levels[i], low[i]), high[i]))
        if excess <= 0.0:
            lower = max(lower, bend)
        if excess >= 0.0:
            upper = min(upper, bend)
    a, heavier = free, 1.0
    for k in range(count):
        if levels[k] + high[k] <= lower:
            a -= float(ratios[k] * high[k])
        elif levels[k] + low[k] >= upper:
            a -= float(ratios[k] * low[k])
        elif low[k] < high[k]:
            a += float(ratios[k] * levels[k])
            heavier += float(ratios[k])
    return a / heavier


@settle.of(Friction)
def _settle(friction, model, s, mode):
    bodies = s.bodies
    count = len(bodies)
    _turn(friction, bodies)
    phase = phase_at(model.free.forcing, s.periods, s.time)
    free = motion_from(model.free, s.x, s.v, phase).a
    ratios, levels = model.masses[:, RATIO], np.zeros(count)
    low, high, soon = np.zeros(count), np.zeros(count), _soon(model)
    for k in range(count):
        b = bodies[k]
        most, leaves = friction_of(friction, k), b[CAUSE] in (RELEASE, SLIP)
        # One that stops is on its wall where it would be there in no time.
        scale = abs(free) + abs(float(model.masses[k, GRAVITY])) + most
        if b[MODE] == FLIGHT and b[RATE] == 0.0 and not leaves and 2.0 * b[GAP] <= scale * soon:
            b[GAP] = 0.0
        on_wall = b[GAP] == 0.0
        if is_joined(b[MODE]) or (b[RATE] == 0.0 and (on_wall or most > 0.0) and not leaves):
            levels[k] = acceleration_of(mass_of(model, k, 0.0), 0.0, 0.0, phase)
            low[k] = -math.inf if on_wall and b[SIDE] > 0.0 else -most
            high[k] = math.inf if on_wall and b[SIDE] < 0.0 else most
        else:
            free += float(b[WAY] * ratios[k]) * most
    a = common_acceleration(free, ratios, levels, low, high)
    size = abs(free) + abs(s.x) + 2.0 * model.free.damping * abs(s.v)
    for k in range(count):
        if low[k] < high[k]:
            beyond = max(low[k] - (a - levels[k]), (a - levels[k]) - high[k])
            way = -1.0 if a - levels[k] > high[k] else 1.0
            way = way if friction_of(friction, k) > 0.0 else 0.0
            slack = VANISHES * ROUNDOFF * (size + abs(levels[k]) + friction_of(friction, k))
            _decide(bodies[k], beyond, slack, way, mode)


@compiled
def _decide(b, beyond, slack, way, mode):
    """Let a mass rest, or slide that is asked for more than what holds it; in place."""
    on_wall = b[GAP] == 0.0
    if is_joined(b[MODE]):
        if b[CAUSE] == NOTHING and beyond > slack:
            b[MODE], b[WAY] = FLIGHT, way
            b[CAUSE] = RELEASE if on_wall else SLIP
            b[FIRST] = 0.0 if on_wall else b[FIRST]
    elif beyond > 0.0:
        if b[CAUSE] == NOTHING and way != 0.0 and b[WAY] == -way:
            b[CAUSE] = REVERSAL
        b[WAY] = way
    else:
        b[MODE] = mode if on_wall else RESTING
        b[WAY], b[COMPLETION] = 0.0, 0.0
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
        elif b[WAY] == -way and b[CAUSE] == NOTHING:
            b[CAUSE] = REVERSAL
        b[WAY] = way


# --- what happens next


@first_stop.of(Friction)
def _first_stop(friction, own, view, segment, way, last, slowest):
    if way == 0.0:
        return NextEvent(last, 0.0, 0, False)
    speed = Speed(less(gap_of(own, view, segment, -way * segment.side), 0.0, slowest))
    here = speed_point(speed, start_point(speed.gap))
    root = first_root(speed, here, math.inf, False, last, 0.0)
    tau = root.point.tau + root.step
    if root.side == 1.0 and tau <= last:
        return NextEvent(tau, 1.0, root.steps, True)
    return NextEvent(last, GAVE_UP if root.side == GAVE_UP else 0.0, root.steps, False)


@slide_on.of(Friction)
def _slide_on(friction, bodies):
    for k in range(len(bodies)):
        b = bodies[k]
        if b[MODE] == FLIGHT and b[WAY] * b[SIDE] * b[RATE] > 0.0:
            b[RATE] = 0.0


@let_go.of(Friction)
def _let_go(friction, model, bodies, k, side):
    b = bodies[k]
    stops, rate = b[MODE] == FLIGHT, float(b[SIDE] * b[RATE])
    way = float(b[WAY] if stops else -side * b[SIDE])
    most = _level(friction, model, k, way)
    for j in range(len(bodies)):
        c = bodies[j]
        if _level(friction, model, j, way) != most:
            continue
        if stops:
            if c[MODE] == FLIGHT and c[WAY] == way and c[SIDE] * c[RATE] == rate:
                c[CAUSE] = REST
        elif is_joined(c[MODE]) and (c[MODE] == RESTING or way == -c[SIDE]):
            c[CAUSE] = RELEASE if c[MODE] == STICKING else SLIP
            c[WAY] = way if friction_of(friction, j) > 0.0 else 0.0
            c[MODE], c[COMPLETION] = FLIGHT, LIFTS
    for j in range(len(bodies)):
        if bodies[j, CAUSE] == REST:
            bodies[j, RATE], bodies[j, CAUSE] = 0.0, NOTHING


@compiled
def _level(friction, model, k, way):
    """Acceleration of a mass that slides this way, but for what all masses have."""
    return -float(model.masses[k, GRAVITY]) - way * friction_of(friction, k)


# --- chatter


@fade.of(Friction)
def _fade(friction, model, s, start):
    fades = _fading(friction, model, s)
    if not np.any(fades):
        return False, 0.0
    return True, _stop(model, s, start, fades)


@settle_again.of(Friction)
def _settle_again(friction, model, s, v):
    # Slides may have turned round.
    settle(friction, model, segment_of_all(s.periods, s.time, s.x, v, s.bodies), TAIL)


@is_over.of(Friction)
def _is_over(friction, model, s, start, k, chatter):
    return has_nothing_left(friction, model, s, start, k, 0.0)


@compiled
def _fading(friction, model, s):
    """Which masses have all but no speed after an impact that had none either.

    Where a wall presses one only as long as others rest that each impact moves, no sequence is one
    of its own, and speeds fall without end in no time. What is left of them here is so little that
    who rests is a question of forces alone.
    """
    bodies = s.bodies
    fades = np.zeros(len(bodies))
    a = abs(motion_from(model.free, s.x, s.v, phase_at(model.free.forcing, s.periods, s.time)).a)
    any_hits = False
    for k in range(len(bodies)):
        b, most = bodies[k], friction_of(friction, k)
        least = (a + abs(float(model.masses[k, GRAVITY])) + most) * _soon(model)
        near = 2.0 * b[GAP] <= least
        if b[MODE] == FLIGHT and abs(b[RATE]) <= least and (near or most > 0.0):
            fades[k] = 1.0
            b[GAP] = 0.0 if near else b[GAP]
            any_hits = any_hits or (b[CAUSE] == IMPACT and b[SPEED] <= least)
    return fades if any_hits else np.zeros(len(bodies))


@compiled
def _stop(model, s, start, fades):
    """Take their speed from masses, in place; the change of the primary's velocity."""
    bodies = s.bodies
    heavier, pushed = 1.0 + start.joined, 0.0
    for k in range(len(bodies)):
        ratio = float(fades[k] * model.masses[k, RATIO])
        heavier += ratio
        pushed += float(bodies[k, SIDE]) * ratio * float(bodies[k, RATE])
    change = -pushed / heavier
    for k in range(len(bodies)):
        b = bodies[k]
        if fades[k] == 0.0:
            b[RATE] += b[SIDE] * change if b[MODE] == FLIGHT else 0.0
            continue
        if b[CAUSE] == IMPACT:
            # It is asked again at the end of the tail, which the others may have let go of.
            b[MODE], b[COMPLETION] = TAIL, -SHORTEST
        elif b[CAUSE] == RELEASE:
            b[MODE], b[CAUSE], b[SPEED] = STICKING, NOTHING, -b[RATE]
        elif b[CAUSE] == SLIP:
            b[MODE], b[CAUSE] = RESTING, NOTHING
        b[RATE], b[WAY] = 0.0, 0.0
    return change


@compiled
def _soon(model):
    """The square of the longest time that counts as none."""
    return (NOTHING_LEFT * model.tolerance) ** 2


@has_nothing_left.of(Friction)
def _has_nothing_left(friction, model, s, start, k, change):
    b = s.bodies[k]
    if not (b[MODE] == FLIGHT and b[GAP] == 0.0 and b[CAUSE] != NOTHING):
        return False
    side, most = float(b[SIDE]), friction_of(friction, k)
    r, rate = restitution_of(model, k, side), float(b[RATE]) + side * change
    if change != 0.0 and b[CAUSE] == IMPACT:
        r = max(rate, 0.0) / float(b[SPEED])
    # What presses on the way out and on the way back.
    joined = 1.0 + start.joined
    own = acceleration_of(mass_of(model, k, float(b[WAY])), 0.0, 0.0, start.primary.phase)
    out = side * (own - start.primary.a)
    back = out - 2.0 * (joined + float(model.masses[k, RATIO])) / joined * most
    if not back > 0.0 or r * math.sqrt(back / out) >= 1.0:
        return False
    left = abs(rate) * (1.0 / out + 1.0 / math.sqrt(out * back))
    return left <= NOTHING_LEFT * model.tolerance * (1.0 - r * math.sqrt(back / out))

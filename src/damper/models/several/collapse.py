"""Masses that lose their speed with one another in no time, each disturbed by the others' impacts.

No chatter sequence is one by itself then, and speeds fall without end.
"""

from typing import Any

import numpy as np

from damper.engine.compiled import compiled
from damper.engine.dispatch import by_class
from damper.engine.forcing import phase_at
from damper.engine.oscillator import motion_from
from damper.engine.segment import (
    FLIGHT,
    IMPACT,
    NOTHING,
    RELEASE,
    RESTING,
    SLIP,
    STICKING,
    TAIL,
)
from damper.models.masses import NoFriction
from damper.models.several.bodies import (
    CAUSE,
    COMPLETION,
    GAP,
    LEVEL,
    MODE,
    MOST,
    RATE,
    RATIO,
    SIDE,
    SLIP_DIRECTION,
    SPEED,
    WALL,
    Frictions,
    Several,
    SeveralSegment,
    Start,
    body_in,
    mass_at,
    own_acceleration,
    restitution_of,
)
from damper.models.several.contacts import common_motion, negligible
from damper.models.several.pinch import SHORTEST

#: Acceleration, in units of F0/M, beyond which none is promised: weights are up to this.
_LARGEST = 1e6


@by_class
def close_at_both_walls(
    friction: Any, model: Several, s: SeveralSegment, start: Start
) -> tuple[bool, float]:
    """Close what masses do with one another in no time, in place.

    Returned is whether they do so, and the change of the primary's velocity.
    """


@close_at_both_walls.of(NoFriction)
def _fade_between_walls(friction, model, s, start):
    any_brief = False
    for k in range(len(s.bodies)):
        b, p = body_in(s.bodies, k), start.primary
        if b.mode == FLIGHT and b.gap == 0.0 and b.rate > 0.0 and b.cause == IMPACT:
            m = mass_at(model, k)
            own = own_acceleration(model.single, m, b, s.x, s.v, p.phase, 0.0)
            pressed = negligible(model.tolerance) * abs(p.a - own)
            any_brief = any_brief or 2.0 * b.speed <= pressed
    return any_brief and _close_together(model, s), 0.0


@compiled
def _close_together(model, s):
    """Close what masses at both walls do with one another in no time.

    Each impact disturbs the other masses, so no chatter sequence is one by itself, and an elastic
    mass has no sequence; all lose speed as long as one mass is not elastic. The masses rest, or
    leave their walls at once, where the contact forces would stop them in a hundredth of the
    accuracy.
    """
    bodies, longest = s.bodies, negligible(model.tolerance)
    count = len(bodies)
    slow = np.abs(bodies[:, RATE]) <= longest * _LARGEST
    inside = slow & (bodies[:, MODE] == FLIGHT) & (bodies[:, GAP] <= longest)
    last = count + 1
    forces = np.zeros(count)
    while np.sum(inside) < last:
        last = int(np.sum(inside))
        bodies[:, WALL] = np.where(inside | (bodies[:, MODE] == STICKING), bodies[:, SIDE], 0.0)
        bodies[:, MOST] = 0.0
        common = common_motion(model, s)
        for k in range(count):
            b = bodies[k]
            forces[k] = abs(b[LEVEL] - common.a) if b[WALL] != 0.0 else 0.0
            brief = 2.0 * abs(b[RATE]) <= longest * forces[k]
            inside[k] = inside[k] and brief and b[GAP] <= longest * longest * forces[k]
    left, any_loses, facing = SHORTEST, False, 0.0
    for k in range(count):
        if inside[k]:
            facing += float(bodies[k, SIDE])
            left = max(left, 2.0 * abs(float(bodies[k, RATE])) / float(forces[k]))
            any_loses = any_loses or _loses(model, bodies, k)
    if abs(facing) == last or not any_loses:
        return False
    for k in range(count):
        if inside[k]:
            bodies[k, MODE], bodies[k, COMPLETION] = TAIL, -left
    return True


@compiled
def _loses(model, bodies, k):
    """Whether a mass loses speed at its wall."""
    return restitution_of(mass_at(model, k), float(bodies[k, SIDE])) < 1.0


@close_at_both_walls.of(Frictions)
def _fade_by_friction(friction, model, s, start):
    fades = _fading(model, s)
    if not np.any(fades):
        return False, 0.0
    return True, _stop(model, s, start, fades)


@compiled
def _fading(model, s):
    """Masses of negligible speed after an impact of negligible speed, marked by 1.

    A wall may press a mass only as long as other masses rest, which each impact moves. No chatter
    sequence is one by itself then, and speeds fall without end in no time. The speeds left here are
    so small that the forces alone decide which masses rest.
    """
    bodies = s.bodies
    fades = np.zeros(len(bodies))
    phase = phase_at(model.free.forcing, s.periods, s.time)
    a = abs(motion_from(model.free, s.x, s.v, phase).a)
    any_hits = False
    for k in range(len(bodies)):
        m, b = mass_at(model, k), body_in(bodies, k)
        own = abs(own_acceleration(model.single, m, b, s.x, s.v, phase, 0.0))
        least = (a + own + m.friction) * negligible(model.tolerance) ** 2
        near = 2.0 * b.gap <= least
        if b.mode == FLIGHT and abs(b.rate) <= least and (near or m.friction > 0.0):
            fades[k] = 1.0
            bodies[k, GAP] = 0.0 if near else b.gap
            any_hits = any_hits or (b.cause == IMPACT and b.speed <= least)
    return fades if any_hits else np.zeros(len(bodies))


@compiled
def _stop(model, s, start, fades):
    """Take their speed from masses, in place; the change of the primary's velocity."""
    bodies = s.bodies
    change = change_by_rest(model, bodies, fades, start.joined)
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
        b[RATE], b[SLIP_DIRECTION] = 0.0, 0.0
    return change


@compiled
def change_by_rest(model: Several, bodies: np.ndarray, rests: np.ndarray, joined: float) -> float:
    """Change of the primary's velocity where masses come to rest on it, those marked by 1."""
    heavier, pushed = 1.0 + joined, 0.0
    for k in range(len(bodies)):
        ratio = float(rests[k] * model.masses[k, RATIO])
        heavier += ratio
        pushed += float(bodies[k, SIDE]) * ratio * float(bodies[k, RATE])
    return -pushed / heavier

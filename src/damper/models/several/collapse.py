"""Masses that lose their speed with one another in no time, each disturbed by the others' impacts.

No chatter sequence is one by itself then, and speeds fall without end.
"""

import numpy as np

from damper.engine.compiled import compiled
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
from damper.models.many import ACCUMULATION, CAUSE, GAP, MODE, RATE, SIDE, SPEED, MassesSegment
from damper.models.several.bodies import (
    FRICTION,
    RATIO,
    SLIP_DIRECTION,
    Several,
    Start,
    body_in,
    mass_at,
    own_acceleration,
)
from damper.models.several.contacts import negligible
from damper.models.several.pinch import SHORTEST

#: Acceleration, in units of F0/M, beyond which none is promised: weights are up to this.
_LARGEST = 1e6


@compiled
def is_brief(model: Several, speed: float) -> bool:
    """Whether accelerations may stop a speed in no time: asked before they are worked out."""
    return abs(speed) <= negligible(model.tolerance) * _LARGEST


@compiled
def close_together(model: Several, s: MassesSegment, start: Start) -> tuple[bool, float]:
    """Close what masses do with one another in no time, in place.

    Returned is whether they do so, and the change of the primary's velocity.
    """
    any_brief = False
    for k in range(len(s.bodies)):
        b = s.bodies[k]
        any_brief = any_brief or bool(b[CAUSE] == IMPACT and is_brief(model, b[SPEED]))
    if not any_brief:
        return False, 0.0
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
    bodies, longest = s.bodies, negligible(model.tolerance)
    fades = np.zeros(len(bodies))
    phase = phase_at(model.free.forcing, s.periods, s.time)
    largest = abs(motion_from(model.free, s.x, s.v, phase).a)
    for k in range(len(bodies)):
        m, b = mass_at(model, k), body_in(bodies, k)
        own = abs(own_acceleration(model.single, m, b, s.x, s.v, phase, 0.0))
        largest = max(largest, own + m.friction)
    slow = largest * longest
    if not _face(bodies, slow, longest):
        # On one wall a sequence completes by itself, and before speeds are as low as this. Where
        # friction lets others rest between its impacts, it may not complete.
        slow *= longest if np.any(model.masses[:, FRICTION] > 0.0) else 0.0
    any_hits = False
    for k in range(len(bodies)):
        m, b = mass_at(model, k), body_in(bodies, k)
        near = 2.0 * b.gap <= largest * longest * longest
        if b.mode == FLIGHT and abs(b.rate) <= slow and (near or m.friction > 0.0):
            fades[k] = 1.0
            bodies[k, GAP] = 0.0 if near else b.gap
            any_hits = any_hits or (b.cause == IMPACT and b.speed <= slow)
    return fades if any_hits else np.zeros(len(bodies))


@compiled
def _face(bodies, slow, longest):
    """Whether masses of negligible speed are at both walls."""
    at_left, at_right = False, False
    for k in range(len(bodies)):
        b = body_in(bodies, k)
        if b.mode == FLIGHT and abs(b.rate) <= slow and 2.0 * b.gap <= slow * longest:
            at_left, at_right = at_left or b.side < 0.0, at_right or b.side > 0.0
    return at_left and at_right


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
            b[MODE], b[ACCUMULATION] = TAIL, -SHORTEST
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

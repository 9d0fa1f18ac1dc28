"""Simultaneous contacts in boxes of a structure: impacts, and who stays on a wall."""

import numpy as np

from damper.engine.compiled import compiled, compiled_apart
from damper.engine.forcing import force_rates, phase_at
from damper.engine.impact import restitution_at
from damper.engine.search import ROUNDOFF
from damper.engine.segment import FLIGHT, IMPACT, NOTHING, RELEASE, STICK, STICKING
from damper.models.flights import VANISHES
from damper.models.structure.constants import (
    CAUSE,
    COMPLETION,
    DISPLACEMENT,
    FIRST,
    GAP,
    MODE,
    RATE,
    SIDE,
    SPEED,
    VELOCITY,
    OnStructure,
    StructureSegment,
    box_in,
    drag_in,
    law_of,
    mass_in,
    push_in,
    stiffness_in,
)
from damper.models.structure.flow import compliance, pushed
from damper.models.structure.linear import complementary, dot, times


@compiled
def hit(model: OnStructure, s: StructureSegment, arrives: np.ndarray) -> float:
    """Impacts of one instant, in place; the energy lost. `arrives` as for `rebound`."""
    impulses, loss = rebound(model, s.bodies, arrives)
    s.modes[VELOCITY] += pushed(model, s.bodies, impulses)
    return loss


@compiled_apart
def rebound(
    model: OnStructure, bodies: np.ndarray, arrives: np.ndarray
) -> tuple[np.ndarray, float]:
    """Impacts of one instant on the masses, in place; the impulses and the energy lost.

    `arrives` has the wall at which each mass arrives, or 0; its rate is that at its own wall.
    Masses that touch a wall with no relative velocity take part, whether or not they stick to it.
    """
    count, loss, touching = len(bodies), 0.0, 0
    touches, least = np.zeros(count, dtype=np.bool_), np.zeros(count)
    for k in range(count):
        b = bodies[k]
        touches[k] = b[MODE] == STICKING or (b[GAP] == 0.0 and b[RATE] == 0.0)
        if arrives[k] != 0.0:
            touches[k] = True
            speed = abs(float(b[RATE]))
            if b[SIDE] != arrives[k]:
                b[FIRST] = 0.0
            b[GAP], b[SIDE], b[SPEED], b[RATE] = 0.0, arrives[k], speed, -speed
            least[k] = (1.0 + _restitution(model, b, k)) * speed
        touching += int(touches[k])
    matrix = compliance(model, bodies)
    if touching > 1:
        impulses = impulses_of(matrix, least, touches)
    else:
        impulses = least
        for k in range(count):
            impulses[k] /= matrix[k, k]
    gained = times(matrix, impulses)
    for k in range(count):
        b, p = bodies[k], float(impulses[k])
        if arrives[k] != 0.0 and p > 0.0:
            r = _restitution(model, b, k)
            loss += 0.5 * p * (1.0 - r) * float(b[SPEED])
            b[RATE], b[CAUSE] = r * b[SPEED], IMPACT
            b[FIRST] = b[FIRST] if b[FIRST] > 0.0 else b[SPEED]
        elif arrives[k] != 0.0:  # another one's impact takes the wall away
            b[RATE], b[SPEED] = b[RATE] + gained[k], 0.0
        elif b[MODE] == STICKING:
            if is_kicked(matrix, impulses, k):
                b[MODE], b[RATE], b[CAUSE], b[FIRST] = FLIGHT, gained[k], RELEASE, 0.0
        elif not touches[k] or p == 0.0:
            b[RATE] += gained[k]
    return impulses, loss


@compiled
def _restitution(model, b, k):
    """Coefficient of restitution of the impact of a mass."""
    return restitution_at(law_of(mass_in(model.masses, k), float(b[SIDE])), float(b[SPEED]))


@compiled_apart
def impulses_of(matrix: np.ndarray, least: np.ndarray, chosen: np.ndarray) -> np.ndarray:
    """Impulses, or forces, of `complementary` in the chosen gaps."""
    count = 0
    for k in range(len(least)):
        count += int(chosen[k])
    small, asked, place = np.zeros((count, count)), np.zeros(count), 0
    numbers = np.zeros(count, dtype=np.int64)
    for k in range(len(least)):
        if chosen[k]:
            numbers[place] = k
            place += 1
    for i in range(count):
        asked[i] = least[numbers[i]]
        for j in range(count):
            small[i, j] = matrix[numbers[i], numbers[j]]
    found, of_these = np.zeros(len(least)), complementary(small, asked)
    for i in range(count):
        found[numbers[i]] = of_these[i]
    return found


@compiled_apart
def is_kicked(matrix: np.ndarray, impulses: np.ndarray, k: int) -> bool:
    """Whether impulses in other gaps open that of a mass that sticks, by more than roundoff."""
    gained, size = dot(matrix[k], impulses), dot(np.abs(matrix[k]), impulses)
    return bool(impulses[k] == 0.0 and gained > ROUNDOFF * size)


@compiled_apart
def _accelerations(model, s):
    """Second derivatives of all gaps if no wall pressed a mass, and the sizes of their terms."""
    bodies, count = s.bodies, len(s.bodies)
    x, v = s.modes[DISPLACEMENT], s.modes[VELOCITY]
    force, _, _, _, _ = force_rates(model.forcing, phase_at(model.forcing, s.periods, s.time))
    a = push_in(model) * force - times(drag_in(model), v) - stiffness_in(model) * x
    size = push_in(model) * abs(force) + times(np.abs(drag_in(model)), np.abs(v))
    size += stiffness_in(model) * np.abs(x)
    pulls = np.zeros(count)
    for k in range(count):
        b, m = bodies[k], mass_in(model.masses, k)
        pulls[k] = b[SIDE] * (m.tie_stiffness * (m.clearance - b[GAP]) - m.tie_damping * b[RATE])
        if pulls[k] != 0.0:
            a += pulls[k] * box_in(model, k)
            size += abs(pulls[k]) * np.abs(box_in(model, k))
    found, sizes = np.zeros(count), np.zeros(count)
    for k in range(count):
        m = mass_in(model.masses, k)
        own = m.carried * force - m.gravity - pulls[k] / m.mass
        found[k] = bodies[k, SIDE] * (dot(box_in(model, k), a) - own)
        sizes[k] = dot(np.abs(box_in(model, k)), size) + abs(m.carried * force)
        sizes[k] += abs(m.gravity) + abs(pulls[k] / m.mass)
    return found, sizes


@compiled
def _touches(bodies, k):
    """Whether a mass sticks to a wall, or touches it with no relative velocity."""
    b = bodies[k]
    fresh = b[GAP] == 0.0 and b[RATE] == 0.0 and b[CAUSE] != RELEASE
    return bool(b[MODE] == STICKING or fresh)


@compiled_apart
def decide_contacts(model: OnStructure, s: StructureSegment, mode: float) -> None:
    """Let masses that touch a wall with no relative velocity stay or leave, in place.

    A mass that comes to rest gets `mode`. A mass that has stuck stays, unless the force that
    parts it is more than roundoff.
    """
    bodies, count = s.bodies, len(s.bodies)
    any_touches = False
    for k in range(count):
        any_touches = any_touches or _touches(bodies, k)
    if not any_touches:
        return
    touches = np.zeros(count, dtype=np.bool_)
    for k in range(count):
        touches[k] = _touches(bodies, k)
    parting, sizes = _accelerations(model, s)
    matrix = compliance(model, bodies)
    forces = impulses_of(matrix, -parting, touches)
    parting += times(matrix, forces)
    for k in range(count):
        b = bodies[k]
        if not touches[k]:
            continue
        slack = VANISHES * ROUNDOFF * (sizes[k] + dot(np.abs(matrix[k]), forces))
        leaves = forces[k] == 0.0 and parting[k] > 0.0
        if b[MODE] == STICKING:
            if b[CAUSE] == NOTHING and leaves and parting[k] > slack:
                b[MODE], b[CAUSE], b[FIRST], b[RATE] = FLIGHT, RELEASE, 0.0, 0.0
        elif not leaves:
            b[MODE], b[COMPLETION] = mode, 0.0
            if mode == STICKING:
                b[CAUSE] = STICK


@compiled_apart
def settle(model: OnStructure, s: StructureSegment, impulses: np.ndarray) -> None:
    """Apply impulses in the gaps, in place."""
    s.modes[VELOCITY] += pushed(model, s.bodies, impulses)
    s.bodies[:, RATE] += times(compliance(model, s.bodies), impulses)

"""Simultaneous contacts in boxes of a structure: impacts, and who stays on a wall."""

import numpy as np

from damper.engine.compiled import compiled, compiled_apart
from damper.engine.forcing import force_rates, phase_at
from damper.engine.impact import restitution_at
from damper.engine.search import ROUNDOFF
from damper.engine.segment import FLIGHT, IMPACT, RELEASE, RESTING, SLIP, STICKING
from damper.models.flights import VANISHES
from damper.models.friction import SLIP_DIRECTION, is_joined, rest_or_part, turn
from damper.models.many import (
    CAUSE,
    FIRST,
    GAP,
    MODE,
    RATE,
    SIDE,
    SPEED,
    MassesSegment,
    is_on_wall,
    negligible,
)
from damper.models.structure.constants import (
    ARRIVES,
    DISPLACEMENT,
    IMPULSE,
    PUSH,
    STIFFNESS,
    VELOCITY,
    WEIGHTS,
    OnStructure,
    first_row,
    friction_of,
    mass_in,
    size_of,
)
from damper.models.structure.flow import compliance, give
from damper.models.structure.linear import complementary, times
from damper.models.wall_laws import law_of


@compiled
def hit(model: OnStructure, s: MassesSegment) -> float:
    """Impacts of one instant, in place; the energy lost."""
    loss, bodies = rebound(model, s.bodies), s.bodies
    for k in range(len(bodies)):
        if bodies[k, IMPULSE] != 0.0:
            for i in range(size_of(model)):
                impulse = bodies[k, SIDE] * bodies[k, IMPULSE]
                s.modes[VELOCITY, i] += impulse * model.table[WEIGHTS + k, i]
    return loss


@compiled
def rebound(model: OnStructure, bodies: np.ndarray) -> float:
    """Impacts of one instant on the masses, in place, with their impulses; the energy lost.

    A mass that arrives has its rate at its own wall. Masses that touch a wall with no relative
    velocity take part, whether or not they stick to it.
    """
    count, loss, touching = len(bodies), 0.0, 0
    for k in range(count):
        b = bodies[k]
        b[IMPULSE] = 0.0
        if b[ARRIVES] != 0.0:
            speed = abs(float(b[RATE]))
            if b[SIDE] != b[ARRIVES]:
                b[FIRST] = 0.0
            b[GAP], b[SIDE], b[SPEED], b[RATE] = 0.0, b[ARRIVES], speed, -speed
            b[IMPULSE] = (1.0 + _restitution(model, b, k)) * speed / give(model, bodies, k, k)
            touching += 1
        elif b[MODE] == STICKING or (b[GAP] == 0.0 and b[RATE] == 0.0):
            touching += 1
    if touching > 1:
        _share(model, bodies)
    for k in range(count):
        b, p = bodies[k], float(bodies[k, IMPULSE])
        if b[ARRIVES] != 0.0 and p > 0.0:
            r = _restitution(model, b, k)
            loss += 0.5 * p * (1.0 - r) * float(b[SPEED])
            b[RATE], b[CAUSE] = r * b[SPEED], IMPACT
            b[FIRST] = b[FIRST] if b[FIRST] > 0.0 else b[SPEED]
            continue
        if p != 0.0:
            continue
        gained, size = _gained(model, bodies, k)
        if b[ARRIVES] != 0.0:  # another one's impact takes the wall away
            b[RATE], b[SPEED] = b[RATE] + gained, 0.0
        elif b[MODE] == RESTING:
            b[RATE] = gained if abs(gained) > ROUNDOFF * size else 0.0
        elif b[MODE] != STICKING:
            b[RATE] += gained
        elif gained > ROUNDOFF * size:
            b[MODE], b[RATE], b[CAUSE], b[FIRST] = FLIGHT, gained, RELEASE, 0.0
    return loss


@compiled
def _restitution(model, b, k):
    """Coefficient of restitution of the impact of a mass."""
    return restitution_at(law_of(model, mass_in(model.masses, k), float(b[SIDE])), float(b[SPEED]))


@compiled
def _gained(model, bodies, k):
    """Change of a gap's rate by the impulses in all gaps, and the size of its terms."""
    gained, size = 0.0, 0.0
    for j in range(len(bodies)):
        if bodies[j, IMPULSE] != 0.0:
            part = give(model, bodies, k, j) * bodies[j, IMPULSE]
            gained += part
            size += abs(part)
    return gained, size


@compiled_apart
def _share(model, bodies):
    """Solve for the impulses of several contacts at one instant, in place."""
    count = len(bodies)
    touches, least = np.zeros(count, dtype=np.bool_), np.zeros(count)
    matrix = compliance(model, bodies)
    for k in range(count):
        b = bodies[k]
        least[k] = b[IMPULSE] * matrix[k, k]
        touches[k] = least[k] > 0.0 or b[MODE] == STICKING or (b[GAP] == 0.0 and b[RATE] == 0.0)
    impulses = impulses_of(matrix, least, touches)
    for k in range(count):
        bodies[k, IMPULSE] = impulses[k]


@compiled_apart
def impulses_of(matrix: np.ndarray, least: np.ndarray, chosen: np.ndarray) -> np.ndarray:
    """Impulses in the chosen gaps that make their rates grow by `least`, or more."""
    return forces_of(matrix, least, np.zeros(len(least)), np.full(len(least), np.inf), chosen)


@compiled_apart
def forces_of(
    matrix: np.ndarray,
    least: np.ndarray,
    low: np.ndarray,
    high: np.ndarray,
    chosen: np.ndarray,
) -> np.ndarray:
    """Forces, or impulses, of `complementary` in the chosen gaps."""
    count = 0
    for k in range(len(least)):
        count += int(chosen[k])
    small, asked, place = np.zeros((count, count)), np.zeros((3, count)), 0
    numbers = np.zeros(count, dtype=np.int64)
    for k in range(len(least)):
        if chosen[k]:
            numbers[place] = k
            place += 1
    for i in range(count):
        k = numbers[i]
        asked[0, i], asked[1, i], asked[2, i] = least[k], low[k], high[k]
        for j in range(count):
            small[i, j] = matrix[numbers[i], numbers[j]]
    found, of_these = np.zeros(len(least)), complementary(small, asked[0], asked[1], asked[2])
    for i in range(count):
        found[numbers[i]] = of_these[i]
    return found


@compiled
def _accelerations(model, s, touches, pulls, sizes):
    """Second derivatives of all gaps if nothing held masses; also the sizes of their terms.

    Masses that do not touch anything rub if they slide.
    """
    bodies, count, n, table = s.bodies, len(s.bodies), size_of(model), model.table
    force, _, _, _, _ = force_rates(model.forcing, phase_at(model.forcing, s.periods, s.time))
    found, drag = np.zeros(count), first_row(table, 0)
    for k in range(count):
        b, m = bodies[k], mass_in(model.masses, k)
        pulls[k] = b[SIDE] * (m.tie_stiffness * (m.clearance - b[GAP]) - m.tie_damping * b[RATE])
        if not touches[k]:
            pulls[k] += m.mass * b[SLIP_DIRECTION] * friction_of(model, k)
        own = m.carried * force - m.gravity - pulls[k] / m.mass
        found[k] = -b[SIDE] * own
        sizes[k] = abs(m.carried * force) + abs(m.gravity) + abs(pulls[k] / m.mass)
    for i in range(n):
        a = table[PUSH, i] * force - table[STIFFNESS, i] * s.modes[DISPLACEMENT, i]
        size = table[PUSH, i] * abs(force) + abs(table[STIFFNESS, i] * s.modes[DISPLACEMENT, i])
        for j in range(n):
            part = table[drag + i, j] * s.modes[VELOCITY, j]
            a -= part
            size += abs(part)
        for k in range(count):
            a += pulls[k] * table[WEIGHTS + k, i]
            size += abs(pulls[k] * table[WEIGHTS + k, i])
        for k in range(count):
            found[k] += bodies[k, SIDE] * table[WEIGHTS + k, i] * a
            sizes[k] += abs(table[WEIGHTS + k, i]) * size
    return found


@compiled
def _touches(model, bodies, k):
    """Whether a mass is held by its wall or by friction, or has no velocity relative to them."""
    b = bodies[k]
    bound = b[GAP] == 0.0 or friction_of(model, k) > 0.0
    fresh = b[RATE] == 0.0 and b[CAUSE] != RELEASE and b[CAUSE] != SLIP
    return bool(b[MODE] in (STICKING, RESTING) or (bound and fresh))


@compiled
def decide_contacts(model: OnStructure, s: MassesSegment, mode: float) -> None:
    """Let masses with no relative velocity rest, or part from their boxes; in place.

    A mass that comes to rest on a wall gets `mode`. A mass that has been at rest stays, unless the
    force that parts it is more than roundoff.
    """
    touches = False
    for k in range(len(s.bodies)):
        b = s.bodies[k]
        if friction_of(model, k) > 0.0 and b[RATE] != 0.0 and not is_on_wall(b[MODE]):
            turn(b)
        touches = touches or _touches(model, s.bodies, k)
    if touches:
        _decide(model, s, mode)


@compiled_apart
def _decide(model, s, mode):
    bodies, count = s.bodies, len(s.bodies)
    touches, wanted = np.zeros(count, dtype=np.bool_), np.zeros(count)
    sizes, low, high = np.zeros(count), np.zeros(count), np.full(count, np.inf)
    for k in range(count):
        touches[k] = _touches(model, bodies, k)
    parting = _accelerations(model, s, touches, wanted, sizes)
    for k in range(count):
        b, friction = bodies[k], friction_of(model, k)
        wanted[k] = -parting[k]
        if friction > 0.0:
            soon = negligible(model.tolerance)
            near = 2.0 * b[GAP] <= (sizes[k] + friction) * soon * soon
            if touches[k] and b[MODE] == FLIGHT and near:
                b[GAP] = 0.0
            most = mass_in(model.masses, k).mass * friction
            low[k], high[k] = -most, np.inf if b[GAP] == 0.0 else most
    matrix = compliance(model, bodies)
    forces = forces_of(matrix, wanted, low, high, touches)
    pressed = times(matrix, forces)
    for k in range(count):
        b, size = bodies[k], sizes[k]
        if not touches[k]:
            continue
        for j in range(count):
            size += abs(matrix[k, j] * forces[j])
        slack, apart = VANISHES * ROUNDOFF * size, parting[k] + pressed[k]
        beyond, way = 0.0, 0.0
        if forces[k] == low[k]:
            beyond, way = apart, -b[SIDE]
        elif forces[k] == high[k]:
            beyond, way = -apart, b[SIDE]
        if friction_of(model, k) == 0.0:
            way = 0.0
        elif b[SLIP_DIRECTION] == way and not is_joined(b[MODE]):
            beyond -= slack  # a slide that has stopped does not go on
        rest_or_part(b, float(beyond), slack, float(way), mode)


@compiled_apart
def settle(model: OnStructure, s: MassesSegment, impulses: np.ndarray) -> None:
    """Apply impulses in the gaps, in place."""
    for k in range(len(impulses)):
        s.bodies[k, IMPULSE] = impulses[k]
        for i in range(size_of(model)):
            impulse = s.bodies[k, SIDE] * impulses[k]
            s.modes[VELOCITY, i] += impulse * model.table[WEIGHTS + k, i]
    for k in range(len(impulses)):
        s.bodies[k, RATE] += _gained(model, s.bodies, k)[0]

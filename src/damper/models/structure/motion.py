"""The motion of a structure and its free masses in a segment."""

import math

import numpy as np

from damper.engine import model as declared
from damper.engine.compiled import compiled, compiled_apart
from damper.engine.impact import restitution_at
from damper.engine.lending import lent
from damper.engine.search import ROUNDOFF
from damper.engine.segment import FLIGHT, TAIL, clock_after
from damper.models.flights import Bounce, bounce_at
from damper.models.friction import SLIP_DIRECTION
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
from damper.models.structure.constants import (
    ARRIVES,
    BEFORE,
    DISPLACEMENT,
    EASED,
    HEAD,
    PLAIN,
    PREVIOUS,
    PREVIOUS_SLIP,
    VELOCITY,
    WEIGHTS,
    OnStructure,
    box_at,
    first_row,
    mass_in,
    size_in,
    size_of,
)
from damper.models.structure.courses import course_of, gap_after
from damper.models.structure.flow import (
    ModalStart,
    begin,
    impulses_to_rest,
    modes_after,
    pushed,
)
from damper.models.structure.log import segment_of_all
from damper.models.structure.steps import CHANGE, WAY, V, X
from damper.models.wall_laws import law_of

#: Roundoffs of a gap within which an approaching mass is at the wall together with another.
_TOGETHER = 4.0


@compiled
def all_after(
    model: OnStructure, s: MassesSegment, start: ModalStart, tau: float, first: int, wall: float
) -> MassesSegment:
    """Where all are after a time; `ARRIVES` of the masses has the wall at which each arrives, or 0.

    The mass `first` arrives at a wall then, if there is such a mass; others may be there, too.
    """
    modes_after(model.forcing, start, tau)
    owned, off, count = s.bodies.copy(), 0.0, len(s.bodies)
    bodies = lent(owned)
    for each in range(count):
        k = (first + each) % count
        b = bodies[k]
        b[SPEED], b[ARRIVES], b[PREVIOUS] = 0.0, 0.0, b[MODE]
        b[PREVIOUS_SLIP] = b[SLIP_DIRECTION]
        if b[MODE] != FLIGHT:
            continue
        gap, rate, roundoff = gap_after(course_of(model, s.bodies, start, k), tau)
        width = 2.0 * mass_in(model.masses, k).clearance
        if k == first:
            # How far it is off its wall is roundoff, which the others have as well.
            b[ARRIVES], off = wall, abs(gap if b[SIDE] == wall else width - gap)
        elif gap <= _TOGETHER * (roundoff + off) and rate < 0.0:
            b[ARRIVES] = b[SIDE]
        elif width - gap <= _TOGETHER * (roundoff + off + ROUNDOFF * width) and rate > 0.0:
            b[ARRIVES] = -b[SIDE]
        b[GAP], b[RATE], b[ACCUMULATION] = min(max(gap, 0.0), width), rate, 0.0
    periods, time = clock_after(model.cycle, s.periods, s.time, tau)
    return segment_of_all(periods, time, structure_after(model, start, tau), owned)


@compiled
def structure_after(model: OnStructure, start: ModalStart, tau: float) -> np.ndarray:
    """`MassesSegment.modes` from what `modes_after` has written."""
    n, table, rows = size_of(model), start.tables[start.slot], start.modes
    modes, first = np.zeros((3, n)), first_row(table, 1)
    for j in range(size_in(table)):
        place = rows[WAY, j] + (rows[X, j] + tau * rows[V, j])
        rate = rows[CHANGE, j] + rows[V, j]
        if table[HEAD, PLAIN] != 0.0:
            modes[DISPLACEMENT, j], modes[VELOCITY, j] = place, rate
            continue
        for i in range(n):
            modes[DISPLACEMENT, i] += table[first + i, j] * place
            modes[VELOCITY, i] += table[first + i, j] * rate
    for i in range(n):
        modes[BEFORE, i] = modes[VELOCITY, i]
    return modes


@compiled_apart
def state_after(
    model: OnStructure, s: MassesSegment, start: ModalStart, tau: float
) -> MassesSegment:
    """Where all are a time after a segment's start; in a tail the bounces go on."""
    here = all_after(model, s, start, tau, len(s.bodies), 0.0)
    bounces, count = False, len(s.bodies)
    sticks, places, rates = np.zeros(count, dtype=np.bool_), np.zeros(count), np.zeros(count)
    for k in range(count):
        b = s.bodies[k]
        sticks[k] = b[MODE] != FLIGHT
        if b[MODE] == TAIL and b[ACCUMULATION] > 0.0:
            bounce = bounce_in(model, s.bodies, k)
            places[k], rates[k] = bounce_at(bounce, float(b[ACCUMULATION]), float(b[RATE]), tau)
            bounces = True
    if bounces:
        _carry(model, here, sticks, DISPLACEMENT, places)
        _carry(model, here, sticks, VELOCITY, rates)
    return here


@compiled
def bounce_in(model: OnStructure, bodies: np.ndarray, k: int) -> Bounce:
    """How a mass bounces in a tail, or at a restitution of its wall where that has no time left."""
    b = bodies[k]
    r = restitution_at(law_of(model, mass_in(model.masses, k), float(b[SIDE])), 0.0)
    if not (b[MODE] == TAIL and b[ACCUMULATION] > 0.0 and b[RATE] > 0.0):
        return Bounce(1.0, 1.0, r)
    root = math.sqrt(float(b[EASED]))
    out = b[RATE] * (1.0 + 1.0 / root) / (b[ACCUMULATION] * (1.0 - r * root))
    return Bounce(float(out), float(out * b[EASED]), r * root)


@compiled_apart
def _carry(model, here, sticks, order, moved):
    """Let bounces of a tail carry the structure about the motion that it has with them stuck.

    `moved` has the gaps, where `order` is that of displacements, or their rates.
    """
    bodies, count = here.bodies.copy(), len(moved)
    for k in range(count):
        bodies[k, RATE] = -moved[k]
    change = pushed(model, bodies, impulses_to_rest(model, bodies, sticks))
    for i in range(len(change)):
        here.modes[order, i] += change[i]
    for k in range(count):
        if sticks[k]:
            here.bodies[k, order] = moved[k]
            continue
        for i in range(len(change)):
            gained = here.bodies[k, SIDE] * model.table[WEIGHTS + k, i] * change[i]
            here.bodies[k, order] += gained


@compiled
def place_of(model: OnStructure, s: MassesSegment, k: int) -> tuple[float, float]:
    """Displacement and velocity of a free mass at the start of a segment."""
    b = s.bodies[k]
    offset = b[SIDE] * (mass_in(model.masses, k).clearance - b[GAP])
    place = box_at(model, s, DISPLACEMENT, k) + offset
    return place, box_at(model, s, VELOCITY, k) - b[SIDE] * b[RATE]


@declared.masses_at.of(OnStructure)
def _masses_at(model, segment, tau, masses):
    here = segment
    if tau >= 0.0:
        here = state_after(model, segment, begin(model, segment, 2), tau)
    is_before = tau == declared.BEFORE
    for k in range(len(here.bodies)):
        place, u = place_of(model, here, k)
        mode = float(segment.bodies[k, MODE])
        if is_before:
            mode, box = float(here.bodies[k, PREVIOUS]), box_at(model, here, BEFORE, k)
            u, mode = before_event(here, k, mode, box, u)
        masses[k, 0], masses[k, 1], masses[k, 2] = place, u, mode
    order = BEFORE if is_before else VELOCITY
    return box_at(model, here, DISPLACEMENT, 0), box_at(model, here, order, 0)


@declared.begin_samples.of(OnStructure)
def _begin_samples(model, segment):
    return begin(model, segment, 2)


@declared.motion.of(OnStructure)
def _motion(model, segment, tau):
    return _motion_sample(model, segment, begin(model, segment, 2), tau)


@declared.motion_sample.of(OnStructure)
def _motion_sample(model, segment, begun, tau):
    here, k = state_after(model, segment, begun, tau), int(segment.body)
    x, v = box_at(model, here, DISPLACEMENT, k), box_at(model, here, VELOCITY, k)
    return x, v, float(here.bodies[k, GAP]), float(here.bodies[k, RATE])


@declared.state_in.of(OnStructure)
def _state_in(model, segment, tau):
    return _state_sample(model, segment, begin(model, segment, 2), tau)


@declared.state_sample.of(OnStructure)
def _state_sample(model, segment, begun, tau):
    here, n = state_after(model, segment, begun, tau), size_of(model)
    first = first_row(model.table, 1)
    count = len(here.bodies)
    y, u, x, v = np.empty(count), np.empty(count), np.zeros(n), np.zeros(n)
    for k in range(count):
        y[k], u[k] = place_of(model, here, k)
    for i in range(n):
        for j in range(n):
            x[i] += model.table[first + i, j] * here.modes[DISPLACEMENT, j]
            v[i] += model.table[first + i, j] * here.modes[VELOCITY, j]
    return x, v, y, u

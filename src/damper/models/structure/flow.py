"""Motion of the modes in a segment.

Modes that damping does not couple are an oscillator each. Coupled ones go a last part of the way by
their Taylor series, which stops below roundoff, and the steps before it by matrices that are made
once (`damper.models.structure.steps`): that knows no cases of nearly equal or critical modes.
"""

from typing import Any, NamedTuple

import numpy as np

from damper.engine.compiled import compiled, compiled_apart
from damper.engine.dispatch import by_class_or_default
from damper.engine.forcing import force_rates, phase_at, turn_over
from damper.engine.forcing.weighed import WeighedForce
from damper.engine.lending import lent
from damper.engine.oscillator import Motion, Oscillator, arrive, motion_from, moved
from damper.engine.search import HORIZON
from damper.engine.segment import TAIL
from damper.models.friction import SLIP_DIRECTION, is_joined
from damper.models.many import GAP, MODE, RATE, SIDE, MassesSegment
from damper.models.structure.constants import (
    COUPLED,
    COUPLING,
    DAMPING,
    DISPLACEMENT,
    FAST,
    FASTEST,
    HEAD,
    JOINED,
    JUMP,
    PLAIN,
    PULL,
    PUSH,
    REGIME,
    SLOW,
    SPLIT,
    STATE,
    STIFFNESS,
    VELOCITY,
    WEIGHTS,
    OnStructure,
    first_row,
    mass_in,
    size_in,
    size_of,
)
from damper.models.structure.linear import solve
from damper.models.structure.steps import (
    CHANGE,
    LOWER,
    ROWS,
    UPPER,
    WAY,
    A,
    J,
    V,
    X,
    coupled_after,
    next_rate,
    room_for_steps,
)
from damper.models.structure.system import is_tied, kept_gain, make_system, shape_of_tables

#: Most systems that a run keeps; of more, the oldest makes room.
_MOST_KEPT = 8


class ModalStart(NamedTuple):
    """Start of the motion in a segment, and the systems that the run has met."""

    modes: np.ndarray
    """A row for each derivative of the modes at the start; further ones are room to work in."""
    slot: int
    """Which of the systems it is."""
    tables: np.ndarray
    """(slots, rows, columns) the table of each system; first `OnStructure.flying`."""
    steps: np.ndarray
    """What coupled modes do in a step, for each system."""
    phase: Any
    """Of the force."""


@compiled_apart
def joined_in(bodies: np.ndarray) -> np.ndarray:
    """Whether each free mass moves with its box."""
    found = np.zeros(len(bodies), dtype=np.bool_)
    for k in range(len(bodies)):
        found[k] = is_joined(bodies[k, MODE])
    return found


@compiled
def _state_of(b):
    """State of a mass, as `damper.models.structure.constants.STATE` has it."""
    return JOINED if is_joined(b[MODE]) else 2.0 * b[SLIP_DIRECTION]


@compiled_apart
def _states_in(bodies):
    found = np.zeros(len(bodies))
    for k in range(len(bodies)):
        found[k] = _state_of(bodies[k])
    return found


@compiled_apart
def begin(model: OnStructure, s: MassesSegment, most: int) -> ModalStart:
    """Start of a run that may keep so many systems, at least two."""
    rows, columns, size = shape_of_tables(model)
    slots = min(most, _MOST_KEPT)
    tables = np.zeros((slots, rows, columns))
    for i in range(rows):
        for j in range(columns):
            tables[0, i, j] = model.flying[i, j]
    phase = phase_at(model.forcing, s.periods, s.time)
    steps = room_for_steps(model.forcing, phase, slots, size)
    start = ModalStart(np.empty((ROWS, columns)), 0, tables, steps, phase)
    return begin_after(model, s, start)


@compiled
def begin_after(model: OnStructure, s: MassesSegment, before: ModalStart) -> ModalStart:
    """Start of the motion in a segment of a run, with the systems kept so far."""
    bodies, tail = s.bodies, False
    for k in range(len(bodies)):
        tail = tail or bodies[k, MODE] == TAIL
        bodies[k, JUMP] = 0.0
    slot = before.slot
    if not _is_of(before.tables[slot], bodies):
        slot = _slot_for(model, bodies, before)
    table, owned = lent(before.tables[slot]), np.empty(before.modes.shape)
    modes = lent(owned)
    if table[HEAD, PLAIN] != 0.0:
        for i in range(size_in(table)):
            modes[X, i], modes[V, i] = s.modes[DISPLACEMENT, i], s.modes[VELOCITY, i]
    else:
        _from_coordinates(model, s, table, modes, tail)
    phase = phase_at(model.forcing, s.periods, s.time)
    if table[HEAD, COUPLED] != 0.0:
        force, rate, _, _, _ = force_rates(model.forcing, phase)
        for order in range(2):
            push = force if order == 0 else rate
            next_rate(table, push, order, modes, order, order + 1, order + 2)
    else:
        for i in range(size_in(table)):
            osc = mode_of(model.forcing, table, i)
            motion = motion_from(osc, float(modes[X, i]), float(modes[V, i]), phase)
            modes[A, i], modes[J, i] = motion.a, motion.j
    return ModalStart(owned, slot, before.tables, before.steps, phase)


@compiled
def _is_of(table, bodies):
    """Whether a system is that of these masses."""
    found = True
    for k in range(len(bodies)):
        found = found and _state_of(bodies[k]) == table[STATE, k]
    return found


@compiled_apart
def _slot_for(model, bodies, before):
    """The place of the system of these masses; where there is none, make it.

    The present system is kept: its motion may be asked for as well.
    """
    tables, count = before.tables, len(before.tables)
    empty = 0
    for slot in range(count):
        if tables[slot, HEAD, 0] == 0.0:
            empty = empty or slot
        elif _is_of(tables[slot], bodies):
            return slot
    if empty == 0:
        empty = before.slot % (count - 1) + 1
        for i in range(tables.shape[1]):
            for j in range(tables.shape[2]):
                tables[empty, i, j] = 0.0
    make_system(model, _states_in(bodies), tables[empty])
    before.steps[empty, 0, 0, 0] = 0.0
    return empty


@compiled_apart
def _from_coordinates(model, s, table, modes, tail):
    """Displacements and velocities of the modes from those of the coordinates, in free rows."""
    n, size, given = size_of(model), size_in(table), model.table
    for i in range(size):
        modes[LOWER, i] = s.modes[DISPLACEMENT, i] if i < n else 0.0
        modes[UPPER, i] = s.modes[VELOCITY, i] if i < n else 0.0
    own = n
    for k in range(len(s.bodies)):
        if is_tied(model, k) and table[STATE, k] != JOINED:
            side = s.bodies[k, SIDE]
            place = side * (mass_in(model.masses, k).clearance - s.bodies[k, GAP])
            rate = -side * s.bodies[k, RATE]
            for i in range(n):
                place += given[WEIGHTS + k, i] * s.modes[DISPLACEMENT, i]
                rate += given[WEIGHTS + k, i] * s.modes[VELOCITY, i]
            modes[LOWER, own], modes[UPPER, own] = place, rate
            own += 1
    if tail:
        _stop_bounces(model, s.bodies, modes)
    first = first_row(table, 2)
    for i in range(size):
        place, rate = 0.0, 0.0
        for j in range(size):
            place += table[first + i, j] * modes[LOWER, j]
            rate += table[first + i, j] * modes[UPPER, j]
        modes[X, i], modes[V, i] = place, rate


@compiled_apart
def _stop_bounces(model, bodies, modes):
    """Let masses in a tail go with their boxes, as if they stuck."""
    n = size_of(model)
    change = pushed(model, bodies, impulses_to_rest(model, bodies, joined_in(bodies)))
    for i in range(n):
        modes[UPPER, i] += change[i]
    for k in range(len(bodies)):
        for i in range(n):
            bodies[k, JUMP] += bodies[k, SIDE] * model.table[WEIGHTS + k, i] * change[i]


@compiled
def give(model: OnStructure, bodies: np.ndarray, i: int, j: int) -> float:
    """Change of a gap's rate by a unit impulse in another one, with no masses stuck."""
    table, total = model.table, 0.0
    for mode in range(size_of(model)):
        total += table[WEIGHTS + i, mode] * table[WEIGHTS + j, mode]
    total *= bodies[i, SIDE] * bodies[j, SIDE]
    return total + 1.0 / mass_in(model.masses, i).mass if i == j else total


@compiled_apart
def compliance(model: OnStructure, bodies: np.ndarray) -> np.ndarray:
    """`give` of all gaps."""
    found = np.zeros((len(bodies), len(bodies)))
    for i in range(len(bodies)):
        for j in range(len(bodies)):
            found[i, j] = give(model, bodies, i, j)
    return found


@compiled_apart
def pushed(model: OnStructure, bodies: np.ndarray, impulses: np.ndarray) -> np.ndarray:
    """Change of the modes' velocities by impulses in the gaps."""
    found = np.zeros(size_of(model))
    for k in range(len(bodies)):
        for i in range(len(found)):
            found[i] += bodies[k, SIDE] * impulses[k] * model.table[WEIGHTS + k, i]
    return found


@compiled_apart
def impulses_to_rest(model: OnStructure, bodies: np.ndarray, rests: np.ndarray) -> np.ndarray:
    """Impulses in the gaps by which the rates of those that are marked vanish."""
    needed = np.zeros(len(bodies))
    for k in range(len(bodies)):
        needed[k] = -bodies[k, RATE]
    return solve(compliance(model, bodies), needed, rests)


@by_class_or_default
def mode_of(forcing: Any, table: np.ndarray, i: int) -> Oscillator:
    """The oscillator that an uncoupled mode is."""
    return _oscillator_in(forcing, table, i, float(table[PUSH, i]))


@mode_of.of(WeighedForce)
def _weighed_mode_of(forcing, table, i):
    own = WeighedForce(forcing.forcing, float(table[PUSH, i]), float(table[PULL, i]))
    return _oscillator_in(own, table, i, 1.0)


@compiled
def _oscillator_in(forcing, table, i, strength):
    return Oscillator(
        float(table[DAMPING, i]),
        float(table[STIFFNESS, i]),
        strength,
        float(table[REGIME, i]),
        float(table[SPLIT, i]),
        float(table[SLOW, i]),
        float(table[FAST, i]),
        float(table[FASTEST, i]),
        float(table[COUPLING, i]),
        forcing,
        kept_gain(forcing, table, i),
    )


@compiled
def motion_of(m: np.ndarray, phase: Any, i: int) -> Motion:
    """How an uncoupled mode moves at the start, by `ModalStart.modes`."""
    return Motion(float(m[X, i]), float(m[V, i]), float(m[A, i]), float(m[J, i]), phase)


@compiled
def increments_after(forcing: Any, start: ModalStart, turn: Any, tau: float) -> None:
    """Motion of the modes over a time as increments, in rows of the start.

    `WAY` has those of the displacements, beyond those by the velocities at the start, and `CHANGE`
    those of the velocities. `turn` is that of the force over this time.
    """
    table, modes, phase = start.tables[start.slot], start.modes, start.phase
    if table[HEAD, COUPLED] != 0.0:
        coupled_after(forcing, table, start.steps[start.slot], modes, phase, tau)
        return
    for i in range(size_in(table)):
        osc, motion = mode_of(forcing, table, i), motion_of(modes, phase, i)
        modes[WAY, i], modes[CHANGE, i] = moved(osc, motion, turn, tau)


@compiled
def modes_after(forcing: Any, start: ModalStart, tau: float) -> None:
    """As `increments_after`, but for the roundoff of long times, many of which add up."""
    increments_after(forcing, start, turn_over(forcing, tau), tau)
    table, modes, phase = start.tables[start.slot], start.modes, start.phase
    if tau == HORIZON and table[HEAD, COUPLED] == 0.0:
        for i in range(size_in(table)):
            osc, motion = mode_of(forcing, table, i), motion_of(modes, phase, i)
            x, v = arrive(osc, motion, tau)
            modes[WAY, i], modes[CHANGE, i] = (x - motion.x) - motion.v * tau, v - motion.v

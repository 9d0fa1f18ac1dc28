"""Motion of modes that damping couples: matrices of whole steps, and a Taylor series for the rest.

Modes, force and a constant are one linear system without input, z' = A z: a force is a sum of tones
that obey f'' = -rate^2 f. A step h has E = exp(A h) - 1 by its Taylor series, and one twice as long
has 2 E + E E, which keeps the digits of slow modes.
"""

import math
from typing import Any

import numpy as np

from damper.engine.compiled import compiled, compiled_apart
from damper.engine.forcing import (
    TAYLOR_REMAINDER,
    derivative_of,
    rate_of,
    tones_of,
    turn_over,
    turned,
)
from damper.engine.oscillator import TAYLOR_RANGE
from damper.models.structure.constants import (
    HEAD,
    PULL,
    PUSH,
    STIFFNESS,
    SYSTEM_RATE,
    first_row,
    size_in,
)

#: Rows of `damper.models.structure.flow.ModalStart.modes`: displacements at the start and three
#: derivatives; increments over a time; and three to work with.
X, V, A, J, WAY, CHANGE, LOWER, UPPER = range(8)
ROWS = 9
#: Lengths of steps with a matrix, each twice the one before: made when they are asked for. A fast
#: mode has billions of steps in the time that a search looks ahead.
_LEVELS = 30


@compiled_apart
def room_for_steps(forcing: Any, phase: Any, slots: int, size: int) -> np.ndarray:
    """Room for the matrices of so many systems, with how many there are in the first place."""
    width = 2 * (size + len(tones_of(forcing, phase))) + 1
    found = np.empty((slots, 1 + _LEVELS, width, width))
    for slot in range(slots):
        found[slot, 0, 0, 0] = 0.0
    return found


@compiled_apart
def next_rate(
    table: np.ndarray, force: float, order: int, rows: np.ndarray, lower: int, upper: int, into: int
) -> None:
    """Write the derivative of the modes above two others, which are rows of one array.

    `force` is the derivative of the force of this order.
    """
    size, drag = size_in(table), first_row(table, 0)
    for i in range(size):
        rows[into, i] = table[PUSH, i] * force - table[STIFFNESS, i] * rows[lower, i]
        if order == 0:
            rows[into, i] += table[PULL, i]
    for j in range(size):
        rate = rows[upper, j]
        for i in range(size):
            rows[into, i] -= table[drag + j, i] * rate


@compiled_apart
def coupled_after(
    forcing: Any, table: np.ndarray, steps: np.ndarray, rows: np.ndarray, phase: Any, tau: float
) -> None:
    """`damper.models.structure.flow.modes_after` of coupled modes."""
    size, step = size_in(table), _step_of(forcing, table)
    for i in range(size):
        rows[LOWER, i], rows[UPPER, i] = rows[X, i], rows[V, i]
    if tau <= step:
        _series(forcing, table, rows, phase, tau)
        return
    whole = math.floor(tau / step)
    gained = _after_steps(forcing, table, steps, rows, phase, int(whole))
    done = whole * step
    part = tau - done
    for i in range(size):
        rows[LOWER, i] += gained[i]
        rows[UPPER, i] += gained[size + i]
    _series(forcing, table, rows, turned(forcing, phase, turn_over(forcing, done)), part)
    for i in range(size):
        rows[WAY, i] += (gained[i] - done * rows[V, i]) + part * gained[size + i]
        rows[CHANGE, i] += gained[size + i]


@compiled
def _step_of(forcing, table):
    """The shortest step with a matrix, the longest of the series."""
    return TAYLOR_RANGE / max(table[HEAD, SYSTEM_RATE], rate_of(forcing), 1e-300)


@compiled
def _series(forcing, table, rows, phase, tau):
    """Write increments from `LOWER` and `UPPER`: beyond those by these velocities, and of them."""
    size = size_in(table)
    for i in range(size):
        rows[WAY, i], rows[CHANGE, i] = 0.0, 0.0
    reach = max(table[HEAD, SYSTEM_RATE], rate_of(forcing)) * tau
    last = len(rows) - 1
    lower, upper, into = last - 2, last - 1, last
    power, order, remainder = tau, 0, 1.0
    while remainder > TAYLOR_REMAINDER:
        next_rate(table, derivative_of(forcing, phase, order), order, rows, lower, upper, into)
        longer = power * (tau / (order + 2.0))
        for i in range(size):
            rows[CHANGE, i] += power * rows[into, i]
            rows[WAY, i] += longer * rows[into, i]
        lower, upper, into = upper, into, lower
        power = longer
        order += 1
        remainder *= min(reach, TAYLOR_RANGE) / (order + 1.0)


@compiled_apart
def _after_steps(forcing, table, steps, rows, phase, whole):
    """Increments of displacements, velocities and tones in whole steps from the start."""
    tones, size = tones_of(forcing, phase), size_in(table)
    count = 2 * (size + len(tones)) + 1
    begun, now, gained = np.empty(count), np.empty(count), np.zeros(count)
    for i in range(size):
        begun[i], begun[size + i] = rows[X, i], rows[V, i]
    for i in range(len(tones)):
        begun[2 * (size + i)], begun[2 * (size + i) + 1] = tones[i, 1], tones[i, 2]
    begun[count - 1] = 1.0
    level = 0
    while whole > 0:
        level += 1
        times = whole & 1 if level < _LEVELS else whole
        whole = whole >> 1 if level < _LEVELS else 0
        if steps[0, 0, 0] < level:
            _add_level(forcing, table, steps, tones)
        for _ in range(times):
            for j in range(count):
                now[j] = begun[j] + gained[j]
            for j in range(count):
                part = now[j]
                for i in range(count):
                    gained[i] += steps[level, j, i] * part
    return gained


@compiled_apart
def _add_level(forcing, table, steps, tones):
    """Make the next matrix, transposed."""
    count, known = 2 * (size_in(table) + len(tones)) + 1, int(steps[0, 0, 0])
    for j in range(count):
        if known == 0:
            _first_column(table, steps, tones, _step_of(forcing, table), j)
            continue
        for i in range(count):
            steps[known + 1, j, i] = 2.0 * steps[known, j, i]
        for k in range(count):
            part = steps[known, j, k]
            for i in range(count):
                steps[known + 1, j, i] += part * steps[known, k, i]
    steps[0, 0, 0] = known + 1.0


@compiled
def _first_column(table, steps, tones, step, j):
    """What a unit of one coordinate makes of all in the shortest step, less itself."""
    size, drag = size_in(table), first_row(table, 0)
    last = 2 * (size + len(tones))
    now, rate = np.zeros(last + 1), np.zeros(last + 1)
    now[j] = 1.0
    for i in range(last + 1):
        steps[1, j, i] = 0.0
    order, remainder = 1.0, 1.0
    while remainder > TAYLOR_REMAINDER:
        force = 0.0
        for i in range(len(tones)):
            even, odd = 2 * (size + i), 2 * (size + i) + 1
            force += now[even]
            rate[even], rate[odd] = now[odd], -tones[i, 0] * now[even]
        for i in range(size):
            total = table[PUSH, i] * force + table[PULL, i] * now[last]
            total -= table[STIFFNESS, i] * now[i]
            for k in range(size):
                total -= table[drag + i, k] * now[size + k]
            rate[i], rate[size + i] = now[size + i], total
        for i in range(last + 1):
            now[i] = rate[i] * (step / order)
            steps[1, j, i] += now[i]
        order += 1.0
        remainder *= TAYLOR_RANGE / order

"""Motion of the modes in a segment.

Modes that damping does not couple are an oscillator each. Coupled ones go in steps over which
their Taylor series stops below roundoff: it knows no cases of nearly equal or critical modes.
"""

from typing import Any, NamedTuple

import numpy as np

from damper.engine.compiled import compiled, compiled_apart
from damper.engine.forcing import (
    TAYLOR_REMAINDER,
    derivative_of,
    force_rates,
    phase_at,
    rate_of,
    turn_over,
    turned,
)
from damper.engine.oscillator import (
    TAYLOR_RANGE,
    Motion,
    Oscillator,
    arrive,
    motion_from,
    moved,
)
from damper.engine.search import HORIZON
from damper.engine.segment import STICKING, TAIL
from damper.models.several.bodies import oscillator_under
from damper.models.structure.constants import (
    DISPLACEMENT,
    JUMP,
    MODE,
    RATE,
    SIDE,
    STICKS,
    VELOCITY,
    JoinedSystem,
    OnStructure,
    StructureSegment,
    box_in,
    drag_in,
    inverse_in,
    mass_in,
    pull_in,
    push_in,
    size_of,
    stiffness_in,
    weights_in,
)
from damper.models.structure.linear import dot, solve, times
from damper.models.structure.system import is_tied, system_of


class ModalStart(NamedTuple):
    """ModalStart of the motion in a segment."""

    system: JoinedSystem
    modes: np.ndarray
    """(7, N) displacement of each mode and its first three derivatives.

    Then, of coupled modes, displacements and velocities after whole steps; how many comes first
    in the last row.
    """
    phase: Any
    """Of the force."""


@compiled
def is_on_wall(mode: float) -> bool:
    """Whether a free mass sticks to its wall, or will where its tail ends."""
    return mode in (STICKING, TAIL)


@compiled
def stuck_in(bodies: np.ndarray) -> np.ndarray:
    """Whether each free mass moves with its box."""
    found = np.zeros(len(bodies), dtype=np.bool_)
    for k in range(len(bodies)):
        found[k] = is_on_wall(bodies[k, MODE])
    return found


@compiled_apart
def begin_after(model: OnStructure, s: StructureSegment, system: JoinedSystem) -> ModalStart:
    """ModalStart of the motion in a segment; `system` may be that of the masses that stick."""
    bodies = s.bodies
    changes, tail, any_sticks = False, False, False
    for k in range(len(bodies)):
        on_wall = is_on_wall(bodies[k, MODE])
        any_sticks = any_sticks or on_wall
        tail = tail or bodies[k, MODE] == TAIL
        changes = changes or on_wall != (system.own[STICKS, k] == 1.0)
    if changes:
        system = system_of(model, stuck_in(bodies)) if any_sticks else model.flying
    modes = np.zeros((7, size_of(system)))
    if system.plain:
        modes[0], modes[1] = s.modes[DISPLACEMENT], s.modes[VELOCITY]
    else:
        place, rate = _coordinates(model, s, system, 0), _coordinates(model, s, system, 1)
        if tail:
            change = pushed(model, bodies, impulses_to_rest(model, bodies, stuck_in(bodies)))
            rate[: len(change)] += change
            bodies[:, JUMP] = bodies[:, SIDE] * times(weights_in(model), change)
        modes[0], modes[1] = times(inverse_in(system), place), times(inverse_in(system), rate)
    if not tail:
        bodies[:, JUMP] = 0.0
    phase = phase_at(model.forcing, s.periods, s.time)
    if system.coupled:
        rates = rates_in(system, force_rates(model.forcing, phase), modes[0], modes[1])
        modes[2], modes[3] = rates[2], rates[3]
        return ModalStart(system, modes, phase)
    forcing, table, masses = model.forcing, system.table, system.number
    for i in range(modes.shape[1]):
        osc = mode_of(forcing, table, masses, i)
        motion = motion_from(osc, float(modes[0, i]), float(modes[1, i]), phase)
        modes[2, i], modes[3, i] = motion.a, motion.j
    return ModalStart(system, modes, phase)


@compiled_apart
def _coordinates(model, s, system, order):
    """Displacements (order 0) or velocities (1) of all coordinates of a system."""
    n = size_of(model)
    found = np.zeros(size_of(system))
    found[:n] = s.modes[order]
    own = n
    for k in range(len(s.bodies)):
        if is_tied(model, k) and system.own[STICKS, k] == 0.0:
            side = s.bodies[k, SIDE]
            box = dot(box_in(model, k), s.modes[order])
            if order == 0:
                found[own] = box + side * (mass_in(model.masses, k).clearance - s.bodies[k, 0])
            else:
                found[own] = box - side * s.bodies[k, RATE]
            own += 1
    return found


@compiled_apart
def compliance(model: OnStructure, bodies: np.ndarray) -> np.ndarray:
    """Changes of the gaps' rates by unit impulses in them, with no masses stuck."""
    count, table, masses, size = len(bodies), model.table, model.masses, size_of(model)
    found = np.zeros((count, count))
    for i in range(count):
        for j in range(i + 1):
            total = 0.0
            for mode in range(size):
                total += table[3 + i, mode] * table[3 + j, mode]
            found[i, j] = found[j, i] = bodies[i, SIDE] * bodies[j, SIDE] * total
        found[i, i] += 1.0 / mass_in(masses, i).mass
    return found


@compiled_apart
def pushed(model: OnStructure, bodies: np.ndarray, impulses: np.ndarray) -> np.ndarray:
    """Change of the modes' velocities by impulses in the gaps."""
    found = np.zeros(size_of(model))
    for k in range(len(bodies)):
        if impulses[k] != 0.0:
            found += bodies[k, SIDE] * impulses[k] * box_in(model, k)
    return found


@compiled_apart
def impulses_to_rest(model: OnStructure, bodies: np.ndarray, rests: np.ndarray) -> np.ndarray:
    """Impulses in the gaps by which the rates of those that are marked vanish."""
    return solve(compliance(model, bodies), -bodies[:, RATE], rests)


@compiled
def mode_of(forcing: Any, table: np.ndarray, masses: int, i: int) -> Oscillator:
    """The oscillator that an uncoupled mode is, by the table of a system of so many masses."""
    damping, stiffness = 0.5 * table[3 + masses + i, i], float(table[0, i])
    if stiffness == 0.0 and damping > 0.0:
        stiffness = 1e-100  # an oscillator with a dashpot needs some
    return oscillator_under(forcing, damping, stiffness, float(table[1, i]), float(table[2, i]))


@compiled
def motion_of(m: np.ndarray, phase: Any, i: int) -> Motion:
    """How an uncoupled mode moves at the start, by `ModalStart.modes`."""
    return Motion(float(m[0, i]), float(m[1, i]), float(m[2, i]), float(m[3, i]), phase)


@compiled_apart
def rates_in(
    system: JoinedSystem, force: tuple[float, ...], lower: np.ndarray, upper: np.ndarray
) -> np.ndarray:
    """Derivatives 0 to 6 of the modes, from their displacements and velocities."""
    found = np.zeros((7, len(lower)))
    found[0], found[1] = lower, upper
    pushes = (force[0], force[1], force[2], force[3], force[4])
    for order in range(5):
        found[order + 2] = _next_rate(system, pushes[order], order, found[order], found[order + 1])
    return found


@compiled_apart
def _next_rate(system, force, order, lower, upper):
    """The derivative of an order above two others; `order` counts those of the force."""
    found = push_in(system) * force - stiffness_in(system) * lower - times(drag_in(system), upper)
    if order == 0:
        found += pull_in(system)
    return found


@compiled_apart
def _series(forcing, system, start, phase, tau):
    """Increments of displacements, beyond those by the velocities, and of velocities."""
    way, change = np.zeros(len(start[0])), np.zeros(len(start[0]))
    lower, upper = start[0], start[1]
    reach = max(system.rate, rate_of(forcing)) * tau
    power, order, remainder = tau, 0, 1.0
    while remainder > TAYLOR_REMAINDER:
        force = derivative_of(forcing, phase, order)
        lower, upper = upper, _next_rate(system, force, order, lower, upper)
        change += power * upper
        power *= tau / (order + 2.0)
        way += power * upper
        order += 1
        remainder *= min(reach, TAYLOR_RANGE) / (order + 1.0)
    return way, change


@compiled_apart
def coupled_after(forcing: Any, start: ModalStart, tau: float) -> tuple[np.ndarray, np.ndarray]:
    """Increments of coupled modes as for `modes_after`.

    Steps are whole ones from the start, but for the last: what is found does not depend on what
    has been asked for before.
    """
    system, modes = start.system, start.modes
    step = TAYLOR_RANGE / max(system.rate, rate_of(forcing), 1e-300)
    if tau <= step:
        return _series(forcing, system, start.modes, start.phase, tau)
    if modes[6, 0] * step >= tau or modes[6, 0] == 0.0:
        modes[6, 0], modes[4], modes[5] = 0.0, modes[0], modes[1]
    while True:
        done = modes[6, 0] * step
        phase = turned(forcing, start.phase, turn_over(forcing, done))
        last = tau - done <= step
        part = tau - done if last else step
        way, change = _series(forcing, system, modes[4:6], phase, part)
        way += part * modes[5] + modes[4]
        change += modes[5]
        if last:
            return (way - modes[0]) - tau * modes[1], change - modes[1]
        modes[6, 0], modes[4], modes[5] = modes[6, 0] + 1.0, way, change


@compiled_apart
def modes_after(model: OnStructure, start: ModalStart, tau: float) -> tuple[np.ndarray, np.ndarray]:
    """Motion of the modes over a time, as increments.

    Returns
    -------
    way, change : ndarray (N,)
        Of displacements, beyond those by the velocities at the start, and of velocities.
    """
    system = start.system
    if system.coupled:
        return coupled_after(model.forcing, start, tau)
    forcing, table, masses = model.forcing, system.table, system.number
    modes, phase, size = start.modes, start.phase, start.modes.shape[1]
    way, change = np.zeros(size), np.zeros(size)
    turn = turn_over(forcing, tau)
    for i in range(size):
        osc, motion = mode_of(forcing, table, masses, i), motion_of(modes, phase, i)
        if tau == HORIZON:
            x, v = arrive(osc, motion, tau)
            way[i], change[i] = (x - motion.x) - motion.v * tau, v - motion.v
        else:
            way[i], change[i] = moved(osc, motion, turn, tau)
    return way, change

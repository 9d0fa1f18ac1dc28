"""Constants of free masses in boxes of a structure, and its segments.

All coordinates of the structure are those of its modes without damping and without free masses:
mass 1, stiffness the square of the frequency.
"""

from typing import Any, NamedTuple

import numpy as np

from damper.engine.compiled import compiled, compiled_apart
from damper.engine.forcing.none import ZeroForce
from damper.engine.oscillator import Oscillator, oscillator
from damper.engine.tuples import reader
from damper.models.friction import Frictions, known_friction
from damper.models.many import MassesSegment

#: Columns of `MassesSegment.bodies` after `SLIP_DIRECTION`, the last of the log: mode and slip
#: direction before what happens; in a tail the pressing acceleration on the way back of a bounce,
#: friction against it, over that on the way out.
PREVIOUS, PREVIOUS_SLIP, EASED = 9, 10, 11
BODY = 12
#: Further columns, which the log does not have: by how much faster the gap grows where masses in a
#: tail are taken for stuck, the wall at which a mass arrives, or 0, and the impulse in its gap.
JUMP, ARRIVES, IMPULSE = 12, 13, 14
WIDTH = 15
#: Rows of `MassesSegment.modes`: displacements, velocities, and those before what happens.
DISPLACEMENT, VELOCITY, BEFORE = range(3)


class BoxedMass(NamedTuple):
    """Constants of a free mass, a row of `OnStructure.masses`."""

    mass: float
    clearance: float
    gravity: float
    tie_stiffness: float
    tie_damping: float
    carried: float
    """Acceleration by the force's shape in flight: where the base moves, else 0."""
    friction: float
    """Acceleration by dry friction while it slides."""
    left: float
    """Of the walls, from here on: `damper.models.wall_laws`."""
    right: float
    yields: float
    exponent: float
    left_table: float
    right_table: float


mass_in = reader(BoxedMass)


# A system is the structure with the masses that stick to it, by its modes without damping, whose
# mass is 1. A flying mass that is tied to its box has a coordinate of its own; where the base
# moves, the last coordinate is that of a mass that follows nothing but the force. All numbers of a
# system are in one table: compiled code counts two references to each array in every call.

#: Rows of a table. First numbers of the whole system. Then, a column for each free mass: its state,
#: `JOINED`, or twice the direction in which it slides, or 0; the constant part of the acceleration
#: of its box less its own; the change of that velocity by a unit impulse between both; what
#: dashpots do to that impulse; their fastest rate; by how much an impulse moves fast modes more
#: than the slowest one.
HEAD, STATE, FALLS, YIELDS, DRAGS, DASHPOTS, STIFFENS = range(7)
#: Then, a column for each mode: squares of the frequencies, accelerations by the force's shape,
#: >= 0, and constant ones.
STIFFNESS, PUSH, PULL = 7, 8, 9
#: The oscillator that a mode is where damping does not couple it: seven fields of `Oscillator`.
DAMPING, REGIME, SPLIT, SLOW, FAST, FASTEST, COUPLING = range(10, 17)
#: Its gain, where the force is one harmonic.
GAIN_RE, GAIN_IM = 17, 18
#: Then displacements of each box less those of its free mass; then three blocks with a row for each
#: mode: damping; coordinates, a column for each mode, first those of the structure alone; modes, a
#: column for each coordinate.
WEIGHTS = 19
#: Columns of the first row: how many modes and free masses; whether the last mode is that of the
#: force alone, damping couples the modes, the modes are the coordinates; a bound on the rate of
#: free motion; of a derivative to the two below it; the least stiffness where the last mode is that
#: of the force.
SIZE, NUMBER, CARRIED, COUPLED, PLAIN, SYSTEM_RATE, SYSTEM_COUPLING, LEAST = range(8)
HEAD_WIDTH = 8
#: State of a mass that moves with its box.
JOINED = 1.0


class OnStructure(NamedTuple):
    """Constants of one run."""

    mass_ratio: float
    """Mass of all free masses together, in the unit of mass."""
    clearance: float
    """The largest."""
    law: Any
    """Constants of the laws of all walls, for `damper.models.wall_laws`."""
    cycle: float
    tolerance: float
    free: Oscillator
    """The first mode; all have its class."""
    forcing: Any
    """The shape of the force."""
    table: np.ndarray
    """The system without free masses."""
    masses: np.ndarray
    """A `BoxedMass` in each row."""
    number: int
    """Number of free masses."""
    flying: np.ndarray
    """The table of the system in which no mass sticks or slides."""
    friction: Any
    """`Frictions`, or `NoFriction` where no mass rubs on its box."""

    @property
    def features(self) -> tuple[str, ...]:
        """Features of the masses, by their names in `damper.parameters.models`."""
        rubs = isinstance(self.friction, Frictions)
        return ("structure", *["several"] * (self.number > 1), *["sliding"] * rubs)


@compiled
def friction_of(model: OnStructure, k: int) -> float:
    """Acceleration that friction gives a free mass while it slides."""
    return known_friction(model.friction, mass_in(model.masses, k).friction)


@compiled
def size_in(table: np.ndarray) -> int:
    """How many modes a system has."""
    return int(table[HEAD, SIZE])


@compiled
def size_of(model: OnStructure) -> int:
    """How many modes the structure has by itself."""
    return int(model.table[HEAD, SIZE])


@compiled
def box_at(model: OnStructure, s: MassesSegment, order: int, k: int) -> float:
    """Displacement, velocity or velocity before the event of a mass's box, by `order`."""
    found = 0.0
    for i in range(size_of(model)):
        found += model.table[WEIGHTS + k, i] * s.modes[order, i]
    return found


@compiled
def first_row(table: np.ndarray, block: int) -> int:
    """First row of the damping (block 0), the coordinates (1) or the modes (2) of a system."""
    return WEIGHTS + int(table[HEAD, NUMBER]) + block * int(table[HEAD, SIZE])


@compiled_apart
def fill_table(
    table: np.ndarray,
    stiffness: np.ndarray,
    push: np.ndarray,
    pull: np.ndarray,
    weights: np.ndarray,
    blocks: tuple[np.ndarray, np.ndarray, np.ndarray],
) -> None:
    """Write what each mode has into a table of zeros."""
    size, count = len(stiffness), len(weights)
    table[HEAD, SIZE], table[HEAD, NUMBER] = size, count
    for i in range(size):
        table[PUSH, i], table[PULL, i] = push[i], pull[i]
        for k in range(count):
            table[WEIGHTS + k, i] = weights[k, i]
    for which in range(3):
        block, first = blocks[which], first_row(table, which)
        for i in range(size):
            for j in range(size):
                table[first + i, j] = block[i, j]
    for i in range(size):
        damping, square = 0.5 * table[first_row(table, 0) + i, i], float(stiffness[i])
        if square == 0.0 and damping > 0.0:
            square = 1e-100  # an oscillator with a dashpot needs some
        own = oscillator(damping, square, 1.0, ZeroForce(0.0))
        table[STIFFNESS, i] = square
        table[DAMPING, i], table[REGIME, i], table[SPLIT, i] = damping, own.regime, own.split
        table[SLOW, i], table[FAST, i], table[FASTEST, i] = own.slow, own.fast, own.rate
        table[COUPLING, i] = own.coupling

"""Constants of free masses in boxes of a structure, and its segments.

All coordinates of the structure are those of its modes without damping and without free masses:
mass 1, stiffness the square of the frequency.
"""

from typing import Any, NamedTuple

import numpy as np

from damper.engine.compiled import compiled, compiled_apart
from damper.engine.impact import YieldingRestitution
from damper.engine.oscillator import Oscillator
from damper.engine.tuples import reader

#: Columns of `StructureSegment.bodies`, those of the log: as `damper.models.several.bodies`.
GAP, RATE, SIDE, MODE, CAUSE, SPEED, FIRST, COMPLETION = range(8)
BODY = 8
#: A further column, which the log does not have: by how much faster the gap grows where masses in a
#: tail are taken for stuck.
JUMP, WIDTH = 8, 9
#: Rows of `StructureSegment.modes`: displacements, velocities, and those before what happens.
DISPLACEMENT, VELOCITY, BEFORE = range(3)


class BoxedMass(NamedTuple):
    """Constants of a free mass, a row of `OnStructure.masses`."""

    mass: float
    clearance: float
    gravity: float
    tie_stiffness: float
    tie_damping: float
    left: float
    right: float
    """Restitution of the walls at low speeds."""
    yields: float
    """Yield speed of the walls."""
    exponent: float
    """Of the restitution's fall above that."""
    carried: float
    """Acceleration by the force's shape in flight: where the base moves, else 0."""


mass_in = reader(BoxedMass)


#: Rows of `JoinedSystem.own`: 1 where a free mass sticks; the constant part of the acceleration of
#: its box less its own; the change of that velocity by a unit impulse between both.
STICKS, FALLS, YIELDS = range(3)


class JoinedSystem(NamedTuple):
    """The structure with the masses that stick to it, by its modes without damping.

    Their mass is 1. A flying mass that is tied to its box has a coordinate of its own; where the
    base moves, the last coordinate is that of a mass that follows nothing but the force.
    """

    table: np.ndarray
    """Constants of the modes, a column for each mode; the functions below read the rows."""
    own: np.ndarray
    """(3, m) what each free mass has: `STICKS`, `FALLS` and `YIELDS`."""
    number: int
    """Number of free masses."""
    carried: bool
    """Whether the last mode is that of the force alone."""
    coupled: bool
    """Whether damping couples the modes."""
    plain: bool
    """Whether the modes are the coordinates."""
    rate: float
    """Bound on the rate of free motion."""
    coupling: float
    """Of a derivative to the two below it."""


class OnStructure(NamedTuple):
    """Constants of one run."""

    mass_ratio: float
    """Mass of all free masses together, in the unit of mass."""
    clearance: float
    """The largest."""
    law: Any
    cycle: float
    tolerance: float
    free: Oscillator
    """The first mode; all have its class."""
    forcing: Any
    """The shape of the force."""
    table: np.ndarray
    """As of a `JoinedSystem`, of the structure by itself."""
    masses: np.ndarray
    """A `BoxedMass` in each row."""
    number: int
    """Number of free masses."""
    flying: JoinedSystem
    """Where no mass sticks."""

    @property
    def features(self) -> tuple[str, ...]:
        """Features of the masses, by their names in `damper.parameters.models`."""
        return ("structure",)


class StructureSegment(NamedTuple):
    """A segment; the fields of `damper.engine.segment.Segment` are those of one free mass.

    `x` and `v` are of its box. Of events at one instant each begins a segment of its own; all but
    the last of them have no length.
    """

    periods: float
    time: float
    x: float
    v: float
    gap: float
    gap_rate: float
    side: float
    mode: float
    cause: float
    speed: float
    v_before: float
    first_speed: float
    completion: float
    duration: float
    y: float
    u: float
    body: float
    """Number of the free mass that the other fields speak of, from 0."""
    loss: float
    """Energy lost in all impacts of this instant; the first of their segments has it."""
    modes: np.ndarray
    """(3, n) the structure."""
    bodies: np.ndarray
    """A row for each free mass."""


# A struct of few arrays: compiled code counts two references to each of them in every call.


@compiled
def size_of(of: Any) -> int:
    """How many modes there are, of a structure or a system."""
    return of.table.shape[1]


@compiled_apart
def stiffness_in(of: Any) -> np.ndarray:
    """(N,) squares of the frequencies."""
    return of.table[0]


@compiled_apart
def push_in(of: Any) -> np.ndarray:
    """(N,) accelerations by the force's shape, >= 0."""
    return of.table[1]


@compiled_apart
def pull_in(of: Any) -> np.ndarray:
    """(N,) constant accelerations."""
    return of.table[2]


@compiled_apart
def weights_in(of: Any) -> np.ndarray:
    """(m, N) displacements of the boxes less those of the free masses."""
    return of.table[3 : 3 + of.number]


@compiled_apart
def box_in(of: Any, k: int) -> np.ndarray:
    """(N,) displacements of the box of a free mass less its own."""
    return of.table[3 + k]


@compiled_apart
def drag_in(of: Any) -> np.ndarray:
    """(N, N) damping."""
    first = 3 + of.number
    return of.table[first : first + size_of(of)]


@compiled_apart
def shapes_in(of: Any) -> np.ndarray:
    """(N, N) coordinates, a column for each mode; first those of the structure alone."""
    first = 3 + of.number + size_of(of)
    return of.table[first : first + size_of(of)]


@compiled_apart
def inverse_in(of: Any) -> np.ndarray:
    """(N, N) modes, a column for each coordinate."""
    first = 3 + of.number + 2 * size_of(of)
    return of.table[first : first + size_of(of)]


@compiled_apart
def table_of(
    stiffness: np.ndarray,
    push: np.ndarray,
    pull: np.ndarray,
    weights: np.ndarray,
    drag: np.ndarray,
    shapes: np.ndarray,
    inverse: np.ndarray,
) -> np.ndarray:
    """Make a table that the functions above read."""
    size, count = len(stiffness), len(weights)
    found = np.zeros((3 + count + 3 * size, size))
    found[0], found[1], found[2] = stiffness, push, pull
    found[3 : 3 + count] = weights
    found[3 + count : 3 + count + size] = drag
    found[3 + count + size : 3 + count + 2 * size] = shapes
    found[3 + count + 2 * size :] = inverse
    return found


@compiled
def law_of(m: BoxedMass, side: float) -> YieldingRestitution:
    """Contact law of a mass at one of its walls."""
    return YieldingRestitution(m.left if side < 0.0 else m.right, m.yields, m.exponent)

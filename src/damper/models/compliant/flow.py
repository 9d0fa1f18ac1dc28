"""Exact flow of the two masses during a compliant contact.

Everything is relative to the wall (side = +1 right, -1 left): displacements and the force are
multiplied by the side, so that both walls are one case. With gamma = (1 + mu) / mu = 1 / beta and
the wall's stiffness k and damping c (in units of K and sqrt(K M)),

    U = X - beta g                        centre of mass
    p = S - 2 zeta X' - X                 net force on the primary but for the wall, S the force
    U'' = p / (1 + mu)
    g'' = p - gamma (k g + c g')          gap; contact force N = -(k g + c g')

A state is the tuple (U, U', g, g', S, C), C the forcing's cosine; it obeys a linear equation
without explicit time. The gap is a variable of its own and keeps its digits however small it is.

Times are split in binary: one step of a Taylor series for less than the shortest interval, and then
propagators over that interval times 1, 2, 4, ..., which are made once for a run. A propagator is
held as its difference from one, E, and doubled by E -> 2 E + E^2, so that slow motion is not lost
beside fast motion. Where the primary's damping is the fastest of all, propagators are for X and X'
in the place of U and U': the damping would be in two rows otherwise, and each doubling would double
its rounding in the slow motions, where it cancels. (Elsewhere the contact would be.) No rate,
however high, limits a step. See docs/models.md.
"""

import math
from typing import NamedTuple

import numpy as np

from damper.engine.compiled import compiled
from damper.engine.search import HORIZON
from damper.engine.trigonometry import sine_cosine

#: State of the pair: U, U', g, g', S, C; or, for propagators, see ContactConstants.shift.
Pair = tuple[float, float, float, float, float, float]

#: Rate times the shortest interval of the binary split.
_REACH = 0.5
#: The Taylor series stops where its remainder is below this part of its scale.
_REMAINDER = 1e-19
#: Numbers of one propagator: four rows of six, then cosine - 1 and sine of the forcing's turn.
ENTRIES = 26


class ContactConstants(NamedTuple):
    """Constants of the motion in contact."""

    share: float
    """1 / (1 + mu)."""
    reduced: float
    """beta = mu / (1 + mu), the reduced mass."""
    drag: float
    """2 zeta."""
    stiffness: float
    """k."""
    damping: float
    """c."""
    relative_stiffness: float
    """gamma k, the square of the contact's frequency between free bodies."""
    relative_damping: float
    """gamma c."""
    omega: float
    """Forcing frequency."""
    rate: float
    """Bound on the fastest rate."""
    shortest: float
    """Shortest interval of the binary split."""
    levels: int
    """Number of doublings; the last interval is longer than any segment."""
    shift: float
    """Propagators are for U + shift g and its rate: beta where the drag is fastest, else 0."""


@compiled
def contact_constants(
    mass_ratio: float,
    damping_ratio: float,
    frequency_ratio: float,
    stiffness: float,
    contact_damping: float,
) -> tuple[float, ...]:
    """Fields of `ContactConstants`, from the damping ratio of the contact oscillation."""
    reduced = mass_ratio / (1.0 + mass_ratio)
    frequency = math.sqrt(stiffness / reduced)
    relative_damping = 2.0 * contact_damping * frequency
    own = (1.0 + mass_ratio) * (1.0 + frequency + relative_damping)
    rate = 1.0 + 2.0 * damping_ratio + frequency_ratio + frequency + relative_damping
    levels = 0
    shortest = 1.04 * HORIZON
    while rate * shortest > _REACH:
        shortest *= 0.5
        levels += 1
    return (
        1.0 / (1.0 + mass_ratio),
        reduced,
        2.0 * damping_ratio,
        stiffness,
        relative_damping * reduced,
        frequency * frequency,
        relative_damping,
        frequency_ratio,
        rate,
        shortest,
        levels,
        reduced if 2.0 * damping_ratio > own else 0.0,
    )


@compiled
def derivative(contact: ContactConstants, z: Pair) -> Pair:
    """Time derivative of a state, or of any derivative of it."""
    u, w, g, h, s, c = z
    p = s - contact.drag * (w + contact.reduced * h) - (u + contact.reduced * g)
    wall = contact.relative_stiffness * g + contact.relative_damping * h
    return w, contact.share * p, h, p - wall, contact.omega * c, -contact.omega * s


@compiled
def energy_size(contact: ContactConstants, z: Pair) -> float:
    """Root of twice the energy of masses and springs, of a state or of a derivative of it.

    In a time t it grows by at most the forcing's amplitude times t, since the dashpots only take.
    """
    u, w, g, h, _, _ = z
    x = u + contact.reduced * g
    energy = w * w / contact.share + contact.reduced * h * h + x * x
    return math.sqrt(energy + contact.stiffness * g * g)


@compiled
def short_increment(contact: ContactConstants, z: Pair, tau: float) -> Pair:
    """Change of the state over a time of at most the shortest interval, by its Taylor series."""
    reach = contact.rate * tau
    u, w, g, h, s, c = 0.0, 0.0, 0.0, 0.0, 0.0, 0.0
    term = z
    remainder = 1.0
    n = 1.0
    while remainder > _REMAINDER:
        part = tau / n
        a, b, d, e, f, k = derivative(contact, term)
        term = (part * a, part * b, part * d, part * e, part * f, part * k)
        u += term[0]
        w += term[1]
        g += term[2]
        h += term[3]
        s += term[4]
        c += term[5]
        remainder *= reach / n
        n += 1.0
    return u, w, g, h, s, c


def propagators(contact: ContactConstants) -> np.ndarray:
    """E = propagator - 1 over the intervals shortest * 2**k, one row each.

    Returns
    -------
    float64 array (levels + 1, ENTRIES)
    """
    table = np.zeros((contact.levels + 1, ENTRIES))
    _fill(contact, table)
    return table


@compiled
def shifted(contact: ContactConstants, z: Pair) -> Pair:
    """State as propagators have it."""
    return z[0] + contact.shift * z[2], z[1] + contact.shift * z[3], z[2], z[3], z[4], z[5]


@compiled
def unshifted(contact: ContactConstants, z: Pair) -> Pair:
    """State of the pair, from one as propagators have it."""
    return z[0] - contact.shift * z[2], z[1] - contact.shift * z[3], z[2], z[3], z[4], z[5]


@compiled
def unit_state(column: int) -> tuple[float, ...]:
    """State with 1 in one place of six, and 0 elsewhere."""
    return (
        1.0 if column == 0 else 0.0,
        1.0 if column == 1 else 0.0,
        1.0 if column == 2 else 0.0,
        1.0 if column == 3 else 0.0,
        1.0 if column == 4 else 0.0,
        1.0 if column == 5 else 0.0,
    )


@compiled
def _fill(contact, table):
    for column in range(6):
        z = unshifted(contact, unit_state(column))
        change = shifted(contact, short_increment(contact, z, contact.shortest))
        for row in range(4):
            table[0, 6 * row + column] = change[row]
    length = contact.shortest
    for level in range(contact.levels + 1):
        sine, _, less_1 = sine_cosine(contact.omega * length)
        table[level, 24] = less_1
        table[level, 25] = sine
        length *= 2.0
    for level in range(contact.levels):
        e = table[level]
        for row in range(4):
            for column in range(6):
                total = 0.0
                for k in range(4):
                    total += float(e[6 * row + k]) * float(e[6 * k + column])
                if column == 4:
                    total += float(e[6 * row + 4]) * float(e[24])
                    total -= float(e[6 * row + 5]) * float(e[25])
                elif column == 5:
                    total += float(e[6 * row + 4]) * float(e[25])
                    total += float(e[6 * row + 5]) * float(e[24])
                table[level + 1, 6 * row + column] = 2.0 * float(e[6 * row + column]) + total


@compiled
def leap(e: np.ndarray, z: Pair) -> Pair:
    """State, as propagators have it, after the interval of one row of the propagators."""
    u, w, g, h, s, c = z
    return (
        u + float(e[0] * u + e[1] * w + e[2] * g + e[3] * h + e[4] * s + e[5] * c),
        w + float(e[6] * u + e[7] * w + e[8] * g + e[9] * h + e[10] * s + e[11] * c),
        g + float(e[12] * u + e[13] * w + e[14] * g + e[15] * h + e[16] * s + e[17] * c),
        h + float(e[18] * u + e[19] * w + e[20] * g + e[21] * h + e[22] * s + e[23] * c),
        s + float(e[24] * s + e[25] * c),
        c + float(e[24] * c - e[25] * s),
    )


@compiled
def advance(contact: ContactConstants, table: np.ndarray, z: Pair, tau: float) -> Pair:
    """State after a time `tau` in contact."""
    if tau >= contact.shortest:
        own = shifted(contact, z)
        length = contact.shortest * math.ldexp(1.0, contact.levels)
        for level in range(contact.levels, -1, -1):
            # At most once, but for a time longer than all of them together.
            while tau >= length:
                own = leap(table[level], own)
                tau -= length
            length *= 0.5
        z = unshifted(contact, own)
    if tau > 0.0:
        a, b, d, e, f, k = short_increment(contact, z, tau)
        z = (z[0] + a, z[1] + b, z[2] + d, z[3] + e, z[4] + f, z[5] + k)
    return z

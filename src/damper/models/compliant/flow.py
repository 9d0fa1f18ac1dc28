"""Exact flow of the two masses during a compliant contact.

Both walls are one case: the gap is multiplied by the wall's side (+1 right, -1 left) and called r
then, r = side g = x - y + side d. With gamma = (1 + mu) / mu = 1 / beta and the wall's stiffness k
and damping c (in units of K and sqrt(K M)),

    U = x - beta r                                       centre of mass
    p = -2 zeta x' - x                                   net force on the primary but for S
    U'' = p / (1 + mu) + S (1 + share mu) / (1 + mu)
    r'' = p + S (1 - share) - gamma (k r + c r')         contact force: side N = -(k r + c r')

S is the force on the primary; `share` of it, times mu, acts on the free mass (1 in the frame of a
base that moves). Gravity shifts the state of rest, for both walls alike: the equations are those of
the distance to it, and what a time changes is added to the state itself. A state is the tuple
(U, U', r, r', P, Q), the last two those of `damper.models.compliant.pairs`. Each pair (p, q) of the
force's obeys a linear equation without explicit time, together with the masses. The gap is a
variable of its own and keeps its digits however small it is.

Times are split in binary: a step of a Taylor series for less than the shortest interval, then
propagators over this interval times 1, 2, 4, ..., made once for a run. A propagator is held as its
difference from one, E, and doubled by E -> 2 E + E^2, so that slow motion is not lost beside fast
motion. Where the primary's damping is the fastest of all, propagators are for x and x' in the place
of U and U': the damping would be in two rows otherwise, and each doubling would double its rounding
in the slow motions, where it cancels. (Elsewhere the contact would be.) No rate, however high,
limits a step. See docs/models.md.
"""

import math
from typing import Any, NamedTuple

import numpy as np

from damper.engine.compiled import compiled
from damper.engine.dispatch import by_class_or_default
from damper.engine.forcing import bound_of, force_rates, rate_of
from damper.engine.forcing.harmonics import SumOfHarmonics
from damper.engine.search import HORIZON
from damper.models.compliant import pairs

#: Displacement and velocity of the centre of mass, gap and its rate times the side.
Masses = tuple[float, float, float, float]
#: State of the pair: the masses, and what it carries of the force. For propagators see
#: ContactConstants.shift.
Pair = tuple[float, float, float, float, float, float]

#: Rate times the shortest interval of the binary split.
_REACH = 0.5
#: The Taylor series stops where its remainder is below this part of its scale.
_REMAINDER = 1e-19


class Rest(NamedTuple):
    """Where both masses would be at rest in contact without the force."""

    centre: float
    gap: float


#: What deviations are measured from.
NOWHERE = Rest(0.0, 0.0)


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
    forcing: Any
    """NamedTuple of `damper.engine.forcing`."""
    strength: float
    """Force on the primary over the forcing's shape."""
    on_mass: float
    """Force on the free mass over that on the primary."""
    on_centre: float
    """Acceleration of the centre of mass over the force on the primary."""
    on_gap: float
    """The same of the gap."""
    largest: float
    """Largest size of the force on the primary and of gravity."""
    push: float
    """Growth of `energy_size` in a unit of time, over the forcing's shape, at most."""
    rate: float
    """Bound on the fastest rate."""
    shortest: float
    """Shortest interval of the binary split."""
    levels: int
    """Number of doublings; the last interval is longer than any segment."""
    shift: float
    """Propagators are for U + shift r and its rate: beta where the drag is fastest, else 0."""
    rest: Rest


def contact_constants(
    mass_ratio: float,
    damping_ratio: float,
    stiffness: float,
    contact_damping: float,
    forcing: Any,
    strength: float,
    share: float,
    gravity: float = 0.0,
) -> ContactConstants:
    """Make the constants, from the damping ratio of the contact oscillation."""
    reduced = mass_ratio / (1.0 + mass_ratio)
    frequency = math.sqrt(stiffness / reduced)
    relative_damping = 2.0 * contact_damping * frequency
    own = (1.0 + mass_ratio) * (1.0 + frequency + relative_damping)
    rate = 1.0 + 2.0 * damping_ratio + rate_of(forcing) + frequency + relative_damping
    levels = max(0, math.ceil(math.log2(rate * 1.04 * HORIZON / _REACH)))
    on_mass = share * mass_ratio
    on_centre = (1.0 + on_mass) / (1.0 + mass_ratio)
    on_gap = 1.0 - share
    weight = mass_ratio * gravity
    push = math.sqrt(on_centre * on_centre * (1.0 + mass_ratio) + on_gap * on_gap * reduced)
    return ContactConstants(
        1.0 / (1.0 + mass_ratio),
        reduced,
        2.0 * damping_ratio,
        stiffness,
        relative_damping * reduced,
        frequency * frequency,
        relative_damping,
        forcing,
        strength,
        on_mass,
        on_centre,
        on_gap,
        strength * bound_of(forcing, 0) + abs(gravity),
        strength * push,
        rate,
        math.ldexp(1.04 * HORIZON, -levels),
        levels,
        reduced if 2.0 * damping_ratio > own else 0.0,
        Rest(0.0 - weight - reduced * weight / stiffness, weight / stiffness),
    )


@compiled
def row_length(contact: ContactConstants) -> int:
    """Number of coefficients of what is linear in a state."""
    return pairs.MASSES + 2 * pairs.pair_count(contact.forcing)


@compiled
def force_rates_in(contact: ContactConstants, z: Pair) -> tuple[float, float, float, float, float]:
    """The force on the primary, and its first four derivatives."""
    a, b, c, d, e = force_rates(contact.forcing, pairs.phase_of(contact.forcing, z[4], z[5]))
    f = contact.strength
    return f * a, f * b, f * c, f * d, f * e


@compiled
def derivative(contact: ContactConstants, z: Masses, force: float) -> Masses:
    """Time derivative of the masses' distance to rest, or of one of its derivatives.

    `force` is that on the primary, or its derivative of that order. Of a `Pair` the masses count.
    """
    u, w, r, q = z[0], z[1], z[2], z[3]
    p = -contact.drag * (w + contact.reduced * q) - (u + contact.reduced * r)
    wall = contact.relative_stiffness * r + contact.relative_damping * q
    return w, contact.share * p + contact.on_centre * force, q, p + contact.on_gap * force - wall


@compiled
def from_rest(rest: Rest, z: Pair) -> Pair:
    """Distance of a state to that of rest."""
    return z[0] - rest.centre, z[1], z[2] - rest.gap, z[3], z[4], z[5]


@compiled
def energy_size(contact: ContactConstants, z: Masses) -> float:
    """Root of twice the energy of masses and springs, of a state or of a derivative of it.

    In a time t it grows by at most `push` times the force's shape times t, since the dashpots only
    take.
    """
    x = z[0] + contact.reduced * z[2]
    energy = z[1] * z[1] / contact.share + contact.reduced * z[3] * z[3] + x * x
    return math.sqrt(energy + contact.stiffness * z[2] * z[2])


@compiled
def _series(contact, z, up, down, tau):
    """Change of a state under one pair over at most the shortest interval, by its Taylor series."""
    reach = contact.rate * tau
    u, w, r, q, s, c = 0.0, 0.0, 0.0, 0.0, 0.0, 0.0
    term = (z[0], z[1], z[2], z[3])
    first, second = z[4], z[5]
    remainder = 1.0
    n = 1.0
    while remainder > _REMAINDER:
        part = tau / n
        a, b, d, e = derivative(contact, term, contact.strength * first)
        term = (part * a, part * b, part * d, part * e)
        first, second = part * (up * second), part * (down * first)
        u += term[0]
        w += term[1]
        r += term[2]
        q += term[3]
        s += first
        c += second
        remainder *= reach / n
        n += 1.0
    return u, w, r, q, s, c


@by_class_or_default
def _increment(forcing: Any, contact: ContactConstants, z: Pair, tau: float) -> Pair:
    up, down = pairs.pair_rates(forcing, 0)
    return _series(contact, z, up, down, tau)  # type: ignore[no-any-return]


@_increment.of(SumOfHarmonics)
def _increment_of_many(forcing, contact, z, tau):
    # The motion under the first pair, and under each other one that from rest.
    p, q = z[4], z[5]
    even, odd = pairs.harmonic_of(forcing, 0, p, q)
    rate = forcing.omega
    u, w, r, v, _, _ = _series(contact, (z[0], z[1], z[2], z[3], even, odd), rate, -rate, tau)
    sin, cos = p, q
    for k in range(1, len(forcing.sine)):
        sin, cos = sin * q + cos * p, cos * q - sin * p
        even, odd = pairs.harmonic_of(forcing, k, sin, cos)
        if even != 0.0 or odd != 0.0:
            rate = forcing.omega * (k + 1.0)
            more = _series(contact, (0.0, 0.0, 0.0, 0.0, even, odd), rate, -rate, tau)
            u += more[0]
            w += more[1]
            r += more[2]
            v += more[3]
    nothing = (0.0, 0.0, 0.0, 0.0, p, q)
    _, _, _, _, turned_p, turned_q = _series(contact, nothing, forcing.omega, -forcing.omega, tau)
    return u, w, r, v, turned_p, turned_q


@compiled
def short_increment(contact: ContactConstants, z: Pair, tau: float) -> Pair:
    """Change of a distance to rest over a time of at most the shortest interval."""
    return _increment(contact.forcing, contact, z, tau)  # type: ignore[no-any-return]


def propagators(contact: ContactConstants) -> np.ndarray:
    """E = propagator - 1 over the intervals shortest * 2**k, one row each.

    Returns
    -------
    float64 array (levels + 1, 4 row_length + 3)
        Four rows of a matrix, and what the interval adds to what a state carries of the force.
    """
    table = np.zeros((contact.levels + 1, 4 * row_length(contact) + 3))
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
def unit_state(column: int) -> tuple[Pair, int]:
    """State with 1 in one column of a row, its last two numbers a pair; and which pair."""
    pair = max(column - pairs.MASSES, 0) // 2
    place = column - 2 * pair
    return (
        1.0 if place == 0 else 0.0,
        1.0 if place == 1 else 0.0,
        1.0 if place == 2 else 0.0,
        1.0 if place == 3 else 0.0,
        1.0 if place == 4 else 0.0,
        1.0 if place == 5 else 0.0,
    ), pair


@compiled
def advance_under(
    contact: ContactConstants, table: np.ndarray, pair: int, z: Pair, tau: float
) -> Pair:
    """State after a time under one pair alone, which is its last two numbers.

    Both states are as propagators have them. To make what is linear in a state; `advance` is fast.
    """
    n = row_length(contact)
    first = pairs.MASSES + 2 * pair
    up, down = pairs.pair_rates(contact.forcing, pair)
    length = contact.shortest * math.ldexp(1.0, contact.levels)
    for level in range(contact.levels, -1, -1):
        while tau >= length:
            row = table[level]
            own, to_first, to_second = pairs.turn_over_pair(up, down, length)
            z = (
                z[0] + _under(row, 0, first, z),
                z[1] + _under(row, n, n + first, z),
                z[2] + _under(row, 2 * n, 2 * n + first, z),
                z[3] + _under(row, 3 * n, 3 * n + first, z),
                z[4] + (own * z[4] + to_first * z[5]),
                z[5] + (own * z[5] + to_second * z[4]),
            )
            tau -= length
        length *= 0.5
    if tau > 0.0:
        natural = unshifted(contact, z)
        a, b, d, e, f, k = shifted(contact, _series(contact, natural, up, down, tau))
        z = (z[0] + a, z[1] + b, z[2] + d, z[3] + e, z[4] + f, z[5] + k)
    return z


@compiled
def _under(e, masses, pair, z):
    return (
        float(e[masses]) * z[0]
        + float(e[masses + 1]) * z[1]
        + float(e[masses + 2]) * z[2]
        + float(e[masses + 3]) * z[3]
        + float(e[pair]) * z[4]
        + float(e[pair + 1]) * z[5]
    )


@compiled
def _fill(contact, table):
    length = row_length(contact)
    for column in range(length):
        unit, pair = unit_state(column)
        up, down = pairs.pair_rates(contact.forcing, pair)
        z = unshifted(contact, unit)
        change = shifted(contact, _series(contact, z, up, down, contact.shortest))
        for row in range(4):
            table[0, length * row + column] = change[row]
    tau = contact.shortest
    for level in range(contact.levels + 1):
        up, down = pairs.pair_rates(contact.forcing, 0)
        turn = pairs.turn_over_pair(up, down, tau)
        for k in range(3):
            table[level, 4 * length + k] = turn[k]
        if level < contact.levels:
            _double(contact, tau, length, table[level], table[level + 1])
        tau *= 2.0


@compiled
def _double(contact, tau, length, e, result):
    """The propagator over twice the time of another."""
    for row in range(4):
        for column in range(length):
            total = 0.0
            for k in range(4):
                total += float(e[length * row + k]) * float(e[length * k + column])
            if column >= pairs.MASSES:
                up, down = pairs.pair_rates(contact.forcing, (column - pairs.MASSES) // 2)
                own, to_first, to_second = pairs.turn_over_pair(up, down, tau)
                here = float(e[length * row + column])
                if (column - pairs.MASSES) % 2 == 0:
                    total += here * own + float(e[length * row + column + 1]) * to_second
                else:
                    total += float(e[length * row + column - 1]) * to_first + here * own
            result[length * row + column] = 2.0 * float(e[length * row + column]) + total


@compiled
def leap(contact: ContactConstants, e: np.ndarray, rest: Rest, state: Pair) -> Pair:
    """State after the interval of one row of the propagators; all states are as these have them."""
    u, w, r, q, s, c = state
    z = from_rest(rest, state)
    n = row_length(contact)
    turn = 4 * n
    return (
        u + _times(contact.forcing, e, 0, z),
        w + _times(contact.forcing, e, n, z),
        r + _times(contact.forcing, e, 2 * n, z),
        q + _times(contact.forcing, e, 3 * n, z),
        s + (float(e[turn]) * s + float(e[turn + 1]) * c),
        c + (float(e[turn]) * c + float(e[turn + 2]) * s),
    )


@compiled
def _times(forcing, row, first, z):
    """Sum of a state's variables, times their coefficients, which begin at `first`."""
    masses = (
        float(row[first]) * z[0]
        + float(row[first + 1]) * z[1]
        + float(row[first + 2]) * z[2]
        + float(row[first + 3]) * z[3]
    )
    return masses + pairs.product(forcing, row, first + pairs.MASSES, z[4], z[5])


@compiled
def dot(contact: ContactConstants, row: np.ndarray, z: Pair) -> float:
    """Linear function of a state."""
    return _times(contact.forcing, row, 0, z)  # type: ignore[no-any-return]


@compiled
def shifted_rest(contact: ContactConstants, rest: Rest) -> Rest:
    """State of rest as propagators have it."""
    return Rest(rest.centre + contact.shift * rest.gap, rest.gap)


@compiled
def advance(contact: ContactConstants, table: np.ndarray, z: Pair, tau: float) -> Pair:
    """State after a time `tau` in contact."""
    return advance_about(contact.rest, contact, table, z, tau)  # type: ignore[no-any-return]


@compiled
def advance_about(
    rest: Rest, contact: ContactConstants, table: np.ndarray, z: Pair, tau: float
) -> Pair:
    """State after a time `tau` in contact, with this place of rest."""
    if tau >= contact.shortest:
        own = shifted(contact, z)
        about = shifted_rest(contact, rest)
        length = contact.shortest * math.ldexp(1.0, contact.levels)
        for level in range(contact.levels, -1, -1):
            # At most once, but for a time longer than all of them together.
            while tau >= length:
                own = leap(contact, table[level], about, own)
                tau -= length
            length *= 0.5
        z = unshifted(contact, own)
    if tau > 0.0:
        a, b, d, e, f, k = short_increment(contact, from_rest(rest, z), tau)
        z = (z[0] + a, z[1] + b, z[2] + d, z[3] + e, z[4] + f, z[5] + k)
    return z

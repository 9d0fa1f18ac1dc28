"""The force during a contact, as a sum of pairs of variables that obey linear equations.

    p' = up q,    q' = down p

serves the sine and cosine of a harmonic (omega, -omega), the value and slope of a record within a
sample (1, 0), and no force (0, 0); the force's shape is the sum of all p. A linear function of a
contact's state is a row of coefficients: four for the masses, and two for each pair. The state
itself carries two numbers, from which all pairs follow.
"""

import math
from typing import Any

import numpy as np

from damper.engine.compiled import compiled
from damper.engine.dispatch import by_class
from damper.engine.forcing import bound_of
from damper.engine.forcing.harmonic import HarmonicForce, Phase
from damper.engine.forcing.harmonics import SumOfHarmonics
from damper.engine.forcing.none import ZeroForce
from damper.engine.forcing.record import PiecewiseLinear, RecordPhase
from damper.engine.trigonometry import sine_cosine

#: Coefficients of the masses in a row.
MASSES = 4


@by_class
def pair_count(forcing: Any) -> int:
    """How many pairs the force is the sum of."""


@by_class
def pair_rates(forcing: Any, number: int) -> tuple[float, float]:
    """Rates `up` and `down` of a pair; the rates of the first pair are also the rates of the
    carried numbers."""


@by_class
def carried(forcing: Any, phase: Any) -> tuple[float, float]:
    """What a state carries of the force: the first pair, or what makes all of them."""


@by_class
def phase_of(forcing: Any, p: float, q: float) -> Any:
    """The force's phase, from what a state carries; good for its value and derivatives."""


@by_class
def write_pairs(forcing: Any, p: float, q: float, row: np.ndarray) -> None:
    """Write all pairs into a row."""


@by_class
def product(forcing: Any, row: np.ndarray, first: int, p: float, q: float) -> float:
    """Sum of all pairs, times their coefficients in a row; those begin at `first`."""


@by_class
def bound_of_sum(forcing: Any, row: np.ndarray, order: int) -> float:
    """Bound on the derivative of this order of the sum of pairs times the coefficients in a row."""


@compiled
def turn_over_pair(up: float, down: float, tau: float) -> tuple[float, float, float]:
    """Gain of p of the pair (1, 0) over a time; gains of p and of q of (0, 1) and (1, 0)."""
    if down == 0.0:
        return 0.0, up * tau, 0.0
    sine, _, less_1 = sine_cosine(up * tau)  # down is -up
    return less_1, sine, -sine


# --- one harmonic


@pair_count.of(HarmonicForce)
def _one(forcing):
    return 1


@pair_rates.of(HarmonicForce)
def _harmonic_rates(forcing, number):
    return forcing.omega, -forcing.omega


@carried.of(HarmonicForce)
def _harmonic_carried(forcing, phase):
    return phase.sin, phase.cos


@phase_of.of(HarmonicForce)
def _harmonic_phase(forcing, p, q):
    return Phase(p, q)


@write_pairs.of(HarmonicForce)
def _write_one(forcing, p, q, row):
    row[MASSES] = p
    row[MASSES + 1] = q


@product.of(HarmonicForce)
def _one_product(forcing, row, first, p, q):
    return float(row[first]) * p + float(row[first + 1]) * q


@bound_of_sum.of(HarmonicForce)
def _harmonic_bound(forcing, row, order):
    return math.hypot(float(row[MASSES]), float(row[MASSES + 1])) * bound_of(forcing, order)


# --- several: sine and cosine of the first angle are carried


@pair_count.of(SumOfHarmonics)
def _many(forcing):
    return len(forcing.sine)


@pair_rates.of(SumOfHarmonics)
def _harmonics_rates(forcing, number):
    rate = forcing.omega * (number + 1.0)
    return rate, -rate


carried.like(SumOfHarmonics, HarmonicForce)
phase_of.like(SumOfHarmonics, HarmonicForce)


@compiled
def harmonic_of(
    forcing: SumOfHarmonics, number: int, sin: float, cos: float
) -> tuple[float, float]:
    """Pair of a harmonic, from sine and cosine of its own angle."""
    a, b = float(forcing.sine[number]), float(forcing.cosine[number])
    return a * sin + b * cos, a * cos - b * sin


@write_pairs.of(SumOfHarmonics)
def _write_many(forcing, p, q, row):
    sin, cos = p, q
    for k in range(len(forcing.sine)):
        row[MASSES + 2 * k], row[MASSES + 2 * k + 1] = harmonic_of(forcing, k, sin, cos)
        sin, cos = sin * q + cos * p, cos * q - sin * p


@product.of(SumOfHarmonics)
def _many_product(forcing, row, first, p, q):
    total = 0.0
    sin, cos = p, q
    for k in range(len(forcing.sine)):
        even, odd = harmonic_of(forcing, k, sin, cos)
        total += float(row[first + 2 * k]) * even + float(row[first + 2 * k + 1]) * odd
        sin, cos = sin * q + cos * p, cos * q - sin * p
    return total


@bound_of_sum.of(SumOfHarmonics)
def _harmonics_bound(forcing, row, order):
    total = 0.0
    for k in range(len(forcing.sine)):
        bound = math.hypot(float(row[MASSES + 2 * k]), float(row[MASSES + 2 * k + 1]))
        bound *= math.hypot(float(forcing.sine[k]), float(forcing.cosine[k]))
        for _ in range(order):
            bound *= forcing.omega * (k + 1.0)
        total += bound
    return total


# --- a record


pair_count.like(PiecewiseLinear, HarmonicForce)
write_pairs.like(PiecewiseLinear, HarmonicForce)
product.like(PiecewiseLinear, HarmonicForce)


@pair_rates.of(PiecewiseLinear)
def _record_rates(forcing, number):
    return 1.0, 0.0


@carried.of(PiecewiseLinear)
def _record_carried(forcing, phase):
    return phase.value, phase.slope


@phase_of.of(PiecewiseLinear)
def _record_phase(forcing, p, q):
    return RecordPhase(p, q, math.inf)


@bound_of_sum.of(PiecewiseLinear)
def _record_bound(forcing, row, order):
    # The slope is the value's first derivative.
    of_value = abs(float(row[MASSES])) * bound_of(forcing, order)
    return of_value + abs(float(row[MASSES + 1])) * bound_of(forcing, order + 1)


# --- none


pair_count.like(ZeroForce, HarmonicForce)
write_pairs.like(ZeroForce, HarmonicForce)


@pair_rates.of(ZeroForce)
def _no_rates(forcing, number):
    return 0.0, 0.0


@carried.of(ZeroForce)
def _nothing_carried(forcing, phase):
    return 0.0, 0.0


@phase_of.of(ZeroForce)
def _no_phase(forcing, p, q):
    return 0.0


@product.of(ZeroForce)
def _no_product(forcing, row, first, p, q):
    return 0.0


@bound_of_sum.of(ZeroForce)
def _no_bound(forcing, row, order):
    return 0.0

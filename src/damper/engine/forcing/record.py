"""A record: a force that is linear between its samples, solved exactly.

N. C. Nigam and P. C. Jennings, Bull. Seismol. Soc. Am. 1969, 59, 909. Each sample ends a segment,
so that within one the force is a polynomial of the first degree.
"""

import math
from typing import Any, NamedTuple

import numpy as np

from damper.engine import forcing as declared
from damper.engine.compiled import compiled
from damper.engine.roundoff import EPSILON

#: Roundoff of a time as a part of the cycle; a time nearer than this to a sample is at the sample.
_AT = 8.0 * EPSILON


class PiecewiseLinear(NamedTuple):
    """The pieces of a force; before the first one there is none, and the last one does not end."""

    cycle: float
    """Of the clock."""
    cycles: np.ndarray
    """(n,) whole cycles of the clock before each piece begins."""
    time: np.ndarray
    """(n,) time since then."""
    value: np.ndarray
    """(n,) value at the start of each piece."""
    slope: np.ndarray
    """(n,) slope of each piece."""
    largest: float
    """Largest size of the value."""
    steepest: float
    """Largest size of the slope."""


class RecordPhase(NamedTuple):
    """Where in its record the force is."""

    value: float
    slope: float
    left: float
    """Time to the next sample."""


def record(cycle: float, time: np.ndarray, value: np.ndarray, slope: np.ndarray) -> PiecewiseLinear:
    """Make a record from the times at which its pieces begin, their values and slopes."""
    cycles = np.floor(time / cycle)
    rest = np.fmod(time, cycle)
    rest = np.where(rest < 0.0, rest + cycle, rest)
    cycles = np.round((time - rest) / cycle)
    lengths = np.append(np.diff(time), 0.0)
    largest = max(np.abs(value).max(), np.abs(value + slope * lengths).max())
    cycles, rest, value, slope = (
        np.ascontiguousarray(each, dtype=float) for each in (cycles, rest, value, slope)
    )
    return PiecewiseLinear(
        cycle, cycles, rest, value, slope, float(largest), float(np.abs(slope).max())
    )


@declared.repeats.of(PiecewiseLinear)
def _repeats(forcing):
    return False


declared.is_odd.of(PiecewiseLinear)(_repeats)


@declared.may_jump.of(PiecewiseLinear)
def _may_jump(forcing):
    return True


@declared.rate_of.of(PiecewiseLinear)
def _rate_of(forcing):
    return 0.0


@declared.bound_of.of(PiecewiseLinear)
def _bound_of(forcing, order):
    if order == 0:
        return forcing.largest
    return forcing.steepest if order == 1 else 0.0


@declared.bound_ahead.of(PiecewiseLinear)
def _bound_ahead(forcing, phase, order, span):
    if order == 0:
        return abs(phase.value) + abs(phase.slope) * span
    return abs(phase.slope) if order == 1 else 0.0


@compiled
def _since(forcing, index, cycles, time):
    """Time since a piece began."""
    return (cycles - float(forcing.cycles[index])) * forcing.cycle + (
        time - float(forcing.time[index])
    )


@declared.phase_at.of(PiecewiseLinear)
def _phase_at(forcing, cycles, time):
    # How many pieces have begun, by bisection.
    low = 0
    high = len(forcing.time)
    while low < high:
        middle = (low + high) // 2
        if _since(forcing, middle, cycles, time) >= -_AT * forcing.cycle:
            low = middle + 1
        else:
            high = middle
    left = math.inf
    if low < len(forcing.time):
        left = -_since(forcing, low, cycles, time)
    if low == 0:
        return RecordPhase(0.0, 0.0, left)
    slope = float(forcing.slope[low - 1])
    since = _since(forcing, low - 1, cycles, time)
    return RecordPhase(float(forcing.value[low - 1]) + slope * since, slope, left)


@declared.horizon.of(PiecewiseLinear)
def _horizon(forcing, phase):
    return phase.left


@declared.turn_over.of(PiecewiseLinear)
def _turn_over(forcing, tau):
    return tau


declared.long_turn.of(PiecewiseLinear)(_turn_over)


@declared.turned.of(PiecewiseLinear)
def _turned(forcing, phase, turn):
    return RecordPhase(phase.value + phase.slope * turn, phase.slope, phase.left - turn)


@declared.force_rates.of(PiecewiseLinear)
def _force_rates(forcing, phase):
    return phase.value, phase.slope, 0.0, 0.0, 0.0


@declared.derivative_of.of(PiecewiseLinear)
def _derivative_of(forcing, phase, order):
    if order == 0:
        return phase.value
    return phase.slope if order == 1 else 0.0


@declared.tones_of.of(PiecewiseLinear)
def _tones_of(forcing, phase):
    found = np.zeros((1, 3))
    found[0, 1], found[0, 2] = phase.value, phase.slope
    return found


@declared.gain_of.of(PiecewiseLinear)
def _gain_of(forcing, damping, stiffness, split):
    return 0.0


@declared.driven.of(PiecewiseLinear)
def _driven(forcing, gain, osc, flow, phase, turn, tau):
    step, ramp = held(osc, flow, tau)
    return phase.value * step + phase.slope * ramp, phase.value * flow.s + phase.slope * step


@compiled
def held(osc: Any, flow: declared.FreeFlow, tau: float) -> tuple[float, float]:
    """Displacement after a force from rest that jumps to 1, and after one that grows at rate 1."""
    if osc.fast * osc.fast > 2.0 * osc.stiffness:
        # By divided differences of phi functions, where a slow root may vanish.
        fast, slow = osc.fast * tau, osc.slow * tau
        fast1, slow1 = _phi(fast), _phi(slow)
        part = tau * tau / (fast - slow)
        return part * (fast1 - slow1), part * tau * (_phi2(fast, fast1) - _phi2(slow, slow1))
    if osc.stiffness == 0.0:
        return 0.5 * tau * tau, tau * tau * tau / 6.0
    step = -flow.c_less_1 / osc.stiffness
    return step, -(flow.s_less_tau + 2.0 * osc.damping * step) / osc.stiffness


@compiled
def _phi(z):
    """(exp z - 1) / z."""
    return math.expm1(z) / z if z != 0.0 else 1.0


@compiled
def _phi2(z, phi):
    """(phi - 1) / z of `_phi`."""
    if abs(z) > 0.5:
        return (phi - 1.0) / z
    total = 0.0
    term = 0.5
    n = 3.0
    while abs(term) > declared.TAYLOR_REMAINDER:
        total += term
        term *= z / n
        n += 1.0
    return total

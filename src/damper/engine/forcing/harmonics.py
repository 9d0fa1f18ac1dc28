"""A sum of harmonics: integer multiples of the frequency of the clock's cycle.

    f = sum over k of sine[k - 1] sin(k theta) + cosine[k - 1] cos(k theta)

with theta = omega t + phase.

Sines and cosines of k theta follow from those of theta by a recurrence.
"""

import math
from typing import Any, NamedTuple

import numpy as np

from damper.engine import forcing as declared
from damper.engine.compiled import compiled
from damper.engine.forcing.harmonic import Gain, HarmonicForce, Turn, answer, gain_at


class SumOfHarmonics(NamedTuple):
    """Amplitudes of the harmonics of the orders 1 to n."""

    omega: float
    phase: float
    """At time 0, in (-pi, pi]."""
    sine: np.ndarray
    """(n,)"""
    cosine: np.ndarray
    """(n,)"""


class Gains(NamedTuple):
    """The `damper.engine.forcing.harmonic.Gain` of each harmonic."""

    re: np.ndarray
    im: np.ndarray


def harmonics(omega: float, phase: float, sine: np.ndarray, cosine: np.ndarray) -> SumOfHarmonics:
    """Make a sum of harmonics; the last one must not vanish."""
    return SumOfHarmonics(omega, math.atan2(math.sin(phase), math.cos(phase)), sine, cosine)


@declared.second_derivative.register
def _second_derivative(forcing: SumOfHarmonics, amplitude: float) -> tuple[float, Any]:
    factor = -((forcing.omega * np.arange(1.0, len(forcing.sine) + 1.0)) ** 2)
    return amplitude, forcing._replace(sine=factor * forcing.sine, cosine=factor * forcing.cosine)


# The angle of the first harmonic is all that moves.
for each in (
    declared.repeats,
    declared.horizon,
    declared.may_jump,
    declared.phase_at,
    declared.turn_over,
    declared.long_turn,
    declared.turned,
):
    each.like(SumOfHarmonics, HarmonicForce)


@declared.is_odd.of(SumOfHarmonics)
def _is_odd(forcing):
    for k in range(1, len(forcing.sine), 2):
        if forcing.sine[k] != 0.0 or forcing.cosine[k] != 0.0:
            return False
    return True


@declared.rate_of.of(SumOfHarmonics)
def _rate_of(forcing):
    return forcing.omega * len(forcing.sine)


@declared.bound_of.of(SumOfHarmonics)
def _bound_of(forcing, order):
    total = 0.0
    for k in range(len(forcing.sine)):
        bound = math.hypot(float(forcing.sine[k]), float(forcing.cosine[k]))
        for _ in range(order):
            bound *= forcing.omega * (k + 1.0)
        total += bound
    return total


@compiled
def _twice(turn, first):
    """Turn that follows one by another, as small as they are."""
    less_1 = (turn.cos_less_1 + first.cos_less_1) + (
        turn.cos_less_1 * first.cos_less_1 - turn.sin * first.sin
    )
    return Turn(turn.sin * first.cos + turn.cos * first.sin, 1.0 + less_1, less_1)


@declared.force_rates.of(SumOfHarmonics)
def _force_rates(forcing, phase):
    value = 0.0
    first = 0.0
    second = 0.0
    third = 0.0
    fourth = 0.0
    angle = phase
    for k in range(len(forcing.sine)):
        rate = forcing.omega * (k + 1.0)
        a, b = float(forcing.sine[k]), float(forcing.cosine[k])
        even = a * angle.sin + b * angle.cos
        odd = rate * (a * angle.cos - b * angle.sin)
        square = rate * rate
        value += even
        first += odd
        second -= square * even
        third -= square * odd
        fourth += square * square * even
        angle = declared.turned(forcing, angle, phase)
    return value, first, second, third, fourth


@declared.derivative_of.of(SumOfHarmonics)
def _derivative_of(forcing, phase, order):
    total = 0.0
    angle = phase
    for k in range(len(forcing.sine)):
        a, b = float(forcing.sine[k]), float(forcing.cosine[k])
        part = a * angle.sin + b * angle.cos if order % 2 == 0 else a * angle.cos - b * angle.sin
        for _ in range(order):
            part *= forcing.omega * (k + 1.0)
        total += part
        angle = declared.turned(forcing, angle, phase)
    return total if order % 4 < 2 else -total


@declared.tones_of.of(SumOfHarmonics)
def _tones_of(forcing, phase):
    found, angle = np.empty((len(forcing.sine), 3)), phase
    for k in range(len(forcing.sine)):
        rate = forcing.omega * (k + 1.0)
        a, b = float(forcing.sine[k]), float(forcing.cosine[k])
        found[k, 0] = rate * rate
        found[k, 1] = a * angle.sin + b * angle.cos
        found[k, 2] = rate * (a * angle.cos - b * angle.sin)
        angle = declared.turned(forcing, angle, phase)
    return found


@declared.gain_of.of(SumOfHarmonics)
def _gain_of(forcing, damping, stiffness, split):
    count = len(forcing.sine)
    gains = Gains(np.empty(count), np.empty(count))
    for k in range(count):
        gain = gain_at(forcing.omega * (k + 1.0), damping, stiffness)
        gains.re[k] = gain.re
        gains.im[k] = gain.im
    return gains


@declared.driven.of(SumOfHarmonics)
def _driven(forcing, gain, osc, flow, phase, turn, tau):
    x = 0.0
    v = 0.0
    angle = phase
    turning = turn
    for k in range(len(forcing.sine)):
        a, b = float(forcing.sine[k]), float(forcing.cosine[k])
        if a != 0.0 or b != 0.0:
            own = Gain(float(gain.re[k]), float(gain.im[k]))
            rate = forcing.omega * (k + 1.0)
            q_re, q_im, q_dot_re, q_dot_im = answer(rate, own, osc, flow, turning, tau)
            even = a * angle.sin + b * angle.cos
            odd = a * angle.cos - b * angle.sin
            x += q_re * even + q_im * odd
            v += q_dot_re * even + q_dot_im * odd
        angle = declared.turned(forcing, angle, phase)
        turning = _twice(turning, turn)
    return x, v

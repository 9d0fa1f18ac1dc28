"""The force sin(omega t + phase)."""

import math
from typing import Any, NamedTuple

import numpy as np

from damper.engine import forcing as declared
from damper.engine.compiled import compiled
from damper.engine.trigonometry import sine_cosine

#: Steady amplitude over the static one, above which free and steady part would cancel.
RESONANT_GAIN = 4.0


class Phase(NamedTuple):
    """Sine and cosine of the forcing phase."""

    sin: float
    cos: float


class Turn(NamedTuple):
    """Sine, cosine, and cosine - 1 without cancellation, of a change of the forcing phase."""

    sin: float
    cos: float
    cos_less_1: float


class Gain(NamedTuple):
    """Steady response to exp(i omega tau); both are zero near resonance: another form serves."""

    re: float
    im: float


class HarmonicForce(NamedTuple):
    """The force sin(omega t + phase)."""

    omega: float
    phase: float
    """Phase at time 0, in (-pi, pi]."""


@compiled
def harmonic(omega: float, phase: float) -> HarmonicForce:
    """Make a harmonic forcing."""
    return HarmonicForce(omega, math.atan2(math.sin(phase), math.cos(phase)))


@declared.second_derivative.register
def _second_derivative(forcing: HarmonicForce, amplitude: float) -> tuple[float, Any]:
    from damper.engine.forcing.weighed import WeighedForce

    return 1.0, WeighedForce(forcing, -amplitude * forcing.omega**2, 0.0)


@declared.repeats.of(HarmonicForce)
def _repeats(forcing):
    return True


@declared.is_odd.of(HarmonicForce)
def _is_odd(forcing):
    return True


@declared.horizon.of(HarmonicForce)
def _horizon(forcing, phase):
    return math.inf


@declared.may_jump.of(HarmonicForce)
def _may_jump(forcing):
    return False


@declared.rate_of.of(HarmonicForce)
def _rate_of(forcing):
    return forcing.omega


@declared.bound_of.of(HarmonicForce)
def _bound_of(forcing, order):
    bound = 1.0
    for _ in range(order):
        bound *= forcing.omega
    return bound


@declared.phase_at.of(HarmonicForce)
def _phase_at(forcing, cycles, time):
    sin, cos, _ = sine_cosine(forcing.omega * time + forcing.phase)
    return Phase(sin, cos)


@declared.turn_over.of(HarmonicForce)
def _turn_over(forcing, tau):
    sin, cos, cos_less_1 = sine_cosine(forcing.omega * tau)
    return Turn(sin, cos, cos_less_1)


@declared.long_turn.of(HarmonicForce)
def _long_turn(forcing, tau):
    return _turn_over(forcing, tau % (2.0 * math.pi / forcing.omega))


@declared.turned.of(HarmonicForce)
def _turned(forcing, phase, turn):
    return Phase(
        phase.sin * turn.cos + phase.cos * turn.sin, phase.cos * turn.cos - phase.sin * turn.sin
    )


@declared.force_rates.of(HarmonicForce)
def _force_rates(forcing, phase):
    omega = forcing.omega
    square = omega * omega
    return (
        phase.sin,
        omega * phase.cos,
        -square * phase.sin,
        -square * omega * phase.cos,
        square * square * phase.sin,
    )


@declared.derivative_of.of(HarmonicForce)
def _derivative_of(forcing, phase, order):
    value = phase.sin if order % 2 == 0 else phase.cos
    for _ in range(order):
        value *= forcing.omega
    return value if order % 4 < 2 else -value


@declared.tones_of.of(HarmonicForce)
def _tones_of(forcing, phase):
    found = np.empty((1, 3))
    found[0, 0] = forcing.omega * forcing.omega
    found[0, 1], found[0, 2] = phase.sin, forcing.omega * phase.cos
    return found


@declared.gain_of.of(HarmonicForce)
def _gain_of(forcing, damping, stiffness, split):
    return gain_at(forcing.omega, damping, stiffness)


@compiled
def gain_at(omega: float, damping: float, stiffness: float) -> Gain:
    """Gain of an oscillator at a frequency."""
    root = math.sqrt(stiffness)
    # Products keep the digits that stiffness - omega**2 would lose near resonance.
    detuning = (root - omega) * (root + omega)
    loss = 2.0 * damping * omega
    modulus = math.sqrt(detuning * detuning + loss * loss)
    if root > damping and stiffness > RESONANT_GAIN * modulus:
        return Gain(0.0, 0.0)
    return Gain(detuning / modulus / modulus, -loss / modulus / modulus)


@declared.driven.of(HarmonicForce)
def _driven(forcing, gain, osc, flow, phase, turn, tau):
    q_re, q_im, q_dot_re, q_dot_im = answer(forcing.omega, gain, osc, flow, turn, tau)
    return q_re * phase.sin + q_im * phase.cos, q_dot_re * phase.sin + q_dot_im * phase.cos


@compiled
def answer(
    omega: float, gain: Gain, osc: Any, flow: Any, turn: Turn, tau: float
) -> tuple[float, float, float, float]:
    """The complex response Q to exp(i omega tau) from rest, and its derivative.

    Re Q answers the cosine of the turn.
    """
    if gain.re == 0.0 and gain.im == 0.0:
        q_re, q_im, q_dot_re, q_dot_im = _resonant(
            osc.damping, osc.split, omega, flow.c_less_1, flow.s, tau
        )
    else:
        # gain (exp(i angle) - C - i omega S) and its derivative.
        re = turn.cos_less_1 - flow.c_less_1
        im = turn.sin - omega * flow.s
        q_re = gain.re * re - gain.im * im
        q_im = gain.re * im + gain.im * re
        re = osc.stiffness * flow.s - omega * turn.sin
        im = omega * (turn.cos_less_1 - flow.s_dot_less_1)
        q_dot_re = gain.re * re - gain.im * im
        q_dot_im = gain.re * im + gain.im * re
    return q_re, q_im, q_dot_re, q_dot_im


@compiled
def _resonant(damping, split, omega, c_less_1, s, tau):
    """Q and Q' as divided differences of the exponential: nothing grows as damping -> 0.

    With lambda = -damping + i split and E = (exp(i omega tau) - exp(lambda tau)) /
    (i omega - lambda): Q = (E - S) / (i omega - conj(lambda)) and Q' = E + conj(lambda) Q.
    """
    shift = omega - split
    growth = math.expm1(damping * tau) if damping > 0.0 else 0.0
    half, half_cosine, _ = sine_cosine(0.5 * shift * tau)
    turn = 2.0 * half * half_cosine
    # exp((damping + i shift) tau) - 1
    re = growth * (1.0 - 2.0 * half * half) - 2.0 * half * half
    im = (1.0 + growth) * turn
    square = damping * damping + shift * shift
    if square > 0.0:
        ratio_re = (re * damping + im * shift) / square
        ratio_im = (im * damping - re * shift) / square
    else:
        ratio_re = tau
        ratio_im = 0.0
    # exp(lambda tau) = c + i sine
    c = 1.0 + c_less_1 - damping * s
    sine = s * split
    e_re = c * ratio_re - sine * ratio_im
    e_im = c * ratio_im + sine * ratio_re
    total = omega + split
    square = damping * damping + total * total
    re = e_re - s
    q_re = (re * damping + e_im * total) / square
    q_im = (e_im * damping - re * total) / square
    return q_re, q_im, e_re - damping * q_re + split * q_im, e_im - damping * q_im - split * q_re


@declared.taylor.of(HarmonicForce)
def _taylor(forcing, osc, a, j, phase, tau):
    omega = forcing.omega
    force_even = -osc.strength * omega * omega * phase.sin
    force_odd = -osc.strength * omega * omega * omega * phase.cos
    decrease = -omega * omega
    twice = 2.0 * osc.damping
    reach = max(osc.rate, omega) * tau
    lower = a
    upper = j
    power = 0.5 * tau  # tau**(n-1) / n! of the n-th derivative
    dv = a * tau
    dx = a * power
    remainder = 0.5 * reach
    n = 3.0
    # Relative to the second term, since the first one may be zero.
    while remainder > declared.TAYLOR_REMAINDER * reach:
        dv += upper * power * tau
        power *= tau / n
        dx += upper * power
        following = (force_even - osc.stiffness * lower) - twice * upper
        lower = upper
        upper = following
        force_next = force_even * decrease
        force_even = force_odd
        force_odd = force_next
        remainder *= reach / n
        n += 1.0
    return dx * tau, dv

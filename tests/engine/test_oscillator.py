"""The exact flow against closed forms in 100-digit arithmetic, and the bounds on its derivatives.

The closed form is the textbook one; where two of its rates coincide the parameter is moved by
1e-40, which 120 digits carry and a double cannot see.
"""

import math
import random
from typing import NamedTuple

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from mpmath import mp, mpf

from damper.engine.bounds import bounds_ahead, energy_norm
from damper.engine.compiled import compiled
from damper.engine.forcing import bound_of, phase_at
from damper.engine.forcing.harmonic import harmonic
from damper.engine.oscillator import (
    TAYLOR_RANGE,
    Motion,
    arrive,
    higher_derivatives,
    increments,
    motion_from,
    oscillator,
)
from damper.engine.search import HORIZON
from damper.engine.trigonometry import sine_cosine

EPS = np.finfo(float).eps
DIGITS = 120
NUDGE = mpf(10) ** -40


class Case(NamedTuple):
    """An oscillator under sin(omega t + phase) and its state at time 0."""

    damping: float
    stiffness: float
    strength: float
    omega: float
    phase: float
    x: float
    v: float


@compiled
def _start(damping, stiffness, strength, omega, phase, x, v):
    forcing = harmonic(omega, phase)
    osc = oscillator(damping, stiffness, strength, forcing)
    return osc, motion_from(osc, x, v, phase_at(forcing, 0.0, 0.0))


@compiled
def flow(damping, stiffness, strength, omega, phase, x, v, a, j, tau):
    """Increments and the phase, the state formed as such, the regime; one entry for Python."""
    osc, start = _start(damping, stiffness, strength, omega, phase, x, v)
    start = Motion(start.x, start.v, a, j, start.phase)
    dx, dv, phase = increments(osc, start, tau)
    x, v = arrive(osc, start, tau)
    return dx, dv, phase.sin, phase.cos, x, v, osc.regime, osc.rate


@compiled
def derivatives(damping, stiffness, strength, omega, phase, x, v):
    """Second to sixth derivative at the start, and the phase's sine and cosine."""
    osc, start = _start(damping, stiffness, strength, omega, phase, x, v)
    snap, crackle, sixth = higher_derivatives(osc, start)
    return start.a, start.j, snap, crackle, sixth, start.phase.sin, start.phase.cos


class Responses(NamedTuple):
    """Motion at one time from (1, 0), from (0, 1) and, forced by exp(i omega t), from rest."""

    c: mpf
    c_dot: mpf
    s: mpf
    s_dot: mpf
    q: mp.mpc
    q_dot: mp.mpc


def responses(case: Case, tau: float) -> Responses:
    """Return the closed form at the precision that is set; arguments are exact binary values."""
    b, k, w, t = mpf(case.damping), mpf(case.stiffness), mpf(case.omega), mpf(tau)
    if b**2 == k:
        b += NUDGE
    root = mp.sqrt(mp.mpc(b**2 - k))
    one, two = -b + root, -b - root
    if one == mp.mpc(0, w):
        w += NUDGE
    grow_one, grow_two = mp.exp(one * t), mp.exp(two * t)
    s = (grow_one - grow_two) / (one - two)
    s_dot = (one * grow_one - two * grow_two) / (one - two)
    c = s_dot + 2 * b * s
    gain = 1 / (k - w**2 + 2j * b * w)
    turn = mp.expj(w * t)
    c_dot = -k * s
    q = gain * (turn - c - 1j * w * s)
    q_dot = gain * (1j * w * turn - c_dot - 1j * w * s_dot)
    return Responses(mp.re(c), mp.re(c_dot), mp.re(s), mp.re(s_dot), q, q_dot)


class Start(NamedTuple):
    """Correctly rounded second and third derivative, and the phase as the oscillator has it."""

    a: float
    j: float
    turn: mp.mpc


def start(case: Case) -> Start:
    """What the motion follows from, beside displacement and velocity."""
    *_, sin, cos = derivatives(*case)
    b, k, f, w, _, x, v = (mpf(value) for value in case)
    a = f * mpf(sin) - 2 * b * v - k * x
    return Start(float(a), float(f * w * mpf(cos) - 2 * b * a - k * v), mp.mpc(cos, sin))


def errors(case: Case, tau: float) -> tuple[float, ...]:
    """Return the errors of dx, dv, x and v in units of roundoff.

    While a Taylor series serves, the unit is the roundoff of the increment's own first terms:
    relative accuracy. It serves the free motion longer than the forced one if the force is fast.
    Beyond, the unit is that of x0, v0 and the forced part. All times 1 + (oscillations) * time,
    which rounding an angle costs in any arithmetic.
    """
    stiffness, strength, omega, x0, v0 = case.stiffness, case.strength, case.omega, case.x, case.v
    with mp.workdps(DIGITS):
        a, j, turn = start(case)
        got_dx, got_dv, sin, cos, got_x, got_v, _, rate = flow(*case, a, j, tau)
        f = responses(case, tau)
        x = x0 * f.c + v0 * f.s + strength * mp.im(f.q * turn)
        v = x0 * f.c_dot + v0 * f.s_dot + strength * mp.im(f.q_dot * turn)
        angle = mpf(omega) * tau
        phase = turn * mp.expj(angle)
        assert abs(mp.mpc(cos, sin) - phase) <= 3 * EPS * (1 + omega * tau)
        forced, forced_v = strength * abs(f.q), strength * abs(f.q_dot)
        if max(rate, omega) * tau <= TAYLOR_RANGE:
            size_dv = abs(a) * tau + abs(j) * tau**2 / 2 + strength * omega**2 * tau**3 / 6
            size_dx = size_dv * tau / 2
        elif rate * tau <= TAYLOR_RANGE:
            size_dx = abs(x0 * (f.c - 1)) + abs(v0 * (f.s - tau)) + forced
            size_dv = abs(x0 * f.c_dot) + abs(v0 * (f.s_dot - 1)) + forced_v
        else:
            size_dx = abs(x0) + abs(v0 * tau) + forced
            size_dv = abs(x0 * f.c_dot) + abs(v0) + forced_v
        swing = math.sqrt(max(stiffness - case.damping**2, 0.0))
        unit = EPS * (1 + (omega + swing) * tau)
        # Formed as such, as after a long time, nothing rounds in units of v0 tau.
        slow = 1 / rate + 2 * case.damping / stiffness
        pairs = (
            (got_dx - (x - x0 - v0 * mpf(tau)), size_dx),
            (got_dv - (v - v0), size_dv),
            (got_x - x, abs(x0) + abs(v0) * min(tau, slow) + forced + strength),
            (got_v - v, abs(x0 * f.c_dot) + abs(v0) + forced_v + strength),
        )
        # What is smaller than the last term is lost in the reference's own digits.
        found = [float(abs(error) / (unit * size + 1e-90)) for error, size in pairs]
        return tuple(found if tau >= 10.0 else found[:2])


#: Damping, stiffness, strength: the primary, both masses together, a support with its free mass.
OSCILLATORS = (
    [(zeta, 1.0, 1.0) for zeta in (0.0, 1e-12, 0.05, 1 - 1e-12, 1.0, 1 + 1e-12, 1.3, 3.0, 10.0)]
    + [
        (zeta / m, 1 / m, 1 / m)
        for zeta, m in ((0.05, 1.1), (1.0, 1.5), (10.0, 101.0), (10.0, 1e18))
    ]
    + [
        (0.0, 4e6, 0.0),
        (1000.0, 1e-100, 0.0),
        (500.0, 1e6, 0.0),
        (1.0, 1.0, 0.0),
        (1000.0, 1.0, 0.0),
    ]
)
OMEGAS = [1e-3, 0.01, 0.2, 0.97, 1 - 1e-9, 1.0, 1 + 1e-9, 1.016, 3.0, 100.0, 1e3]
TAUS = [1e-12, 1e-8, 1e-5, 1e-3, 0.03, 0.24, 0.26, 0.49, 0.51, 1.0, 3.0, 10.0, HORIZON]
STATES = [(0.7, -0.4, 0.3), (0.0, 0.0, 0.0), (0.0, 0.0, 1.1), (-1e-3, 5.0, 2.5), (20.0, 0.0, -1.7)]


@pytest.mark.parametrize("numbers", OSCILLATORS, ids=str)
def test_motion_against_120_digits(numbers: tuple) -> None:
    """Each frequency, with some of the times and states."""
    draw = random.Random(str(numbers))
    for omega in OMEGAS:
        for tau in draw.sample(TAUS, 5):
            x, v, phase = draw.choice(STATES)
            found = errors(Case(*numbers, omega, phase, x, v), tau)
            assert max(found) <= 20, (omega, tau, found)


@pytest.mark.parametrize("gain", [2.0, 3.9, 4.1, 31.0, 1e6])
def test_no_digits_are_lost_on_the_way_to_resonance(gain: float) -> None:
    """Steady and free part cancel by the gain there."""
    for detuning, zeta in ((-1.0 / gain, 0.0), (1.0 / gain, 0.5 / gain)):
        for tau in (0.6, 3.0, 10.0, 25.0):
            for x, v, phase in STATES[:3]:
                case = Case(zeta, 1.0, 1.0, math.sqrt(1.0 + detuning), phase, x, v)
                found = errors(case, tau)
                assert max(found) <= 8, (detuning, tau, found)


@pytest.mark.parametrize("zeta", [0.0, 0.3, 1.0, 5.0])
def test_derivatives_against_the_closed_form(zeta: float) -> None:
    case = Case(zeta, 1.0, 1.0, 0.7, 0.3, 0.7, -0.4)
    *found, sin, cos = derivatives(*case)
    with mp.workdps(DIGITS):

        def x(tau: mpf) -> mpf:
            f = responses(case, tau)
            return case.x * f.c + case.v * f.s + mp.im(f.q * mp.mpc(cos, sin))

        exact = mp.taylor(x, 0, 6)
        for order, value in enumerate(found, start=2):
            assert value == pytest.approx(float(exact[order] * mp.factorial(order)), rel=1e-13)


# --- bounds


@compiled
def excess(damping, stiffness, strength, omega, phase, x, v, span, count):
    """By how much |x''| ... |x^(5)| exceed their bounds on a span, in units of their roundoff."""
    osc, start = _start(damping, stiffness, strength, omega, phase, x, v)
    forcing = osc.forcing
    bound2, bound3 = bounds_ahead(osc, start, span)
    snap, crackle, _ = higher_derivatives(osc, start)
    growth3 = osc.strength * bound_of(forcing, 3) * span
    growth4 = osc.strength * bound_of(forcing, 4) * span
    bound4 = energy_norm(osc, start.j, snap) + growth3
    bound5 = energy_norm(osc, snap, crackle) + growth4
    rate = 1.0 + forcing.omega + osc.rate
    worst = 0.0
    tightest = math.inf
    for k in range(count + 1):
        tau = span * k / count
        dx, dv, phase = increments(osc, start, tau)
        motion = motion_from(osc, start.x + (start.v * tau + dx), start.v + dv, phase)
        snap, crackle, _ = higher_derivatives(osc, motion)
        # Of x'' when formed from x and v, which the bounds themselves have not got.
        size = (
            osc.strength
            + osc.coupling * (abs(motion.v) + abs(start.v))
            + osc.stiffness * (abs(motion.x) + abs(start.x))
        )
        noise = 2.2e-16 * (1.0 + forcing.omega * tau) * (1.0 + size) * rate
        worst = max(
            worst,
            (abs(motion.a) - bound2) / noise,
            (abs(motion.j) - bound3) / (noise * rate),
            (abs(snap) - bound4) / (noise * rate * rate),
            (abs(crackle) - bound5) / (noise * rate * rate * rate),
        )
        tightest = min(tightest, bound2 / max(abs(motion.a), 1e-300))
    return worst, tightest


exponents = st.floats(-3, 3).map(lambda k: 10.0**k)


@settings(max_examples=300)
@given(
    zeta=st.one_of(st.just(0.0), st.floats(-3, 1).map(lambda k: 10.0**k)),
    inertia=st.one_of(st.just(1.0), st.floats(0, 18).map(lambda k: 10.0**k)),
    omega=st.one_of(st.just(1.0), exponents),
    x=st.floats(-20, 20),
    v=st.floats(-20, 20),
    phase=st.floats(-4, 4),
    reach=st.floats(-6, 1.2),
)
def test_bounds_hold(
    zeta: float, inertia: float, omega: float, x: float, v: float, phase: float, reach: float
) -> None:
    """Densely sampled, for the second to the fifth derivative."""
    case = Case(zeta / inertia, 1.0 / inertia, 1.0 / inertia, omega, phase, x, v)
    worst, _ = excess(*case, 10.0**reach / max(1.0, omega), 100)
    assert worst <= 64.0


# --- sine and cosine


@settings(max_examples=300)
@given(
    angle=st.one_of(
        st.floats(-8, 8),
        st.floats(-1e6, 1e6),
        st.floats(-300, 0).map(lambda k: 10.0**k),
        st.tuples(st.integers(1, 99_999), st.integers(-3, 3)).map(
            lambda pair: pair[0] * math.pi / 2 * (1 + pair[1] * EPS)
        ),
    )
)
def test_sine_and_cosine(angle: float) -> None:
    """To an ulp of one, also near quarter turns; a small sine, and cosine less one, relatively."""
    sine, cosine, less_1 = sine_cosine(angle)
    with mp.workdps(40):
        exact, reduced = mp.sin(mpf(angle)), 2e-16 + 1.5e-21 * abs(angle)
        assert abs(sine - exact) <= reduced
        assert abs(cosine - mp.cos(mpf(angle))) <= reduced
        exact_less_1 = -2 * mp.sin(mpf(angle) / 2) ** 2
        assert abs(less_1 - exact_less_1) <= 2 * reduced
        if abs(angle) < 0.7:
            assert abs(sine - exact) <= 2 * EPS * abs(exact)
            assert abs(less_1 - exact_less_1) <= 4 * EPS * abs(exact_less_1) + 1e-300

"""The exact flow against closed forms in 100-digit arithmetic, and the bounds on its derivatives.

The closed form is the textbook one; where two of its rates coincide the parameter is moved by
1e-40, which 120 digits carry and a double cannot see.
"""

import math
from typing import NamedTuple

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from mpmath import mp, mpf

from damper.engine.oscillator import (
    TAYLOR_RANGE,
    acceleration,
    advance,
    arrive,
    derivative_bounds,
    energy_norm,
    higher_derivatives,
    increments,
    oscillator,
    relax,
    sine_cosine,
)

EPS = np.finfo(float).eps
DIGITS = 120
NUDGE = mpf(10) ** -40


class Responses(NamedTuple):
    """Motion at one time from (1, 0), from (0, 1) and, forced by exp(i omega t), from rest."""

    c: mpf
    c_dot: mpf
    s: mpf
    s_dot: mpf
    q: mp.mpc
    q_dot: mp.mpc


def responses(beta: float, kappa: float, omega: float, tau: float) -> Responses:
    """Return the closed form at the precision that is set; arguments are exact binary values."""
    b, k, w, t = mpf(beta), mpf(kappa), mpf(omega), mpf(tau)
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
    """A state as doubles, with the derivatives and the phase factors that belong to it."""

    x: float
    v: float
    a: float
    j: float
    sin: float
    cos: float


def start(osc: tuple, x: float, v: float, phase: float) -> Start:
    """Return the start with correctly rounded derivatives."""
    beta, kappa, force, omega = (mpf(value) for value in osc[:4])
    sin, cos = math.sin(phase), math.cos(phase)
    a = force * mpf(sin) - 2 * beta * v - kappa * x
    j = force * omega * mpf(cos) - 2 * beta * a - kappa * v
    return Start(x, v, float(a), float(j), sin, cos)


def errors(osc: tuple, s: Start, tau: float) -> tuple[float, float]:
    """Return the errors of dx and dv in units of rounding.

    While a Taylor series serves, the unit is the rounding of the increment's own first terms:
    relative accuracy. It serves the free motion longer than the forced one if the force is fast.
    Beyond, the unit is that of x0, v0 and the forced part. All times 1 + (oscillations) * time,
    which rounding an angle costs in any arithmetic.
    """
    with mp.workdps(DIGITS):
        beta, kappa, force, omega = osc[:4]
        f = responses(beta, kappa, omega, tau)
        turn = mp.mpc(s.cos, s.sin)
        dx = s.x * (f.c - 1) + s.v * (f.s - tau) + force * mp.im(f.q * turn)
        dv = s.x * f.c_dot + s.v * (f.s_dot - 1) + force * mp.im(f.q_dot * turn)
        if osc[10] * tau <= TAYLOR_RANGE:
            size_dv = abs(s.a) * tau + abs(s.j) * tau**2 / 2 + force * omega**2 * tau**3 / 6
            size_dx = size_dv * tau / 2
        elif (2.0 * beta + math.sqrt(kappa)) * tau <= TAYLOR_RANGE:
            size_dx = abs(s.x * (f.c - 1)) + abs(s.v * (f.s - tau)) + force * abs(f.q)
            size_dv = abs(s.x * f.c_dot) + abs(s.v * (f.s_dot - 1)) + force * abs(f.q_dot)
        else:
            size_dx = abs(s.x) + abs(s.v * tau) + force * abs(f.q)
            size_dv = abs(s.x * f.c_dot) + abs(s.v) + force * abs(f.q_dot)
        turns = 1 + (omega + math.sqrt(max(kappa - beta**2, 0.0))) * tau
        got_dx, got_dv, sin, cos = increments(osc, *s, tau)
        angle = mpf(omega) * tau
        phase_error = max(
            abs(sin - (s.sin * mp.cos(angle) + s.cos * mp.sin(angle))),
            abs(cos - (s.cos * mp.cos(angle) - s.sin * mp.sin(angle))),
        )
        assert phase_error <= 2 * EPS * (1 + omega * tau)
        return tuple(
            float(abs(got - exact) / (EPS * turns * size)) if size else float(abs(got - exact))
            for got, exact, size in ((got_dx, dx, size_dx), (got_dv, dv, size_dv))
        )


ZETAS = [0.0, 1e-12, 0.05, 1 - 1e-12, 1.0, 1 + 1e-12, 1.3, 3.0, 40.0, 2000.0, 1e6]
OMEGAS = [1e-4, 0.01, 0.2, 0.97, 1 - 1e-9, 1.0, 1 + 1e-9, 1.016, 3.0, 100.0, 1e4]
TAUS = [*(10.0**k for k in range(-12, 0)), 0.24, 0.26, 0.49, 0.51, 1.0, 3.0, 10.0, 25.0]
STATES = [(0.7, -0.4, 0.3), (0.0, 0.0, 0.0), (0.0, 0.0, 1.1), (-1e-3, 5.0, 2.5), (20.0, 0.0, -1.7)]


@pytest.mark.parametrize("zeta", ZETAS)
@pytest.mark.parametrize("mass_ratio", [0.0, 0.1, 100.0], ids="mass_ratio={}".format)
def test_increments_against_120_digits(zeta: float, mass_ratio: float) -> None:
    """Every regime; a positive mass ratio stands for sticking. Largest error measured: 27 units."""
    inertia = 1.0 + mass_ratio
    states = STATES if mass_ratio == 0.0 else STATES[:3]
    for omega in OMEGAS:
        osc = oscillator(zeta / inertia, 1.0 / inertia, 1.0 / inertia, omega)
        for tau in TAUS:
            for state in states:
                found = errors(osc, start(osc, *state), tau)
                assert max(found) <= 40, (omega, tau, state, found)


@pytest.mark.parametrize("gain", [1.0, 2.0, 3.9, 4.1, 10.0, 31.0, 100.0, 1e6])
def test_no_digits_are_lost_on_the_way_to_resonance(gain: float) -> None:
    """Steady and free part cancel by the gain there. Largest error measured: 4 units."""
    for detuning in (-1.0 / gain, 1.0 / gain):
        for zeta in (0.0, 0.5 / gain):
            omega = math.sqrt(1.0 + detuning) if detuning > -1.0 else 0.1
            osc = oscillator(zeta, 1.0, 1.0, omega)
            for tau in (0.6, 1.0, 2.0, 3.0, 5.0, 10.0, 25.0):
                for state in STATES:
                    found = errors(osc, start(osc, *state), tau)
                    assert max(found) <= 8, (omega, zeta, tau, state, found)


@pytest.mark.parametrize("zeta", ZETAS)
@pytest.mark.parametrize("omega", OMEGAS)
def test_increments_keep_relative_accuracy_as_time_shrinks(zeta: float, omega: float) -> None:
    """dx ~ tau**2: its own digits must survive although x does not change in double precision."""
    osc = oscillator(zeta, 1.0, 1.0, omega)
    s = start(osc, 0.7, -0.4, 0.3)
    for k in range(1, 13):
        tau = 10.0**-k * TAYLOR_RANGE / osc[10]
        dx, dv, _, _ = increments(osc, *s, tau)
        with mp.workdps(DIGITS):
            f = responses(zeta, 1.0, omega, tau)
            turn = mp.mpc(s.cos, s.sin)
            exact_dx = s.x * (f.c - 1) + s.v * (f.s - tau) + mp.im(f.q * turn)
            exact_dv = s.x * f.c_dot + s.v * (f.s_dot - 1) + mp.im(f.q_dot * turn)
            assert abs(dx / exact_dx - 1) <= 6 * EPS
            assert abs(dv / exact_dv - 1) <= 6 * EPS


def test_increments_are_continuous_where_the_form_changes() -> None:
    """Neighbouring doubles on both sides of the Taylor range give the same motion."""
    for zeta in ZETAS:
        for omega in OMEGAS:
            osc = oscillator(zeta, 1.0, 1.0, omega)
            s = start(osc, 0.7, -0.4, 0.3)
            tau = TAYLOR_RANGE / osc[10]
            below, above = tau * (1 - 4 * EPS), tau * (1 + 4 * EPS)
            assert osc[10] * below <= TAYLOR_RANGE < osc[10] * above
            for one, two in zip(
                increments(osc, *s, below), increments(osc, *s, above), strict=True
            ):
                assert one == pytest.approx(two, rel=0, abs=1e-14)


def test_no_time_no_motion() -> None:
    for zeta in ZETAS:
        osc = oscillator(zeta, 1.0, 1.0, 0.3)
        s = start(osc, 0.7, -0.4, 0.3)
        assert increments(osc, *s, 0.0) == (0.0, 0.0, s.sin, s.cos)


@pytest.mark.parametrize("zeta", [0.0, 0.3, 1.0, 5.0])
def test_derivatives_against_the_closed_form(zeta: float) -> None:
    osc = oscillator(zeta, 1.0, 1.0, 0.7)
    s = start(osc, 0.7, -0.4, 0.3)
    a, j = acceleration(osc, s.x, s.v, s.sin, s.cos)
    snap, crackle = higher_derivatives(osc, a, j, s.sin, s.cos)
    with mp.workdps(DIGITS):

        def x(tau: mpf) -> mpf:
            f = responses(zeta, 1.0, 0.7, tau)
            return s.x * f.c + s.v * f.s + mp.im(f.q * mp.mpc(s.cos, s.sin))

        exact = mp.taylor(x, 0, 5)
        for order, value in zip((2, 3, 4, 5), (a, j, snap, crackle), strict=True):
            assert value == pytest.approx(float(exact[order] * mp.factorial(order)), rel=1e-14)


exponents = st.floats(-4, 4)
signed = st.floats(-20, 20)


@settings(max_examples=400)
@given(
    zeta=st.one_of(st.just(0.0), st.floats(-3, 4).map(lambda k: 10.0**k)),
    inertia=st.one_of(st.just(1.0), st.floats(1, 101)),
    omega=st.one_of(st.just(1.0), exponents.map(lambda k: 10.0**k)),
    x=signed,
    v=signed,
    phase=st.floats(-4, 4),
    reach=st.floats(-6, 1.2),
    derived=st.booleans(),
)
def test_derivative_bounds_hold(
    zeta: float,
    inertia: float,
    omega: float,
    x: float,
    v: float,
    phase: float,
    reach: float,
    derived: bool,
) -> None:
    """Of the motion, and (`derived`) of its second derivative, as release and lift-off need."""
    osc = oscillator(zeta / inertia, 1.0 / inertia, 1.0 / inertia, omega)
    s = start(osc, x, v, phase)
    span = 10.0**reach / max(1.0, omega)
    if derived:
        snap, crackle = higher_derivatives(osc, s.a, s.j, s.sin, s.cos)
        force2 = osc[2] * omega * omega
        bounds = derivative_bounds(osc, force2, s.a, s.j, snap, crackle, span)
    else:
        bounds = derivative_bounds(osc, osc[2], s.x, s.v, s.a, s.j, span)
    for tau in np.linspace(0.0, span, 60).tolist():
        dx, dv, sin, cos = increments(osc, *s, tau)
        x1, v1 = s.x + s.v * tau + dx, s.v + dv
        a, j = acceleration(osc, x1, v1, sin, cos)
        # Rounding of a and j when formed from x and v, which the bound itself has not got.
        noise = 16 * EPS * (1 + omega * tau) * (osc[2] + 2 * osc[0] * abs(s.v) + abs(x1) + abs(v1))
        rate = 1 + omega + 2 * osc[0]
        second, third = (a, j)
        if derived:
            second, third = higher_derivatives(osc, a, j, sin, cos)
            noise *= rate**2
        assert abs(second) <= bounds[0] * (1 + 8 * EPS) + noise * rate
        assert abs(third) <= bounds[1] * (1 + 8 * EPS) + noise * rate**2


@settings(max_examples=400)
@given(
    zeta=st.one_of(st.just(0.0), st.floats(-3, 1).map(lambda k: 10.0**k)),
    omega=st.one_of(st.just(1.0), exponents.map(lambda k: 10.0**k)),
    x=signed,
    v=signed,
    phase=st.floats(-4, 4),
    reach=st.floats(-6, 1.2),
)
def test_energy_norm_bounds_the_fourth_and_fifth_derivative(
    zeta: float, omega: float, x: float, v: float, phase: float, reach: float
) -> None:
    """Its growth over a span is at most that of the force's derivative."""
    osc = oscillator(zeta, 1.0, 1.0, omega)
    s = start(osc, x, v, phase)
    span = 10.0**reach / max(1.0, omega)
    snap, crackle = higher_derivatives(osc, s.a, s.j, s.sin, s.cos)
    fourth = energy_norm(osc, s.j, snap) + osc[2] * omega**3 * span
    fifth = energy_norm(osc, snap, crackle) + osc[2] * omega**4 * span
    rate = 1 + omega + 2 * zeta
    for tau in np.linspace(0.0, span, 60).tolist():
        dx, dv, sin, cos = increments(osc, *s, tau)
        x1, v1 = s.x + s.v * tau + dx, s.v + dv
        a, j = acceleration(osc, x1, v1, sin, cos)
        snap, crackle = higher_derivatives(osc, a, j, sin, cos)
        noise = 16 * EPS * (1 + omega * tau) * (1 + 2 * zeta * abs(s.v) + abs(x1) + abs(v1))
        assert abs(snap) <= fourth * (1 + 8 * EPS) + noise * rate**3
        assert abs(crackle) <= fifth * (1 + 8 * EPS) + noise * rate**4


def test_derivative_bounds_are_not_idle() -> None:
    """Within twice the truth for a free, undamped oscillator and at resonance."""
    for x, v, phase in [(1.0, 0.0, 0.0), (0.0, 0.0, 0.0), (3.0, -2.0, 1.0)]:
        osc = oscillator(0.0, 1.0, 1.0, 1.0)
        s = start(osc, x, v, phase)
        path = []
        for tau in np.linspace(0.0, 2.0, 200).tolist():
            dx, dv, sin, cos = increments(osc, *s, tau)
            path.append(acceleration(osc, s.x + s.v * tau + dx, s.v + dv, sin, cos))
        bounds = derivative_bounds(osc, 1.0, s.x, s.v, s.a, s.j, 2.0)
        peaks = np.abs(path).max(axis=0)
        assert np.all(bounds >= peaks)
        assert np.all(bounds <= 2.1 * peaks + 1.1)


def test_sharp_resonance_does_not_cancel() -> None:
    """Undamped, near omega = 1: the steady part alone would be 1e9, the motion is about tau/2."""
    tau = 25.0
    osc = oscillator(0.0, 1.0, 1.0, 1.0 + 1e-9)
    dx, _, _, _ = increments(osc, 0.0, 0.0, 0.0, osc[3], 0.0, 1.0, tau)
    secular = 0.5 * (math.sin(tau) - tau * math.cos(tau))
    assert dx == pytest.approx(secular, abs=1e-6)
    osc = oscillator(0.0, 1.0, 1.0, 1.0)
    dx, _, _, _ = increments(osc, 0.0, 0.0, 0.0, 1.0, 0.0, 1.0, tau)
    assert dx == pytest.approx(secular, abs=1e-13)


@settings(max_examples=1000)
@given(
    angle=st.one_of(
        st.floats(-8, 8), st.floats(-1e6, 1e6), st.floats(-300, 0).map(lambda k: 10.0**k)
    )
)
def test_sine_and_cosine(angle: float) -> None:
    """To an ulp of one; a small sine, and cosine less one, relative to themselves."""
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


@pytest.mark.parametrize("quarters", [1, 2, 3, 4, 7, 1000, 99_999])
def test_sine_and_cosine_near_quarter_turns(quarters: int) -> None:
    for k in range(-3, 4):
        angle = quarters * math.pi / 2
        angle += k * np.spacing(angle)
        sine, cosine, _ = sine_cosine(angle)
        with mp.workdps(40):
            assert abs(sine - mp.sin(mpf(angle))) < 2e-16 + 1.5e-21 * angle
            assert abs(cosine - mp.cos(mpf(angle))) < 2e-16 + 1.5e-21 * angle


@pytest.mark.parametrize("beta", [0.0, 1e-9, 0.05, 0.999999, 1.0, 3.0, 1e3])
@pytest.mark.parametrize("omega", [0.37, 1.0, 7.3])
@pytest.mark.parametrize("tau", [2.0, 25.293586195180865])
def test_state_formed_as_such_is_the_one_by_increments(
    beta: float, omega: float, tau: float
) -> None:
    """To the rounding of v tau, by which they may differ."""
    osc = oscillator(beta, 1.0, 1.0, omega)
    x, v, sin, cos = 0.7, -1.3, math.sin(0.4), math.cos(0.4)
    dx, v1 = advance(osc, x, v, sin, cos, tau)
    end, speed = arrive(osc, x, v, sin, cos, tau)
    assert end == pytest.approx(x + dx, abs=1e-13)
    assert speed == pytest.approx(v1, abs=1e-13)


@pytest.mark.parametrize("beta", [1.5, 30.0, 1e3, 1e6])
@pytest.mark.parametrize("omega", [1e-4, 0.37, 7.3])
@pytest.mark.parametrize("tau", [1e-3, 2.0, 25.3])
def test_a_velocity_that_damping_has_eaten_leaves_no_rounding(
    beta: float, omega: float, tau: float
) -> None:
    """Relative to what is left of the motion, not to the velocity that it began with."""
    osc = oscillator(beta, 1.0, 1.0, omega)
    x, v, angle = 1e-7, -1.3, 0.4
    with mp.workdps(DIGITS):
        exact = responses(beta, 1.0, omega, tau)
        turn = mp.expj(mpf(angle))
        end = x * exact.c + v * exact.s + (turn * exact.q).imag - mpf(x)
        speed = x * exact.c_dot + v * exact.s_dot + (turn * exact.q_dot).imag
        # What force and spring make of it, beside what is left of v.
        size = (abs(v * exact.s_dot) + 1 / mpf(2 * beta), abs(v * exact.s) + tau / mpf(2 * beta))
    dx, v1 = relax(osc, x, v, math.sin(angle), math.cos(angle), tau)
    rounding = (8.0 + omega * tau) * EPS
    assert abs(dx - end) < rounding * size[1]
    assert abs(v1 - speed) < rounding * size[0]

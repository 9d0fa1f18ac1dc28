"""The flow in contact against matrix exponentials in 60 digits."""

import math

import numpy as np
import pytest
from mpmath import mp, mpf

from damper.models.compliant.flow import (
    Touch,
    advance,
    derivative,
    energy_size,
    propagators,
    touch_of,
)

#: mass ratio, damping ratio, frequency ratio, stiffness, contact damping.
CASES = [
    (0.1, 0.05, 0.8, 1e2, 0.2),
    (0.1, 0.05, 0.2, 1e10, 0.2),
    (0.5, 0.0, 1.0, 1e10, 0.0),
    (1e-9, 0.02, 0.3, 1e10, 0.3),
    (1e6, 1.0, 1e-3, 1e6, 2.0),
    (0.1, 100.0, 1.0, 1e4, 0.2),
    (0.1, 0.1, 1e4, 1e6, 1.0),
    (0.3, 0.02, 1.0, 1e10, 500.0),
]
START = (0.3, -0.2, 0.0, -1e-3, math.sin(0.7), math.cos(0.7))


def touch(*numbers: float) -> Touch:
    *values, levels = touch_of(*numbers)
    return Touch(*values, int(levels))


def exact(t: Touch, z: tuple, tau: float) -> list:
    """State by scaling and squaring the matrix exponential."""
    with mp.workdps(60):
        alpha, beta, drag = mpf(t.share), mpf(t.reduced), mpf(t.drag)
        push = [-1, -drag, -beta, -drag * beta, 1, 0]
        a = mp.matrix(6, 6)
        a[0, 1] = a[2, 3] = 1
        for j in range(6):
            a[1, j], a[3, j] = alpha * push[j], push[j]
        a[3, 2] -= mpf(t.relative_stiffness)
        a[3, 3] -= mpf(t.relative_damping)
        a[4, 5], a[5, 4] = mpf(t.omega), -mpf(t.omega)
        halvings = max(0, int(mp.log(mpf(t.rate) * tau, 2)) + 8)
        part = a * mpf(tau) / mpf(2) ** halvings
        total, term = mp.eye(6), mp.eye(6)
        for n in range(1, 40):
            term = term * part / n
            total += term
        for _ in range(halvings):
            total = total * total
        return list(total * mp.matrix([mpf(value) for value in z]))


@pytest.mark.parametrize("numbers", CASES)
@pytest.mark.parametrize("swings", [1e-3, 2.0, 30.0, 1e3, math.inf])
def test_flow_in_contact(numbers: tuple, swings: float) -> None:
    t = touch(*numbers)
    frequency = math.sqrt(t.relative_stiffness)
    tau = min(swings / frequency, 20.0)
    found, right = advance(t, propagators(t), START, tau), exact(t, START, tau)
    # A phase of the contact's oscillation cannot be better than rounding of frequency times time.
    phase = 1e-15 * (1.0 + frequency * tau)
    swing = 1e-3 * math.exp(-min(0.5 * t.relative_damping * tau, 700.0))
    if t.relative_damping > 2.0 * frequency:
        swing = 1e-3
    # The push of order one sets the gap's scale 1 / frequency^2 once the oscillation has died.
    force = 1e-14 + 1e-15 * t.omega * tau
    gap = min(tau * tau, 1.0 / frequency**2) * force + phase * swing * min(tau, 1.0 / frequency)
    rate = min(tau, 1.0 / frequency) * force + phase * swing
    for value, reference, allowed in zip(found, right, (3e-14, 3e-14, gap, rate), strict=False):
        assert abs(value - reference) <= allowed + 1e-15 * abs(reference)


def test_short_steps_keep_the_gap_relative_to_itself() -> None:
    t = touch(*CASES[1])
    for tau in (1e-12, 1e-9, 1e-7):
        found, right = advance(t, propagators(t), START, tau), exact(t, START, tau)
        assert abs(found[2] / right[2] - 1) < 1e-15


def test_a_long_way_is_many_short_ones() -> None:
    t = touch(*CASES[1])
    table = propagators(t)
    z = START
    for _ in range(64):
        z = advance(t, table, z, 0.25 / 64)
    once = advance(t, table, START, 0.25)
    np.testing.assert_allclose(z[:2], once[:2], rtol=1e-13)
    np.testing.assert_allclose(z[2], once[2], rtol=1e-11)


@pytest.mark.parametrize("numbers", CASES)
def test_energy_grows_by_the_force_at_most(numbers: tuple) -> None:
    """Also of the derivatives of the motion, which bounds every one of them."""
    t = touch(*numbers)
    table = propagators(t)
    for tau in (0.3 / t.rate, 3.0 / t.rate, 0.1, 2.0):
        z, after = START, advance(t, table, START, tau)
        growth = tau
        for _ in range(4):
            before = energy_size(t, z)
            assert energy_size(t, after) <= (before + growth) * (1 + 1e-9) + 1e-15
            z, after, growth = derivative(t, z), derivative(t, after), growth * t.omega

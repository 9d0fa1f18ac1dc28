"""The flow in contact against matrix exponentials in 60 digits."""

import math

import numpy as np
import pytest
from mpmath import mp, mpf

from damper.engine.compiled import compiled
from damper.models.compliant.flow import (
    ContactConstants,
    advance,
    contact_constants,
    derivative,
    energy_size,
    propagators,
)

#: Mass ratio, damping ratio, frequency ratio, stiffness, contact damping; corners of the range.
CASES = [
    (0.1, 0.05, 0.8, 1e2, 0.2),
    (0.1, 0.05, 0.2, 1e8, 0.2),
    (0.5, 0.0, 1.0, 1e8, 0.0),
    (1e-6, 0.02, 0.3, 1e8, 0.3),
    (1e18, 1.0, 1e-3, 1e6, 2.0),
    (0.1, 10.0, 1.0, 1e-3, 0.2),
    (0.1, 0.1, 1e3, 1e6, 1.0),
    (0.3, 0.02, 1.0, 1e8, 500.0),
]
START = (0.3, -0.2, 0.0, -1e-3, math.sin(0.7), math.cos(0.7))


@compiled
def advanced(contact, table, tau):
    """State after a time from START, and the energy of it and of its first derivatives."""
    z = advance(contact, table, START, tau)
    first = derivative(contact, z)
    second = derivative(contact, first)
    third = derivative(contact, second)
    sizes = (
        energy_size(contact, z),
        energy_size(contact, first),
        energy_size(contact, second),
        energy_size(contact, third),
    )
    return z, sizes


def constants(*numbers: float) -> ContactConstants:
    *values, levels, shift = contact_constants(*numbers)
    return ContactConstants(*values, int(levels), shift)


def exact(t: ContactConstants, tau: float) -> list:
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
        return list(total * mp.matrix([mpf(value) for value in START]))


@pytest.mark.parametrize("numbers", CASES, ids=str)
def test_flow_in_contact(numbers: tuple) -> None:
    t = constants(*numbers)
    table = propagators(t)
    frequency = math.sqrt(t.relative_stiffness)
    for swings in (1e-3, 2.0, 30.0, 1e3, math.inf):
        tau = min(swings / frequency, 20.0)
        found, right = advanced(t, table, tau)[0], exact(t, tau)
        # A phase of the contact's oscillation cannot be better than roundoff of frequency times
        # time.
        phase = 1e-15 * (1.0 + frequency * tau)
        swing = 1e-3 * math.exp(-min(0.5 * t.relative_damping * tau, 700.0))
        if t.relative_damping > 2.0 * frequency:
            swing = 1e-3
        # The force of order one sets the gap's scale 1 / frequency^2 once the oscillation has
        # died.
        force = 1e-14 + 1e-15 * t.omega * tau
        slow = min(tau, 1.0 / frequency)
        gap = min(tau * tau, 1.0 / frequency**2) * force + phase * swing * slow
        rate = slow * force + phase * swing
        for value, reference, allowed in zip(found, right, (3e-14, 3e-14, gap, rate), strict=False):
            assert abs(value - reference) <= allowed + 1e-15 * abs(reference), swings


def test_short_steps_keep_the_gap_relative_to_itself() -> None:
    t = constants(*CASES[1])
    for tau in (1e-12, 1e-9, 1e-7):
        found, right = advanced(t, propagators(t), tau)[0], exact(t, tau)
        assert abs(found[2] / right[2] - 1) < 1e-15


@pytest.mark.parametrize("numbers", CASES, ids=str)
def test_energy_grows_by_the_force_at_most(numbers: tuple) -> None:
    """Also of the derivatives of the motion, which bounds every one of them."""
    t = constants(*numbers)
    table = propagators(t)
    before = np.array(advanced(t, table, 0.0)[1])
    for tau in (0.3 / t.rate, 3.0 / t.rate, 0.1, 2.0):
        after = np.array(advanced(t, table, tau)[1])
        growth = tau * t.omega ** np.arange(4)
        assert (after <= (before + growth) * (1 + 1e-9) + 1e-15).all()

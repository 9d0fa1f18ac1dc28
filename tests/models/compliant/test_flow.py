"""The flow in contact against matrix exponentials in 60 digits."""

import math
from collections.abc import Callable
from typing import Any, NamedTuple

import numpy as np
import pytest
from mpmath import mp, mpf

from damper.engine.compiled import compiled
from damper.engine.forcing import bound_of
from damper.engine.forcing.harmonic import HarmonicForce, Phase
from damper.engine.forcing.harmonics import SumOfHarmonics
from damper.engine.forcing.none import ZeroForce
from damper.engine.forcing.record import PiecewiseLinear, RecordPhase
from damper.models.compliant.flow import (
    ContactConstants,
    advance,
    contact_constants,
    derivative,
    energy_size,
    force_rates_in,
    propagators,
)
from damper.models.compliant.pairs import carried

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
MASSES = (0.3, -0.2, 0.0, -1e-3)
THETA = 0.7


class Force(NamedTuple):
    """A force of a strength, its phase at the start; and its pairs: rates and values."""

    forcing: Any
    phase: Any
    strength: float
    share: float
    pairs: list


def harmonic_force(omega: float) -> Force:
    phase = Phase(math.sin(THETA), math.cos(THETA))
    pair = (omega, -omega, phase.sin, phase.cos)
    return Force(HarmonicForce(omega, 0.0), phase, 1.0, 0.0, [pair])


def several(omega: float) -> Force:
    sine, cosine = np.array([0.4, 0.0, -0.3]), np.array([0.2, 0.5, 0.1])
    pairs = []
    for k, (a, b) in enumerate(zip(sine, cosine, strict=True), 1):
        sin, cos = math.sin(k * THETA), math.cos(k * THETA)
        pairs.append((k * omega, -k * omega, a * sin + b * cos, a * cos - b * sin))
    phase = Phase(math.sin(THETA), math.cos(THETA))
    return Force(SumOfHarmonics(omega, 0.0, sine, cosine), phase, 1.5, 1.0, pairs)


def recorded(omega: float) -> Force:
    pieces = np.zeros(1), np.zeros(1), np.array([0.6]), np.array([0.1])
    forcing = PiecewiseLinear(1.0, *pieces, 2.6, 0.1)
    return Force(forcing, RecordPhase(0.6, 0.1, math.inf), 0.5, 1.0, [(1, 0, 0.6, 0.1)])


def none(omega: float) -> Force:
    return Force(ZeroForce(0.0), 0.0, 0.0, 0.0, [])


FORCES = [harmonic_force, several, recorded, none]


@compiled
def advanced(contact, table, phase, tau):
    """State after a time, and the energy of it and of its first derivatives."""
    start = (0.3, -0.2, 0.0, -1e-3)
    z = advance(contact, table, start + carried(contact.forcing, phase), tau)
    f0, f1, f2, _, _ = force_rates_in(contact, z)
    first = derivative(contact, z, f0)
    second = derivative(contact, first, f1)
    third = derivative(contact, second, f2)
    sizes = (
        energy_size(contact, z),
        energy_size(contact, first),
        energy_size(contact, second),
        energy_size(contact, third),
    )
    return z, sizes


def constants(numbers: tuple, force: Force) -> ContactConstants:
    mu, zeta, _, k, z = numbers
    return contact_constants(mu, zeta, k, z, force.forcing, force.strength, force.share)


def exact(numbers: tuple, t: ContactConstants, force: Force, tau: float) -> list:
    """State by scaling and squaring the matrix exponential, from the two masses' own equations."""
    with mp.workdps(60):
        mu, drag = mpf(numbers[0]), mpf(t.drag)
        beta, strength, share = mpf(t.reduced), mpf(force.strength), mpf(force.share)
        size = 4 + 2 * len(force.pairs)
        a = mp.matrix(size, size)
        a[0, 1] = a[2, 3] = 1
        # x'' = S - drag x' - x - (k r + c r'),  y'' = share S + (k r + c r') / mu,  r = x - y.
        x2 = mp.matrix([-1, -drag, -beta, -drag * beta] + [0] * (size - 4))
        wall = mp.matrix([0, 0, mpf(t.stiffness), mpf(t.damping)] + [0] * (size - 4))
        y2 = wall / mu
        x2 -= wall
        start = [mpf(value) for value in MASSES]
        for k, (up, down, p, q) in enumerate(force.pairs):
            place = 4 + 2 * k
            x2[place], y2[place] = strength, share * strength
            a[place, place + 1], a[place + 1, place] = mpf(up), mpf(down)
            start += [mpf(p), mpf(q)]
        for j in range(size):
            a[1, j] = (x2[j] + mu * y2[j]) / (1 + mu)
            a[3, j] = x2[j] - y2[j]
        halvings = max(0, int(mp.log(mpf(t.rate) * tau, 2)) + 8)
        part = a * mpf(tau) / mpf(2) ** halvings
        total, term = mp.eye(size), mp.eye(size)
        for n in range(1, 40):
            term = term * part / n
            total += term
        for _ in range(halvings):
            total = total * total
        return list(total * mp.matrix(start))[:4]


@pytest.mark.parametrize("numbers", CASES, ids=str)
@pytest.mark.parametrize("make", FORCES)
def test_flow_in_contact(make: Callable[[float], Force], numbers: tuple) -> None:
    omega = numbers[2]
    driven = make(omega)
    t = constants(numbers, driven)
    table = propagators(t)
    frequency = math.sqrt(t.relative_stiffness)
    for swings in (1e-3, 2.0, 30.0, 1e3, math.inf):
        tau = min(swings / frequency, 20.0)
        found = advanced(t, table, driven.phase, tau)[0]
        right = exact(numbers, t, driven, tau)
        # A phase of the contact's oscillation cannot be better than roundoff of frequency times
        # time.
        phase = 1e-15 * (1.0 + frequency * tau)
        swing = 1e-3 * math.exp(-min(0.5 * t.relative_damping * tau, 700.0))
        if t.relative_damping > 2.0 * frequency:
            swing = 1e-3
        # The force of order one sets the gap's scale 1 / frequency^2 once the oscillation has
        # died.
        force = 1e-14 + 1e-15 * omega * tau
        slow = min(tau, 1.0 / frequency)
        gap = min(tau * tau, 1.0 / frequency**2) * force + phase * swing * slow
        rate = slow * force + phase * swing
        for value, reference, allowed in zip(found, right, (3e-14, 3e-14, gap, rate), strict=False):
            assert abs(value - reference) <= allowed + 1e-15 * abs(reference), swings


def test_short_steps_keep_the_gap_relative_to_itself() -> None:
    driven = harmonic_force(CASES[1][2])
    t = constants(CASES[1], driven)
    for tau in (1e-12, 1e-9, 1e-7):
        found = advanced(t, propagators(t), driven.phase, tau)[0]
        assert abs(found[2] / exact(CASES[1], t, driven, tau)[2] - 1) < 1e-15


@pytest.mark.parametrize("numbers", CASES, ids=str)
@pytest.mark.parametrize("make", FORCES)
def test_energy_grows_by_the_force_at_most(make: Callable[[float], Force], numbers: tuple) -> None:
    """Also of the derivatives of the motion, which bounds every one of them."""
    driven = make(numbers[2])
    t = constants(numbers, driven)
    table = propagators(t)
    before = np.array(advanced(t, table, driven.phase, 0.0)[1])
    bounds = np.array([bound_of(t.forcing, order) for order in range(4)])
    for tau in (0.3 / t.rate, 3.0 / t.rate, 0.1, 2.0):
        after = np.array(advanced(t, table, driven.phase, tau)[1])
        assert (after <= (before + t.push * bounds * tau) * (1 + 1e-9) + 1e-15).all()

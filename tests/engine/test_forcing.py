"""Each force against a matrix exponential in fifty digits, and what it says of itself.

A harmonic, and what is linear in time, follow linear equations of their own. With them added the
motion of an oscillator is one linear flow, of which the engine knows nothing.
"""

import math
from typing import Any

import numpy as np
import pytest
from cases import thinned
from mpmath import mp, mpf

from damper.engine.forcing import (
    bound_of,
    derivative_of,
    force_rates,
    horizon,
    is_odd,
    may_jump,
    phase_at,
    rate_of,
    repeats,
    tones_of,
    turn_over,
    turned,
)
from damper.engine.forcing.harmonic import harmonic
from damper.engine.forcing.harmonics import harmonics
from damper.engine.forcing.none import ZeroForce
from damper.engine.forcing.record import record
from damper.engine.forcing.weighed import WeighedForce
from damper.engine.oscillator import arrive, displaced, increments, motion_from, oscillator

CYCLE = 7.0
OMEGA = 2.0 * math.pi / CYCLE
RECORD = record(
    CYCLE, np.array([0.5, 1.25, 40.0]), np.array([1.0, -0.5, 0.0]), np.array([-2.0, 0.25, 0.0])
)
FORCES: dict[str, Any] = {
    "none": ZeroForce(0.0),
    "harmonic": harmonic(OMEGA, 0.4),
    "two": harmonics(OMEGA, 0.4, np.array([1.0, 0.3]), np.array([0.0, -0.2])),
    "odd": harmonics(OMEGA, -2.0, np.array([0.8, 0.0, 0.4]), np.zeros(3)),
    "tenth": harmonics(OMEGA, 0.0, np.eye(10)[9], np.zeros(10)),
    "weighed": WeighedForce(harmonic(OMEGA, 0.4), 0.6, -0.3),
    "before": RECORD,
    "record": RECORD,
    "after": RECORD,
}
#: Moment at which each is looked at; of the record, before it, in its second piece, after it.
TIMES = {"before": 0.25, "record": 20.5, "after": 100.0}
#: Damping and stiffness: under-, overdamped, critical, free, with a dashpot alone, soft.
OSCILLATORS = [
    (0.05, 1.0), (3.0, 1.0), (1.0, 1.0), (0.0, OMEGA**2), (0.0, 0.0), (0.2, 0.0), (40.0, 1e-3),
    (1e-3, 1e-8), (2.0, 1e-100),
]  # fmt: skip


def parts(name: str) -> list[tuple[mpf, mpf, mpf, mpf]]:
    """Pairs (p, q) with p' = up q and q' = down p, whose first ones add up to the force."""
    force, time = FORCES[name], mpf(TIMES.get(name, 3.1))
    if name == "none":
        return []
    if name == "harmonic":
        angle = mpf(force.omega) * time + mpf(force.phase)
        return [(mp.sin(angle), mp.cos(angle), mpf(force.omega), -mpf(force.omega))]
    if hasattr(force, "sine"):
        found = []
        for k, (a, b) in enumerate(zip(force.sine, force.cosine, strict=True), 1):
            angle, rate = k * (mpf(force.omega) * time + mpf(force.phase)), k * mpf(force.omega)
            sin, cos = mp.sin(angle), mp.cos(angle)
            a, b = mpf(float(a)), mpf(float(b))
            found.append((a * sin + b * cos, a * cos - b * sin, rate, -rate))
        return found
    if name == "weighed":
        angle = mpf(OMEGA) * time + mpf(0.4)
        share = mpf(force.share)
        pair = (share * mp.sin(angle), share * mp.cos(angle), mpf(OMEGA), -mpf(OMEGA))
        return [pair, (mpf(force.weight), mpf(0), mpf(0), mpf(0))]
    value = {"before": mpf(0), "after": mpf(0), "record": mpf(-0.5) + (time - 1.25) / 4}[name]
    return [(value, mpf(0.25 if name == "record" else 0.0), mpf(1), mpf(0))]


def exact(name: str, osc: Any, x: float, v: float, tau: float) -> tuple[mpf, mpf]:
    """Displacement and velocity after a time, by one matrix exponential."""
    pairs = parts(name)
    size = 2 + 2 * len(pairs)
    a, z = mp.zeros(size), mp.zeros(size, 1)
    a[0, 1], a[1, 0], a[1, 1] = 1, -mpf(osc.stiffness), -2 * mpf(osc.damping)
    z[0], z[1] = x, v
    for k, (p, q, up, down) in enumerate(pairs):
        at = 2 + 2 * k
        a[1, at], a[at, at + 1], a[at + 1, at] = mpf(osc.strength), up, down
        z[at], z[at + 1] = p, q
    found = mp.expm(a * mpf(tau)) * z
    return found[0], found[1]


#: Each force on each oscillator; by default every other one.
PAIRS = [(name, *osc) for osc in OSCILLATORS for name in FORCES]


@pytest.mark.parametrize(("name", "damping", "stiffness"), thinned(PAIRS, PAIRS[::2].__contains__))
def test_flow(name: str, damping: float, stiffness: float) -> None:
    force, time = FORCES[name], TIMES.get(name, 3.1)
    cycles, rest = divmod(time, CYCLE)
    x, v, strength = 0.7, -0.4, 1.0 if name == "weighed" else 1.3
    osc = oscillator(damping, stiffness, strength, force)
    start = motion_from(osc, x, v, phase_at(force, cycles, rest))
    for tau in (1e-7, 1e-3, 0.1, 0.4, 2.0, 11.0):
        assert tau < horizon(force, start.phase) or name == "before"
        with mp.workdps(50):
            at, moving = exact(name, osc, x, v, tau)
            way, change = at - mpf(x) - mpf(v) * mpf(tau), moving - mpf(v)
        # Terms of the increments; all of them are there twice, as doubles.
        push = strength * (bound_of(force, 0) + abs(x) * stiffness)
        reach = min(tau, 1.0 / max(damping, 1e-9))
        sizes = (push + 2.0 * damping * abs(v)) * reach * (1.0 + rate_of(force) * tau)
        dx, dv, _ = increments(osc, start, tau)
        assert abs(dx - way) <= 1e-14 * sizes * tau, tau
        assert abs(dv - change) <= 1e-14 * sizes, tau
        if osc.rate * tau <= 0.5:
            continue  # or it would be formed by increments
        for end in (
            arrive(osc, start, tau)[0],
            x + displaced(osc, start, turn_over(force, tau), tau)[0],
        ):
            assert abs(end - at) <= 1e-14 * (1.0 + abs(x) + sizes * tau), tau


@pytest.mark.parametrize("name", FORCES)
def test_value_derivatives_and_bounds(name: str) -> None:
    force, time = FORCES[name], TIMES.get(name, 3.1)
    phase = phase_at(force, *divmod(time, CYCLE))
    phase = turned(force, phase, turn_over(force, 0.15))
    with mp.workdps(50):
        rates = [mpf(0)] * 7
        for p, q, up, down in parts(name):
            turn = mp.expm(mp.matrix([[0, up], [down, 0]]) * mpf(0.15)) * mp.matrix([p, q])
            for order in range(7):
                rates[order] += turn[0]
                turn = mp.matrix([[0, up], [down, 0]]) * turn
    rate = rate_of(force)
    for order in range(7):
        size = bound_of(force, order) if order < 6 else rate * bound_of(force, 5)
        assert abs(derivative_of(force, phase, order) - rates[order]) <= 2e-14 * size
        assert abs(rates[order]) <= size * (1 + 1e-15)
        if order < 5:
            assert abs(force_rates(force, phase)[order] - rates[order]) <= 2e-14 * size
    if repeats(force):
        half = phase_at(force, 0.0, (time + 0.15 + 0.5 * CYCLE) % CYCLE)
        opposite = abs(derivative_of(force, half, 0) + derivative_of(force, phase, 0)) < 1e-13
        assert is_odd(force) == (opposite or name == "none")
    assert may_jump(force) == (name in TIMES)


def test_a_sample_that_roundoff_just_misses_is_reached() -> None:
    """A segment ends at a sample; the clock adds its length to a rounded time."""
    time = np.sort(np.random.default_rng(5).uniform(0.0, 50.0, 400))
    force = record(CYCLE, time, np.arange(400.0), np.zeros(400))
    cycles, rest, seen = 0.0, 0.0, 0
    while (left := horizon(force, phase_at(force, cycles, rest))) < math.inf:
        assert left > 1e-15
        turns, rest = divmod(rest + left, CYCLE)
        cycles += turns
        seen += 1
        assert phase_at(force, cycles, rest).value == seen - 1
    assert seen == 400


@pytest.mark.parametrize("name", FORCES)
def test_tones_add_up_to_the_force(name: str) -> None:
    force = FORCES[name]
    phase = phase_at(force, *divmod(TIMES.get(name, 3.1), CYCLE))
    for order in range(6):
        own = [
            (-c) ** (order // 2) * (odd if order % 2 else even)
            for c, even, odd in tones_of(force, phase)
        ]
        assert sum(own) == pytest.approx(derivative_of(force, phase, order), rel=1e-12, abs=1e-12)

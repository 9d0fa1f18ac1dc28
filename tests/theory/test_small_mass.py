"""The small-mass limit against arbitrary precision, the engine at a tiny mass, and itself."""

import math

import pytest
from cases import thinned
from hypothesis import given, settings
from hypothesis import strategies as st
from mpmath import mp, mpf

import damper
from damper.theory.small_mass import accumulation, completes, critical_restitution, first_impact

GAPS = st.floats(1e-3, 3.1)


def burst_completes(gap: float, restitution: mpf) -> bool:
    """Bounce on the wall sin(psi) in 60 digits, each flight by bisection of its gap."""
    with mp.workdps(60):
        psi = mp.findroot(lambda t: t - mp.sin(t) - mpf(gap), mp.cbrt(6 * mpf(gap)))
        w = restitution * (1 - mp.cos(psi))
        while psi < mp.pi:
            push = mp.sin(psi)

            def above(tau, psi=psi, w=w):
                return w * tau + mp.sin(psi + tau) - mp.sin(psi) - tau * mp.cos(psi)

            if 2 * w < mpf(10) ** -6 * push * (mp.pi - psi) * (1 - restitution):
                return True
            if above(mp.pi - psi) >= 0:
                return False
            # The push is at most 1, so the flight lasts at least 2 w.
            low, tau = w, mp.pi - psi
            while tau - low > mpf(10) ** -45 * low:
                middle = (low + tau) / 2
                low, tau = (middle, tau) if above(middle) > 0 else (low, middle)
            w = -restitution * (w + mp.cos(psi + tau) - mp.cos(psi))
            psi += tau
    return False


@pytest.mark.parametrize(
    ("gap", "expected"), [(0.05, 0.7918), (0.1, 0.7060), (0.2, 0.5918), (0.5, 0.3944), (1, 0.2189)]
)
def test_stated_values(gap: float, expected: float) -> None:
    assert critical_restitution(gap) == pytest.approx(expected, abs=5e-5)


@pytest.mark.parametrize("gap", thinned([0.1, 0.5, 2.5], [0.5].__contains__))
def test_limit_to_the_last_digits(gap: float) -> None:
    limit = mpf(float(critical_restitution(gap)))
    near = mpf(10) ** -13
    assert burst_completes(gap, limit * (1 - near))
    assert not burst_completes(gap, limit * (1 + near))


def test_small_gaps() -> None:
    """Many small bounces lose w at the rate (1 - r) a / 2 and keep w / a^(1/3) otherwise."""
    gap = 1e-4
    integral = math.sqrt(math.pi) * math.gamma(5.0 / 6.0) / math.gamma(4.0 / 3.0)
    expected = (6.0 * gap) ** (5.0 / 9.0) / integral
    assert 1.0 - critical_restitution(gap) == pytest.approx(expected, rel=0.02)


@settings(max_examples=15, deadline=None)
@given(GAPS, st.floats(0.0, 1.0))
def test_bursts_complete_up_to_the_limit_and_no_further(gap: float, restitution: float) -> None:
    limit = critical_restitution(gap)
    if abs(restitution - limit) > 1e-14:
        assert completes(gap, restitution) == (restitution < limit)
    assert completes(gap, restitution) == math.isfinite(accumulation(gap, restitution))


@pytest.mark.parametrize(
    ("omega", "gap", "part"), [(0.2, 0.05, 0.9), (1.6, 0.5, 0.999), (0.7, 2.0, 0.9)]
)
def test_accumulation_against_the_engine(omega: float, gap: float, part: float) -> None:
    """At no mass, whatever the frequency."""
    restitution = part * float(critical_restitution(gap))
    amplitude = 1.0 / (1.0 - omega**2)
    d = 0.5 * gap * abs(amplitude)
    speed = amplitude * omega
    # Above resonance the walls start to the left: the same, mirrored.
    side = math.copysign(1.0, amplitude)
    start = damper.State(0.0, speed, -side * d, speed)
    p = damper.Parameters(0.0, 0.0, omega, d, restitution)
    rows = damper.events(p, start, until=1.001 * math.pi / omega)
    first, stick = rows[0], rows[rows["kind"] == 1][0]
    assert first["side"] == stick["side"] == side
    assert omega * first["time"] == pytest.approx(first_impact(gap), rel=1e-13)
    assert omega * stick["time"] == pytest.approx(accumulation(gap, restitution), abs=1e-7)


@pytest.mark.parametrize("gap", [0.1, 1.5])
def test_engine_changes_its_mind_at_the_limit(gap: float) -> None:
    limit = float(critical_restitution(gap))
    d = 0.5 * gap / 0.75
    for restitution, complete in ((limit - 1e-5, True), (limit + 1e-5, False)):
        p = damper.Parameters(0.0, 0.0, 0.5, d, restitution)
        rows = damper.events(p, damper.State(0.0, 0.5 / 0.75, -d, 0.5 / 0.75), until=2.0 * math.pi)
        assert (rows["kind"] == 1).any() == complete

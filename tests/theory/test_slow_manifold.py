"""The slow invariant manifold against its definition: a ball between two vibrating walls."""

import math

import numpy as np
import pytest
from hypothesis import example, given
from hypothesis import strategies as st
from scipy.optimize import brentq

import damper
from damper.theory.slow_manifold import SYMMETRIC_LIMIT, amplitude, branches, fold, stable
from damper.theory.steady import steady_amplitude
from damper.theory.two_impacts import orbits

RESTITUTION = st.floats(0.0, 1.0)


def largest_multiplier(theta: float, restitution: float) -> float:
    """Size of the half-cycle map's larger multiplier, by differences of the map itself.

    Clearance and frequency are 1. From the right wall at phase psi with speed V the ball reaches
    the left wall at the phase psi' (mirrored back).
    """
    xi, r = float(amplitude(theta, restitution)), restitution
    speed = 2.0 * theta / math.pi
    sine, cosine = (theta - 1.0) / xi, -(1.0 - r) / (1.0 + r) * speed / xi
    assert math.hypot(sine, cosine) == pytest.approx(1.0, abs=1e-12)
    psi = math.atan2(sine, cosine)

    def after(phase: float, v: float) -> np.ndarray:
        def gap(tau: float) -> float:
            return 2.0 + xi * math.sin(phase) - v * tau - xi * math.sin(phase + tau)

        tau = brentq(gap, math.pi - 0.2, math.pi + 0.2, xtol=1e-15, rtol=1e-15)
        new = phase + tau - math.pi
        return np.array([new, r * v - (1.0 + r) * xi * math.cos(new)])

    np.testing.assert_allclose(after(psi, speed), [psi, speed], atol=1e-12)
    h = 1e-6
    phases = (after(psi + h, speed) - after(psi - h, speed)) / (2.0 * h)
    speeds = (after(psi, speed + h) - after(psi, speed - h)) / (2.0 * h)
    return float(abs(np.linalg.eigvals(np.array([phases, speeds]).T)).max())


@pytest.mark.parametrize("restitution", [0.0, 0.7])
def test_stability_of_the_map(restitution: float) -> None:
    low, high = fold(restitution).theta, SYMMETRIC_LIMIT
    assert largest_multiplier(low, restitution) == pytest.approx(1.0, abs=2e-4)
    assert largest_multiplier(high, restitution) == pytest.approx(1.0, abs=1e-7)
    for theta in (0.5 * low, 0.98 * low, 1.02 * low, 1.0, 1.3, 0.99 * high, 1.01 * high, 2.5):
        assert stable(theta, restitution) == (largest_multiplier(theta, restitution) < 1.0)


@pytest.mark.parametrize("theta", [0.5, 1.2, 2.4])
@pytest.mark.parametrize("restitution", [0.2, 0.9])
def test_limit_of_the_closed_form_motion(theta: float, restitution: float) -> None:
    omega, zeta = 1.3, 0.1
    d = steady_amplitude(zeta, omega) / float(amplitude(theta, restitution))
    found = orbits(damper.Parameters(1e-6, zeta, omega, d, restitution))
    peaks = [(orbit.displacement + d) / d for orbit in found]
    near = int(np.argmin([abs(peak - theta) for peak in peaks]))
    assert peaks[near] == pytest.approx(theta, abs=1e-4)
    assert found[near].stable == stable(theta, restitution)


@given(RESTITUTION, st.floats(0.0, 5.0))
def test_branches_invert_the_amplitude(restitution: float, theta: float) -> None:
    upper, lower = branches(amplitude(theta, restitution), restitution)
    # At the fold both meet with a square root: half the digits.
    if theta >= fold(restitution).theta:
        assert upper == pytest.approx(theta, abs=1e-7)
    else:
        assert lower == pytest.approx(theta, abs=1e-7)


@example(0.99999, 0.0)
@given(RESTITUTION, st.floats(0.0, 5.0))
def test_fold_is_the_least_amplitude(restitution: float, theta: float) -> None:
    low = fold(restitution)
    assert amplitude(low.theta, restitution) == pytest.approx(low.xi, abs=1e-15)
    assert amplitude(theta, restitution) >= low.xi * (1.0 - 1e-15)
    if low.xi > 0.0:
        upper, lower = branches(low.xi * (1.0 - 1e-9), restitution)
        assert np.isnan(upper)
        assert np.isnan(lower)


@pytest.mark.parametrize("restitution", [0.3, 0.6])
def test_a_free_decay_follows_the_manifold(restitution: float) -> None:
    """Cycle by cycle, from the upper end to the fold, where the free mass falls out of step.

    Amplitude of the primary: that of its energy, with the mean of its kinetic energies just before
    and just after the impact on the right wall.
    """
    mu = 0.005
    p = damper.Parameters(mu, 0.0, 1.0, 1.0, restitution, force_amplitude=0.0)
    rows = damper.events(p, damper.State(2.5, 0.0, 2.5, 0.0), until=3000.0, max_events=3000)
    rows = rows[rows["kind"] == 0]
    walls = rows["side"]
    starts = np.flatnonzero((walls == 1) & (np.append(-1, walls[:-1]) == -1))
    first = rows[starts[:-1]]
    v = first["v"]
    before = v - mu * (1.0 + restitution) / (1.0 + mu) * first["approach_speed"]
    xi = np.sqrt(first["x"] ** 2 + 0.5 * (v**2 + before**2))
    theta = first["x"] + 1.0
    low, high = fold(restitution), float(amplitude(SYMMETRIC_LIMIT, restitution))
    inside = (xi > 1.3 * low.xi) & (xi < 0.8 * high)
    assert inside.sum() > 20
    assert (np.diff(starts)[inside] == 2).all()  # one impact on each wall
    upper, _ = branches(xi[inside], restitution)
    assert abs(theta[inside] - upper).max() < 0.03
    assert xi.min() < 0.9 * low.xi

"""The references of the tests: known numbers and rules of single cases.

`tests/verification/comparison/test_reference_rigid.py` has the rigid reference against a second one
in all digits. Here are the formulas of `accumulation` and the closed orbit.
"""

from __future__ import annotations

from itertools import pairwise

import numpy as np
import pytest
from mpmath import mp, mpf

from damper.verification.comparison.reference_rigid import (
    Event,
    PreciseParameters,
    events,
    stick_flow,
)

from .accumulation import (
    accumulation_time,
    kinematic_accumulation_time,
    small_mass_burst_completes,
    small_mass_critical_restitution,
)
from .two_impacts import coefficients, two_impacts


def of_kind(found: list[Event], kind: str) -> list[Event]:
    """Return the events of one kind."""
    return [event for event in found if event.kind == kind]


# --- completion (model section 4)

SCENE = (0.5, 0.2, 0.3, 0.6)
ON_WALL = {"time": 2, "position": 2, "velocity": 0.1}


def test_completion_formulas() -> None:
    """First and second order, and the common velocity: the errors fall as they should."""
    mu, zeta, omega, r = SCENE
    t, x, v = (ON_WALL[name] for name in ("time", "position", "velocity"))
    p = PreciseParameters(*(mpf(value) for value in (mu, zeta, omega, 1, r, 0)))
    errors = []
    with mp.workdps(40):
        for w, printed in ((mpf("0.01"), "0.0340400694"), (mpf("0.005"), "0.0169819753")):
            exact = accumulation_time(*SCENE, **ON_WALL, rebound_speed=w)
            assert abs(exact - mpf(printed)) < 0.51e-10
            a = -(mp.sin(p.omega * t) - 2 * p.zeta * v - x)
            j = p.omega * mp.cos(p.omega * t) + 2 * p.zeta * a - v
            first = 2 * w / (a * (1 - p.r))
            second = first + mpf(4) / 3 * j * w**2 / (a**3 * (1 - p.r) ** 2)
            second -= 4 * p.zeta * mu * p.r * w**2 / ((1 + mu) * a**2 * (1 - p.r) ** 2)
            run = events(
                *SCENE[:3], 1.0, r, state=(x, v, x + 1, v - w), start_time=t, until=t + 0.1
            )
            stuck = of_kind(run, "stick")[0]
            assert abs(stuck.time - t - exact) < mpf(10) ** -38
            common = v - p.mu * w / (1 + p.mu)
            shared = stick_flow(p, mpf(t), mpf(x), common, exact)
            own = stick_flow(p, mpf(t), mpf(x), mpf(v), exact)
            errors.append([first - exact, second - exact, shared[0] - stuck.x, own[1] - stuck.v])
        ratios = [float(coarse / fine) for coarse, fine in zip(*errors, strict=True)]
    assert ratios[:2] == pytest.approx([4.06, 8.07], abs=0.006)
    assert ratios[2] > 7.8  # x along the sticking flow: third order
    assert ratios[3] == pytest.approx(2, abs=0.05)  # the primary's own velocity: first order only


@pytest.mark.parametrize(
    ("r", "w", "printed"), [(0.6, 0.05, "0.26156342"), (0.8, 0.025, "0.26157446")]
)
def test_kinematic_completion_time(r: float, w: float, printed: str) -> None:
    assert abs(kinematic_accumulation_time(1, 0.5, r, w) - mpf(printed)) < 0.51e-8


def test_small_mass_critical_restitution() -> None:
    for gap, printed in [(0.05, 0.7918), (0.1, 0.7060), (0.2, 0.5918), (0.5, 0.3944)]:
        assert small_mass_burst_completes(gap, printed - 5e-5)
        assert not small_mass_burst_completes(gap, printed + 5e-5)
    assert small_mass_critical_restitution(1, digits=5) == pytest.approx(0.218920, abs=2e-5)


# --- two impacts per cycle (model section 5)


def test_two_impacts_numbers() -> None:
    stable, unstable = two_impacts(0.1, 0.1, 1.0, 5.5, 0.5)
    assert stable.speed == pytest.approx(4.594001326355, abs=1e-12)
    assert stable.x0 == pytest.approx(1.716240408729, abs=1e-12)
    assert stable.approach_speed == pytest.approx(6.737868611987, abs=1e-12)
    assert stable.peak == pytest.approx(2.58569621, abs=6e-9)
    assert stable.forcing_phase == pytest.approx(4.3308, abs=5e-5)
    assert np.abs(stable.multipliers).max() == pytest.approx(0.727671, abs=6e-7)
    assert unstable.speed == pytest.approx(0.318, abs=5e-4)
    assert np.abs(unstable.multipliers).max() == pytest.approx(46, abs=0.5)
    assert stable.admissible
    assert unstable.admissible
    with pytest.raises(ValueError, match="singular"):
        coefficients(0.1, 0.0, 1.0, 0.5)


@pytest.mark.parametrize("which", [0, 1])
def test_two_impacts_against_events(which: int) -> None:
    orbit = two_impacts(0.1, 0.1, 1.0, 5.5, 0.5)[which]
    x, v, _, u = orbit.state
    # Exactly on the right wall, whatever the roundoff.
    state = (x, v, mpf(x) + mpf(5.5), u)
    found = events(0.1, 0.1, 1.0, mpf(5.5), 0.5, orbit.forcing_phase, state, until=6.5, dps=20)
    assert [event.side for event in found] == [-1, 1]
    for k, event in enumerate(found, start=1):
        error = 1e-12 * 50.0 ** (k * which)
        assert float(event.time) == pytest.approx(k * np.pi, abs=error)
        assert float(event.approach_speed) == pytest.approx(orbit.approach_speed, abs=error)
        assert float(event.x) == pytest.approx((-1) ** k * orbit.x0, abs=error)


def test_two_impacts_slow_invariant_manifold() -> None:
    omega, r, d = 0.8, 0.6, 1.0
    rho = 2 / np.pi * (1 - r) / (1 + r)
    xi = coefficients(0.0, 0.05, omega, r).amplitude / d
    for orbit in two_impacts(0.0, 0.05, omega, d, r):
        theta = (orbit.x0 + d) / d
        assert xi**2 == pytest.approx((theta - 1) ** 2 + (rho * theta) ** 2, rel=1e-12)


# --- the ordinary cases that have a rule each


def test_plastic_impact_sticks_at_once_or_flies() -> None:
    found = events(0.1, 0.05, 0.2, 0.25, 0.0, until=100, dps=25)
    kinds = [event.kind for event in found]
    for event, following in pairwise(found):
        if event.kind == "stick":
            assert following.kind == "release"
            assert following.side == event.side
        if event.kind == "impact":
            force = np.sin(0.2 * float(event.time)) - 0.1 * float(event.v) - float(event.x)
            assert (following.kind == "stick") == (-event.side * force > 0)
            assert (following.time == event.time) == (following.kind == "stick")
    assert kinds.count("stick") > 3


def test_start_on_a_wall() -> None:
    scene = (0.1, 0.05, 0.2, 0.5, 0.6)
    hit = events(*scene, state=(0, 0, 0.5, 0.25), until=1)[0]
    assert (hit.kind, hit.side, hit.time, hit.approach_speed) == ("impact", 1, 0, 0.25)
    leaving = events(*scene, state=(0, 0, 0.5, -1), until=5)[0]
    assert (leaving.kind, leaving.side) == ("impact", -1)
    pressed = events(*scene, state=(1, 0, 1.5, 0), until=1)[0]  # wall accelerates to the left
    assert (pressed.kind, pressed.side, pressed.time) == ("stick", 1, 0)
    free = events(*scene, state=(1, 0, 0.5, 0), until=5)[0]  # left wall moves away from it
    assert (free.kind, free.side) == ("impact", 1)
    assert abs(free.x) < mpf(10) ** -48
    # At rest in the origin the acceleration is 0: the third derivative (positive) decides.
    lifted = events(*scene, state=(0, 0, 0.5, 0), until=10)[0]
    assert lifted.kind == "impact"
    assert lifted.time > 0.5
    held = events(*scene, state=(0, 0, -0.5, 0), until=20)
    assert [(event.kind, event.side) for event in held[:2]] == [("stick", -1), ("release", -1)]
    assert held[0].time == 0
    assert held[1].time > 0.5
    with pytest.raises(ValueError, match="outside"):
        events(*scene, state=(0, 0, 1, 0), until=50)

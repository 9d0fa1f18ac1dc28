"""The closed rest of a complete chatter sequence, against bounces followed in many digits."""

import math
from typing import Any

import numpy as np
import pytest
from tails import completed, tail

from damper import Parameters
from damper.engine.accumulation import accumulation, accumulation_times, bounce_at, sticks
from damper.engine.impact import (
    ConstantRestitution,
    TabledRestitution,
    YieldingRestitution,
    restitution_at,
)
from damper.models import model_of
from damper.parameters.dampers import BASIC

FAR = 1e9  # clearance at which the other wall is out of reach
ON_WALL = (0.5, 0.2, 0.3, 0.6)  # mass ratio, zeta, omega, r; at t = 2, x = 2, x' = .1


@pytest.mark.parametrize("side", [1.0, -1.0])
def test_sticks_while_the_contact_force_is_positive(side: float) -> None:
    """The first derivative that does not vanish decides."""
    for j in (-3.0, 0.0, 3.0):
        assert sticks(side, -side * 1e-300, j, side)
        assert not sticks(side, side * 1e-300, j, -side)
    assert sticks(side, 0.0, -side, side)
    assert not sticks(side, 0.0, side, -side)
    assert sticks(side, 0.0, 0.0, -side)
    assert not sticks(side, 0.0, 0.0, side)
    assert sticks(side, 0.0, 0.0, 0.0)


@pytest.mark.parametrize("side", [1.0, -1.0])
def test_orders_of_the_accumulation_times(side: float) -> None:
    """Halving w divides the errors by 4.06 and 8.07 (model section 4), on both walls alike."""
    mu, zeta, omega, r = ON_WALL
    phase = 0.0 if side > 0.0 else math.pi
    model = model_of(Parameters(mu, zeta, omega, 1.0, r, phase))
    values = dict(zip(BASIC, (mu, zeta, omega, FAR, r), strict=False))
    errors = []
    for w in (0.01, 0.005):
        duration, _, _, _ = tail(model, 2.0, side, 2.0 * side, 0.1 * side, w)
        exact = completed(values, 2.0, 1, 2.0, 0.1, w, within=1.1 * duration, digits=50).time
        force = -(math.sin(omega * 2) - 2 * zeta * 0.1 - 2.0)
        jerk = omega * math.cos(omega * 2) + 2 * zeta * force - 0.1
        first, second = accumulation_times(zeta * mu / (1 + mu), r, force, jerk, w)
        assert second == pytest.approx(duration, rel=1e-14)
        errors.append((float(first - exact), float(duration - exact)))
    ratios = [one / other for one, other in zip(*errors, strict=True)]
    assert ratios == pytest.approx([4.06, 8.07], abs=0.006)


@pytest.mark.parametrize(
    "law",
    [
        ConstantRestitution(0.8),
        YieldingRestitution(0.8, 8e-4, 0.25),
        # At the speed of the first impact as at none, and lower between.
        TabledRestitution(np.array([(1e-5, 0.8), (1e-4, 0.75), (1e-3, 0.8)])),
    ],
)
def test_the_error_holds_what_the_law_changes_along_the_sequence(law: Any) -> None:
    """Under a constant force, where the time errs by nothing else."""
    force, w = 0.7, 1e-3
    duration, error = accumulation(law, 0.0, 0.0, 0.0, force, 0.0, w)
    exact, speed = 0.0, w
    while speed > 1e-20:
        exact += 2.0 * speed / force
        speed *= restitution_at(law, speed)
    assert abs(exact - duration) <= error + 1e-12 * duration
    assert error < duration


@pytest.mark.parametrize("r", [0.05, 0.5, 0.9])
def test_bounces_are_those_of_a_constant_force(r: float) -> None:
    """Against bounces computed one after the other: g = w t - a t^2 / 2, w -> r w."""
    force, w = 0.7, 1e-6
    duration = 2 * w / (force * (1 - r))
    start, speed = 0.0, w
    while start < 0.999 * duration and speed > 1e-3 * w:
        flight = 2 * speed / force
        for part in (0.01, 0.3, 0.5, 0.9):
            t = part * flight
            gap, rate = bounce_at(r, duration, w, start + t)
            assert gap == pytest.approx(speed * t - force * t * t / 2, rel=1e-9)
            assert rate == pytest.approx(speed - force * t, rel=1e-9, abs=1e-9 * speed)
        start += flight
        speed *= r
    assert bounce_at(r, duration, w, 0.0) == (0.0, w)
    assert bounce_at(r, duration, w, duration) == (0.0, 0.0)
    assert bounce_at(0.0, 1.0, 0.0, 0.5) == (0.0, 0.0)

"""The energy balance against motions whose every term is known."""

import math

import pytest

from damper import Parameters
from damper.verification.comparison.energy import energy_residual, stored_energy


def test_free_fall_of_an_undamped_primary_balances():
    p = Parameters(0.3, 0.0, 2.0, clearance=5.0, restitution=0.5)
    # x = (sin 2t - 2 sin t) / -3 from rest; work = (v^2 + x^2) / 2 as nothing is lost.
    t = 1.7
    x = (math.sin(2 * t) - 2 * math.sin(t)) / -3
    v = (2 * math.cos(2 * t) - 2 * math.cos(t)) / -3
    work = 0.5 * (v * v + x * x)
    end = (x, v, 0.0, 0.0)
    assert abs(energy_residual(p, (0, 0, 0, 0), end, work, 0.0, 0.0)) < 1e-15
    assert abs(energy_residual(p, (0, 0, 0, 0), end, 1.01 * work, 0.0, 0.0)) > 1e-3


def test_an_impact_loses_the_energy_of_the_relative_motion():
    mu, r = 0.4, 0.6
    p = Parameters(mu, 0.1, 1.0, clearance=1.0, restitution=r)
    v, u = 0.2, 1.5
    v1 = ((1 - mu * r) * v + mu * (1 + r) * u) / (1 + mu)
    u1 = ((1 + r) * v + (mu - r) * u) / (1 + mu)
    lost = 0.5 * mu / (1 + mu) * (1 - r * r) * (u - v) ** 2
    start, end = (0.7, v, 1.7, u), (0.7, v1, 1.7, u1)
    assert abs(energy_residual(p, start, end, 0.0, 0.0, lost)) < 1e-15
    assert energy_residual(p, start, end, 0.0, 0.0, 0.0) == pytest.approx(
        -lost / (stored_energy(p, start) + stored_energy(p, end))
    )


@pytest.mark.parametrize("side", [-1, 1])
def test_a_wall_that_gives_stores_energy_while_it_is_pressed_in(side):
    p = Parameters(0.4, 0.1, 1.0, clearance=1.0, restitution=0.6, contact_stiffness_ratio=50.0)
    pressed = stored_energy(p, (0.0, 0.0, side * 1.1, 0.0))
    assert pressed == pytest.approx(0.5 * 50.0 * 0.1**2)
    assert stored_energy(p, (0.0, 0.0, side * 0.9, 0.0)) == 0.0


def test_nothing_balances_and_what_is_not_finite_does_not():
    p = Parameters(0.4, 0.1, 1.0, clearance=1.0, restitution=0.6)
    rest = (0.0, 0.0, 0.0, 0.0)
    assert energy_residual(p, rest, rest, 0.0, 0.0, 0.0) == 0.0
    assert math.isnan(energy_residual(p, rest, (math.inf, 0.0, 0.0, 0.0), 0.0, 0.0, 0.0))
    assert math.isnan(energy_residual(p, rest, rest, math.nan, 0.0, 0.0))

"""Hertz's impact against the motion itself and against Johnson's Contact Mechanics (1985)."""

import math

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from damper.sizing.contact import (
    HARD_STEEL,
    STEEL,
    ball_diameter,
    contact_modulus,
    hertz_impact,
    yield_speed,
)


def test_an_impact_is_that_of_a_mass_on_the_nonlinear_spring() -> None:
    """M x'' = -(4/3) E* sqrt(R) x^(3/2), solved as an equation of motion."""
    mass, speed, radius, modulus = 2.0, 0.7, 0.04, 60e9

    def force(x: float) -> float:
        return 4.0 / 3.0 * modulus * math.sqrt(radius) * max(x, 0.0) ** 1.5

    def parted(t: float, y: np.ndarray) -> float:
        return y[0] if t > 1e-6 else 1.0

    parted.terminal = True  # type: ignore[attr-defined]
    run = solve_ivp(
        lambda t, y: [y[1], -force(y[0]) / mass],
        (0.0, 0.01),
        [0.0, speed],
        events=parted,
        max_step=1e-6,
    )
    found = hertz_impact(mass, speed, radius, modulus)
    assert found.time == pytest.approx(run.t[-1], rel=1e-3)
    assert found.depth == pytest.approx(run.y[0].max(), rel=1e-4)
    assert found.force == pytest.approx(force(run.y[0].max()), rel=1e-4)


def test_the_numbers_are_those_of_the_textbook() -> None:
    """Johnson: 2.87 (m^2/(R E*^2 V))^(1/5); hard steel on steel yields from .14 m/s on."""
    m, v, r, e = 0.5, 1.3, 0.02, contact_modulus(STEEL, STEEL)
    assert hertz_impact(m, v, r, e).time == pytest.approx(
        2.87 * (m**2 / (r * e**2 * v)) ** 0.2, rel=2e-3
    )
    assert e == pytest.approx(115e9, rel=5e-3)
    assert yield_speed(e, HARD_STEEL, STEEL.density) == pytest.approx(0.14, abs=0.005)


def test_a_ball_of_one_inch_has_its_mass() -> None:
    """A bearing ball of 1 inch weighs 67 g by its makers' tables (66.8 g at 7.79 g/cm3)."""
    assert ball_diameter(0.0668, 7790.0) == pytest.approx(0.0254, rel=1e-3)

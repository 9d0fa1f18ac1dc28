"""A constant acceleration of the free mass along the box: against closed forms."""

import math
from dataclasses import replace

import pytest
from scenes import GENERIC

from damper import Parameters, SIParameters, State, continue_orbit, periodic_orbit
from damper.theory.ball_on_table import bounce


def test_a_weight_out_of_range_is_refused() -> None:
    with pytest.raises(
        ValueError, match=r"^gravity = 2000000\.0 with mass_ratio: .* weighs 1e\+12 F0"
    ):
        Parameters(**GENERIC | {"mass_ratio": 5e5}, gravity=2e6)


def test_si() -> None:
    """A level box, free motion, and an angle of nothing; else tests/sweep/test_si.py."""
    p = SIParameters(2.0, 4.0, 200.0, 10.0, 11.0, 0.2, 0.02, 0.6, gravity=9.81, inclination=30.0)
    assert replace(p, inclination=0.0).dimensionless.acting.get("gravity") is None
    free = replace(p, force_amplitude=0.0)
    assert free.dimensionless.gravity == pytest.approx(9.81 * 0.5 / 0.01 / 100.0, rel=1e-15)
    with pytest.raises(ValueError, match=r"^inclination = 30\.0 without gravity: nothing pulls"):
        replace(p, gravity=0.0)


@pytest.mark.parametrize(
    ("period", "zeta"), [(1, 0.0), (1, 0.1), pytest.param(2, 0.0, marks=pytest.mark.exhaustive)]
)
def test_a_ball_bounces_on_an_oscillating_table(period: int, zeta: float) -> None:
    """Its motions of n periods set in and double where they should.

    The table's motion is prescribed, or that of a damped primary which does not feel the ball.
    """
    omega, r = 2.0, 0.5
    height = 1 / math.hypot(1 - omega**2, 2 * zeta * omega) if zeta else 1.0
    lag = math.atan2(2 * zeta * omega, 1 - omega**2) if zeta else 0.0
    carrier = "oscillator" if zeta else "prescribed"
    push = height * omega**2
    onset = period * math.pi * (1 - r) / (1 + r)
    doubling = math.hypot(onset, 2 * (1 + r**2) / (1 + r) ** 2)
    middle = 0.5 * (onset + doubling)
    box = {"walls": "left", "carrier": carrier, "gravity": push / middle}
    p = Parameters(0.0, zeta, omega, 0.0, r, **box)
    known = bounce(p, period)
    assert known[:3] == pytest.approx((middle, onset, doubling), rel=1e-14)
    # Just after an impact: it flies for whole periods, as long as it takes to be back.
    angle = math.acos(onset / middle)
    x, v = height * math.sin(angle), height * omega * math.cos(angle)
    start = State(x, v, x, 0.5 * p.gravity * period * p.cycle, (angle + lag) / omega)
    orbit = periodic_orbit(p, period, start)
    assert orbit.events["approach_speed"] == pytest.approx(known.approach_speed, rel=1e-11)
    branch = continue_orbit(orbit, "gravity", push / (1.1 * doubling), push / (0.95 * onset))
    found = {point.kind: push / point.value for point in branch.special_points}
    assert found == pytest.approx({"fold": onset, "period doubling": doubling}, rel=1e-9)

"""A constant acceleration of the free mass along the box: against closed forms."""

import math
from dataclasses import replace

import pytest
from scenes import GENERIC

from damper import Parameters, SIParameters, State, continue_orbit, events, periodic_orbit, simulate
from damper.models import start_run
from damper.theory.ball_on_table import bounce

#: Two impacts a period.
TWO_IMPACTS = {"damping_ratio": 0.1, "frequency_ratio": 1.0, "clearance": 5.0, "restitution": 0.5}


def test_a_ball_on_a_heavy_floor_comes_to_rest() -> None:
    """It falls half of the gap, and all of its bounces take (1 + r) / (1 - r) times as long."""
    p = Parameters(0.0, 0.0, 1.0, 2.0, 0.5, force_amplitude=0.0, gravity=0.3)
    table = events(p, until=60.0)
    fall = math.sqrt(2 * 2.0 / 0.3)
    assert set(table["side"]) == {-1}
    assert table["time"][0] == pytest.approx(fall, rel=1e-15)
    assert table["kind"][-1] == 1  # for good
    assert table["time"][-1] == pytest.approx(fall * 1.5 / 0.5, rel=1e-15)


def test_masses_at_rest_hang_at_the_weight() -> None:
    p = Parameters(0.3, 0.4, 1.0, 0.5, 0.2, force_amplitude=0.0, gravity=0.7)
    run = start_run(p)
    run.skip(60.0)
    at = run.state_at(60.0)
    assert (at.x, at.v, at.y, at.u) == pytest.approx((-0.21, 0.0, -0.71, 0.0), abs=1e-13)


def test_sticking_follows_the_joined_masses() -> None:
    """(1 + mu) x'' + 2 zeta x' + x = sin - mu gamma; no release where x'' stays above -gamma."""
    mu, zeta, omega, gamma = 0.2, 0.3, 0.8, 3.0
    start = {"initial_position": -1.0, "transient": 40, "periods": 2}
    values = {"mass_ratio": mu, "damping_ratio": zeta, "gravity": gamma}
    cube = simulate(**GENERIC | values, **start, observers=["response"])
    steady = 1 / math.hypot(1 - (1 + mu) * omega**2, 2 * zeta * omega)
    assert cube["peak_displacement"].item() == pytest.approx(steady + mu * gamma, abs=1e-9)
    assert cube["energy_input"].item() == pytest.approx(cube["dashpot_loss"].item(), rel=1e-10)


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

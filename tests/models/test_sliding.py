"""Dry friction between free mass and box, against many digits and closed forms."""

import numpy as np
import pytest

from damper import Parameters, State, events, simulate
from damper.engine.segment import CAUSE, GAP, NOTHING
from damper.models import start_run
from damper.models.sensitivity import neighbours
from damper.models.tangent import derivative
from damper.sweep.orbits.arcs import Arc

IMPACT, STICK, RELEASE, STOPPED, REST, SLIP, REVERSAL = range(7)


#: A primary that swings freely from x = 1: near the turn the right wall presses with about 1.
SWING = {"damping_ratio": 0.0, "frequency_ratio": 1.0, "force_amplitude": 0.0, "clearance": 1.0}


@pytest.mark.parametrize("speed", [1e-3, 1e-6, 1e-9])
def test_comes_to_rest_off_the_wall(speed: float) -> None:
    """Friction above what presses: one bounce of height w^2 / (2 (A + b)), never snapped to it."""
    p = Parameters(mass_ratio=1e-6, restitution=0.5, friction=2.0, **SWING)
    run = start_run(p, State(1.0, 0.0, 2.0, speed))
    log = next(run.segments(*run.whole_periods(0.5))).copy()
    assert log[:, CAUSE].tolist() == [NOTHING, IMPACT, REST]
    height = (0.5 * speed) ** 2 / (2.0 * (1.0 + 2.0))
    assert log[2, GAP] == pytest.approx(height, rel=max(speed, 2e-6))
    assert run.state_at(*run.whole_periods(0.5)).v < 0.0


def test_a_plastic_impact_that_friction_holds_is_one() -> None:
    """The wall does not press: friction alone keeps the free mass there."""
    p = Parameters(mass_ratio=1e-6, restitution=0.0, friction=2.0, **SWING)
    start = State(1.0, 0.0, 2.0, 0.5)
    cube = simulate(p, state=start, transient=0, periods=1, observers=["impacts", "bursts"])
    assert (cube.impacts_per_period, cube.max_approach_speed) == (1.0, 0.5)


@pytest.mark.parametrize("u", [0.0, 0.3, -0.4])
def test_an_idle_damper_comes_to_rest(u: float) -> None:
    """Without a contact, and with accelerations below friction, it ends at rest in the box."""
    p = Parameters(0.1, 0.1, 0.5, 50.0, 0.6, friction=0.8)
    found = events(p, State(0.0, 0.0, 1.0, u), until=500.0)
    assert set(found["kind"]) <= {REST, SLIP, REVERSAL}
    assert found["kind"][-1] == REST
    assert found["time"][-1] < 50.0


def test_no_derivative_where_it_stops_at_the_very_wall() -> None:
    """The speed between one that reaches the wall, which is 1 away, and one that does not."""
    p = Parameters(mass_ratio=1e-6, restitution=0.5, friction=0.5, **SWING)
    run = start_run(p, State(0.0, 0.0, 0.0, 1.0000003540367046))
    message = r"^no derivative: the free mass comes to rest at the "
    with pytest.raises(ValueError, match=message):
        derivative(run, *run.whole_periods(3.0), pieces := [])
    # Nor one by a parameter, which a branch would ask for.
    wall, start = np.zeros(1), np.zeros(4)
    arc = Arc(p, start, wall, start, wall, np.eye(4), np.concatenate(pieces), run)
    with pytest.raises(ValueError, match=message):
        arc.change_by(neighbours(p, {"friction": 1.0}), start)

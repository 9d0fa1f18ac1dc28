"""Lyapunov exponents against sums and motions that are known."""

import math
from typing import Any

import numpy as np
import pytest

import damper
from damper.engine.segment import DURATION, FLIGHT, MODE
from damper.models import start_run
from damper.models.compliant.restitution import contact_damping
from damper.parameters import Parameters, State
from damper.theory.two_impacts import orbits


@pytest.mark.compiled
@pytest.mark.parametrize("runs", [12, pytest.param(1000, marks=pytest.mark.exhaustive)])
def test_volumes_shrink_as_dashpots_and_impacts_say(runs: int) -> None:
    """Their sum is -2 zeta plus 2 ln r for each impact, wherever no burst completes."""
    rng = np.random.default_rng(3)
    compared = 0
    while compared < runs:
        p = {
            "mass_ratio": 10 ** rng.uniform(-3, 0),
            "damping_ratio": 10 ** rng.uniform(-3, 0),
            "frequency_ratio": rng.uniform(0.3, 3.0),
            "clearance": 10 ** rng.uniform(-1, 1),
            "restitution": rng.uniform(0.5, 0.95),
        }
        cube = damper.simulate(**p, transient=20, periods=20, observers=["lyapunov", "impacts"])
        if not np.isfinite(cube.lyapunov_residual) or np.isnan(cube.slowest_impact):
            assert np.isnan(cube.slowest_impact) or (cube.lyapunov_exponents[2:] == -np.inf).all()
            continue
        compared += 1
        period = math.tau / p["frequency_ratio"]
        events = damper.events(Parameters(**p), until=40.0 * period)
        impacts = ((events["kind"] == 0) & (events["time"] >= 20.0 * period)).sum() / 20.0
        known = -2.0 * p["damping_ratio"] * period + 2.0 * math.log(p["restitution"]) * impacts
        # An impact that grazes stretches deviations by far, and roundoff with them.
        allowed = 1e-10 * abs(known) + 1e-15 / float(cube.slowest_impact) ** 2
        assert float(cube.lyapunov_exponents.sum()) == pytest.approx(known, abs=allowed)
        assert abs(float(cube.lyapunov_residual)) < allowed
        assert float(cube.largest_lyapunov_exponent) == float(cube.lyapunov_exponents[0])


@pytest.mark.compiled
def test_on_a_periodic_motion_they_are_its_multipliers() -> None:
    values = {"mass_ratio": 0.1, "damping_ratio": 0.1, "clearance": 5.5, "restitution": 0.5}
    orbit = next(o for o in orbits(Parameters(frequency_ratio=1.0, **values)) if o.stable)
    cube = damper.simulate(
        frequency_ratio=1.0,
        **values,
        state=orbit.start,
        transient=0,
        periods=400,
        observers=["lyapunov"],
    )
    # Multipliers of half a period.
    known = 2.0 * np.log(abs(orbit.multipliers))
    np.testing.assert_allclose(cube.lyapunov_exponents, known, atol=0.02)
    assert (abs(cube.lyapunov_drift) < 0.02).all()


def test_chaos_is_the_growth_of_a_small_distance() -> None:
    """A second run, set back to a distance of 1e-9 after each period."""
    values = {"mass_ratio": 0.3, "damping_ratio": 0.02, "frequency_ratio": 0.4, "clearance": 0.5}
    p, periods, distance = Parameters(**values, restitution=0.7), 30, 1e-9
    cube = damper.simulate(
        **values, restitution=0.7, transient=0, periods=periods, observers=["lyapunov"]
    )
    state, direction, growth = np.zeros(4), np.array([0.5, 0.5, -0.5, 0.5]), 0.0
    for _ in range(periods):
        ends = []
        for start in (state, state + distance * direction):
            run = start_run(p, State(*start))
            run.skip(1.0)
            end = run.state_at(1.0)
            ends.append(np.array([end.x, end.v, end.y, end.u]))
        apart = ends[1] - ends[0]
        size = float(np.linalg.norm(apart))
        growth += math.log(size / distance)
        state, direction = ends[0], apart / size
    assert growth / periods > 0.3
    assert float(cube.largest_lyapunov_exponent) == pytest.approx(growth / periods, abs=0.05)


def assert_those_of_multipliers(cube: Any, orbit: Any, last: int, atol: float) -> None:
    """So many exponents are those of the orbit; those of rests off the walls are minus infinity."""
    known = np.log(np.maximum(abs(orbit.multipliers), 1e-300))
    np.testing.assert_allclose(cube.lyapunov_exponents[:last], known[:last], atol=atol)
    assert (cube.lyapunov_exponents[last:] == -np.inf).all()
    if last == len(known):
        assert abs(float(cube.lyapunov_residual)) < 1e-9


@pytest.mark.compiled
@pytest.mark.parametrize("rests", [False, True])
def test_on_a_motion_with_dry_friction_they_are_its_multipliers(rests: bool) -> None:
    """Reversals shrink volumes; in a rest one direction vanishes."""
    p = Parameters(0.1, 0.05, 1.06, 1.2, 0.4, 3.6, friction=0.6)
    if not rests:
        p = Parameters(0.1, 0.06, 1.34, 1.1, 0.5, 5.7, friction=0.05)
    orbit = damper.periodic_orbit(p)
    kinds = set(orbit.events["kind"])
    assert (4 in kinds, 6 in kinds) == (rests, True)
    cube = damper.simulate(p, state=orbit.state, transient=0, periods=400, observers=["lyapunov"])
    assert_those_of_multipliers(cube, orbit, 3 if rests else 4, 0.02)


@pytest.mark.parametrize("rests", [False, True])
def test_so_they_are_of_several_masses_that_rub(rests: bool) -> None:
    """With two impacts of each and reversals; where both rest as well."""
    own = [{}, {"mass_ratio": 0.26, "clearance": 1.3, "friction": 0.23}]
    p = Parameters(0.13, 0.084, 0.83, 2.9, 0.54, friction=0.37, masses=own)
    near = State(-3.91, -0.28, [-4.47, -5.12], [-2.87, 1.63]) if rests else None
    if not rests:
        own = [{"friction": 0.02}, {"mass_ratio": 0.09, "clearance": 3.6, "friction": 0.03}]
        p = Parameters(0.1, 0.1, 1.0, 3.0, 0.5, gravity=0.05, masses=own)
    orbit = damper.periodic_orbit(p, state=near)
    ask = {"lyapunov": {"exponents": 6}}
    cube = damper.simulate(p, state=orbit.state, transient=0, periods=40, observers=ask)
    assert_those_of_multipliers(cube, orbit, 4 if rests else 6, 0.1)


def test_masses_in_step_that_rest_but_do_not_hit() -> None:
    """Friction keeps their places apart, and not their velocities."""
    p = Parameters(0.1, 0.1, 0.8, 9.0, 0.5, friction=1.5, masses=damper.equal_masses(2))
    ask = {"lyapunov": {"exponents": 6}}
    cube = damper.simulate(p, transient=4, periods=10, observers=ask)
    assert 0.0 in cube.lyapunov_exponents
    assert (cube.lyapunov_exponents[-2:] == -np.inf).all()
    assert damper.periodic_orbit(p).multipliers[[0, 1, 4, 5]] == pytest.approx([1, 1, 0, 0])


def test_one_that_rests_beside_one_that_nothing_touches() -> None:
    """Both come to rest: what each takes is a part of all directions, not the whole of one."""
    own = [{}, {"clearance": 2.0, "friction": 0.2, "mass_ratio": 0.1}]
    p = Parameters(0.3, 0.1, 1.0, 50.0, 0.5, friction=1.5, masses=own)
    ask = {"lyapunov": {"exponents": 6}}
    state = State(0.0, 0.0, [0.0, 0.0], [0.0, 0.3])
    cube = damper.simulate(p, state=state, transient=0, periods=20, observers=ask)
    assert np.isfinite(cube.lyapunov_exponents[:4]).all()
    assert (cube.lyapunov_exponents[4:] == -np.inf).all()


@pytest.mark.parametrize("tension", [0, 1])
def test_volumes_shrink_by_the_dashpot_of_compliant_walls(tension: int) -> None:
    """All four exponents are finite: the masses never join."""
    values = {
        "mass_ratio": 0.1,
        "damping_ratio": 0.1,
        "frequency_ratio": 0.8,
        "clearance": 0.5,
        "restitution": 0.5,
        "contact_stiffness_ratio": 1e4,
        "contact_tension": tension,
    }
    cube = damper.simulate(**values, transient=0, periods=20, observers=["lyapunov"])
    run = start_run(Parameters(**values))
    log = np.concatenate([piece.copy() for piece in run.segments(20.0, 0.0)])
    touching = log[log[:, MODE] != FLIGHT, DURATION].sum() / 20.0
    assert touching > 0.0
    drag = 2.0 * contact_damping(0.5, bool(tension)) * math.sqrt(1e4 * 1.1 / 0.1)
    known = -2.0 * 0.1 * math.tau / 0.8 - drag * touching
    assert float(cube.lyapunov_exponents.sum()) == pytest.approx(known, rel=1e-10)
    assert abs(float(cube.lyapunov_residual)) < 1e-10 * abs(known)

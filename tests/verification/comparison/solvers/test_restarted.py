"""scipy's integrators, restarted: against the engine, closed forms and 50-digit values."""

import math
import warnings
from dataclasses import replace

import numpy as np
import pytest
from scipy.linalg import expm

import damper
from damper.models import start_run
from damper.parameters import Parameters, State
from damper.verification.comparison import integration
from damper.verification.comparison.integration import LONGEST_STEP, falling_depth, falling_gap
from damper.verification.comparison.restarted import solve_restarted
from damper.verification.comparison.scene import Scene, read_scene
from damper.verification.comparison.solution import CAPPED, FAILED, FINISHED, STALLED
from damper.verification.comparison.solvers import load

#: One complete burst from rest; its values below are from arithmetic in 50 digits.
BURST = {
    "mass_ratio": 0.1,
    "damping_ratio": 0.05,
    "frequency_ratio": 0.2,
    "clearance": 0.25,
    "restitution": 0.6,
}
FIRST_IMPACTS = np.array([2.15860318928243951, 5.25460925811892195, 14.2978156676934251])
ACCUMULATION, RELEASE = 44.249718778208865, 46.2709500002439

#: Solver -> tolerances from coarse to fine, and what is left of the error with the finest.
SOLVERS = {
    "dop853": ((1e-9, 1e-11, 1e-13), 2e-9),
    "rk45": ((1e-7, 1e-9, 1e-11), 2e-8),
    "lsoda": ((1e-8, 1e-10, 1e-12), 2e-8),
    "radau": ((1e-6, 1e-8, 1e-9), 1e-6),
}
METHODS = {"dop853": "DOP853", "rk45": "RK45", "lsoda": "LSODA", "radau": "Radau"}
each_solver = pytest.mark.parametrize("name", SOLVERS)


@each_solver
def test_complete_burst_converges_with_the_tolerance(name):
    solver = load(name)
    tolerances, left = SOLVERS[name]
    errors = []
    for tolerance in tolerances:
        found = solver.solve(read_scene(BURST, 60.0), tolerance)
        assert found.outcome == FINISHED
        assert found.reached == 60.0
        assert len(found.stick_times) == len(found.release_times) == 1
        errors.append(
            (
                np.abs(found.impact_times[:3] - FIRST_IMPACTS).max(),
                abs(found.stick_times[0] - ACCUMULATION),
                abs(found.release_times[0] - RELEASE),
            )
        )
        assert 0.0 <= found.penetration <= 1e-15
    errors = np.array(errors)
    assert (errors[-1] < left).all()
    assert (errors[-1] < 0.02 * errors[0]).all()


@each_solver
def test_impacts_of_the_burst_are_those_of_the_engine(name):
    scene = read_scene(BURST, 45.0)
    rows = damper.events(scene.parameters, scene.state, until=45.0)
    impacts = rows[rows["kind"] == 0]
    tolerances, left = SOLVERS[name]
    found = load(name).solve(scene, tolerances[-1])
    # The last ones before sticking differ in number: the rest is closed at different places.
    count = len(impacts) - 6
    assert count > 20
    np.testing.assert_allclose(
        found.impact_times[:count], impacts["time"][:count], rtol=0.0, atol=left
    )
    np.testing.assert_array_equal(found.impact_sides[:count], impacts["side"][:count])
    np.testing.assert_allclose(
        found.approach_speeds[:count], impacts["approach_speed"][:count], rtol=0.0, atol=3.0 * left
    )


@each_solver
def test_orbit_with_two_impacts_has_its_closed_form(name):
    # docs/theory.md: mu = .1, zeta = .1, omega = 1, r = .5, d = 5.5.
    speed, x0 = 4.594001326355, 1.716240408729
    mu, zeta, omega, r, d = 0.1, 0.1, 1.0, 0.5, 5.5
    after = speed * (2.0 * mu * r - 1.0 + r) / (1.0 + r)
    phase = _phase_at_impact(zeta, omega, x0, after - 2.0 * mu * speed, after)
    scene = Scene(
        Parameters(mu, zeta, omega, d, r, phase=phase),
        State(x0, after, x0 + d, -speed),
        4.5 * math.pi,
    )
    tolerances, left = SOLVERS[name]
    found = load(name).solve(scene, tolerances[-1])
    np.testing.assert_allclose(found.impact_times, math.pi * np.arange(1, 5), atol=10.0 * left)
    np.testing.assert_array_equal(found.impact_sides, [-1, 1, -1, 1])
    np.testing.assert_allclose(found.approach_speeds, 6.737868611987, atol=50.0 * left)


def _phase_at_impact(zeta, omega, x0, before, after):
    """Forcing phase with which the free primary goes from (x0, after) to (-x0, -before)."""
    h = math.pi / omega
    a = np.zeros((4, 4))
    a[0, 1] = 1.0
    a[1] = [-1.0, -2.0 * zeta, 1.0, 0.0]
    a[2, 3], a[3, 2] = omega, -omega
    flow = expm(a * h)
    sine, cosine = np.linalg.solve(
        flow[:2, 2:], np.array([-x0, -before]) - flow[:2, :2] @ [x0, after]
    )
    assert abs(math.hypot(sine, cosine) - 1.0) < 1e-9
    return math.atan2(sine, cosine)


@each_solver
def test_complete_burst_stalls_without_sticking(name):
    scene = read_scene(BURST, 60.0)
    found = solve_restarted(METHODS[name], scene, 1e-7, (), False, 100_000, sticking=False)
    assert found.outcome == STALLED
    assert abs(found.reached - ACCUMULATION) < 1e-3
    assert len(found.impact_times) > 150
    assert len(found.stick_times) == 0


@each_solver
def test_evaluations_are_capped(name):
    found = load(name).solve(
        read_scene(BURST, 60.0), 1e-8, times=(1.0, 50.0), balance=True, max_evaluations=500
    )
    assert found.outcome == CAPPED
    assert found.evaluations == 501
    assert 2.0 < found.reached < 40.0
    assert len(found.impact_times) > 0
    assert np.isfinite(found.states[0]).all()
    assert np.isnan(found.states[1]).all()
    assert math.isnan(found.energy_residual)


@each_solver
def test_what_is_too_large_for_numbers_is_an_outcome(name):
    values = {**BURST, "initial_velocity": 1e308, "clearance": 1e308}
    found = load(name).solve(read_scene(values, 30.0), 1e-8, max_evaluations=2_000)
    assert found.outcome in (FAILED, CAPPED)
    assert found.reached == 0.0


@pytest.mark.parametrize("trouble", ["raises", "gives up", "not a number"])
def test_what_the_integrator_cannot_do_is_a_failure_and_warns_nobody(monkeypatch, trouble):
    real = integration.solve_ivp
    calls = []

    def solve_ivp(*args, **options):
        calls.append(1)
        found = real(*args, **options)
        if len(calls) == 3:
            warnings.warn("lsoda: Excess work done on this call", stacklevel=1)
            if trouble == "raises":
                raise ValueError("f(a) and f(b) must have different signs")
            if trouble == "gives up":
                found.status = -1
            else:
                found.y[0, -1] = math.nan
        return found

    monkeypatch.setattr(integration, "solve_ivp", solve_ivp)
    found = load("lsoda").solve(read_scene(BURST, 60.0), 1e-8, times=(1.0, 50.0), balance=True)
    assert found.outcome == FAILED
    assert len(found.impact_times) == 2
    assert found.reached == found.impact_times[-1]
    assert np.isnan(found.states[1]).all()
    assert math.isnan(found.energy_residual)


def test_tolerances_below_rounding_warn_nobody(capfd):
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        found = load("lsoda").solve(read_scene(BURST, 20.0), 1e-17)
    assert found.outcome == FINISHED
    assert capfd.readouterr() == ("", "")


@each_solver
def test_states_are_those_of_the_engine(name):
    # In flight, in the burst, in sticking, after the release, and at the very end.
    times = (0.0, 3.0, 30.0, 43.0, 45.0, 47.0, 48.0)
    scene = read_scene(BURST, 48.0)
    tolerances, left = SOLVERS[name]
    found = load(name).solve(scene, tolerances[-1], times=times)
    run = start_run(scene.parameters, scene.state)
    for time, row in zip(times, found.states, strict=True):
        run.skip(*run.whole_periods(time))
        s = run.state_at(*run.whole_periods(time))
        np.testing.assert_allclose(row, (s.x, s.v, s.y, s.u), rtol=0.0, atol=5.0 * left)


@each_solver
def test_energy_balance_closes_with_the_tolerance(name):
    scene = read_scene(BURST, 60.0)
    tolerances, left = SOLVERS[name]
    found = load(name).solve(scene, tolerances[-1], balance=True)
    assert abs(found.energy_residual) < left
    assert found.energy_residual != 0.0
    # And changes nothing.
    plain = load(name).solve(scene, tolerances[-1])
    assert math.isnan(plain.energy_residual)
    np.testing.assert_array_equal(plain.impact_times, found.impact_times)
    np.testing.assert_array_equal(plain.stick_times, found.stick_times)


@pytest.mark.parametrize("restitution", [0.0, 0.5, 1.0])
@pytest.mark.parametrize("until", [9.0, 21.0])
def test_impacts_of_every_restitution(restitution, until):
    scene = read_scene({**BURST, "restitution": restitution}, until)
    rows = damper.events(scene.parameters, scene.state, until=until)
    found = load("dop853").solve(scene, 1e-12, balance=True)
    assert abs(found.energy_residual) < 1e-11
    for kind, times in enumerate((found.impact_times, found.stick_times, found.release_times)):
        np.testing.assert_allclose(times, rows["time"][rows["kind"] == kind], rtol=0.0, atol=1e-7)


@pytest.mark.parametrize(
    ("x", "v", "u", "side"),
    [
        (0.0, 0.0, 0.5, 1.0),  # approaches: an impact at once
        (0.0, 0.0, -0.5, 1.0),  # leaves
        (0.3, 0.1, 0.1, 1.0),  # no relative velocity, and the wall runs away from the mass
        (0.3, 0.1, 0.1, -1.0),  # the wall pushes
        (0.0, 0.0, 0.0, 1.0),  # neither, until the third derivative decides
        (0.0, 0.0, 0.0, -1.0),
    ],
)
def test_starts_on_a_wall(x, v, u, side):
    p = Parameters(0.1, 0.05, 0.2, 0.25, 0.6)
    scene = Scene(p, State(x, v, x + side * p.clearance, u), 6.0)
    rows = damper.events(p, scene.state, until=6.0)
    found = load("dop853").solve(scene, 1e-12)
    assert found.outcome == FINISHED
    # Sticking from the start is a row of the engine as well.
    sticks = rows["time"][rows["kind"] == 1]
    for want, times in (
        (rows["time"][rows["kind"] == 0], found.impact_times),
        (sticks, found.stick_times),
        (rows["time"][rows["kind"] == 2], found.release_times),
    ):
        np.testing.assert_allclose(times, want, rtol=0.0, atol=1e-8)


def test_no_clearance_is_one_mass():
    values = {"clearance": 0.0, "initial_velocity": 1.0, "initial_relative_velocity": 0.5}
    scene = read_scene({**BURST, **values}, 20.0)
    found = load("dop853").solve(scene, 1e-11, times=(20.0,), balance=True)
    run = start_run(scene.parameters, scene.state)
    run.skip(*run.whole_periods(20.0))
    s = run.state_at(*run.whole_periods(20.0))
    np.testing.assert_allclose(found.states[0], (s.x, s.v, s.x, s.v), rtol=0.0, atol=1e-8)
    assert len(found.impact_times) == len(found.stick_times) == 0
    assert abs(found.energy_residual) < 1e-9


def test_start_at_another_time():
    scene = read_scene({**BURST, "phase": 0.4}, 12.0)
    period = scene.parameters.period
    later = replace(scene, state=replace(scene.state, time=period), until=period + 12.0)
    plain, shifted = (load("rk45").solve(s, 1e-9, times=(s.until,)) for s in (scene, later))
    np.testing.assert_allclose(shifted.impact_times - period, plain.impact_times, atol=1e-9)
    np.testing.assert_allclose(shifted.states, plain.states, atol=1e-9)


@pytest.mark.parametrize(("event", "sign"), [(falling_gap, 1.0), (falling_depth, -1.0)])
def test_event_does_not_see_the_root_it_starts_on(event, sign):
    # gap = tau (1 - tau) away from the surface: the only root to be found is at 1.
    watched = event([0.0, 0.0, 0.0, sign])
    for tau in (0.0, 1e-300, 1e-9, 0.5, 0.999):
        assert watched(tau, [0.0, 0.0, sign * tau * (1.0 - tau), 0.0 if tau else sign]) > 0.0
    assert watched(1.001, [0.0, 0.0, sign * 1.001 * -0.001, 0.0]) < 0.0
    # From elsewhere it is the gap itself.
    assert event([0.0, 0.0, sign, 0.0])(0.0, [0.0, 0.0, sign * 0.25, 0.0]) == 0.25


def test_steps_are_no_longer_than_two_events_may_be_apart(monkeypatch):
    steps = []
    real = integration.solve_ivp

    def solve_ivp(*args, **options):
        found = real(*args, **options)
        steps.append(np.diff(found.t).max())
        return found

    monkeypatch.setattr(integration, "solve_ivp", solve_ivp)
    load("dop853").solve(read_scene(BURST, 30.0), 1e-2)
    assert 0.9 * LONGEST_STEP < max(steps) <= LONGEST_STEP * (1.0 + 1e-12)


def compliant(stiffness, tension, until=40.0):
    return read_scene(
        {**BURST, "contact_stiffness_ratio": stiffness, "contact_tension": tension}, until
    )


@pytest.mark.parametrize("tension", [0, 1])
@pytest.mark.parametrize(("name", "tolerance"), [("dop853", 1e-10), ("lsoda", 1e-10)])
@pytest.mark.parametrize("stiffness", [1e4, 1e6])
def test_walls_that_give(name, tolerance, stiffness, tension):
    scene = compliant(stiffness, tension)
    rows = damper.events(scene.parameters, scene.state, until=scene.until)
    impacts = rows[rows["kind"] == 0]
    errors = []
    for factor in (1000.0, 1.0):
        found = load(name).solve(scene, tolerance * factor, balance=factor == 1.0)
        assert found.outcome == FINISHED
        assert len(found.stick_times) == len(found.release_times) == 0
        np.testing.assert_array_equal(found.impact_sides, impacts["side"])
        errors.append(np.abs(found.impact_times - impacts["time"]).max())
    assert errors[1] < 3e-7
    assert errors[1] < 0.05 * errors[0]
    assert abs(found.energy_residual) < 1e-8


@pytest.mark.parametrize("name", ["rk45", "radau"])
def test_walls_that_give_by_other_methods(name):
    scene = compliant(1e4, 0, 25.0)
    rows = damper.events(scene.parameters, scene.state, until=scene.until)
    found = load(name).solve(scene, 1e-8, times=(20.0,), balance=True)
    np.testing.assert_allclose(
        found.impact_times, rows["time"][rows["kind"] == 0], rtol=0.0, atol=1e-5
    )
    run = start_run(scene.parameters, scene.state)
    run.skip(*run.whole_periods(20.0))
    s = run.state_at(*run.whole_periods(20.0))
    np.testing.assert_allclose(found.states[0], (s.x, s.v, s.y, s.u), rtol=0.0, atol=1e-5)
    assert abs(found.energy_residual) < 1e-7


def test_undamped_walls_that_give_are_held():
    values = {**BURST, "restitution": 1.0, "contact_stiffness_ratio": 1e4}
    scene = read_scene(values, 16.0)
    rows = damper.events(scene.parameters, scene.state, until=scene.until)
    found = load("dop853").solve(scene, 1e-11, balance=True)
    np.testing.assert_allclose(found.impact_times, rows["time"], rtol=0.0, atol=1e-6)
    assert abs(found.energy_residual) < 1e-9


def test_start_in_a_wall_that_gives():
    p = Parameters(0.1, 0.05, 0.2, 0.25, 0.6, contact_stiffness_ratio=1e4)
    for u in (0.1, -0.1, -3.0):
        scene = Scene(p, State(0.0, 0.0, 0.251, u), 12.0)
        rows = damper.events(p, scene.state, until=scene.until)
        found = load("dop853").solve(scene, 1e-11)
        np.testing.assert_allclose(
            found.impact_times, rows["time"][rows["kind"] == 0], rtol=0.0, atol=1e-7
        )
        assert found.penetration >= 0.001 - 1e-15

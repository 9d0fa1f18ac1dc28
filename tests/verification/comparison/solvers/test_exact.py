"""The engine as a solver: its own events and states, and nothing done that is not asked for."""

import math

import numpy as np
import pytest

import damper
from damper.models import start_run
from damper.sweep.events import events
from damper.verification.comparison.scene import Scene, read_scene
from damper.verification.comparison.solution import CAPPED, FINISHED
from damper.verification.comparison.solvers import exact

BURST = {
    "mass_ratio": 0.1,
    "damping_ratio": 0.05,
    "frequency_ratio": 0.2,
    "clearance": 0.25,
    "restitution": 0.6,
}


@pytest.mark.parametrize("walls", [{}, {"contact_stiffness_ratio": 300.0}])
def test_events_and_evaluations_are_those_of_the_engine(walls):
    scene = read_scene({**BURST, **walls}, 400.0)
    found = exact.solve(scene, 1e-12)
    rows = events(scene.parameters, until=400.0)
    impacts = rows[rows["kind"] == 0]
    np.testing.assert_array_equal(found.impact_times, impacts["time"])
    np.testing.assert_array_equal(found.impact_sides, impacts["side"])
    np.testing.assert_array_equal(found.approach_speeds, impacts["approach_speed"])
    np.testing.assert_array_equal(found.stick_times, rows["time"][rows["kind"] == 1])
    np.testing.assert_array_equal(found.release_times, rows["time"][rows["kind"] == 2])
    run = start_run(scene.parameters)
    run.skip(*run.whole_periods(400.0))
    assert found.evaluations == run.evaluations
    assert (found.penetration > 1e-6) == bool(walls)


@pytest.mark.parametrize("walls", [{}, {"contact_stiffness_ratio": 300.0}])
def test_states_are_where_a_run_to_that_time_ends(walls):
    scene = read_scene({**BURST, **walls}, 50.0)
    # In flight, in a burst's tail, in sticking, at an impact, at the end.
    hit = float(events(scene.parameters, until=50.0)["time"][2])
    times = (0.0, 7.0, hit, 44.2497, 45.0, 50.0)
    found = exact.solve(scene, 1e-12, times=times)
    for time, state in zip(times, found.states, strict=True):
        run = start_run(scene.parameters)
        run.skip(*run.whole_periods(time))
        end = run.state_at(*run.whole_periods(time))
        np.testing.assert_allclose(state, (end.x, end.v, end.y, end.u), rtol=0, atol=1e-13)


def test_states_at_the_end_are_there_however_times_are_rounded():
    p = damper.Parameters(0.1, 0.05, 1e3, clearance=2.0, restitution=0.6, phase=1.0)
    # At rest on a wall that pushes: the run is one segment.
    speed = -0.8183375991714585
    state = damper.State(0.2845930835364112, speed, 2.284593083536411, speed, time=3.0)
    for until in 3.0 + p.period * np.linspace(0.5, 3.5, 40):
        found = exact.solve(Scene(p, state, float(until)), 1e-12, times=(float(until),))
        assert found.outcome == FINISHED
        assert found.reached == until
        assert np.all(np.isfinite(found.states))


@pytest.mark.parametrize("walls", [{}, {"contact_stiffness_ratio": 300.0, "restitution": 0.3}])
@pytest.mark.parametrize("until", [1.0, 17.3, 44.2497, 45.0, 200.0])
def test_the_balance_holds_to_rounding_over_any_stretch(walls, until):
    found = exact.solve(read_scene({**BURST, **walls}, until), 1e-12, balance=True)
    assert abs(found.energy_residual) < 1e-12


def test_accuracy_moves_accumulation_alone():
    scene = read_scene(BURST, 50.0)
    fine, coarse = (exact.solve(scene, accuracy) for accuracy in (1e-13, 1e-4))
    shared = len(coarse.impact_times)
    assert shared < len(fine.impact_times)
    np.testing.assert_array_equal(coarse.impact_times, fine.impact_times[:shared])
    error = abs(coarse.stick_times[0] - fine.stick_times[0])
    assert 1e-12 < error < 1e-4
    assert abs(fine.stick_times[0] - 44.249718778208865) < 1e-11


def test_a_cap_is_kept_within_a_piece_of_the_log():
    scene = read_scene({**BURST, "frequency_ratio": 1.0, "clearance": 1.0}, 10_000.0)
    for cap in (1, 30, 1000):
        found = exact.solve(scene, 1e-12, times=(9999.0,), balance=True, max_evaluations=cap)
        assert found.outcome == CAPPED
        assert cap <= found.evaluations < 1.7 * cap + 40
        assert found.reached < 9999.0
        assert math.isnan(found.energy_residual)
        assert np.all(np.isnan(found.states))


def test_a_start_outside_the_box_and_a_bad_accuracy_are_refused():
    outside = Scene(damper.Parameters(**BURST), damper.State(0.0, 0.0, 1.0, 0.0), 1.0)
    with pytest.raises(ValueError, match="outside the box"):
        exact.solve(outside, 1e-12)
    with pytest.raises(ValueError, match="accuracy"):
        exact.solve(read_scene(BURST, 1.0), 1.0)

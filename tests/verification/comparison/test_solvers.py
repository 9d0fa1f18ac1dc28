"""Solvers of the comparison: orders, known values, and that they notice their known failures."""

import math
import warnings
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from cases import thinned
from scenes import SLOW as BURST

import damper
from damper.analysis.labels import LABELS
from damper.engine.compiled import plain
from damper.theory.two_impacts import orbits
from damper.verification.comparison import SOLVERS, solvers
from damper.verification.comparison.solvers import FAILED, FINISHED, Scene, dop853, load, read_scene

STEP_END, LOCATED, MOREAU = "rk4_step_end", "rk4_located", "moreau_jean"
FIXED = (STEP_END, LOCATED, MOREAU)
#: A setting that is fine enough for each kind of setting, and a coarse one.
FINE = {"accuracy": 1e-12, "tolerance": 1e-9, "steps_per_period": 1000}
COARSE = {"accuracy": 1e-4, "tolerance": 1e-4, "steps_per_period": 100}
#: Of `BURST` from rest, by arithmetic in 50 digits: three impacts, then a complete burst.
FIRST_IMPACTS = np.array([2.15860318928243951, 5.25460925811892195, 14.2978156676934251])
ACCUMULATION, RELEASE = 44.249718778208865, 46.2709500002439
each_solver = pytest.mark.parametrize("name", SOLVERS)


def solve(name, scene, setting=None, most=10**8):
    """Run a scene; in plain Python where that takes less time than to compile."""
    solver = load(name)
    setting = FINE[SOLVERS[name]] if setting is None else setting
    many = name in FIXED and setting * scene.periods > 20_000.0
    return (solver.solve if many else plain(solver.solve))(scene, setting, most)


def order(errors, settings):
    """Slope of log(error) against log(setting) by least squares."""
    assert all(errors)
    return np.polyfit(np.log(settings), np.log(errors), 1)[0]


@plain
def engine(scene):
    """Times of impacts, sticking and releases by the engine."""
    rows = damper.events(scene.parameters, scene.state, until=scene.until)
    return [rows["time"][rows["kind"] == kind] for kind in range(3)]


def instants(found):
    return found.impact_times, found.stick_times, found.release_times


@plain
def periodic(quarters):
    """The scene on an orbit of two impacts per period, and the orbit."""
    p = damper.Parameters(0.1, 0.1, 1.0, clearance=5.5, restitution=0.5)
    orbit = next(orbit for orbit in orbits(p) if orbit.admissible)
    return Scene(p, orbit.start, orbit.start.time + quarters * 0.25 * p.cycle), orbit


def test_every_solver_is_in_the_list_and_describes_itself():
    files = Path(solvers.__file__).parent.glob("*.py")
    assert {path.stem for path in files} == {*SOLVERS, "__init__"}
    for name in SOLVERS:
        assert name in LABELS


@each_solver
def test_errors_on_the_periodic_motion_fall_with_the_setting(name):
    """Two impacts per period, in closed form."""
    scene, orbit = periodic(9)
    quarter = 0.25 * scene.parameters.cycle
    errors = []
    for setting in (COARSE[SOLVERS[name]], FINE[SOLVERS[name]]):
        found = solve(name, scene, setting)
        assert found.outcome == FINISHED
        assert found.reached == scene.until
        np.testing.assert_array_equal(found.impact_sides, [-1.0, 1.0, -1.0, 1.0])
        exact = scene.state.time + quarter * np.array([2.0, 4.0, 6.0, 8.0])
        _, _, y, u = found.end_state
        off = np.append(found.impact_times - exact, (y - scene.state.y, u)) - (
            *[0.0] * 4,
            *(-orbit.speed * quarter, -orbit.speed),
        )
        errors.append(np.abs(off).max())
    assert errors[1] < max(0.2 * errors[0], 1e-10)


@pytest.mark.parametrize(("name", "expected"), [(STEP_END, 1), (LOCATED, 4), (MOREAU, 1)])
def test_order_of_impact_times(name, expected):
    scene, _ = periodic(9)
    exact = scene.state.time + 0.25 * scene.parameters.cycle * np.array([2.0, 4.0, 6.0, 8.0])
    settings = (90, 180, 360)
    errors = [np.abs(solve(name, scene, s).impact_times - exact).max() for s in settings]
    # At step ends it is the luck of the steps that decides: between 0 and h.
    assert abs(-order(errors, settings) - expected) < (0.5 if expected == 1 else 0.2)


def burst_errors(name, setting):
    found = solve(name, read_scene(BURST, 60.0), setting)
    assert found.outcome == FINISHED
    assert len(found.stick_times) == len(found.release_times) == 1
    return (
        np.abs(found.impact_times[:3] - FIRST_IMPACTS).max(),
        abs(found.stick_times[0] - ACCUMULATION),
        abs(found.release_times[0] - RELEASE),
    )


#: Solver -> settings from coarse to fine, and what is left of the errors with the finest.
SETTINGS = {
    "exact": ((1e-3, 1e-12), 1e-11),
    STEP_END: ((1e4, 1e6), 1e-2),
    "dop853": ((1e-9, 1e-13), 2e-9),
    MOREAU: ((2e4, 2e5), 2e-2),
}


@pytest.mark.parametrize("name", thinned(SETTINGS, {"exact", "dop853", MOREAU}.__contains__))
def test_a_complete_burst_converges_to_50_digits(name):
    settings, left = SETTINGS[name]
    coarse, fine = (np.array(burst_errors(name, setting)) for setting in settings)
    assert (fine < left).all()
    # The engine's accuracy is that of accumulation times alone.
    assert (fine <= 0.15 * coarse).all() or name == "exact"


def test_a_phase_and_a_later_start_undo_each_other():
    one = read_scene(BURST, 60.0)
    p, time = one.parameters, 5.0
    shifted = replace(p, phase=p.phase - p.frequency_ratio * time)
    later = Scene(shifted, replace(one.state, time=one.state.time + time), 60.0 + time)
    for here, there in zip(*(instants(solve("dop853", s)) for s in (one, later)), strict=True):
        np.testing.assert_allclose(there - time, here, atol=1e-8)


# The engine as a solver


def test_the_engine_gives_its_own_events_and_stops_after_a_piece_of_the_log():
    scene = read_scene({**BURST, "frequency_ratio": 1.0, "clearance": 1.0}, 400.0)
    for mine, wanted in zip(instants(solve("exact", scene)), engine(scene), strict=True):
        np.testing.assert_array_equal(mine, wanted)
    long = read_scene({**BURST, "frequency_ratio": 1.0, "clearance": 1.0}, 10_000.0)
    for most in (1, 30, 1000):
        assert most <= solve("exact", long, most=most).evaluations < 1.7 * most + 40


# Fixed steps


def test_rules_of_sticking_end_a_burst_where_they_say():
    # As good as unmoved by it, a wall pushes with the acceleration 5. Bounces last 0.04, 0.024,
    # ...: as long as a step, 0.001, after seven of them, and as its square after twenty.
    p = damper.Parameters(1e-6, 0.0, 1e-3, clearance=0.5, restitution=0.6)
    scene = Scene(p, damper.State(-5.0, 0.0, -5.5, 0.1), 0.2)
    at_ends, located = (solve(name, scene, 1000.0 * p.cycle) for name in (STEP_END, LOCATED))
    assert len(at_ends.stick_times) == len(located.stick_times) == 1
    assert 5 <= len(at_ends.impact_times) <= 9
    assert len(located.impact_times) == 21
    (stick,) = engine(scene)[1]
    # What is left of the burst then: the next bounce's length over 1 - r.
    assert stick - 1e-6 / 0.4 < located.stick_times[0] < stick


@pytest.mark.parametrize("name", [STEP_END, LOCATED])
def test_a_step_too_long_for_heavy_damping_blows_up_and_says_so(name):
    scene = read_scene({**BURST, "damping_ratio": 10.0}, 100.0)
    assert solve(name, scene, 50).outcome == FAILED
    assert solve(MOREAU, scene, 50).outcome == FINISHED


# scipy


@pytest.mark.parametrize("trouble", ["raises", "gives up", "not a number"])
def test_what_the_integrator_cannot_do_is_a_failure_and_warns_nobody(monkeypatch, trouble):
    real = dop853.solve_ivp
    calls = []

    def solve_ivp(*args, **options):
        calls.append(1)
        found = real(*args, **options)
        if len(calls) == 3:
            warnings.warn("rtol is too small", stacklevel=1)
            if trouble == "raises":
                raise ValueError("f(a) and f(b) must have different signs")
            if trouble == "gives up":
                found.status = -1
            else:
                found.y[0, -1] = math.nan
        return found

    monkeypatch.setattr(dop853, "solve_ivp", solve_ivp)
    found = solve("dop853", read_scene(BURST, 60.0))
    assert found.outcome == FAILED
    assert len(found.impact_times) == 2
    assert found.reached == found.impact_times[-1]

"""Solvers of the comparison: orders, known values, and that they notice their known failures."""

import math
import warnings
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
from damper.verification.comparison.solvers import (
    CAPPED,
    FAILED,
    FINISHED,
    STALLED,
    Scene,
    dop853,
    load,
    read_scene,
)

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


def test_orders_of_a_burst_with_located_impacts():
    settings = (200, 400, 800)
    errors = np.array([burst_errors(LOCATED, setting) for setting in settings]).T
    for values, expected in zip(errors, (4, 2, 4), strict=True):
        assert abs(-order(values, settings) - expected) < 0.4


@each_solver
def test_a_cap_ends_a_run(name):
    # Long enough for every method: the engine takes five evaluations for an impact.
    found = solve(
        name, read_scene({**BURST, "frequency_ratio": 0.9, "clearance": 1.0}, 400), most=50
    )
    assert found.outcome == CAPPED
    assert 0.0 <= found.reached < 400.0
    assert np.isnan(found.end_state).all()
    assert np.all(found.impact_times <= found.reached)
    # A step or a search may be finished first.
    assert found.evaluations <= 1000


@each_solver
def test_restitution_zero_sticks_at_once(name):
    scene = read_scene({**BURST, "restitution": 0.0}, 10.0)
    found = solve(name, scene, 20_000 if name in FIXED else None)
    tight = 1e-6 if name in ("exact", LOCATED, "dop853") else 2e-2
    for mine, wanted in zip(instants(found), engine(scene), strict=True):
        np.testing.assert_allclose(mine, wanted, rtol=0, atol=tight)


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


def test_a_release_is_no_impact_wherever_in_a_step_it_lies():
    scene = read_scene({**BURST, "restitution": 0.0}, 10.0)
    for setting in range(300, 700, 37):
        found = solve(LOCATED, scene, setting)
        assert [len(times) for times in instants(found)] == [len(times) for times in engine(scene)]


def test_steps_that_are_checked_at_their_ends_miss_a_double_crossing():
    # Nothing moves the free mass; the primary swings out to 1.001 and back once a period.
    p = damper.Parameters(0.1, 0.0, 1e-3, clearance=1.0, restitution=0.9)
    scene = Scene(p, damper.State(0.0, 1.001, 0.0, 0.0), 3.0)
    hit = engine(scene)[0][0]
    for name in (STEP_END, LOCATED):
        missed = solve(name, scene, 4 * p.cycle)
        assert missed.outcome == FINISHED
        assert len(missed.impact_times) == 0
        assert abs(solve(name, scene, 500 * p.cycle).impact_times[0] - hit) < 3e-3


@pytest.mark.parametrize("name", [STEP_END, LOCATED])
def test_a_step_too_long_for_heavy_damping_blows_up_and_says_so(name):
    scene = read_scene({**BURST, "damping_ratio": 10.0}, 100.0)
    assert solve(name, scene, 50).outcome == FAILED
    assert solve(MOREAU, scene, 50).outcome == FINISHED


def test_a_burst_whose_rebounds_no_longer_move_the_time_stalls():
    # At t = 1e6 they take less than its roundoff, 1e-10; the shortest flights are h^2 long.
    p = damper.Parameters(0.1, 0.05, 1.0, clearance=0.5, restitution=0.95)
    scene = Scene(p, damper.State(-5.0, 0.0, -5.5, 1e-9, time=1e6), 1e6 + 1e-6)
    assert solve(LOCATED, scene, 100).outcome == FINISHED
    tiny = solve(LOCATED, scene, p.cycle * 1e7)
    assert tiny.outcome == STALLED
    assert len(tiny.stick_times) == 0


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


def test_event_does_not_see_the_root_it_starts_on():
    # gap = tau (1 - tau): the only root to be found is at 1.
    watched = dop853.falling_gap([0.0, 0.0, 0.0, 1.0])
    for tau in (0.0, 1e-300, 1e-9, 0.5, 0.999):
        assert watched(tau, [0.0, 0.0, tau * (1.0 - tau), 0.0 if tau else 1.0]) > 0.0
    assert watched(1.001, [0.0, 0.0, 1.001 * -0.001, 0.0]) < 0.0
    # From elsewhere it is the gap itself.
    assert dop853.falling_gap([0.0, 0.0, 1.0, 0.0])(0.0, [0.0, 0.0, 0.25, 0.0]) == 0.25


def test_start_at_another_time():
    scene = read_scene({**BURST, "phase": 0.4}, 12.0)
    s, period = scene.state, scene.parameters.cycle
    later = Scene(scene.parameters, damper.State(s.x, s.v, s.y, s.u, period), period + 12.0)
    for name in ("exact", LOCATED, "dop853"):
        plain_run, shifted = solve(name, scene), solve(name, later)
        np.testing.assert_allclose(shifted.impact_times - period, plain_run.impact_times, atol=1e-9)
        np.testing.assert_allclose(shifted.end_state, plain_run.end_state, atol=1e-9)

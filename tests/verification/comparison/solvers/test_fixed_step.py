"""Orders of the fixed-step methods, and that they notice the failures that they are known for."""

import math

import numpy as np
import pytest

import damper
from damper.engine.compiled import plain
from damper.engine.segment import IMPACT
from damper.models import start_run
from damper.sweep.events import events
from damper.theory.two_impacts import orbits
from damper.verification.comparison.fixed_step import Damper, rk4
from damper.verification.comparison.scene import Scene, read_scene
from damper.verification.comparison.solution import CAPPED, FAILED, FINISHED, STALLED
from damper.verification.comparison.solvers import load, rk4_step_end
from damper.verification.comparison.solvers.rk4_located import RelativeState, _find_impact

STEP_END, LOCATED, MOREAU = "rk4_step_end", "rk4_located", "moreau_jean"
ALL = (STEP_END, LOCATED, MOREAU)
#: From rest: three impacts, then a complete burst; sticking at 44.2497, release at 46.27.
BURST = {
    "mass_ratio": 0.1,
    "damping_ratio": 0.05,
    "frequency_ratio": 0.2,
    "clearance": 0.25,
    "restitution": 0.6,
}


def solve(name, scene, setting, **options):
    return load(name).solve(scene, setting, **options)


def order(errors, settings):
    """Slope of log(error) against log(step) by least squares."""
    assert all(errors)
    return -np.polyfit(np.log(settings), np.log(errors), 1)[0]


def periodic(quarters):
    """The scene on an orbit of two impacts per period, and its orbit."""
    p = damper.Parameters(0.1, 0.1, 1.0, clearance=5.5, restitution=0.5)
    orbit = next(orbit for orbit in orbits(p) if orbit.admissible)
    return Scene(p, orbit.start, orbit.start.time + quarters * 0.25 * p.period), orbit


# Orders


def end_of(scene):
    """State at the end of a scene, by the engine."""
    run = start_run(scene.parameters, scene.state)
    end = run.whole_periods(scene.until)
    run.skip(*end)
    return run.state_at(*end)


@pytest.mark.parametrize(("name", "expected"), [(STEP_END, 4), (LOCATED, 4), (MOREAU, 2)])
def test_order_without_contact(name, expected):
    p = damper.Parameters(0.1, 0.1, 1.3, clearance=50.0, restitution=0.5, phase=0.4)
    scene = Scene(p, damper.State(1.0, -0.5, 0.2, 0.1), 20.0)
    exact = end_of(scene)
    settings = (50, 100, 200, 400)
    errors = []
    for setting in settings:
        (state,) = solve(name, scene, setting, times=(20.0,)).states
        np.testing.assert_allclose(state[2:], (2.2, 0.1), atol=1e-12)
        errors.append(math.hypot(state[0] - exact.x, state[1] - exact.v))
    assert abs(order(errors, settings) - expected) < 0.15


@pytest.mark.parametrize(("name", "expected"), [(STEP_END, 1), (LOCATED, 4), (MOREAU, 1)])
def test_order_on_the_periodic_motion(name, expected):
    scene, orbit = periodic(9)
    quarter = 0.25 * scene.parameters.period
    settings = (90, 180, 360, 720)
    in_time, in_state = [], []
    for setting in settings:
        found = solve(name, scene, setting, times=(scene.until,))
        np.testing.assert_array_equal(found.impact_sides, [-1.0, 1.0, -1.0, 1.0])
        exact = scene.state.time + quarter * np.array([2.0, 4.0, 6.0, 8.0])
        in_time.append(np.abs(found.impact_times - exact).max())
        y = scene.state.y - orbit.speed * quarter
        in_state.append(abs(found.states[0, 2] - y) + abs(found.states[0, 3] + orbit.speed))
    for errors in (in_time, in_state):
        # At step ends it is the luck of the steps that decides: between 0 and h.
        assert abs(order(errors, settings) - expected) < (0.5 if expected == 1 else 0.2)


def test_located_impacts_and_releases_keep_the_fourth_order_and_accumulation_the_second():
    scene = read_scene(BURST, 50.0)
    exact = events(scene.parameters, until=50.0)
    settings = (200, 400, 800, 1600)
    first, stick, release, end = [], [], [], []
    (expected,) = solve("exact", scene, 1e-12, times=(50.0,)).states
    for setting in settings:
        found = solve(LOCATED, scene, setting, times=(50.0,))
        impacts = exact["time"][exact["kind"] == 0][:3]
        first.append(np.abs(found.impact_times[:3] - impacts).max())
        stick.append(abs(found.stick_times[0] - exact["time"][exact["kind"] == 1][0]))
        release.append(abs(found.release_times[0] - exact["time"][exact["kind"] == 2][0]))
        end.append(np.abs(found.states[0] - expected).max())
        assert len(found.stick_times) == len(found.release_times) == 1
    for errors in (first, release, end):
        assert abs(order(errors, settings) - 4) < 0.3
    assert abs(order(stick, settings) - 2) < 0.4


def test_work_and_losses_keep_the_order():
    scene = read_scene(BURST, 50.0)
    settings = (200, 800, 3200)
    # The residual of a stiff balance falls faster than the fourth order here, never slower.
    for name in (STEP_END, LOCATED):
        errors = [abs(solve(name, scene, n, balance=True).energy_residual) for n in settings]
        assert errors[0] < 1e-6
        assert errors[2] < 1e-11
    for setting in settings:
        # The midpoint rule has a balance of its own that holds to rounding.
        assert abs(solve(MOREAU, scene, setting, balance=True).energy_residual) < 1e-13


@pytest.mark.parametrize("tension", [0, 1])
def test_walls_that_give_are_approached_at_first_order(tension):
    values = {**BURST, "clearance": 1.0, "contact_stiffness_ratio": 20.0, "frequency_ratio": 1.0}
    scene = read_scene({**values, "contact_tension": tension}, 9.0)
    (expected,) = solve("exact", scene, 1e-12, times=(9.0,)).states
    exact = events(scene.parameters, until=9.0)
    impacts = exact[exact["kind"] == 0]
    assert len(impacts) == 5
    for setting in (1000, 10_000, 100_000):
        found = solve(STEP_END, scene, setting, times=(9.0,), balance=True)
        step = scene.parameters.period / setting
        np.testing.assert_array_equal(found.impact_sides, impacts["side"])
        assert np.abs(found.impact_times - impacts["time"]).max() < 20 * step
        assert np.abs(found.approach_speeds - impacts["approach_speed"]).max() < 20 * step
        # Where in its steps the corners of the force lie makes the error jump: a bound, no slope.
        assert np.abs(found.states[0] - expected).max() < 3 * step
        assert abs(found.energy_residual) < step


def test_a_runge_kutta_step_is_the_taylor_series_up_to_the_fourth_power():
    # Without force and damping a step is the polynomial of exp(i h): 1 - h^2/2 + h^4/24.
    h = 0.3
    curve, dv, work, loss = rk4(Damper(0.1, 0.0, 1.0, 1.0, 0.6, 0.0), 1.0, 1.0, 0.0, 0.0, 0.0)
    assert curve == dv == work == loss == 0.0
    forced = rk4(Damper(0.1, 0.0, 1e-30, 1.0, 0.6, 0.0), 1.0, 1.0, 0.0, 0.0, h)
    assert forced[0] == pytest.approx(-h * h / 2 + h**4 / 24, rel=1e-14)
    assert forced[1] == pytest.approx(-h + h**3 / 6, rel=1e-14)


# Starts, and ends of contacts


@pytest.mark.parametrize("name", ALL)
@pytest.mark.parametrize("side", [-1, 1])
def test_starts_on_a_wall_are_those_of_the_engine(name, side):
    p = damper.Parameters(0.2, 0.05, 0.5, 0.3, 0.5, phase=-side * 0.5 * math.pi)
    for speed, kinds in ((0.5 * side, (0,)), (-0.5 * side, ()), (0.0, (1,))):
        state = damper.State(0.0, 0.0, side * 0.3, speed)
        exact = events(p, state, until=0.01)
        assert tuple(exact["kind"]) == kinds
        found = solve(name, Scene(p, state, 0.01), 10_000)
        np.testing.assert_array_equal(found.impact_times, exact["time"][exact["kind"] == 0])
        np.testing.assert_array_equal(
            found.approach_speeds, exact["approach_speed"][exact["kind"] == 0]
        )
        np.testing.assert_array_equal(found.stick_times, exact["time"][exact["kind"] == 1])


@pytest.mark.parametrize("name", ALL)
def test_at_rest_on_a_wall_that_is_about_to_push_or_to_leave(name):
    # No acceleration yet, but it is coming: to the right, so the left wall pushes.
    for side in (-1, 1):
        p = damper.Parameters(0.2, 0.0, 0.5, 0.3, 0.5)
        scene = Scene(p, damper.State(0.0, 0.0, side * 0.3, 0.0), 1.0)
        exact = events(p, scene.state, until=1.0)
        assert tuple(exact["kind"]) == ((1,) if side == -1 else ())
        found = solve(name, scene, 10_000)
        assert len(found.stick_times) == len(exact)
        assert len(found.impact_times) == len(found.release_times) == 0


def pushed(speed):
    """A rebound from a wall that pushes with the acceleration 5, as good as unmoved by it."""
    p = damper.Parameters(1e-6, 0.0, 1e-3, clearance=0.5, restitution=0.6)
    return Scene(p, damper.State(-5.0, 0.0, -5.5, speed), 0.2)


def test_rules_of_sticking_end_a_burst_where_they_say():
    # Bounces last 0.04, 0.024, ...: as long as a step, 0.001, after seven of them, and as its
    # square after twenty.
    scene = pushed(0.1)
    setting = 1000.0 * scene.parameters.period
    at_ends = solve(STEP_END, scene, setting)
    assert len(at_ends.stick_times) == 1
    assert 5 <= len(at_ends.impact_times) <= 9
    located = solve(LOCATED, scene, setting)
    assert len(located.stick_times) == 1
    assert len(located.impact_times) == 21
    assert located.stick_times[0] == located.impact_times[-1]
    (stick,) = events(scene.parameters, scene.state, until=0.2)[-1:]["time"]
    # What is left of the burst then: the next bounce's length over 1 - r.
    assert stick - 1e-6 / 0.4 < located.stick_times[0] < stick


def test_a_release_is_no_impact_wherever_in_a_step_it_lies():
    scene = read_scene({**BURST, "restitution": 0.0}, 10.0)
    exact = events(scene.parameters, until=10.0)
    for setting in range(300, 700):
        found = solve(LOCATED, scene, setting)
        assert len(found.impact_times) == np.count_nonzero(exact["kind"] == 0)
        assert len(found.release_times) == np.count_nonzero(exact["kind"] == 2)


@pytest.mark.parametrize("name", ALL)
def test_states_inside_steps(name):
    scene, _ = periodic(6)
    times = scene.state.time + np.linspace(0.0, 1.4, 23) * scene.parameters.period
    found = solve(name, scene, 500, times=times).states
    expected = solve("exact", scene, 1e-12, times=times).states
    allowed = 1e-6 if name == LOCATED else 0.2
    np.testing.assert_allclose(found, expected, rtol=0, atol=allowed)
    # The first half period is free flight: only the order within a step counts.
    early = times < scene.state.time + 0.48 * scene.parameters.period
    allowed = 1e-3 if name == MOREAU else 1e-7
    np.testing.assert_allclose(found[early], expected[early], rtol=0, atol=allowed)


def test_located_impacts_lie_on_the_wall_to_rounding():
    # From a wall with speed 0.1 into one that pushes with 5: 40 steps, or a part of one.
    damper = Damper(0.1, 0.0, 1e-3, 1.0, 0.6, 0.0)
    state = RelativeState(x=-5.0, v=0.0, gap=0.0, rate=0.1, side=-1.0, stuck=False, due=IMPACT)
    for left in (0.05, 0.1, 0.5):
        tau, evaluations = _find_impact(damper, state, 0.0, left)
        curve, _, _, _ = rk4(damper, 1.0, -5.0, 0.0, 0.0, tau)
        assert abs(0.1 * tau - curve) < 1e-16 * 0.1
        assert abs(tau - 0.04) < 1e-4
        assert evaluations <= 60


def test_a_lasting_compliant_contact_is_sticking():
    values = {**BURST, "contact_stiffness_ratio": 100.0, "restitution": 0.3}
    scene = read_scene(values, 20.0)
    exact = events(scene.parameters, until=20.0)
    found = solve(STEP_END, scene, 50_000)
    # It lasts 0.19 before it counts.
    np.testing.assert_allclose(found.stick_times, exact["time"][exact["kind"] == 1], atol=0.05)
    np.testing.assert_allclose(found.release_times, exact["time"][exact["kind"] == 2], atol=0.02)


@pytest.mark.parametrize("name", ALL)
def test_without_clearance_the_masses_are_one_oscillator(name):
    p = damper.Parameters(0.5, 0.1, 0.7, 0.0, 0.5)
    scene = Scene(p, damper.State(0.0, 0.3, 0.0, -0.6), 10.0)
    found = solve(name, scene, 4000, times=(10.0,), balance=True)
    exact = end_of(scene)
    np.testing.assert_allclose(found.states[0], (exact.x, exact.v) * 2, atol=1e-5)
    assert len(found.impact_times) == len(found.stick_times) == len(found.release_times) == 0
    assert abs(found.energy_residual) < 1e-10
    assert found.penetration < 1e-12


@pytest.mark.parametrize("name", ALL)
def test_restitution_zero_sticks_at_once(name):
    scene = read_scene({**BURST, "restitution": 0.0}, 10.0)
    exact = events(scene.parameters, until=10.0)
    found = solve(name, scene, 20_000)
    for kind, instants in enumerate((found.impact_times, found.stick_times, found.release_times)):
        np.testing.assert_allclose(instants, exact["time"][exact["kind"] == kind], atol=2e-2)
    np.testing.assert_array_equal(found.impact_times, found.stick_times)


def test_moreau_jean_passes_a_burst_and_reads_it_as_one():
    scene = read_scene(BURST, 50.0)
    exact = events(scene.parameters, until=50.0)
    found = solve(MOREAU, scene, 200_000)
    np.testing.assert_allclose(found.impact_times[:8], exact["time"][:8], atol=3e-3)
    np.testing.assert_allclose(found.approach_speeds[:8], exact["approach_speed"][:8], atol=3e-3)
    assert len(found.stick_times) == len(found.release_times) == 1
    assert abs(found.stick_times[0] - 44.2497) < 2e-2
    assert abs(found.release_times[0] - 46.2710) < 2e-3


# Failures that are known


def test_steps_that_are_checked_at_their_ends_miss_a_double_crossing():
    # Nothing moves the free mass; the primary swings out to 1.001 and back once a period.
    p = damper.Parameters(0.1, 0.0, 1e-3, clearance=1.0, restitution=0.9)
    scene = Scene(p, damper.State(0.0, 1.001, 0.0, 0.0), 3.0)
    (hit,) = events(p, scene.state, until=3.0)[:1]
    assert hit["kind"] == 0
    assert hit["side"] == -1
    per_time = p.period
    for name in (STEP_END, LOCATED):
        missed = solve(name, scene, 4 * per_time)
        seen = solve(name, scene, 500 * per_time)
        assert missed.outcome == FINISHED
        assert len(missed.impact_times) == 0
        assert abs(seen.impact_times[0] - hit["time"]) < 3e-3


def test_penetration_is_the_way_of_a_step_where_impacts_wait_for_its_end():
    scene, orbit = periodic(9)
    for setting in (100, 1000):
        step = scene.parameters.period / setting
        deepest = solve(STEP_END, scene, setting).penetration
        assert 0.1 * step * orbit.approach_speed < deepest <= 1.1 * step * orbit.approach_speed
        through = solve(MOREAU, scene, setting).penetration
        assert 0.01 * step < through < step * orbit.approach_speed
        assert solve(LOCATED, scene, setting).penetration < 1e-13


def test_a_step_too_long_for_a_stiff_wall_blows_up_and_says_so():
    scene = read_scene({**BURST, "contact_stiffness_ratio": 1e8}, 40.0)
    found = solve(STEP_END, scene, 100, times=(1.0, 40.0), balance=True)
    assert found.outcome == FAILED
    assert 2.0 < found.reached < 40.0
    assert np.all(np.isfinite(found.states[0]))
    assert np.all(np.isnan(found.states[1]))
    assert math.isnan(found.energy_residual)


@pytest.mark.parametrize("name", [STEP_END, LOCATED])
def test_a_step_too_long_for_heavy_damping_blows_up_and_says_so(name):
    scene = read_scene({**BURST, "damping_ratio": 10.0}, 100.0)
    assert solve(name, scene, 50).outcome == FAILED
    assert solve(MOREAU, scene, 50).outcome == FINISHED


def end_of_burst(speed):
    """A late stretch of time with a rebound under way that the wall turns back at once."""
    p = damper.Parameters(0.1, 0.05, 1.0, clearance=0.5, restitution=0.95)
    time = 1e6
    x = -5.0  # so that the wall at the right pushes to the left, strongly
    return Scene(p, damper.State(x, 0.0, x - 0.5, speed, time=time), time + 1e-6)


def test_a_burst_sticks_with_ordinary_steps_and_stalls_with_tiny_ones():
    # The rebounds take less time than rounding of it, 1e-10, can show; the shortest flights that
    # are left to fly are h^2 long.
    scene = end_of_burst(1e-9)
    ordinary = solve(LOCATED, scene, 100)
    assert ordinary.outcome == FINISHED
    tiny = solve(LOCATED, scene, scene.parameters.period * 1e7)
    assert tiny.outcome == STALLED
    assert scene.state.time <= tiny.reached < scene.until
    assert len(tiny.stick_times) == 0
    assert len(tiny.impact_times) > 50


@pytest.mark.parametrize("name", ALL)
def test_what_no_evaluations_are_left_for_is_capped(name):
    scene = read_scene(BURST, 50.0)
    found = solve(name, scene, 100, max_evaluations=100, times=(1.0, 50.0))
    assert found.outcome == CAPPED
    assert found.evaluations < 200
    assert found.reached < 50.0
    assert np.all(np.isfinite(found.states[0]))
    assert np.all(np.isnan(found.states[1]))


@pytest.mark.parametrize("name", ALL)
@pytest.mark.parametrize("setting", [0.0, -1.0, math.inf, math.nan])
def test_a_setting_that_is_no_number_of_steps_is_refused(name, setting):
    with pytest.raises(ValueError, match=r"steps_per_period = .*: must be a finite number > 0"):
        solve(name, read_scene(BURST, 1.0), setting)


# What the rule of sticking is for


def test_without_sticking_the_free_mass_would_sink_through_the_wall(monkeypatch):
    # The primary swings back from -1 and pushes the free mass with cos t, as good as unforced.
    r = 0.3
    p = damper.Parameters(1e-6, 0.0, 1e-3, clearance=0.5, restitution=r)
    scene = Scene(p, damper.State(-1.0, 0.0, -1.5, 0.0), 1.5)
    solve_plain = plain(solve)
    steps = 20 * p.period, 40 * p.period
    for setting in steps:
        kept = solve_plain(STEP_END, scene, setting)
        assert len(kept.stick_times) == 1
        assert kept.penetration < 1e-12
    monkeypatch.setattr(rk4_step_end, "wall_acceleration", lambda *state: (-1.0, -1.0))
    for setting in steps:
        step = p.period / setting
        sunk = solve_plain(STEP_END, scene, setting)
        assert len(sunk.stick_times) == 0
        # The speed a h (1 - r) / (2 (1 + r)), on average over this time sin(1.5) / 1.5 for a = 1.
        sinking = math.sin(1.5) * step * (1.0 - r) / (2.0 * (1.0 + r))
        assert sunk.penetration == pytest.approx(sinking, rel=0.15)

"""What all solvers of a comparison promise, whatever their method."""

import math
from pathlib import Path

import numpy as np
import pytest

import damper
import damper.parameters.quantities
from damper.theory.two_impacts import orbits
from damper.verification.comparison import solvers
from damper.verification.comparison.scene import Scene, read_scene
from damper.verification.comparison.solution import CAPPED, FINISHED, OUTCOMES, STALLED
from damper.verification.comparison.solvers import SOLVERS, load
from damper.verification.labels import LABELS

HERE = Path(solvers.__file__).parent
#: A setting that is fine enough for each kind of setting, and a coarse one.
FINE = {"accuracy": 1e-12, "tolerance": 1e-9, "steps_per_period": 1000, "contact_stiffness": 1e8}
COARSE = {
    "accuracy": 1e-4,
    "tolerance": 1e-4,
    "steps_per_period": 100,
    "contact_stiffness": 1e4,
}

_BURST = {
    "mass_ratio": 0.1,
    "damping_ratio": 0.05,
    "frequency_ratio": 0.2,
    "clearance": 0.25,
    "restitution": 0.3,
}
_WALLS = {"contact_stiffness_ratio": 100.0}
_IMPACTS = {**_BURST, "frequency_ratio": 0.9, "clearance": 1.0, "restitution": 0.7}
SCENES = {
    "rigid": {
        "bursts": read_scene(_BURST, 25.0),
        "impacts": read_scene(_IMPACTS, 20.0),
        "later": Scene(
            damper.Parameters(**_IMPACTS), damper.State(0.3, -0.2, 0.7, 0.4, time=2.5), 12.0
        ),
        "at once": read_scene({**_BURST, "restitution": 0.0}, 12.0),
    },
    "compliant": {
        "bursts": read_scene({**_BURST, **_WALLS}, 25.0),
        "impacts": read_scene({**_IMPACTS, **_WALLS, "contact_tension": 1}, 20.0),
    },
}
#: Complete bursts, which this solver cannot end.
STALLS = [("dop853_free", "bursts"), ("dop853_free", "at once")]
#: In every test; the other scenes are left to `pytest -m exhaustive`.
KEPT = ("bursts", "impacts")
CASES = [
    pytest.param(
        name,
        SCENES[model][scene],
        id=f"{name}-{model}-{scene}",
        marks=() if scene == KEPT[model == "compliant"] else pytest.mark.exhaustive,
    )
    for name in SOLVERS
    for model in load(name).models
    for scene in SCENES[model]
    if (name, scene) not in STALLS
]


def run(name, scene, settings=FINE, **options):
    solver = load(name)
    return solver.solve(scene, settings[solver.setting], **options)


def test_every_solver_is_in_the_list():
    assert {path.stem for path in HERE.glob("*.py")} == {*SOLVERS.values(), "__init__"}


@pytest.mark.parametrize("name", SOLVERS)
def test_a_solver_describes_itself(name):
    solver = load(name)
    assert solver.setting in FINE, "give the setting a fine and a coarse value at the top"
    assert np.sign(FINE[solver.setting] - COARSE[solver.setting]) == solver.finer
    assert name in LABELS
    assert solver.models
    assert set(solver.models) <= {"rigid", "compliant"}
    assert solver.evaluations_per_second > 0


@pytest.mark.parametrize(("name", "scene"), STALLS)
def test_a_burst_without_sticking_stalls(name, scene):
    found = run(name, SCENES["rigid"][scene], times=[5.0, 25.0], balance=True)
    assert found.outcome == STALLED
    assert found.reached < SCENES["rigid"][scene].until
    assert np.isnan(found.states[1]).all()
    assert math.isnan(found.energy_residual)


@pytest.mark.parametrize(("name", "scene"), CASES)
def test_a_solution_is_sound(name, scene):
    start = scene.state.time
    times = np.linspace(start, scene.until, 7)
    found = run(name, scene, times=times, balance=True)
    assert found.outcome in OUTCOMES
    assert found.outcome == FINISHED
    assert found.reached == scene.until
    assert isinstance(found.evaluations, int)
    assert found.evaluations > 0

    impacts = len(found.impact_times)
    assert impacts > 1
    for values in (found.impact_sides, found.approach_speeds):
        assert values.shape == (impacts,)
    assert set(found.impact_sides) <= {-1.0, 1.0}
    assert np.all(found.approach_speeds >= 0.0)
    for values in (
        found.impact_times,
        found.impact_sides,
        found.approach_speeds,
        found.stick_times,
        found.release_times,
        found.states,
    ):
        assert values.dtype == np.float64
    for instants in (found.impact_times, found.stick_times, found.release_times):
        assert instants.ndim == 1
        assert np.all(np.diff(instants) >= 0.0)
        assert np.all((instants >= start) & (instants <= scene.until))
    # Sticking and release take turns.
    assert 0 <= len(found.stick_times) - len(found.release_times) <= 1
    assert np.all(found.stick_times[: len(found.release_times)] < found.release_times)

    assert found.states.shape == (7, 4)
    assert np.all(np.isfinite(found.states))
    s = scene.state
    np.testing.assert_allclose(found.states[0], (s.x, s.v, s.y, s.u), rtol=0, atol=1e-12)
    assert 0.0 <= found.penetration < 0.1
    # Fixed steps across the corners of a wall's force, and tolerances: a few digits.
    assert abs(found.energy_residual) < 2e-2


@pytest.mark.parametrize(("name", "scene"), CASES)
def test_what_is_not_asked_for_is_not_there_and_changes_nothing(name, scene):
    bare = run(name, scene)
    assert bare.states.shape == (0, 4)
    assert math.isnan(bare.energy_residual)
    asked = run(name, scene, times=(scene.state.time + 1.0, scene.until), balance=True)
    assert not math.isnan(asked.energy_residual)
    again = run(name, scene)
    for key in (
        "impact_times",
        "impact_sides",
        "approach_speeds",
        "stick_times",
        "release_times",
    ):
        # Events, not to the last bit where a solver ends a step at such a time.
        np.testing.assert_allclose(getattr(bare, key), getattr(asked, key), rtol=0, atol=1e-6)
        np.testing.assert_array_equal(getattr(bare, key), getattr(again, key))
    assert bare.evaluations == again.evaluations


@pytest.mark.parametrize(("name", "scene"), CASES)
def test_a_cap_ends_a_run(name, scene):
    # Long enough for every method: the engine takes five evaluations for an impact.
    long = Scene(scene.parameters, scene.state, scene.state.time + 400.0)
    found = run(name, long, times=(scene.state.time, long.until), max_evaluations=50)
    assert found.outcome == CAPPED
    assert scene.state.time <= found.reached < long.until
    assert np.all(np.isnan(found.states[1]))
    assert np.all(found.impact_times <= found.reached)
    # A step or a search may be finished first.
    assert found.evaluations <= 1000


@pytest.mark.parametrize(("name", "scene"), CASES)
def test_the_mirror_image_is_solved_alike(name, scene):
    p, s = scene.parameters, scene.state
    names = damper.parameters.quantities.PARAMETER_NAMES
    turned = {key: getattr(p, key) for key in names} | {"phase": p.phase + math.pi}
    mirrored = Scene(
        damper.Parameters(**turned), damper.State(-s.x, -s.v, -s.y, -s.u, s.time), scene.until
    )
    times = np.linspace(s.time, scene.until, 5)[1:]
    one, other = run(name, scene, times=times), run(name, mirrored, times=times)
    np.testing.assert_array_equal(one.impact_sides, -other.impact_sides)
    for key in ("impact_times", "approach_speeds", "stick_times", "release_times"):
        np.testing.assert_allclose(getattr(one, key), getattr(other, key), rtol=0, atol=1e-8)
    np.testing.assert_allclose(one.states, -other.states, rtol=0, atol=1e-8)


@pytest.mark.parametrize("name", [name for name in SOLVERS if "rigid" in load(name).models])
def test_a_finer_setting_is_nearer_to_the_periodic_motion(name):
    p = damper.Parameters(0.1, 0.1, 1.0, clearance=5.5, restitution=0.5)
    orbit = next(orbit for orbit in orbits(p) if orbit.admissible)
    start, quarter = orbit.start, 0.25 * p.period
    scene = Scene(p, start, start.time + 5.0 * quarter)

    def error(settings):
        found = run(name, scene, settings, times=(scene.until,))
        assert found.outcome == FINISHED
        np.testing.assert_array_equal(found.impact_sides, [-1.0, 1.0])
        _, _, y, u = found.states[0]
        impacts = found.impact_times - start.time - (2.0 * quarter, 4.0 * quarter)
        errors = (y - start.y + orbit.speed * quarter, u + orbit.speed, *impacts)
        return max(abs(value) for value in errors)

    assert error(FINE) < max(0.2 * error(COARSE), 1e-10)

"""The observer of the laws: they hold on a reduced grid, and it finds what is wrong."""

import math

import numpy as np
import pytest
from new_process import in_new_process

from damper import Parameters, Record, State, simulate
from damper.engine.segment import (
    CAUSE,
    DURATION,
    FLIGHT,
    GAP,
    GAP_RATE,
    IMPACT,
    MODE,
    NOTHING,
    RELEASE,
    SIDE,
    SPEED,
    STICKING,
    TAIL,
    TIME,
    V,
    X,
)
from damper.models import start_run
from damper.observers.common.base import Window
from damper.observers.common.laws import LAW_NAMES, broken, excess
from damper.observers.laws import Laws

#: Corners, with starts into a wall.
REDUCED = {
    "damping_ratio": [0.0, 1.0 - 1e-12, 1.0 + 1e-12, 10.0],
    "frequency_ratio": [1e-3, 1.0 - 1e-9, 1.0 + 1e-9, 1e3],
    "mass_ratio": [1e-6, 1e6],
    "restitution": [0.0, 0.5, 0.999999],
    "clearance": [0.0, 1e-12, 1e6],
    "initial_position": [0.0, 1.0],
    "initial_relative_velocity": 1.0,
}


@pytest.mark.exhaustive
def test_every_law_holds_on_a_reduced_grid():
    cube = simulate(**REDUCED, observers=["laws"], transient=0, periods=2, max_events=2000)
    found = {name: variable.values.ravel() for name, variable in cube.data_vars.items()}
    assert not broken(found).any(), np.flatnonzero(broken(found))
    assert set(found["status"].tolist()) == {0, 1}
    for name in LAW_NAMES:
        assert np.isfinite(found[name]).any(), name
    # What is kept is kept to roundoff, not just to the limit.
    for name in ("penetration", "touch", "continuity", "momentum", "restitution_law", "clock"):
        assert np.nanmax(found[name]) < 5e-14, name


OTHERS = """
import itertools, json
import numpy as np
from damper import simulate
from damper.observers.common.laws import broken
base = {"damping_ratio": [0.0, 10.0], "frequency_ratio": 0.5, "mass_ratio": [1e-6, 0.3],
        "restitution": 0.5, "clearance": 0.1, "initial_relative_velocity": [0.0, 1.0]}
models = (
    {},
    {"support_stiffness_ratio": 2.0, "support_damping_ratio": [0.0, 2e-4]},
    {"modulation_depth": 0.5, "modulation_order": 2.0},
    {"contact_stiffness_ratio": 1e4, "contact_tension": [0.0, 1.0]},
    # Only at a release from a rigid wall is x'' zero.
    {"clearance": 1e-3, "contact_stiffness_ratio": 1e3, "contact_tension": [0.0, 1.0]},
)
for model, transient in itertools.product(models, (0, 2)):
    cube = simulate(**{**base, **model}, observers=["laws"], transient=transient, periods=1,
                    max_events=100)
    found = {name: variable.values.ravel() for name, variable in cube.data_vars.items()}
    there = found["segments"] > 0
    assert there.any() and np.isfinite(found["energy_balance"][there]).all()
    assert not broken(found).any(), (model, transient)
    assert np.isfinite(found["tensile_force"]).any()
print(json.dumps(len(models)))
"""


def test_every_law_holds_for_every_model_at_any_time_in_plain_python():
    """A record that begins in a flight after an impact has lost nothing in that."""
    assert in_new_process(OTHERS, DAMPER_COMPILE="0") == 5


@pytest.fixture(scope="module")
def run():
    """One run with impacts, tails, sticking and releases: trajectory and log."""
    p = Parameters(0.1, 0.05, 0.2, 0.25, 0.3)
    trajectory = start_run(p, State(0.1, 0.2, 0.0, 0.0))
    log = np.concatenate([piece.copy() for piece in trajectory.segments(3.0, 0.0)])
    assert {IMPACT, RELEASE} <= set(log[:, CAUSE])
    assert {FLIGHT, TAIL, STICKING} <= set(log[:, MODE])
    return trajectory, log


def laws(trajectory, log):
    """Return what the checks find in a log, read in two pieces."""
    observer = Laws()
    observer.allocate(1, 3)
    observer.begin(0, trajectory, Window(0.0, 0.0, 3))
    observer.observe(log[:7])
    observer.observe(log[7:])
    observer.finish(True)
    return {name: float(values[0]) for name, values in observer.arrays.items()}


def violated(trajectory, log):
    found = laws(trajectory, log)
    rows = np.array([found["segments"]])
    return {n for n in LAW_NAMES if excess(n, np.array([found[n]]), rows)[0] > 1.0}


def test_an_untouched_log_violates_nothing(run):
    trajectory, log = run
    assert violated(trajectory, log) == set()
    assert laws(trajectory, log)["segments"] == len(log)


def changed(log, row, column, change):
    """Return a log with one number changed."""
    new = log.copy()
    new[row, column] += change
    return new


def first(log, condition):
    return int(np.flatnonzero(condition)[0])


def impact_row(log):
    """A row in flight after an impact, with another flight before it."""
    flies = log[:, MODE] == FLIGHT
    hits = (log[:, CAUSE] == IMPACT) & flies
    hits[1:] &= flies[:-1]
    hits[0] = False
    return first(log, hits)


def test_a_wall_passed_is_found(run):
    trajectory, log = run
    row = impact_row(log) - 1
    # The flight goes on for 1e-9 after the impact was due.
    assert {"penetration", "touch", "clock"} <= violated(
        trajectory, changed(log, row, DURATION, 1e-9)
    )


@pytest.mark.parametrize(("side", "deep"), [(1.0, 1e-9), (-1.0, 1e-3)])
def test_a_wall_passed_and_left_again_is_found(run, side, deep):
    """The wall draws away at the acceleration 1; just before, the free mass has gone beyond it."""
    trajectory, log = run
    row = log[:1].copy()
    row[0, [X, V, SIDE, CAUSE, MODE]] = -side, 0.0, side, NOTHING, FLIGHT
    forcing = trajectory.model.free.forcing
    row[0, TIME] = (-forcing.phase % (2.0 * math.pi)) / forcing.omega
    # Down to -deep and back to the start.
    row[0, [GAP, GAP_RATE, DURATION]] = deep, -2.0 * math.sqrt(deep), 4.0 * math.sqrt(deep)
    assert "penetration" in violated(trajectory, row)
    assert laws(trajectory, row)["penetration"] == pytest.approx(deep / 2.0, rel=0.2)
    # In half that time it is still out there; at a quarter of the speed it does not get there.
    assert "penetration" in violated(trajectory, changed(row, 0, DURATION, -row[0, DURATION] / 2))
    slow = changed(row, 0, GAP_RATE, 1.5 * math.sqrt(deep))
    assert "penetration" not in violated(trajectory, slow)


def test_an_impact_too_early_is_found(run):
    trajectory, log = run
    found = violated(trajectory, changed(log, impact_row(log) - 1, DURATION, -1e-9))
    assert "touch" in found
    assert "penetration" not in found


@pytest.mark.parametrize("size", [1e-9, -1e-11])
def test_lost_momentum_is_found(run, size):
    trajectory, log = run
    row = impact_row(log)
    # Without what comes after, which does not follow from it.
    found = violated(trajectory, changed(log, row, V, size)[: row + 1])
    assert "momentum" in found
    assert not {"restitution_law", "touch", "continuity"} & found


def test_another_restitution_is_found(run):
    trajectory, log = run
    row = impact_row(log)
    new = changed(log, row, GAP_RATE, 1e-10)
    # Momentum is kept: the primary takes what the free mass gives.
    mass_ratio, side = trajectory.model.mass_ratio, log[row, SIDE]
    new[row, V] += side * mass_ratio / (1.0 + mass_ratio) * 1e-10
    assert violated(trajectory, new[: row + 1]) == {"restitution_law"}


def test_lost_energy_is_found(run):
    trajectory, log = run
    # An approach speed only tells how much an impact takes.
    assert violated(trajectory, changed(log, impact_row(log), SPEED, 1e-8)) == {"energy_balance"}


def test_a_motion_that_does_not_join_is_found(run):
    trajectory, log = run
    release = first(log, log[:, CAUSE] == RELEASE)
    assert {"continuity"} <= violated(trajectory, changed(log, release, X, 1e-10))
    assert {"continuity"} <= violated(trajectory, changed(log, release, V, 1e-10))


MODELS = {
    "rigid": {},
    "grounded": {"support_stiffness_ratio": 0.02},
    "sliding": {"friction": 0.02},
    "grounded, sliding": {"support_stiffness_ratio": 0.02, "friction": 0.02},
    "several": {"masses": [{}, {"mass_ratio": 0.2}]},
    "several that rub": {"masses": [{"friction": 0.02}, {"mass_ratio": 0.2}]},
}


@pytest.mark.parametrize("model", MODELS)
def test_a_jump_of_the_force_is_no_tensile_force(model):
    """It ends sticking: up to there the contact force is that before the jump."""
    count = len(MODELS[model].get("masses", [{}]))
    given = {"mass_ratio": 0.1, "clearance": 0.05, "restitution": 0.2}
    given |= {"forcing": Record([0.0, 0.5], [1.0, 1.0])} | MODELS[model]
    start = State(0.0, 0.0, [-0.05] * count, [0.0] * count) if count > 1 else State(0, 0, -0.05, 0)
    trajectory = start_run(Parameters(damping_ratio=0.05, frequency_ratio=1.0, **given), start)
    log = np.concatenate([piece.copy() for piece in trajectory.segments(0.0, 1.0)])
    assert log[log[:, CAUSE] == RELEASE][0, TIME] == 0.5
    assert violated(trajectory, log) == set()


def test_a_tensile_contact_force_is_found(run):
    trajectory, log = run
    row = first(log, (log[:, MODE] == STICKING) & (np.roll(log[:, CAUSE], -1) == RELEASE))
    assert "tensile_force" in violated(trajectory, changed(log, row, DURATION, 1e-6))


def test_time_that_goes_back_is_found(run):
    trajectory, log = run
    row = first(log, (log[:, TIME] > 1.0) & (log[:, CAUSE] != NOTHING))
    back = changed(log, row, TIME, -(log[row, TIME] - log[row - 1, TIME]) - 1e-9)
    assert "clock" in violated(trajectory, back)


@pytest.mark.parametrize(("column", "value"), [(X, math.nan), (GAP_RATE, math.inf)])
def test_what_is_not_finite_is_found(run, column, value):
    trajectory, log = run
    row = impact_row(log)
    found = violated(trajectory, changed(log, row, column, value))
    assert "not_finite" in found


def test_pieces_of_a_log_join_whatever_the_size_of_their_terms():
    """As long as a run is, nothing is hit: segments end where the log's buffer does not."""
    trajectory = start_run(Parameters(0.1, 0.0, 0.37, 1e6, 0.6), None)
    log = np.concatenate([piece.copy() for piece in trajectory.segments(200.0, 0.0)])
    assert len(log) > 128
    observer = Laws()
    observer.allocate(1, 200)
    observer.begin(0, trajectory, Window(0.0, 0.0, 200))
    for row in range(0, len(log), 64):
        observer.observe(log[row : row + 64])
    observer.finish(True)
    assert observer.arrays["segments"][0] == len(log)
    assert observer.arrays["continuity"][0] < 1e-15

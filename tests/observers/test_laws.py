"""The observer of the laws: they hold on a reduced grid, and it finds what is wrong."""

import math
from dataclasses import replace

import numpy as np
import pytest
from scenes import QUIET

from damper import Parameters, Record, SIParameters, State, Structure, simulate
from damper.engine.segment import (
    CAUSE,
    COLUMNS,
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
    STICK,
    STICKING,
    TAIL,
    TIME,
    V,
    X,
)
from damper.models import start_run
from damper.models.many import GAP as GAP_OF_BODY
from damper.models.many import MODE as MODE_OF_BODY
from damper.models.many import RATE
from damper.models.many import SPEED as SPEED_OF_BODY
from damper.models.several.bodies import BODY
from damper.models.structure.constants import BODY as BODY_ON_STRUCTURE
from damper.observers.common.base import Window
from damper.observers.common.laws import LAW_NAMES, broken, excess
from damper.observers.laws import Laws


@pytest.mark.parametrize("contact", [{}, {"contact_stiffness_ratio": 1e3}], ids=["rigid", "soft"])
def test_every_law_holds_in_a_window_that_begins_anywhere(contact):
    """A record that begins in a flight after an impact has lost nothing in that."""
    given = {"damping_ratio": [0.0, 10.0], "mass_ratio": [1e-6, 0.3], "restitution": 0.5}
    given |= {"frequency_ratio": 0.5, "clearance": 0.1, "initial_relative_velocity": [0.0, 1.0]}
    # Only at a release from a rigid wall is x'' zero.
    given |= contact | ({"clearance": 1e-3, "contact_tension": [0.0, 1.0]} if contact else {})
    cube = simulate(**given, observers=["laws"], transient=2, periods=1, max_events=100)
    found = {law: variable.values.ravel() for law, variable in cube.data_vars.items()}
    there = found["segments"] > 0
    assert there.any()
    assert np.isfinite(found["energy_balance"][there]).all()
    assert not broken(found).any()
    assert np.isfinite(found["tensile_force"]).any()


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


@pytest.fixture(scope="module")
def two():
    """Two masses that chatter and stick under weight."""
    p = Parameters(**QUIET, masses=[{}, {"clearance": 0.4, "gravity": 0.1, "restitution": 0.5}])
    trajectory = start_run(p, State(0.1, 0.2, [0.0, 0.1], [0.0, 0.3]))
    return trajectory, np.concatenate([piece.copy() for piece in trajectory.segments(2.0)])


def test_an_untouched_log_violates_nothing(run, two):
    for trajectory, log in (run, two):
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


def of_body(body, field):
    return COLUMNS + 2 + BODY * body + field


def impact_row_of_two(log):
    """A row after an impact of mass 1 and a flight of both, while mass 0 flies."""
    hit = (log[:, CAUSE] == IMPACT) & (log[:, COLUMNS] == 1.0)
    hit &= log[:, of_body(1, MODE_OF_BODY)] == FLIGHT
    flies = (log[:, of_body(0, MODE_OF_BODY)] == FLIGHT) & (log[:, of_body(0, GAP_OF_BODY)] > 0.01)
    hit[1:] &= flies[:-1] & flies[1:] & (log[:-1, DURATION] > 0.0)
    return first(log, hit)


#: How many masses; what is changed: in the row of an impact or the one before, which column, by how
#: much; laws that it breaks, and laws that it does not.
FAULTS = [
    (1, -1, DURATION, 1e-9, "penetration touch clock", ""),
    (1, -1, DURATION, -1e-9, "touch", "penetration"),
    (1, 0, V, 1e-9, "momentum", "restitution_law touch continuity"),
    (1, 0, V, -1e-11, "momentum", "restitution_law touch continuity"),
    # An approach speed only tells how much an impact takes.
    (1, 0, SPEED, 1e-8, "energy_balance", "momentum restitution_law touch continuity clock"),
    (1, 0, X, math.nan, "not_finite", ""),
    (1, 0, GAP_RATE, math.inf, "not_finite", ""),
    (2, -1, DURATION, 1e-7, "penetration clock", ""),
    (2, -1, DURATION, -1e-7, "touch", ""),
    (2, 0, V, 1e-9, "momentum", ""),
    (2, 0, of_body(1, RATE), 1e-9, "restitution_law", ""),
    (2, 0, of_body(0, GAP_OF_BODY), 1e-9, "continuity", ""),
    (2, 0, COLUMNS + 1, 1e-7, "energy_balance", ""),
    (2, 0, of_body(0, RATE), math.nan, "not_finite", ""),
]


@pytest.mark.parametrize(("masses", "before", "column", "change", "broken", "kept"), FAULTS)
def test_a_broken_law_is_found(run, two, masses, before, column, change, broken, kept):
    trajectory, log = (run, two)[masses - 1]
    row = (impact_row, impact_row_of_two)[masses - 1](log)
    new = changed(log, row + before, column, change)
    # Without what comes after, which does not follow from it.
    found = violated(trajectory, new if broken == "energy_balance" else new[: row + 1])
    assert set(broken.split()) <= found
    assert not found & set(kept.split())


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


def test_another_restitution_is_found(run):
    trajectory, log = run
    row = impact_row(log)
    new = changed(log, row, GAP_RATE, 1e-10)
    # Momentum is kept: the primary takes what the free mass gives.
    mass_ratio, side = trajectory.model.mass_ratio, log[row, SIDE]
    new[row, V] += side * mass_ratio / (1.0 + mass_ratio) * 1e-10
    assert violated(trajectory, new[: row + 1]) == {"restitution_law"}


def test_a_motion_that_does_not_join_is_found(run):
    trajectory, log = run
    release = first(log, log[:, CAUSE] == RELEASE)
    assert {"continuity"} <= violated(trajectory, changed(log, release, X, 1e-10))
    assert {"continuity"} <= violated(trajectory, changed(log, release, V, 1e-10))


@pytest.fixture(scope="module")
def beam():
    """Two masses on three modes, one of them tied to its box, that chatter and stick."""
    shapes = {"tip": [1.0, 0.6, -0.4], "deck": [0.4, -0.9, 0.5], "force": [1.0, 0.6, 0.3]}
    structure = Structure.from_modes([1.0, 2.7, 5.2], [0.02, 0.01, 0.01], shapes)
    one = {"box": "tip", "free_mass": 0.1, "gap": 0.04, "gravity": 0.5}
    tied = {"box": "deck", "free_mass": 0.1, "gap": 0.02, "tie_stiffness": 3.0, "tie_damping": 0.05}
    driven = {"force_amplitude": 2.0, "forcing_frequency": "0.7 Hz", "restitution": 0.4}
    p = SIParameters(structure=structure, masses=[one, tied], **driven)
    trajectory = start_run(p.dimensionless)
    return trajectory, np.concatenate([piece.copy() for piece in trajectory.segments(3.0)])


def of_boxed(body, field):
    return COLUMNS + 2 + 3 * 3 + BODY_ON_STRUCTURE * body + field


#: As `FAULTS`; the velocity is that of the second mode.
FAULTS_ON_STRUCTURE = [
    (-1, DURATION, 1e-9, "penetration touch clock", ""),
    (-1, DURATION, -1e-9, "touch clock", "penetration"),
    (0, COLUMNS + 2 + 3 + 1, 1e-9, "momentum", "touch clock penetration"),
    (0, of_boxed(1, RATE), 1e-9, "momentum restitution_law", "touch clock penetration"),
    (0, of_boxed(0, GAP_OF_BODY), 1e-9, "continuity", "clock momentum restitution_law"),
    (0, of_boxed(0, RATE), 1e-9, "continuity", "clock momentum restitution_law touch"),
    (0, COLUMNS + 1, 1e-7, "energy_balance", "clock momentum restitution_law continuity touch"),
    (0, of_boxed(0, RATE), math.nan, "not_finite", ""),
]


@pytest.mark.parametrize(("before", "column", "change", "broken", "kept"), FAULTS_ON_STRUCTURE)
def test_a_broken_law_is_found_on_a_structure(beam, before, column, change, broken, kept):
    trajectory, log = beam
    hit = (log[:, CAUSE] == IMPACT) & (log[:, COLUMNS] == 1.0)
    for body in (0, 1):
        flies = log[:, of_boxed(body, MODE_OF_BODY)] == FLIGHT
        hit[1:] &= flies[:-1] & flies[1:] & (log[:-1, DURATION] > 0.01)
    hit &= log[:, of_boxed(0, GAP_OF_BODY)] > 0.01
    row = first(log, hit)
    found = violated(trajectory, changed(log, row + before, column, change)[: row + 1])
    assert set(broken.split()) <= found
    assert not found & set(kept.split())


def test_a_run_on_a_structure_keeps_the_laws_of_its_own_matrices(beam):
    """Those of a stiffness that is 1e-9 off it breaks; a mass must not be held on its wall."""
    trajectory, log = beam
    assert {IMPACT, STICK, RELEASE} <= set(log[:, CAUSE])
    assert violated(trajectory, log) == set()
    assert laws(trajectory, log)["segments"] == len(log)
    held = log[:, CAUSE] == RELEASE
    held[1:] &= log[:-1, DURATION] > 0.01
    row = first(log, held) - 1
    late = changed(log, row, DURATION, 1e-6)[: row + 1]
    assert violated(trajectory, late) == {"tensile_force"}
    p = trajectory.parameters
    stiffer = replace(p.structure, stiffness=p.structure.stiffness * (1.0 + 1e-9))
    trajectory.parameters = replace(p, structure=stiffer)
    assert "energy_balance" in violated(trajectory, log)
    trajectory.parameters = p


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


def test_a_tensile_contact_force_is_found(run, two):
    trajectory, log = run
    row = first(log, (log[:, MODE] == STICKING) & (np.roll(log[:, CAUSE], -1) == RELEASE))
    assert "tensile_force" in violated(trajectory, changed(log, row, DURATION, 1e-6))
    trajectory, log = two
    released = (log[:, CAUSE] == RELEASE) & (log[:, of_body(0, RATE)] == 0.0)
    released[1:] &= log[:-1, DURATION] > 0.01
    row = first(log, released) - 1
    assert "tensile_force" in violated(trajectory, changed(log, row, DURATION, 1e-6)[: row + 1])


def test_time_that_goes_back_is_found(run):
    trajectory, log = run
    row = first(log, (log[:, TIME] > 1.0) & (log[:, CAUSE] != NOTHING))
    back = changed(log, row, TIME, -(log[row, TIME] - log[row - 1, TIME]) - 1e-9)
    assert "clock" in violated(trajectory, back)


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


def test_a_kick_that_is_none_keeps_the_law_of_restitution():
    """Under a large weight one of 2e-10 is over within a hundredth of the accuracy."""
    masses = [{"mass_ratio": 2.0}, {"mass_ratio": 0.01, "restitution": 0.05}]
    values = {"restitution": 0.5, "force_amplitude": 0.0, "gravity": -2e5, "masses": masses}
    p = Parameters(0.1, 0.0, 1.0, 1.0, **values)
    trajectory = start_run(p, State(0.1, 0.0, [1.1, 1.0999], [0.0, 0.0]))
    log = np.concatenate([piece.copy() for piece in trajectory.segments(0.1)])
    kicks = log[:, of_body(0, SPEED_OF_BODY)]
    assert 1e-10 < -np.min(kicks) < 1e-9
    assert violated(trajectory, log) == set()
    kicks[kicks < 0.0] = 0.0
    assert "restitution_law" in violated(trajectory, log)

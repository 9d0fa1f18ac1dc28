"""Deviations of motions on a structure, and changes by a parameter, against differences of runs."""

import math
from typing import Any

import numpy as np
import pytest
from differences import difference, differences
from scenes import coupled_structure

from damper import SIParameters, State, Structure
from damper.engine.segment import CAUSE, COLUMNS, IMPACT, SIDE, STICK
from damper.models import start_run
from damper.models.sensitivity import follow_change, neighbours
from damper.models.tangent import derivative, of_state, to_state
from damper.parameters.named import value_of, with_values
from damper.sweep.orbits.arcs import state_of, vector

HERTZ = np.array([1.0, 2.7, 5.2]) / (2.0 * math.pi)
SHAPES = {"a": [1.0, 0.6, -0.4], "b": [0.5, -1.0, 0.8], "force": [1.0, 0.6, 0.3]}
BEAM = Structure.from_modes(HERTZ, [0.02, 0.01, 0.01], SHAPES)
BALL = {"box": "a", "free_mass": 0.1, "gap": 0.8, "restitution": 0.4}
LOW = {"box": "b", "free_mass": 0.3, "gap": 0.6, "restitution": 0.3}


def on(*masses: dict[str, Any], structure: Structure = BEAM, **given: Any) -> SIParameters:
    values = {"force_amplitude": 1.0, "forcing_frequency": 0.8} | given
    return SIParameters(structure=structure, masses=masses, **values)


TABLE = [(0.1, 0.8), (1.0, 0.3)]
ACROSS = {"transverse_acceleration": 1.0}
TIES = BALL | {"tie_stiffness": 0.05, "tie_damping": 0.02}, LOW | {"tie_stiffness": 0.1}
#: Damper, until when it runs, whether a chatter sequence completes, and parameters.
SCENES: dict[str, tuple[Any, float, bool, tuple[str, ...]]] = {
    "two boxes": (on(BALL, LOW), 6.0, True, ("gap_1", "free_mass_0", "mode_3_frequency")),
    "a box for both": (on(BALL, LOW | {"box": "a"}), 5.0, True, ("restitution_1", "free_mass_1")),
    "ties": (on(*TIES), 8.0, True, ("tie_stiffness_0", "tie_damping_0", "mode_1_frequency")),
    "free motion": (
        on(BALL, LOW, forcing="none", force_amplitude=0.0, gravity=0.3),
        8.0,
        True,
        ("gravity", "mode_2_damping_ratio"),
    ),
    "matrices": (
        on(BALL | {"tie_damping": 0.05}, LOW, structure=coupled_structure(3), force_amplitude=6.0),
        6.0,
        False,
        ("tie_damping_0", "forcing_frequency", "force_amplitude"),
    ),
    "tables": (
        on(
            {"box": "a", "free_mass": 0.1, "gap": 0.8, "restitution_table": TABLE},
            LOW | {"restitution_table_left": [(0.2, 0.5), (0.6, 0.4)]},
        ),
        6.0,
        True,
        ("free_mass_0", "gap_0"),
    ),
    "friction": (
        on(BALL | {"friction_coefficient": 0.5}, LOW | {"friction_coefficient": 0.3}, **ACROSS),
        5.0,
        False,
        ("friction_coefficient_1", "free_mass_0"),
    ),
    "friction and ties": (
        on(TIES[0] | {"friction_coefficient": 0.1}, TIES[1], **ACROSS),
        4.5,
        True,
        ("friction_coefficient_0", "transverse_acceleration", "mode_1_frequency"),
    ),
    "yielding": (on(BALL | {"yield_speed": 0.1}, LOW), 6.0, True, ("yield_speed_0", "phase")),
}
MOST = [
    pytest.param(name, marks=[] if name in ("matrices", "friction") else pytest.mark.exhaustive)
    for name in SCENES
]


def _start(p: Any) -> np.ndarray:
    rng = np.random.default_rng(1)
    x, v = rng.normal(size=3) * 0.5, rng.normal(size=3) * 0.5
    boxes = [float(p.structure.boxes[one.box] @ x) for one in p.each]
    y = [at + rng.uniform(-0.8, 0.8) * one.clearance for at, one in zip(boxes, p.each, strict=True)]
    return vector(State(x, v, y, rng.normal(size=len(y))))


def _run(p: Any, start: np.ndarray, cycles: float) -> tuple[np.ndarray, np.ndarray]:
    run = start_run(p, state_of(start, 0.0, 3), accuracy=1e-15)
    end = math.floor(cycles), (cycles - math.floor(cycles)) * p.cycle
    log = np.concatenate([piece.copy() for piece in run.segments(*end)])
    return vector(run.state_at(*end)), log


def _word(log: np.ndarray) -> list[tuple[float, ...]]:
    rows = log[log[:, CAUSE] >= IMPACT]
    return [*map(tuple, rows[:, [CAUSE, SIDE, COLUMNS]])]


@pytest.mark.parametrize("name", MOST)
def test_deviations_are_differences_of_runs(name: str) -> None:
    given, until, completes, _ = SCENES[name]
    p = given.dimensionless
    start, cycles = _start(p), until / given.cycle
    run = start_run(p, state_of(start, 0.0, 3), accuracy=1e-15)
    found = derivative(run, math.floor(cycles), (cycles % 1.0) * p.cycle)
    events = _word(_run(p, start, cycles)[1])
    assert completes == (STICK in [kind for kind, _, _ in events])
    assert len(events) > 6
    wanted = differences(lambda at: _run(p, at, cycles), start, _word)
    assert wanted is not None
    assert found == pytest.approx(wanted, abs=1e-7 * abs(found).max())


@pytest.mark.parametrize("name", MOST)
def test_changes_by_a_parameter_are_differences_of_runs(name: str) -> None:
    given, until, _, names = SCENES[name]
    p = given.dimensionless
    start, cycles = _start(p), until / given.cycle
    run = start_run(p, state_of(start, 0.0, 3), accuracy=1e-15)
    log = _run(p, start, cycles)[1]
    for parameter in names:
        change = of_state(run.model, np.zeros((len(start), 1)))
        follow_change(run.model, neighbours(p, {parameter: 1.0}), log, change, False)
        found, own = to_state(run.model, change)[:, 0], value_of(given, parameter)

        def end(way: float, parameter: str = parameter, own: float = own) -> Any:
            return _run(with_values(p, {parameter: own + way}), start, cycles)

        wanted = difference(end, 1e-5 * (own or 1.0), _word)
        assert wanted is not None, parameter
        assert found == pytest.approx(wanted[0], abs=2e-7 * abs(found).max()), parameter


def test_impacts_that_a_deviation_parts_have_no_derivative() -> None:
    """Two equal masses in step hit by a joint law."""
    p = on(BALL, BALL).dimensionless
    with pytest.raises(ValueError, match="several masses meet walls at one instant"):
        derivative(start_run(p), 1.0)

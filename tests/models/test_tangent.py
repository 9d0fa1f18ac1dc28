"""Deviations along the log against differences of the engine's own runs."""

import numpy as np
import pytest

from damper.engine.compiled import plain
from damper.engine.segment import CAUSE, NOTHING, SIDE, TAIL, segment_at
from damper.models import start_run
from damper.models.tangent import derivative
from damper.parameters import Parameters, State

SCENES = 8
KINDS = ("rigid", "yielding", "grounded", "time_varying", "compliant", "pulling")
YIELDING_WALLS = ("compliant", "pulling")
CASES = [(kind, 0) for kind in KINDS]
CASES += [
    pytest.param(kind, block, marks=pytest.mark.exhaustive)
    for kind in KINDS
    for block in range(1, 63)
]


def draw(kind: str, rng: np.random.Generator) -> tuple[Parameters, np.ndarray, float]:
    """Parameters, a state in flight, and how long it runs."""
    given = {
        "mass_ratio": 10 ** rng.uniform(-2, 0),
        "damping_ratio": 10 ** rng.uniform(-3, -0.5),
        "frequency_ratio": rng.uniform(0.2, 3.0),
        "clearance": 10 ** rng.uniform(-1, 0.5),
        "restitution": rng.uniform(0.2, 0.95),
        "phase": rng.uniform(0.0, 6.0),
    }
    if kind == "yielding":
        given["yield_speed"] = 10 ** rng.uniform(-2, 0)
    if kind == "grounded":
        given["support_stiffness_ratio"] = 10 ** rng.uniform(-3, -1)
        given["support_damping_ratio"] = 10 ** rng.uniform(-4, -2)
    if kind == "time_varying":
        given["modulation_depth"] = rng.uniform(0.1, 0.6)
        given["modulation_order"] = int(rng.integers(1, 4))
        given["modulation_phase"] = rng.uniform(0.0, 6.0)
    if kind in YIELDING_WALLS:
        given["contact_stiffness_ratio"] = 10 ** rng.uniform(1, 4)
        given["contact_tension"] = int(kind == "pulling")
    x, v = rng.normal(size=2)
    y = x + given["clearance"] * rng.uniform(-0.99, 0.99)
    return Parameters(**given), np.array([x, v, y, v + rng.normal()]), rng.uniform(1.0, 15.0)


def run(p: Parameters, start: np.ndarray, until: float) -> tuple[np.ndarray, np.ndarray]:
    """Final state and log."""
    trajectory = start_run(p, State(*start), accuracy=1e-15)
    end = trajectory.whole_periods(until)
    log = np.concatenate([piece.copy() for piece in trajectory.segments(*end)])
    state = trajectory.state_at(*end)
    return np.array([state.x, state.v, state.y, state.u]), log


def word(log: np.ndarray) -> list[tuple[float, float]]:
    return [(row[CAUSE], row[SIDE]) for row in log if row[CAUSE] != NOTHING]


def differences(p: Parameters, start: np.ndarray, until: float, events: list) -> np.ndarray | None:
    """Derivative by central differences of two steps; None where the events differ."""
    columns = []
    for direction in np.eye(4):
        slopes = []
        for step in (1e-6, 5e-7):
            ends = []
            for sign in (1.0, -1.0):
                state, log = run(p, start + sign * step * direction, until)
                if word(log) != events:
                    return None
                ends.append(state)
            slopes.append((ends[0] - ends[1]) / (2.0 * step))
        columns.append((4.0 * slopes[1] - slopes[0]) / 3.0)
    return np.stack(columns, axis=1)


@pytest.mark.parametrize(("kind", "block"), CASES)
@plain
def test_deviations_are_differences_of_runs(kind: str, block: int) -> None:
    rng = np.random.default_rng([block, KINDS.index(kind)])
    compared = joined = 0
    while compared < SCENES:
        p, start, until = draw(kind, rng)
        _, log = run(p, start, until)
        trajectory = start_run(p, State(*start), accuracy=1e-15)
        exact = derivative(trajectory, *trajectory.whole_periods(until))
        # Beside a grazing impact differences are no derivative.
        if abs(exact).max() > 100.0:
            continue
        found = differences(p, start, until, word(log))
        if found is None:
            continue
        compared += 1
        modes = {segment_at(row).mode for row in log}
        joined += TAIL in modes
        # Beside what is asked, the roundoff of the differences.
        np.testing.assert_allclose(exact, found, rtol=0, atol=1e-7 * abs(exact).max() + 5e-9)
        if TAIL in modes:
            assert np.linalg.matrix_rank(exact, tol=1e-9 * abs(exact).max()) <= 2
    if kind in YIELDING_WALLS:
        assert joined == 0
    elif block == 0:
        assert joined > 0

"""Deviations along the log against differences of the engine's own runs."""

from typing import Any

import numpy as np
import pytest
from differences import difference, differences

from damper.engine.compiled import plain
from damper.engine.segment import CAUSE, NOTHING, RESTING, SIDE, TAIL, segment_at
from damper.models import start_run
from damper.models.sensitivity import follow_change, neighbours
from damper.models.tangent import derivative
from damper.parameters import Parameters, State
from damper.parameters.forcing import Base, Harmonics, Record
from damper.parameters.named import value_of, with_values

SCENES = 8
KINDS = ("rigid", "yielding", "grounded", "time_varying", "compliant", "pulling")
#: Models under two harmonics, of which the even one breaks the mirror.
FORCED = tuple(f"{kind} under harmonics" for kind in ("rigid", "grounded", "compliant"))
#: Models under a record, whose jumps release masses that stick: at times that no deviation moves.
RECORDED = ("rigid under a record", "time_varying under a record", "rigid on a base")
#: Models whose walls differ.
DIFFERING = ("differing", "yielding, differing", "grounded, differing", "time_varying, differing")
#: Models with dry friction, whose free mass stops, turns round and rests off the walls.
RUBBING = (
    "sliding",
    "sliding under a record",
    "sliding, differing",
    "sliding on a base",
    "grounded, sliding",
)
RECORDED += RUBBING[1:2]
DIFFERING += RUBBING[2:3]
KINDS += FORCED + RECORDED[:3] + DIFFERING[:4] + RUBBING
YIELDING_WALLS = ("compliant", "pulling", "compliant under harmonics")
CASES = [(kind, 0) for kind in KINDS]
CASES += [
    pytest.param(kind, block, marks=pytest.mark.exhaustive)
    for kind in KINDS
    for block in range(1, 63)
]


def draw(kind: str, rng: np.random.Generator) -> tuple[Parameters, np.ndarray, float]:
    """Parameters, a state in flight, and for how many cycles it runs."""
    given: dict[str, Any] = {
        "mass_ratio": 10 ** rng.uniform(-2, 0),
        "damping_ratio": 10 ** rng.uniform(-3, -0.5),
        "frequency_ratio": rng.uniform(0.2, 3.0),
        "clearance": 10 ** rng.uniform(-1, 0.5),
        "restitution": rng.uniform(0.2, 0.95),
        "phase": rng.uniform(0.0, 6.0),
    }
    if kind in DIFFERING:
        given["restitution_left"] = rng.uniform(0.2, 0.95)
    if kind.startswith("yielding"):
        given["yield_speed"] = 10 ** rng.uniform(-2, 0)
    if kind.startswith("grounded"):
        given["support_stiffness_ratio"] = 10 ** rng.uniform(-3, -1)
        given["support_damping_ratio"] = 10 ** rng.uniform(-4, -2)
    if kind.startswith("time_varying"):
        given["modulation_depth"] = rng.uniform(0.1, 0.6)
        given["modulation_order"] = int(rng.integers(1, 4))
        given["modulation_phase"] = rng.uniform(0.0, 6.0)
    if kind in YIELDING_WALLS:
        given["contact_stiffness_ratio"] = 10 ** rng.uniform(1, 4)
        given["contact_tension"] = int(kind == "pulling")
    if kind == "pulling":
        given["gravity"] = rng.normal()
        given["restitution_left"] = rng.uniform(0.2, 0.95)
    if kind in FORCED:
        phases = rng.uniform(0.0, 6.0), rng.uniform(0.0, 6.0)
        given["forcing"] = Harmonics((1, 2), (1.0, rng.uniform(0.2, 0.8)), phases)
        given["force_amplitude"] = rng.uniform(0.5, 2.0)
    if kind in RECORDED:
        times = np.cumsum(rng.uniform(0.2, 3.0, size=20))
        of = "base_acceleration" if kind.endswith("base") else "force"
        given["forcing"] = Record(times, rng.normal(size=20), of=of)
        del given["phase"]
    if kind == "sliding on a base":
        given["forcing"] = Base("base")
    if kind in RUBBING:
        given["friction"] = 10 ** rng.uniform(-1.5, 0.2)
        given["gravity"] = 0.2 * rng.normal()
    x, v = rng.normal(size=2)
    y = x + given["clearance"] * rng.uniform(-0.99, 0.99)
    p = Parameters(**given)
    return p, np.array([x, v, y, v + rng.normal()]), rng.uniform(1.0, 15.0) / p.cycle


def run(p: Parameters, start: np.ndarray, periods: float) -> tuple[np.ndarray, np.ndarray]:
    """Final state and log."""
    trajectory = start_run(p, State(*start), accuracy=1e-15)
    end = trajectory.whole_periods(periods * p.cycle)
    log = np.concatenate([piece.copy() for piece in trajectory.segments(*end)])
    state = trajectory.state_at(*end)
    return np.array([state.x, state.v, state.y, state.u]), log


def word(log: np.ndarray) -> list[tuple[float, float]]:
    return [(row[CAUSE], row[SIDE]) for row in log if row[CAUSE] != NOTHING]


@pytest.mark.parametrize(("kind", "block"), CASES)
@plain
def test_deviations_are_differences_of_runs(kind: str, block: int) -> None:
    rng = np.random.default_rng([block, KINDS.index(kind)])
    compared = joined = rested = 0
    while compared < SCENES:
        p, start, periods = draw(kind, rng)
        _, log = run(p, start, periods)
        trajectory = start_run(p, State(*start), accuracy=1e-15)
        exact = derivative(trajectory, *trajectory.whole_periods(periods * p.cycle))
        if abs(exact).max() > 100.0:
            continue
        found = differences(lambda at: run(p, at, periods), start, word)  # noqa: B023
        if found is None:
            continue
        compared += 1
        modes = {segment_at(row).mode for row in log}
        joined += TAIL in modes
        rested += RESTING in modes
        # Beside what is asked, the roundoff of the differences.
        np.testing.assert_allclose(exact, found, rtol=0, atol=1e-7 * abs(exact).max() + 5e-9)
        if TAIL in modes:
            assert np.linalg.matrix_rank(exact, tol=1e-9 * abs(exact).max()) <= 2
        if RESTING in modes:
            assert np.linalg.matrix_rank(exact, tol=1e-9 * abs(exact).max()) <= 3
    if kind in YIELDING_WALLS:
        assert joined == 0
    elif block == 0:
        assert joined > 0
        assert (rested > 0) == (kind in RUBBING)


def change_by(name: str, p: Parameters, start: np.ndarray, periods: float) -> np.ndarray:
    """Derivative of the end by a parameter, along the log."""
    stencil = neighbours(p, {name: 1.0})
    trajectory = start_run(p, State(*start), accuracy=1e-15)
    change = np.zeros((4, 1))
    for index, log in enumerate(trajectory.segments(*trajectory.whole_periods(periods * p.cycle))):
        follow_change(trajectory.model, stencil, log, change, index > 0)
    return change[:, 0]


#: The parameters of all models, and what each of the others has besides.
OF_ALL = ("mass_ratio", "damping_ratio", "frequency_ratio", "clearance", "restitution", "phase")
BESIDES = {
    "yielding": ("yield_speed",),
    "grounded": ("support_stiffness_ratio", "support_damping_ratio"),
    "time_varying": ("modulation_depth", "modulation_phase"),
    "compliant": ("contact_stiffness_ratio",),
    "pulling": ("contact_stiffness_ratio", "gravity", "restitution_left"),
    **dict.fromkeys(RECORDED, ("force_amplitude",)),
    **dict.fromkeys(DIFFERING, ("restitution_left",)),
    **dict.fromkeys(RUBBING, ("friction", "gravity")),
    "sliding on a base": ("friction", "gravity", "force_amplitude"),
    "grounded, sliding": ("friction", "support_stiffness_ratio", "support_damping_ratio"),
    **dict.fromkeys(FORCED, ("force_amplitude", "harmonic_2", "harmonic_2_phase")),
}


@pytest.mark.parametrize(("kind", "block"), CASES)
@plain
def test_changes_by_parameters_are_differences_of_runs(kind: str, block: int) -> None:
    rng = np.random.default_rng([block, KINDS.index(kind)])
    # A record has no phase, and does not repeat with the clock.
    names = [n for n in OF_ALL if kind not in RECORDED or n not in ("frequency_ratio", "phase")]
    for name in (*names, *BESIDES.get(kind, ())):
        compared = 0
        while compared < (2 if block == 0 else SCENES):
            p, start, periods = draw(kind, rng)
            value = value_of(p, name)

            def end(step: float) -> tuple[np.ndarray, np.ndarray]:
                return run(with_values(p, {name: value + step}), start, periods)  # noqa: B023

            found = difference(end, 1e-5 * value, word)
            # Beside a grazing impact, or by roundoff, they are no derivative.
            if found is None or found[1] > 1e-8 * (size := abs(found[0]).max()):
                continue
            compared += 1
            exact = change_by(name, p, start, periods)
            np.testing.assert_allclose(exact, found[0], rtol=0, atol=1e-7 * size + 5e-9)

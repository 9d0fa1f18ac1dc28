"""Deviations of several free masses, with and without dry friction, against differences of runs."""

import random
from functools import partial
from itertools import pairwise
from typing import Any

import numpy as np
import pytest
from differences import difference, differences
from forced_scenes import FORCES
from several_scenes import length_of, rubbing_scene, several_scene, supported

from damper import Parameters, State
from damper.engine.compiled import plain
from damper.engine.model import read_segment
from damper.engine.segment import (
    CAUSE,
    COLUMNS,
    DURATION,
    IMPACT,
    RELEASE,
    REST,
    RESTING,
    REVERSAL,
    SIDE,
    SLIP,
    STICK,
    TAIL,
)
from damper.engine.trajectory import Trajectory
from damper.models import start_run
from damper.models.sensitivity import follow_change, model_along, neighbours
from damper.models.several.bodies import CAUSE as CAUSE_OF_BODY
from damper.models.several.bodies import MODE, SPEED
from damper.models.tangent import derivative
from damper.parameters.named import value_of, with_values
from damper.sweep.orbits.arcs import state_of, vector

#: Time before masses stick within which events are not compared: which impact of a sequence is the
#: last that is resolved is a matter of digits, and so is what it moves.
LAST = 1e-6
KINDS = ("rubbing", "resting", "without friction", "supported", "supported, resting")
SCENES = 3
CASES = [(kind, 0) for kind in KINDS]
CASES += [
    pytest.param(kind, block, marks=pytest.mark.exhaustive)
    for kind in KINDS
    for block in range(1, 20)
]


def resting_scene(force: str, seed: int) -> tuple[dict[str, Any], tuple[Any, ...]]:
    """As `rubbing_scene`, in wide boxes with much friction: masses rest, and are moved again."""
    values, state = rubbing_scene(force, seed)
    draw = random.Random(f"resting, {force}, {seed}")
    values |= {"clearance": draw.uniform(0.3, 2.0), "restitution": draw.uniform(0.2, 0.9)}
    values["friction"] = 10 ** draw.uniform(-1.0, 0.3)
    values["damping_ratio"] = draw.uniform(0.0, 0.2)
    values["mass_ratio"] = 10 ** draw.uniform(-1.0, 0.3)
    if "gravity" in values:
        values["gravity"] *= 0.3
    clearances = []
    for own in values["masses"]:
        own.pop("restitution", None)
        own.pop("restitution_left", None)
        if "clearance" in own:
            own["clearance"] = draw.uniform(0.3, 2.0)
        if own.get("friction"):
            own["friction"] = 10 ** draw.uniform(-1.0, 0.3)
        clearances.append(own.get("clearance", values["clearance"]))
    x, v = state[:2]
    return values, (x, v, [x + d * draw.uniform(-1, 1) for d in clearances], state[3])


SCENE_OF = {
    "rubbing": rubbing_scene,
    "resting": resting_scene,
    "without friction": several_scene,
    "supported": partial(supported, several_scene),
    "supported, resting": partial(supported, resting_scene),
}


def scenes(kind: str, block: int) -> Any:
    """Parameters, a start, until when it runs; a force after the other."""
    forces = list(FORCES)
    for seed in range(1000 * block, 1000 * block + 999):
        values, state = SCENE_OF[kind](forces[seed % len(forces)], seed)
        yield Parameters(**values), vector(State(*state)), length_of(values, state, 12)


def run(p: Parameters, start: np.ndarray, until: float) -> tuple[np.ndarray, np.ndarray]:
    """Final state and log."""
    trajectory = start_run(p, state_of(start), accuracy=1e-15)
    end = trajectory.whole_periods(until)
    log = np.concatenate([piece.copy() for piece in trajectory.segments(*end)])
    return vector(trajectory.state_at(*end)), log


def word(log: np.ndarray) -> list[tuple[float, ...]]:
    """Events but for the last before masses stick."""
    rows = log[log[:, CAUSE] >= IMPACT]
    times = (np.cumsum(log[:, DURATION]) - log[:, DURATION])[log[:, CAUSE] >= IMPACT]
    left = times[rows[:, CAUSE] == STICK] - times[:, None]
    last = ((left >= 0.0) & (left < LAST)).any(axis=1) & (rows[:, CAUSE] != STICK)
    return [(row[CAUSE], row[SIDE] * (row[CAUSE] <= RELEASE), row[COLUMNS]) for row in rows[~last]]


def happened(p: Parameters, log: np.ndarray) -> set[str]:
    """What friction does, alone and by impacts."""
    model, found = start_run(p).model, set()
    for s, after in pairwise(read_segment(model, row) for row in log):
        bodies, causes = after.bodies, {after.cause, *after.bodies[:, CAUSE_OF_BODY]}
        hits = bool((bodies[:, SPEED] > 0.0).any())
        found |= {"tail"} if (bodies[:, MODE] == TAIL).any() else set()
        found |= {"two rest"} if (bodies[:, MODE] == RESTING).sum() > 1 else set()
        if s.duration == 0.0:
            continue
        stops = bool(causes & {REST, REVERSAL}) and not hits
        found |= {"rest"} if REST in causes and stops else set()
        found |= {f"reversal {hits=}"} if REVERSAL in causes else set()
        found |= {f"parted {hits=} {stops=}"} if causes & {SLIP, RELEASE} else set()
    return found


#: In some of the scenes of each kind.
ALWAYS = {"without friction": {"tail", "parted hits=True stops=False"}}
ALWAYS["rubbing"] = ALWAYS["without friction"] | {"rest", "reversal hits=False"}
ALWAYS["resting"] = {"rest", "two rest", "parted hits=True stops=False", "reversal hits=False"}
ALWAYS["supported"] = {"tail"}
ALWAYS["supported, resting"] = {"rest", "reversal hits=False"}


@pytest.mark.parametrize(("kind", "block"), CASES)
@plain
def test_deviations_are_differences_of_runs(kind: str, block: int) -> None:
    """Impacts that move what rests, slides that stop and let others slip, chatter."""
    compared, seen = 0, set()
    for p, start, until in scenes(kind, block):
        trajectory = start_run(p, state_of(start), accuracy=1e-15)
        exact = derivative(trajectory, *trajectory.whole_periods(until))
        if abs(exact).max() > 100.0:
            continue
        known = differences(lambda at: run(p, at, until), start, word)  # noqa: B023
        if known is None:
            continue
        # Beside what is asked, the roundoff of the differences.
        np.testing.assert_allclose(exact, known, rtol=0, atol=1e-7 * abs(exact).max() + 5e-9)
        seen |= happened(p, run(p, start, until)[1])
        compared += 1
        if compared >= SCENES and (block or seen >= ALWAYS[kind]):
            return


NAMES = ("mass_ratio", "damping_ratio", "frequency_ratio", "clearance", "restitution", "gravity")
NAMES += ("clearance_1", "mass_ratio_1", "gravity_1", "friction_1")
SUPPORTS = ("support_stiffness_ratio", "support_damping_ratio", "support_stiffness_ratio_1")


@pytest.mark.parametrize(("kind", "block"), CASES)
@plain
def test_changes_by_parameters_are_differences_of_runs(kind: str, block: int) -> None:
    """Of all masses, and of one."""
    each = scenes(kind, block)
    names = {"without friction": NAMES[:-1]}.get(kind, NAMES)
    if "supported" in kind:
        names = ("clearance", "mass_ratio", "frequency_ratio", *SUPPORTS)
    for name in names:
        compared = 0
        while compared < (1 if block == 0 else 2):
            p, start, until = next(each)
            value = value_of(p, name)
            if not (p.forcing.repeats and value):
                continue

            def end(step: float) -> tuple[np.ndarray, np.ndarray]:
                there = with_values(p, {name: value + step})  # noqa: B023
                # The same phase of the force.
                return run(there, start, until * there.cycle / p.cycle)  # noqa: B023

            found = difference(end, 1e-5 * abs(value), word)
            # Beside a grazing impact, or by roundoff, they are no derivative.
            if found is None or found[1] > 1e-8 * (size := abs(found[0]).max()):
                continue
            compared += 1
            exact = change_by(name, p, start, until)
            np.testing.assert_allclose(exact, found[0], rtol=0, atol=1e-7 * size + 5e-9)


def change_by(name: str, p: Parameters, start: np.ndarray, until: float) -> np.ndarray:
    """Derivative of the end by a parameter, along the log."""
    trajectory = Trajectory(model_along(p, [name]), state_of(start))
    stencil, change = neighbours(p, {name: 1.0}), np.zeros((len(start), 1))
    for index, log in enumerate(trajectory.segments(*trajectory.whole_periods(until))):
        follow_change(trajectory.model, stencil, log, change, index > 0)
    return change[:, 0]

"""Deviations along the log against differences of the engine's own runs, in every model."""

import math
import random
from collections.abc import Iterator
from itertools import chain, islice, pairwise
from typing import Any

import numpy as np
import pytest
from differences import difference, differences
from event_pairs import length_of
from scenes import FORCES, MODELS, SEVERAL, Scene, scene_of

from damper import Parameters, State
from damper.engine.model import read_segment
from damper.engine.segment import (
    CAUSE,
    COLUMNS,
    DURATION,
    IMPACT,
    MODE,
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
from damper.models.many import CAUSE as CAUSE_OF_BODY
from damper.models.many import MODE as MODE_OF_BODY
from damper.models.many import SPEED
from damper.models.sensitivity import follow_change, model_along, neighbours
from damper.models.tangent import derivative
from damper.parameters.named import value_of, with_values
from damper.sweep.orbits.arcs import state_of, vector

#: Time before masses stick within which events are not compared: which impact of a sequence is the
#: last that is resolved is a matter of digits, and so is what it moves.
LAST = 1e-6
RESTS = ("sliding, resting", "several, sliding, resting", "several, grounded, sliding, resting")
KINDS = (*MODELS, *SEVERAL[:3], *RESTS)
CASES = [(kind, 0) for kind in KINDS]
CASES += [
    pytest.param(kind, block, marks=pytest.mark.exhaustive)
    for kind in KINDS
    for block in range(1, 40)
]


def wide(values: dict[str, Any], draw: random.Random) -> None:
    """Make the boxes wide and friction large: masses rest, and are moved again."""
    values |= {"mass_ratio": 10 ** draw.uniform(-1.0, 0.3), "damping_ratio": draw.uniform(0.0, 0.2)}
    values["restitution"] = draw.uniform(0.2, 0.9)
    if "gravity" in values:
        values["gravity"] *= 0.3
    for own in (values, *values.get("masses", ())):
        for name, ends in (("clearance", (-0.5, 0.3)), ("friction", (-1.0, 0.3))):
            if own.get(name):
                own[name] = 10 ** draw.uniform(*ends)
        for name in ("restitution", "restitution_left"):
            if own is not values:
                own.pop(name, None)


def drawn(kind: str, force: str, seed: int) -> Scene:
    """Every other one of a single mass in a wide box, where it does not chatter at once."""
    model = kind.removesuffix(", resting")
    values, (x, v, y, u) = scene_of(model, force, seed, ("", "gravity", "unlike walls")[seed % 3])
    draw = random.Random(f"{kind}, {force}, {seed}")
    if kind in RESTS:
        wide(values, draw)
    elif kind not in SEVERAL and seed % 2:
        values |= {"clearance": 10 ** draw.uniform(-1, 0.5), "restitution": draw.uniform(0.2, 0.95)}
    boxes = [own.get("clearance", values["clearance"]) for own in values.get("masses", [{}])]
    places = [x + draw.uniform(-0.99, 0.99) * d for d in boxes]
    return values, (x, v, places if isinstance(y, list) else places[0], u)


def scenes(kind: str, block: int) -> Iterator[tuple[Parameters, np.ndarray, float]]:
    """Parameters, a start, until when it runs; a force after the other."""
    forces = list(FORCES)
    for seed in range(1000 * block, 1000 * block + 999):
        values, state = drawn(kind, forces[seed % len(forces)], seed)
        yield Parameters(**values), vector(State(*state)), length_of(values, state, 12)


def run(p: Parameters, start: np.ndarray, until: float) -> tuple[np.ndarray, np.ndarray]:
    """Final state and log."""
    trajectory = start_run(p, state_of(start), accuracy=1e-15)
    end = trajectory.whole_periods(until)
    log = np.concatenate([piece.copy() for piece in trajectory.segments(*end)])
    return vector(trajectory.state_at(*end)), log


def word(log: np.ndarray) -> list[tuple[float, ...]]:
    """Events but for the last before masses stick."""
    happens = log[:, CAUSE] >= IMPACT
    rows, times = log[happens], (np.cumsum(log[:, DURATION]) - log[:, DURATION])[happens]
    left = times[rows[:, CAUSE] == STICK] - times[:, None]
    last = ((left >= 0.0) & (left < LAST)).any(axis=1) & (rows[:, CAUSE] != STICK)
    bodies = rows[:, COLUMNS] if log.shape[1] > COLUMNS else np.zeros(len(rows))
    sides = rows[:, SIDE] * (rows[:, CAUSE] <= RELEASE)
    return [*zip(rows[~last, CAUSE], sides[~last], bodies[~last], strict=True)]


def happened(p: Parameters, log: np.ndarray) -> set[str]:
    """What friction does, alone and by impacts."""
    if "several" not in p.features:
        names = {TAIL: "tail", RESTING: "rest"}
        return {names[mode] for mode in log[:, MODE] if mode in names}
    model, found = start_run(p).model, set()
    for s, after in pairwise(read_segment(model, row) for row in log):
        bodies, causes = after.bodies, {after.cause, *after.bodies[:, CAUSE_OF_BODY]}
        hits = bool((bodies[:, SPEED] > 0.0).any())
        found |= {"tail"} if (bodies[:, MODE_OF_BODY] == TAIL).any() else set()
        found |= {"two rest"} if (bodies[:, MODE_OF_BODY] == RESTING).sum() > 1 else set()
        if s.duration == 0.0:
            continue
        stops = bool(causes & {REST, REVERSAL}) and not hits
        found |= {"rest"} if REST in causes and stops else set()
        found |= {"reversal"} if REVERSAL in causes and not hits else set()
        found |= {"parted by a hit"} if causes & {SLIP, RELEASE} and hits else set()
    return found


#: In some of the scenes of each kind.
ALWAYS = {kind: {"tail"} for kind in MODELS if kind not in ("compliant", "tension")}
ALWAYS["several"] = {"tail", "parted by a hit"}
ALWAYS |= {kind: {"rest", "reversal"} for kind in RESTS} | {"sliding, resting": {"rest"}}
ALWAYS["several, sliding, resting"] = {"rest", "two rest", "parted by a hit", "reversal"}


@pytest.mark.parametrize(("kind", "block"), CASES)
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
        here = happened(p, run(p, start, until)[1])
        if "several" not in p.features:
            # Each rest takes a direction, and a closed tail two.
            rank = 2 if "tail" in here else 3 if "rest" in here else 4
            assert np.linalg.matrix_rank(exact, tol=1e-9 * abs(exact).max()) <= rank
        seen |= here
        compared += 1
        if compared >= 2 and (block or seen >= ALWAYS.get(kind, set())):
            return
    assert block, seen


#: Asked of each damper in which they act.
NAMES = (
    *("mass_ratio", "damping_ratio", "frequency_ratio", "clearance", "restitution", "phase"),
    *("restitution_left", "gravity", "yield_speed", "yield_exponent", "friction"),
    "force_amplitude",
    *("support_stiffness_ratio", "support_damping_ratio", "contact_stiffness_ratio"),
    *("modulation_depth", "modulation_phase", "harmonic_2", "harmonic_2_phase"),
    *("clearance_1", "mass_ratio_1", "gravity_1", "friction_1", "support_stiffness_ratio_1"),
)


def acting(p: Parameters, name: str) -> float:
    """Value of a parameter; 0 of one that does not act, or by which nothing is asked."""
    if name in ("frequency_ratio", "phase") and not p.forcing.repeats:
        return 0.0
    try:
        value = float(value_of(p, name))
        with_values(p, {name: 1.001 * value})
    except (ValueError, TypeError, LookupError, AttributeError):
        return 0.0
    return value if math.isfinite(value) else 0.0


@pytest.mark.parametrize(("kind", "block"), CASES)
def test_changes_by_parameters_are_differences_of_runs(kind: str, block: int) -> None:
    """Of all masses, and of one; the other parameters of a scene that has been run, too."""
    each = list(islice(scenes(kind, block), len(FORCES)))
    left = {name for p, _, _ in each for name in NAMES if acting(p, name)}
    if len(left) > 12 and not block:
        left = set(sorted(left)[::2])
    for p, start, until in chain(each, islice(scenes(kind, block), len(FORCES), None)):
        for name in sorted(left):
            if not (value := acting(p, name)):
                continue

            def end(step: float) -> tuple[np.ndarray, np.ndarray]:
                there = with_values(p, {name: value + step})  # noqa: B023
                # The same phase of the force.
                return run(there, start, until * there.cycle / p.cycle)  # noqa: B023

            found = difference(end, 1e-5 * abs(value), word)
            # Beside a grazing impact, or by roundoff, they are no derivative.
            if found is None or found[1] > 1e-8 * (size := abs(found[0]).max()):
                continue
            exact = change_by(name, p, start, until)
            np.testing.assert_allclose(exact, found[0], rtol=0, atol=1e-7 * size + 5e-9)
            left.discard(name)
        if not left:
            return
    assert block, left


def change_by(name: str, p: Parameters, start: np.ndarray, until: float) -> np.ndarray:
    """Derivative of the end by a parameter, along the log."""
    trajectory = Trajectory(model_along(p, [name]), state_of(start))
    stencil, change = neighbours(p, {name: 1.0}), np.zeros((len(start), 1))
    for index, log in enumerate(trajectory.segments(*trajectory.whole_periods(until))):
        follow_change(trajectory.model, stencil, log, change, index > 0)
    return change[:, 0]

"""The closed rest of a chatter sequence in each model, against bounces followed in many digits."""

import random
from typing import Any

import numpy as np
import pytest
from tails import completed, largest_rate, tail

from damper import Parameters, State, events
from damper.models import model_of, start_run
from damper.parameters.dampers import BASIC


def of(*numbers: float, **more: float) -> dict[str, Any]:
    return dict(zip(BASIC, numbers, strict=False)) | more


#: Name -> values, and a rebound speed at which the errors are what their last terms are.
SEQUENCES = {
    "rigid": (of(0.5, 0.2, 0.3, 0.5, 0.6), 0.001),
    "grounded": (
        of(0.5, 0.2, 0.3, 0.5, 0.6, 0.6, support_stiffness_ratio=0.05, support_damping_ratio=0.1),
        0.0004,
    ),
    "dashpot alone": (of(0.1, 0.0, 0.3, 0.5, 0.6, 0.6, support_damping_ratio=0.03), 0.0004),
    "time_varying": (
        of(0.5, 0.2, 0.3, 0.5, 0.6, modulation_depth=0.6, modulation_phase=1.0),
        0.005,
    ),
}


@pytest.mark.parametrize("side", [1, -1])
@pytest.mark.parametrize("name", SEQUENCES)
def test_errors_are_of_the_third_order(name: str, side: int) -> None:
    """Of time, place and velocity: halving the rebound speed divides them by eight."""
    values, fast = SEQUENCES[name]
    model = model_of(Parameters(**values))
    time, x, v = 2.0, 2.0 * side, 0.1
    errors = []
    for w in (fast, 0.5 * fast):
        duration, estimate, end_x, end_v = tail(model, time, float(side), x, v, w)
        exact = completed(values, time, side, x, v, w, within=1.1 * duration)
        found = (duration - exact.time, end_x - exact.x, end_v - exact.v)
        errors.append([abs(float(off)) for off in found])
        assert errors[-1][0] < estimate
    assert all(7.0 < a / b < 9.0 for a, b in zip(*errors, strict=True)), errors


def drawn(draw: random.Random, name: str) -> dict[str, float]:
    mu, zeta = 10 ** draw.uniform(-4, 2), draw.choice([0.0, 0.02, 0.2, 1.0, 3.0, 10.0])
    restitution = draw.choice([0.05, 0.3, 0.6, 0.8, 0.9, 0.95])
    values = of(mu, zeta, 10 ** draw.uniform(-1, 1), 1.0, restitution, draw.uniform(-3, 3))
    if name == "grounded":
        values["support_stiffness_ratio"] = draw.choice([0.0, mu * 10 ** draw.uniform(-3, 6)])
        values["support_damping_ratio"] = mu * 10 ** draw.uniform(-3, 2.5)
    if name == "time_varying":
        values["modulation_depth"] = draw.choice([0.1, 0.6, 0.95, 0.999])
        values["modulation_phase"] = draw.uniform(-3, 3)
        values["modulation_order"] = draw.choice([1, 2, 5])
    return values


@pytest.mark.parametrize("name", ["rigid", "grounded", "time_varying"])
def test_the_estimate_bounds_the_error(name: str) -> None:
    """Over random walls, masses and damping: the accuracy setting rests on this."""
    draw = random.Random(name)
    ratios: list[float] = []
    while len(ratios) < 7:
        values = drawn(draw, name)
        model = model_of(Parameters(**values))
        cycle = 6.28 / values["frequency_ratio"]
        time, x, v, side = (draw.uniform(*ends) for ends in ((0, cycle), (-2, 2), (-2, 2), (-1, 1)))
        side = 1.0 if side > 0 else -1.0
        # The rebound speed at which the estimate is what an accuracy setting might ask for.
        rate = largest_rate(model, time, side, x, v, 10 ** draw.uniform(-11, -5))
        if rate == 0.0:
            continue  # the wall does not press
        duration, error, _, _ = tail(model, time, side, x, v, rate)
        within = 1.2 * duration + 1.5 * error
        exact = completed(values, time, side, x, v, rate, within=within).time
        ratios.append(float(abs(exact - duration)) / error)
    assert max(ratios) <= 1.0
    # Not a bound that no tail would ever pass.
    assert max(ratios) > 1e-4


#: Name -> what makes it; each chatters on the right wall.
INSIDE: dict[str, dict[str, Any]] = {
    "rigid": {},
    "grounded": {"support_stiffness_ratio": 0.05, "support_damping_ratio": 0.01},
    "time_varying": {"modulation_depth": 0.3},
    "sliding": {"friction": 0.3},
    "several": {"masses": [{}]},
    "several, sliding": {"friction": 0.3, "masses": [{}]},
}


@pytest.mark.parametrize("name", INSIDE)
def test_inside_a_tail_it_bounces(name: str) -> None:
    """As the same burst does that is resolved to 1e-15, on the wall that a large x presses."""
    given = {"force_amplitude": 0.1} | INSIDE[name]
    p = Parameters(0.1, 0.05, 0.8, 0.5, 0.6, **given)
    one = "masses" not in given
    w = 0.02
    state = State(1.0, 0.0, 1.5 if one else [1.5], w if one else [w])
    coarse = events(p, state, until=0.5, accuracy=1e-3)
    end = float(coarse["time"][coarse["kind"] == 1][0])
    last = coarse[coarse["kind"] == 0][-1]
    start, speed = float(last["time"]), 0.6 * float(last["approach_speed"])
    length = end - start
    heights = []
    for part in (0.05, 0.2, 0.35, 0.5, 0.7, 0.9):
        ends = []
        for accuracy in (1e-3, 1e-15):
            run = start_run(p, state, accuracy)
            at = run.whole_periods(start + part * length)
            run.skip(*at)
            found = run.state_at(*at)
            y, u = (found.y, found.u) if one else (found.y[0], found.u[0])
            ends.append([found.x, found.v, y - found.x, u - found.v])
        off = np.abs(np.subtract(*ends)) / (speed * np.array([length, 1.0, length, 1.0]))
        assert off.max() < 0.02, (part, off)
        heights.append((0.5 - ends[1][2]) / (speed * length))
    assert max(heights) > 0.05

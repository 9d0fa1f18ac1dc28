"""Accumulation of chatter sequences in closed form, against all bounces in many digits."""

import math
import random
from dataclasses import replace

import numpy as np
import pytest
from mpmath import mpf
from tails import completed

from damper import Parameters
from damper.engine.accumulation import accumulation_times
from damper.engine.segment import TAIL, Segment
from damper.models import start_run
from damper.parameters import State
from damper.theory.accumulation import predict

#: Model section 4: on the right wall at t = 2, x = 2, x' = .1.
P = Parameters(0.5, 0.2, 0.3, 0.5, 0.6)


def resolved(
    p: Parameters, side: int, time: float, x: float, v: float, w: float, digits: int = 30
) -> tuple[mpf, mpf]:
    """Time and displacement from an impact to accumulation; the other wall is far away."""
    within = 2.0 * predict(p, side, time, x, v, w).first_order_time
    values = p.given | {"clearance": mpf(1000)}
    end = completed(values, time, side, x, v, w, within=within, digits=digits)
    return end.time, end.x - mpf(x)


# --- known numbers


def test_reference_numbers_of_the_model() -> None:
    w, printed = 0.005, 0.0169819753
    found = predict(P, 1, 2.0, 2.0, 0.1, w)
    exact = resolved(P, 1, 2.0, 2.0, 0.1, w)
    assert abs(exact[0] - printed) < 0.51e-10
    assert abs(found.second_order_time - printed) < 5e-6 * (w / 0.01) ** 3
    assert abs(found.first_order_time - printed) < 2e-4 * (w / 0.01) ** 2


# --- slopes


def derivatives(p: Parameters, angle: float, x: float, v: float) -> tuple[float, float]:
    """Second and third derivative of the primary's displacement in flight."""
    a = math.sin(angle) - 2.0 * p.damping_ratio * v - x
    return a, p.frequency_ratio * math.cos(angle) - 2.0 * p.damping_ratio * a - v


def random_impact(rng: random.Random) -> tuple[Parameters, int, float, float, float, float]:
    """A burst that ends soon: parameters, side, time, x, v, and the speed scale of theory."""
    while True:
        omega = 10 ** rng.uniform(-0.7, 0.7)
        p = Parameters(
            10 ** rng.uniform(-3, 1),
            rng.choice([0.0, 0.05, 0.5, 2.0]),
            omega,
            1.0,
            rng.choice([0.2, 0.5, 0.7, 0.85]),
            rng.uniform(-3, 3),
        )
        side = rng.choice([-1, 1])
        time, x, v = rng.uniform(0, p.cycle), rng.uniform(-2, 2), rng.uniform(-2, 2)
        a, j = derivatives(p, omega * time + p.phase, x, v)
        push = -side * a
        if push < 0.1:
            continue
        # Duration over which the wall's push stays what it is.
        slow = 1.0 / (abs(j) / push + 2 * p.damping_ratio + max(1.0, omega) / math.sqrt(push))
        return p, side, time, x, v, 0.5 * slow * push * (1 - p.restitution)


@pytest.mark.parametrize(
    "seed", [0, *(pytest.param(k, marks=pytest.mark.exhaustive) for k in range(1, 6))]
)
def test_slopes_are_two_and_three(seed: int) -> None:
    """For random complete bursts; single ones may be near a zero of the error's leading term."""
    rng = random.Random(seed)
    slopes = []
    for _ in range(3):
        p, side, time, x, v, scale = random_impact(rng)
        errors = []
        for w in (2e-3 * scale, 1e-3 * scale):
            found = predict(p, side, time, x, v, w)
            duration, way = resolved(p, side, time, x, v, w, digits=25)
            left = (duration, duration, way, way)
            errors.append([float(a - b) for a, b in zip(found[:4], left, strict=True)])
            assert abs(errors[-1][1]) <= found.error * found.first_order_time
        slopes.append(np.log2(np.abs(np.divide(*errors))))
    middle = np.median(slopes, axis=0)
    assert middle == pytest.approx([2.0, 3.0, 2.0, 3.0], abs=0.05)


# --- symmetry, the engine, ends of the range


def test_second_order_is_what_the_engine_closes_tails_with() -> None:
    """An impact on the right wall with the approach speed w / r begins a tail."""
    p, w = P, 1e-6
    approach = w / p.restitution
    before = 0.1 - p.mass_ratio * (1.0 + p.restitution) / (1.0 + p.mass_ratio) * approach
    state = State(2.0, before, 2.0 + p.clearance, before + approach, 2.0)
    trajectory = start_run(p, state)
    log = next(trajectory.segments(0.0, 3.0))
    (tail,) = (segment for segment in map(Segment._make, log) if segment.mode == TAIL)
    found = predict(p, 1, 2.0, tail.x, tail.v, tail.gap_rate)
    assert found.second_order_time == pytest.approx(tail.accumulation, rel=1e-14)
    assert found.error * found.first_order_time <= trajectory.model.tolerance


def test_where_theory_claims_nothing() -> None:
    """A force that fades at once: the first-order time stands, the second-order one is negative."""
    first, second = accumulation_times(0.0, 0.5, 0.1, -1.0, 1.0)
    assert first == pytest.approx(40.0)
    assert second < 0.0
    found = predict(P, 1, 0.0, 0.01, 3.0, 1.0)
    assert found.first_order_time > 0.0
    assert math.isnan(found.second_order_time)
    assert math.isnan(found.second_order_displacement)
    assert found.error == math.inf


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        ({"side": 0}, "side = 0: must be -1 .left wall. or 1 .right wall."),
        (
            {"x": -2.0},
            "the contact force is not positive just after this impact .side = 1, x = -2.0",
        ),
        ({"x": math.nan}, "x = nan: must be a finite number"),
        ({"time": math.inf}, "time = inf: must be a finite number"),
        ({"rebound_speed": -1.0}, "rebound_speed = -1.0: must be"),
    ],
)
def test_invalid_predictions_are_refused(arguments: dict[str, float], words: str) -> None:
    good = {"side": 1, "time": 2.0, "x": 2.0, "v": 0.1, "rebound_speed": 0.01}
    with pytest.raises(ValueError, match=words):
        predict(P, **good | arguments)
    with pytest.raises(ValueError, match=r"restitution = 1\.0"):
        predict(Parameters(0.5, 0.2, 0.3, 0.5, 1.0), **good)
    with pytest.raises(ValueError, match="the prediction does not know dry friction"):
        predict(replace(P, friction=0.1), **good)
    with pytest.raises(ValueError, match="side = 1: this damper has no wall there"):
        predict(replace(P, walls="left"), **good)
    with pytest.raises(TypeError, match="x = '2'"):
        predict(P, **good | {"x": "2"})

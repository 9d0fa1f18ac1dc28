"""What is left of bursts after their impacts: against a plain loop over the events, many digits."""

import math
from collections.abc import Iterator
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from mpmath import mp, mpf
from plain_events import Scene, random_scenes
from scenes import PAPER_A, SLOW

from damper import Parameters
from damper.models import start_run
from damper.observers import make_observers
from damper.observers.common.base import Window
from damper.parameters.forcing import Base, Harmonics
from damper.sweep.runs import run_points
from damper.theory.accumulation import predict
from damper.verification.reference import exact_run

PREDICTED = (
    "first_order_time",
    "second_order_time",
    "first_order_displacement",
    "second_order_displacement",
    "prediction_error_estimate",
)
#: A ball that hops and comes to rest on a table.
TABLE: dict[str, Any] = {"mass_ratio": 0.0, "damping_ratio": 0.0, "carrier": "prescribed"} | {
    **{"walls": "left", "gravity": 1.0, "frequency_ratio": 1.0, "force_amplitude": 1.5},
    **{"clearance": 0.0, "restitution": 0.5},
}
#: Two masses, each of half the mass, whose walls differ; a support holds the first.
SUPPORTED = [
    {"mass_share": 0.5, "support_stiffness_ratio": 0.1, "support_damping_ratio": 0.1},
    {"mass_share": 0.5, "restitution": 0.4},
]


def expected(scene: Scene) -> Iterator[dict[str, Any]]:
    """Complete bursts of the window, from the rows of `damper.events`."""
    at = {float(row["time"]): row for row in scene.rows if row["kind"] == 0}
    for burst in scene.begun:
        if burst.complete:
            hits = [at[time] for time in burst.times]
            yield {
                "wall": burst.wall,
                "displacement": burst.x,
                "rebound_speed": [scene.restitution(burst.wall) * speed for speed in burst.speeds],
                "remaining_time": [burst.stick - time for time in burst.times],
                "remaining_displacement": [burst.x - float(row["x"]) for row in hits],
                "hits": hits,
            }


def assert_as_expected(found: dict[str, np.ndarray], scene: Scene) -> int:
    """Compare everything; return how many impacts had no prediction."""
    parameters = Parameters(**scene.parameters)
    impacts = found["rebound_speed"].shape[1]
    bursts = list(expected(scene))
    assert found["complete_bursts"] == len(bursts)
    listed = bursts[: len(found["accumulation_wall"])]
    assert np.isnan(found["accumulation_wall"][len(listed) :]).all()
    assert np.isnan(found["rebound_speed"][len(listed) :]).all()
    missing = 0
    for number, burst in enumerate(listed):
        assert found["accumulation_wall"][number] == burst["wall"]
        assert found["accumulation_impacts"][number] == len(burst["hits"])
        assert found["accumulation_displacement"][number] == burst["displacement"]
        count = min(len(burst["hits"]), impacts)
        for name in ("rebound_speed", "remaining_time", "remaining_displacement"):
            values = found[name][number]
            # Times of the rows are sums, which blur with their size.
            assert values[:count] == pytest.approx(burst[name][:count], rel=1e-12, abs=5e-12), name
            assert np.isnan(values[count:]).all()
        for k, row in enumerate(burst["hits"][:count]):
            got = [float(found[name][number, k]) for name in PREDICTED]
            state = (burst["wall"], row["time"], row["x"], row["v"])
            try:
                there = predict(parameters, *state, burst["rebound_speed"][k])
            except ValueError:
                assert got[:4] == pytest.approx([math.nan] * 4, nan_ok=True)
                assert got[4] == math.inf
                missing += 1
                continue
            if there.error < 0.1:
                assert got == pytest.approx(there, rel=1e-7, abs=1e-12)
    return missing


# --- against a plain loop


def test_bursts_that_began_before_the_record_are_left_out() -> None:
    """Bursts last a third of each half period, so that some of these records begin inside one."""
    straddling = 0
    for phase in np.linspace(-3.0, 3.0, 9).tolist():
        scene = Scene({**PAPER_A, "phase": phase}, 12, 2)
        assert_as_expected(scene.observed("accumulation"), scene)
        last = [burst for burst in scene.all_bursts if burst.onset < scene.start][-1]
        straddling += last.complete and last.stick > scene.start
    assert straddling >= 2


@settings(max_examples=25)
@given(scene=random_scenes(), bursts=st.integers(1, 15), impacts=st.integers(1, 80))
def test_random_scenes(scene: Scene, bursts: int, impacts: int) -> None:
    found = scene.observed("accumulation", bursts=bursts, impacts=impacts)
    assert_as_expected(found, scene)


def test_impacts_on_a_wall_that_draws_away_have_no_prediction() -> None:
    """With a heavy free mass the first impacts of many bursts come before the push."""
    scene = Scene({**SLOW, "mass_ratio": 2.0, "clearance": 0.4, "restitution": 0.5}, 0, 20)
    assert assert_as_expected(scene.observed("accumulation", bursts=60), scene) > 10


@pytest.mark.parametrize(
    "values",
    [
        {"forcing": Harmonics((1, 2), (1.0, 0.5)), "force_amplitude": 25.0},
        {"forcing": Base("base"), "force_amplitude": 25.0},
        {"support_stiffness_ratio": 0.3, "support_damping_ratio": 0.4},
        {"modulation_depth": 0.5, "gravity": 0.03},
        {"mass_ratio": math.inf},
        TABLE,
        {"masses": [{}]},
        {"masses": [{"mass_share": 0.5}] * 2},
        {"masses": SUPPORTED, "gravity": 0.01},
    ],
    ids=str,
)
def test_predictions_of_other_dampers(values: dict[str, Any]) -> None:
    """Of the second order, with what a force, a support or gravity does to both masses."""
    bodies = {"bodies": range(len(values.get("masses", ())))}
    found, _ = run_points([SLOW | values], {"accumulation": bodies}, transient=1, periods=5)
    exact = found["remaining_time"]
    known = (found["prediction_error_estimate"] < 1e-2) & (exact > 1e-4)
    assert known.sum() > 10
    first, second = (
        abs(found[f"{order}_order_time"] / exact - 1.0)[known] for order in ("first", "second")
    )
    assert (second < 0.25 * found["prediction_error_estimate"][known]).all()
    assert np.median(second) < 0.01 * np.median(first)


# --- against many digits


def test_known_burst_to_forty_digits() -> None:
    """Model section 7: accumulation at 44.249718778208865; no further off than it says."""
    scene = Scene(SLOW, 0, 2)
    found = scene.observed("accumulation")
    with mp.workdps(40):
        decimals = {name: mpf(str(value)) for name, value in SLOW.items()}
    run = exact_run(decimals, until=45, digits=40).events
    stick = run[[event.kind for event in run].index("stick")]
    assert abs(stick.time - 44.249718778208865) < 1e-14
    burst = [event for event in run if event.kind == "impact" and event.side == stick.side]
    burst = [event for event in burst if stick.time - event.time < 10]
    count = int(found["accumulation_impacts"][0])
    assert 15 < count <= len(burst)
    sharp = found["accumulation_time_uncertainty"][0]
    assert 1e-15 < sharp < 2e-12
    assert abs(found["accumulation_displacement"][0] - stick.x) < 1e-12
    for k, event in enumerate(burst[:count]):
        # The impact's own time has an error as well.
        off = abs(found["remaining_time"][0, k] - (stick.time - event.time))
        assert off < sharp + 1e-13
        moved = abs(found["remaining_displacement"][0, k] - (stick.x - event.x))
        assert moved < found["accumulation_displacement_uncertainty"][0] + 1e-13
        w = found["rebound_speed"][0, k]
        assert w == pytest.approx(float(mpf("0.6") * event.approach_speed), rel=1e-9, abs=1e-13)


def test_late_bursts_are_as_sharp_as_early_ones() -> None:
    """The orbit at restitution .3 is periodic: two bursts a period, the same for ever."""
    scene = {**SLOW, "restitution": 0.3}
    early, late = (Scene(scene, n, 3).observed("accumulation", bursts=4) for n in (200, 20_000))
    seen = np.isfinite(early["remaining_time"])
    assert seen.sum() > 20
    for name in ("remaining_time", "remaining_displacement", *PREDICTED[:4]):
        np.testing.assert_allclose(late[name][seen], early[name][seen], rtol=1e-9, atol=1e-12)


# --- units, ends, refusals


def test_another_model_is_refused() -> None:
    """Its bursts end by other formulas, so predictions would be silently wrong."""
    (observer,) = make_observers(["accumulation"])
    trajectory = start_run(Parameters(**SLOW, friction=0.1))
    with pytest.raises(ValueError, match="accumulation does not know dry friction"):
        observer.begin(0, trajectory, Window(0.0, 0.0, 1))

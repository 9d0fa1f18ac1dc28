"""Observers of impacts and bursts against plain loops over the events, and known values."""

import itertools
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from plain_events import Scene, Threshold, assert_observed, random_scenes
from scenes import PAPER_A, SLOW, STUDY

from damper import State
from damper.sweep.runs import run_points
from damper.verification.reference import exact_run

#: Starts on the left wall, which pushes: the primary swings back freely from x = -5.
LONGER_THAN_A_PERIOD = {
    "mass_ratio": 0.1,
    "damping_ratio": 0.02,
    "frequency_ratio": 8.0,
    "clearance": 0.5,
    "restitution": 0.9,
}
ON_THE_LEFT = State(-5.0, 0.0, -5.5, -0.3)
#: A release, and a flight of more than one segment to the same wall.
LONG_FLIGHT = {
    "mass_ratio": 0.1,
    "damping_ratio": 0.05,
    "frequency_ratio": 0.02,
    "clearance": 0.9,
    "restitution": 0.0,
    "phase": 3.2,
}
#: Where a record may begin and end, and what a coarse accuracy closes.
SCENES = [
    Scene(STUDY, 5, 10),
    Scene(SLOW | {"restitution": 0.3}, 0, 10),
    Scene(SLOW | {"restitution": 0.8}, 5, 10),
    Scene(STUDY | {"restitution": 0.0}, 9, 15),
    Scene(STUDY | {"clearance": 0.0}, 1, 4),
    Scene(STUDY | {"clearance": 50.0}, 1, 4),
    Scene(STUDY | {"clearance": 3.0}, 0, 1, State(0.0, 0.0, 3.0, 0.25)),
    Scene(SLOW | {"restitution": 0.3}, 1, 5, State(0.1, 0.0, 0.2, 0.0, time=20.0)),
    Scene(STUDY | {"frequency_ratio": 0.95, "clearance": 4.0}, 1, 8),
    Scene(STUDY | {"frequency_ratio": 1.05, "clearance": 5.0}, 1, 8),
    Scene(LONGER_THAN_A_PERIOD, 0, 1, ON_THE_LEFT),
    Scene(LONGER_THAN_A_PERIOD, 0, 2, ON_THE_LEFT),
    Scene(LONG_FLIGHT, 2, 1),
    *(Scene(PAPER_A | {"frequency_ratio": 0.3, "phase": 0.4 * k}, 20, 2) for k in (0, 3, 4)),
    *(Scene(PAPER_A | {"phase": 0.25 * k}, 30, 2) for k in range(12)),
    *(Scene(SLOW | {"restitution": 0.3, "phase": 0.9 * k}, 2, 3) for k in range(6)),
    *(
        Scene(STUDY | {"restitution": r}, 20, 6, accuracy=accuracy)
        for r, accuracy in itertools.product((0.3, 0.7), (1e-3, 1e-6))
    ),
]


def asked(scene: Scene, threshold: Threshold, compared: tuple[float, ...] = ()) -> dict[str, Any]:
    """All observers, with settings that make them write all that they can."""
    return {
        "bursts": {"threshold": threshold, "records": 60, "compare_thresholds": compared},
        "impacts": {"threshold": threshold, "speeds": 50},
        "burst_at": {"threshold": threshold, "time": 0.4 * (scene.end - scene.start)},
        "chatter_bursts": {"threshold": threshold, "since": (0.0, 0.3 * scene.periods)},
        "impact_section": {"wall": "left", "samples": 60, "free_mass": True},
    }


@pytest.mark.parametrize("threshold", [0.03, 1e-5, {"speed": 0.05}], ids=str)
@pytest.mark.parametrize("scene", SCENES)
def test_known_scenes(scene: Scene, threshold: Threshold) -> None:
    assert_observed(scene, asked(scene, threshold, compared=(0.1, 0.003)))


@settings(max_examples=60)
@given(
    scene=random_scenes(),
    threshold=st.floats(0.001, 0.5) | st.floats(0.001, 0.5).map(lambda speed: {"speed": speed}),
)
def test_random_scenes(scene: Scene, threshold: Threshold) -> None:
    assert_observed(scene, asked(scene, threshold))


# --- known values


COMPLETE = {"restitution": 0.3}
INCOMPLETE = {"restitution": 0.5, "damping_ratio": 0.1, "frequency_ratio": 1.0, "clearance": 5.0}


@pytest.mark.parametrize("change", [COMPLETE, INCOMPLETE], ids=["complete", "incomplete"])
def test_the_rate_of_a_periodic_motion_is_exact(change: dict[str, float]) -> None:
    """One burst on each wall in a period, wherever the record begins and however short it is."""
    for phase, periods in itertools.product(np.arange(0.0, 6.3, 0.9), (1, 5, 30)):
        found = Scene({**STUDY, **change, "phase": phase}, 60, periods).observed("bursts")
        assert found["bursts_per_period"] == 2.0, (phase, periods)


def test_count_does_not_depend_on_where_the_tail_closes() -> None:
    """Against every single bounce of the burst in 30-digit arithmetic."""
    found = exact_run({**SLOW, "restitution": 0.3}, until=19, digits=30).events
    stick = next(k for k, event in enumerate(found) if event.kind == "stick")
    burst = found[:stick]
    while {event.side for event in burst} != {burst[-1].side}:
        burst.pop(0)
    assert len(burst) > 10
    for fraction in (0.2, 2e-3, 2e-6):
        limit = fraction * burst[0].approach_speed
        expected = sum(event.approach_speed >= limit for event in burst)
        for accuracy in (1e-15, 1e-12, 1e-9):
            run = Scene({**SLOW, "restitution": 0.3}, 0, 1, accuracy=accuracy)
            got = run.observed("bursts", threshold=fraction, records=20)
            first = np.flatnonzero(got["burst_complete"] == 1.0)[0]
            assert got["burst_visible_impacts"][first] == expected, (fraction, accuracy)


def test_the_burst_of_paper_a() -> None:
    """Model section 8, A3: found by simulators of its own."""
    found = Scene(PAPER_A, 0, 14).observed("burst_at", time=332)
    onset, duration, sticking = (
        found[f"burst_at_{name}"] for name in ("onset", "duration", "sticking_time")
    )
    assert onset == pytest.approx(332.967, abs=1e-3)
    assert duration == pytest.approx(10.844, abs=1e-3)
    assert duration + sticking == pytest.approx(12.345, abs=1e-3)
    assert found["burst_at_complete"] == 1


def test_incomplete_only_after_the_transient_at_the_highest_frequency() -> None:
    """Model section 8, A5: two complete bursts at 107.2 and 118.3, none after that."""
    run = Scene({**PAPER_A, "frequency_ratio": 0.3}, 0, 30)
    found = run.observed("chatter_bursts", since=[0, 15])
    assert found["chatter_complete"].tolist() == [2, 0]
    assert found["chatter_onset"][0] == pytest.approx(107.2, abs=0.1)
    assert found["chatter_bursts"][1] > 20


# --- descriptions


def test_coordinates_and_comments_say_what_is_visible() -> None:
    asked = {"bursts": {"compare_thresholds": [0.1, 0.01]}, "impacts": {"threshold": 0.07}}
    _, (bursts, impacts) = run_points([], asked, transient=0, periods=1)
    np.testing.assert_array_equal(bursts.coordinates()["threshold"], [0.1, 0.01])
    assert "0.07 of the first" in impacts.variables[0].comment
    absolute = {"bursts": {}, "impacts": {"threshold": {"speed": 0.25}}}
    _, (plain, impacts) = run_points([], absolute, transient=0, periods=1)
    assert plain.coordinates() == {}
    assert impacts.variables[0].comment == "visible: approach speed >= 0.25"

"""Counts and speeds of impacts against a plain loop over the event rows."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from plain_bursts import Scene, all_bursts, impact_summary
from scenes import PAPER_A, STUDY

from damper import State
from damper.sweep.runs import run_points

NAMES = ("impacts_per_period", "mean_approach_speed", "max_approach_speed")


def observed(scene: Scene, **settings: object) -> dict[str, np.ndarray]:
    """Results of the observer for one run."""
    arrays, _ = run_points([scene.parameters], {"impacts": settings}, **scene.run())
    return {name: array[0] for name, array in arrays.items()}


def assert_summary(found: dict[str, np.ndarray], expected: dict[str, float]) -> None:
    for name in NAMES:
        assert found[name] == pytest.approx(expected[name], rel=1e-12, nan_ok=True), name


@pytest.mark.parametrize("accuracy", [1e-12, 1e-3])
@pytest.mark.parametrize("transient", [0, 7])
def test_absolute_speed(transient: int, accuracy: float) -> None:
    run = Scene({**STUDY, "restitution": 0.7}, transient, 12, accuracy=accuracy)
    for speed in (1e-6, 1e-3, 0.05, 0.4):
        assert_summary(observed(run, threshold={"speed": speed}), impact_summary(run, speed=speed))


@settings(max_examples=40)
@given(
    mass_ratio=st.sampled_from([0.001, 0.1, 2.0]),
    damping_ratio=st.sampled_from([0.0, 0.05, 1.0]),
    frequency_ratio=st.sampled_from([0.2, 0.7, 1.3, 3.0]),
    clearance=st.sampled_from([0.0, 0.02, 0.1, 0.4]),
    restitution=st.floats(0, 1),
    phase=st.sampled_from([0.0, 1.0]),
    periods=st.integers(1, 8),
    threshold=st.floats(0.001, 0.5),
)
def test_random_scenes_from_rest(periods: int, threshold: float, **parameters: float) -> None:
    run = Scene(parameters, 0, periods)
    assert_summary(observed(run, threshold=threshold), impact_summary(run, fraction=threshold))


def test_burst_under_way_at_the_start_keeps_its_first_impact() -> None:
    """Visible is what reaches the part of the burst's first speed, seen in the record or not."""
    under_way = 0
    for shift in range(12):
        run = Scene({**PAPER_A, "phase": 0.25 * shift}, 20, 2)
        under_way += any(b.onset < run.start < b.times[-1] for b in all_bursts(run.rows()))
        assert_summary(observed(run), impact_summary(run, fraction=0.03))
    assert under_way >= 4


def test_tail_adds_to_the_count_but_not_to_the_mean() -> None:
    """A coarse accuracy closes the burst while impacts can still be seen."""
    coarse = Scene({**STUDY, "restitution": 0.5}, 0, 8, accuracy=1e-3)
    found, expected = observed(coarse, threshold=1e-4), impact_summary(coarse, fraction=1e-4)
    assert_summary(found, expected)
    in_tails = sum(
        speed >= b.limit(1e-4, 0.0) for b in all_bursts(coarse.rows()) for speed in b.tail(0.5)
    )
    assert in_tails > 20
    fine = observed(Scene({**STUDY, "restitution": 0.5}, 0, 8), threshold=1e-4)
    assert found["impacts_per_period"] == pytest.approx(fine["impacts_per_period"], rel=0.01)
    assert found["mean_approach_speed"] > 1.2 * fine["mean_approach_speed"]


def test_impact_at_the_very_start_counts() -> None:
    run = Scene({**STUDY, "clearance": 3.0}, 0, 1, State(0.0, 0.0, 3.0, 0.25))
    found = observed(run)
    assert_summary(found, impact_summary(run, fraction=0.03))
    assert found["max_approach_speed"] >= 0.25


def test_comments_name_the_threshold() -> None:
    _, (observer,) = run_points([], {"impacts": {"threshold": 0.07}}, transient=0, periods=1)
    assert "0.07" in observer.variables[0].comment
    _, (observer,) = run_points(
        [], {"impacts": {"threshold": {"speed": 0.25}}}, transient=0, periods=1
    )
    assert "0.25" in observer.variables[0].comment
    assert "first" not in observer.variables[0].comment


def test_speeds_are_listed_in_order() -> None:
    run = Scene(STUDY, 3, 4)
    whole = observed(run, threshold=0.03, speeds=200)["approach_speed"]
    seen = whole[np.isfinite(whole)]
    summary = observed(run, threshold=0.03)
    assert seen.mean() == pytest.approx(summary["mean_approach_speed"], rel=1e-12)
    assert seen.size == 4 * summary["impacts_per_period"] > 20
    assert seen.max() == summary["max_approach_speed"]
    np.testing.assert_array_equal(
        observed(run, threshold=0.03, speeds=5)["approach_speed"], whole[:5]
    )

"""Bursts against a plain loop over the event rows, and against known values of the model."""

import itertools
import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from plain_bursts import Scene, all_bursts, burst_summary
from scenes import PAPER_A, SLOW, STUDY

from damper import State
from damper.sweep.runs import run_points
from damper.verification.reference import run as exact_run

SUMMARY = (
    "visible_impacts",
    "chatter",
    "bursts_per_period",
    "complete_fraction",
    "sticking_fraction",
)


def observed(scene: Scene, **settings: object) -> dict[str, np.ndarray]:
    """Results of the observer for one run."""
    arrays, _ = run_points([scene.parameters], {"bursts": settings}, **scene.run())
    return {name: array[0] for name, array in arrays.items()}


def assert_summary(found: dict[str, np.ndarray], expected: dict[str, float]) -> None:
    for name in SUMMARY:
        assert found[name] == pytest.approx(expected[name], abs=1e-9, nan_ok=True), name


# --- the summary of a run


@settings(max_examples=40)
@given(
    mass_ratio=st.sampled_from([0.001, 0.1, 0.5, 2.0]),
    damping_ratio=st.sampled_from([0.0, 0.02, 0.3, 1.0]),
    frequency_ratio=st.sampled_from([0.05, 0.2, 0.7, 1.3, 3.0]),
    clearance=st.sampled_from([0.0, 0.02, 0.1, 0.4, 1.0]),
    restitution=st.floats(0, 1),
    phase=st.sampled_from([0.0, 1.0, math.pi / 2]),
    transient=st.integers(0, 6),
    periods=st.integers(1, 8),
    threshold=st.one_of(st.floats(0.001, 0.5), st.floats(0.001, 0.5).map(lambda s: {"speed": s})),
)
def test_summary_of_random_scenes(
    transient: int, periods: int, threshold: object, **parameters: float
) -> None:
    run = Scene(parameters, transient, periods)
    if isinstance(threshold, dict):
        expected = burst_summary(run, speed=threshold["speed"])
    else:
        expected = burst_summary(run, fraction=threshold)
    assert_summary(observed(run, threshold=threshold), expected)


# --- records of single bursts


@pytest.mark.parametrize(("transient", "restitution"), [(0, 0.3), (5, 0.8)])
@pytest.mark.parametrize("scene", [SLOW, STUDY, PAPER_A], ids=["slow", "study", "paper_a"])
def test_records_are_the_bursts_of_the_event_rows(
    scene: dict[str, float], restitution: float, transient: int
) -> None:
    run = Scene({**scene, "restitution": restitution}, transient, 10)
    found = observed(run, records=60)
    bursts = [b for b in all_bursts(run.rows()) if b.onset >= run.start and b.ended][:60]
    assert len(bursts) > 5
    for k, burst in enumerate(bursts):
        end = burst.stick if burst.complete else burst.times[-1]
        expected = {
            "onset": burst.onset - run.start,
            "wall": burst.wall,
            "first_speed": burst.speeds[0],
            "visible_impacts": burst.visible(restitution, 0.03),
            "complete": float(burst.complete),
            "accumulation_time": burst.stick - run.start,
            "accumulation_displacement": burst.x,
            "duration": end - burst.onset,
        }
        for name, value in expected.items():
            got = found[f"burst_{name}"][k]
            assert got == pytest.approx(value, abs=1e-10, nan_ok=True), (k, name)
        if not math.isnan(burst.release):
            assert found["burst_sticking_time"][k] == pytest.approx(burst.release - burst.stick)
        elif not burst.complete:
            assert math.isnan(found["burst_sticking_time"][k])
    for name, array in found.items():
        if name.startswith("burst_"):
            assert np.isnan(array[len(bursts) :]).all(), name


def test_release_after_the_end_of_the_record_is_not_known() -> None:
    """`burst_sticking_time` is the time from sticking to release, so a cut one is no number."""
    late = [
        run
        for shift in range(40)
        if (run := Scene({**SLOW, "restitution": 0.3, "phase": 0.15 * shift}, 2, 3))
        and (last := [b for b in all_bursts(run.rows()) if b.ended][-1]).complete
        and math.isnan(last.release)
    ]
    assert late
    for run in late:
        found = observed(run, records=40)
        bursts = [b for b in all_bursts(run.rows()) if b.onset >= run.start and b.ended]
        assert math.isnan(found["burst_sticking_time"][len(bursts) - 1])


# --- the edges of the record


def scene_with_end_in_a_burst(restitution: float) -> Scene:
    """Scene whose record is cut between the impacts of a burst with the largest count."""
    for shift in range(200):
        run = Scene({**PAPER_A, "restitution": restitution, "phase": 0.03 * shift}, 30, 2)
        last = all_bursts(run.rows())[-1]
        if not last.ended and last.visible(restitution, 0.03) >= 5:
            return run
    raise AssertionError("no such scene")


COMPLETE = {"restitution": 0.3}
INCOMPLETE = {"restitution": 0.5, "damping_ratio": 0.1, "frequency_ratio": 1.0, "clearance": 5.0}


@pytest.mark.parametrize("change", [COMPLETE, INCOMPLETE], ids=["complete", "incomplete"])
def test_the_rate_of_a_periodic_motion_is_exact(change: dict[str, float]) -> None:
    """One burst on each wall in a period, wherever the record begins and however short it is."""
    for phase, periods in itertools.product(np.arange(0.0, 6.3, 0.9), (1, 5, 30)):
        found = observed(Scene({**STUDY, **change, "phase": phase}, 60, periods))
        assert found["bursts_per_period"] == 2.0, (phase, periods)


def test_burst_cut_by_the_end_has_no_known_end() -> None:
    run = scene_with_end_in_a_burst(0.8)
    begun = [b for b in all_bursts(run.rows()) if b.onset >= run.start]
    found = observed(run, records=50)
    assert found["bursts_per_period"] * run.periods == len(begun)
    assert np.isfinite(found["burst_onset"]).sum() == len(begun) - 1
    assert_summary(found, burst_summary(run, fraction=0.03))


def test_cut_burst_alone_is_chatter_of_unknown_end() -> None:
    """A record that holds nothing but the beginning of a burst longer than the forcing period."""
    parameters = {
        "mass_ratio": 0.1,
        "damping_ratio": 0.02,
        "frequency_ratio": 8.0,
        "clearance": 0.5,
        "restitution": 0.9,
    }
    # On the left wall, which pushes: the primary swings back freely from x = -5.
    state = State(-5.0, 0.0, -5.5, -0.3)
    cut, whole = Scene(parameters, 0, 1, state), Scene(parameters, 0, 2, state)
    rows = cut.rows()
    assert set(rows["kind"].tolist()) == {0}
    assert set(rows["side"].tolist()) == {-1}
    found = observed(cut, records=2)
    assert found["bursts_per_period"] == 1.0
    assert math.isnan(found["complete_fraction"])
    assert found["visible_impacts"] == all_bursts(rows)[0].visible(0.9, 0.03) >= 5
    assert found["chatter"] == 1
    assert np.isnan(found["burst_onset"]).all()
    assert observed(whole)["chatter"] == 2
    assert observed(whole)["complete_fraction"] == 1.0


def test_burst_under_way_at_the_start_is_skipped() -> None:
    """Starts within bursts: neither the burst's rest nor its sticking counts as a burst."""
    tried = 0
    for shift in range(20):
        run = Scene({**PAPER_A, "phase": 0.1 * shift}, 30, 2)
        under_way = [
            b
            for b in all_bursts(run.rows())
            if b.onset < run.start < (b.stick if b.complete else b.times[-1])
        ]
        if not under_way or not under_way[0].complete:
            continue
        tried += 1
        found = observed(run, records=50)
        assert found["burst_onset"][0] >= 0.0
        assert_summary(found, burst_summary(run, fraction=0.03))
    assert tried >= 3


@pytest.mark.parametrize(
    ("frequency_ratio", "clearance", "wall"), [(0.95, 4.0, -1), (1.05, 5.0, 1)]
)
def test_first_contact_of_the_run_begins_a_burst(
    frequency_ratio: float, clearance: float, wall: int
) -> None:
    """A transient without any contact leaves no burst under way."""
    p = {**STUDY, "frequency_ratio": frequency_ratio, "clearance": clearance}
    first = Scene(p, 0, 5).rows()[0]
    run = Scene(p, int(first["time"] // Scene(p, 0, 1).period), 8)
    assert run.transient > 0
    assert first["side"] == wall
    found = observed(run, records=1)
    assert found["burst_onset"][0] == pytest.approx(first["time"] - run.start)
    assert_summary(found, burst_summary(run, fraction=0.03))


def test_long_flight_after_a_release_is_no_burst_under_way() -> None:
    """The record starts late in a flight that a release began and that ends on the same wall."""
    p = {
        "mass_ratio": 0.1,
        "damping_ratio": 0.05,
        "frequency_ratio": 0.02,
        "clearance": 0.9,
        "restitution": 0.0,
        "phase": 3.2,
    }
    run = Scene(p, 2, 1)
    rows = run.rows()
    k = int(np.searchsorted(rows["time"], run.start))
    assert rows["kind"][k - 1 : k + 1].tolist() == [2, 0]
    assert rows["side"][k - 1] == rows["side"][k]
    assert run.start - rows["time"][k - 1] > 25.0
    found = observed(run, records=1)
    assert found["burst_onset"][0] == pytest.approx(rows["time"][k] - run.start)
    assert_summary(found, burst_summary(run, fraction=0.03))


# --- visibility


@pytest.mark.parametrize("accuracy", [1e-3, 1e-6])
def test_impacts_inside_the_closed_tail_count(accuracy: float) -> None:
    """A coarse accuracy closes the burst while its impacts can still be seen."""
    inside = 0
    for r, fraction in itertools.product((0.3, 0.7), (0.03, 1e-5, 1e-9)):
        run = Scene({**STUDY, "restitution": r}, 20, 6, accuracy=accuracy)
        found = observed(run, threshold=fraction, records=40)
        bursts = [b for b in all_bursts(run.rows()) if b.onset >= run.start and b.ended]
        for k, burst in enumerate(bursts[:40]):
            limit = fraction * burst.speeds[0]
            assert found["burst_visible_impacts"][k] == burst.visible(r, fraction)
            inside += sum(speed >= limit for speed in burst.tail(r))
        assert_summary(found, burst_summary(run, fraction=fraction))
    assert inside > 50


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
            got = observed(run, threshold=fraction, records=20)
            first = np.flatnonzero(got["burst_complete"] == 1.0)[0]
            assert got["burst_visible_impacts"][first] == expected, (fraction, accuracy)


def test_compared_thresholds_are_those_of_runs_of_their_own() -> None:
    fractions = [0.1, 0.003, 0.03]
    seen = set()
    for r in (0.3, 0.45, 0.6, 0.9):
        run = Scene({**STUDY, "restitution": r}, 30, 10)
        found = observed(run, threshold={"speed": 0.05}, compare_thresholds=fractions)
        assert_summary(found, burst_summary(run, speed=0.05))
        for k, fraction in enumerate(fractions):
            expected = burst_summary(run, fraction=fraction)
            assert found["visible_impacts_by_threshold"][k] == expected["visible_impacts"]
            assert found["chatter_by_threshold"][k] == expected["chatter"]
            seen.add(expected["chatter"])
    assert seen == {0, 1, 2}


def test_threshold_dimension_has_the_fractions_as_coordinate() -> None:
    _, (observer,) = run_points(
        [STUDY], {"bursts": {"compare_thresholds": [0.1, 0.01]}}, transient=0, periods=1
    )
    np.testing.assert_array_equal(observer.coordinates()["threshold"], [0.1, 0.01])
    _, (plain,) = run_points([STUDY], ["bursts"], transient=0, periods=1)
    assert plain.coordinates() == {}


# --- refusals and stops

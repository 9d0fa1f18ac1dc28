"""Errors of solutions made by hand, whose errors are known."""

from dataclasses import replace
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from scenes import SLOW

from damper.verification.comparison import errors
from damper.verification.comparison.scene import read_scene
from damper.verification.comparison.solution import FAILED, STALLED, Solution

SCENE = read_scene(SLOW | {"frequency_ratio": 1.0, "restitution": 0.1}, 20.0)
#: Left, right, then a complete burst on the right whose speeds fall by 10 each, stick at 6,
#: release at 7, left, a grazing impact on the right.
TIMES = np.array([1.0, 3.0, 5.0, 5.9, 5.99, 5.999, 5.9999, 5.99999, 9.0, 12.0])
SIDES = np.array([-1, 1, 1, 1, 1, 1, 1, 1, -1, 1])
SPEEDS = np.array([1.0, 0.9, 0.8, 0.1, 1e-2, 1e-3, 1e-4, 1e-5, 0.5, 1e-9])
REFERENCE: Any = SimpleNamespace(
    impact_times=TIMES,
    impact_sides=SIDES,
    approach_speeds=SPEEDS,
    stick_times=np.array([6.0]),
    release_times=np.array([7.0]),
    final_state=np.array([1.0, 2.0, 3.0, 4.0]),
)
#: 3.0 belongs to the burst as well: the same wall, nothing in between. So the floor is 9e-3.
COUNTED = 7
NOTHING_WRONG = {
    "impact_time_error": 0.0,
    "accumulation_error": 0.0,
    "release_error": 0.0,
    "state_error": 0.0,
    "penetration": 1e-9,
    "missed_impacts": 0.0,
    "extra_impacts": 0.0,
    "missed_sticks": 0.0,
    "extra_sticks": 0.0,
    "missed_releases": 0.0,
    "evaluations": 77.0,
}


def solution(keep: Any = slice(None), **changes: Any) -> Solution:
    """The reference's own events, or some of them, with changes."""
    same = Solution(
        impact_times=TIMES[keep],
        impact_sides=SIDES[keep],
        approach_speeds=SPEEDS[keep],
        stick_times=REFERENCE.stick_times,
        release_times=REFERENCE.release_times,
        end_state=np.array([1.0, 2.0, 3.0, 4.0]),
        penetration=1e-9,
        evaluations=77,
        reached=20.0,
    )
    return replace(same, **changes)


def check(given: Solution, **expected: float) -> None:
    found = errors.measure_errors(SCENE, REFERENCE, given)
    assert list(found) == list(errors.MEASURES)
    assert all(type(value) is float for value in found.values())
    assert found == pytest.approx(NOTHING_WRONG | expected, nan_ok=True, rel=1e-9, abs=1e-15)


def without(*lost: int) -> np.ndarray:
    return np.setdiff1d(np.arange(len(TIMES)), lost)


def moved(values: np.ndarray, changes: dict[int, float]) -> np.ndarray:
    """The same, but for some of them."""
    values = values.copy()
    values[list(changes)] = list(changes.values())
    return values


TWICE = np.insert(np.arange(10), 8, 8)
NEVER: dict[str, Any] = {"stick_times": np.empty(0), "release_times": np.empty(0)}
MISSED: dict[str, float] = {"accumulation_error": np.nan, "release_error": np.nan}
#: What is solved -> its errors.
KNOWN: dict[str, tuple[Solution, dict[str, float]]] = {
    "the reference itself": (solution(), {}),
    "the largest shift": (
        solution(impact_times=moved(TIMES, {0: 1.001, 1: 2.998, 8: 9.0015})),
        {"impact_time_error": 2e-3},
    ),
    "below the floor, shifted": (solution(impact_times=moved(TIMES, {6: TIMES[6] + 3e-5})), {}),
    "below the floor, missed": (solution(without(6, 7)), {}),
    "one missed": (solution(without(1)), {"missed_impacts": 1.0}),
    # However slow: it is in no complete burst.
    "a slow one missed": (solution(without(9)), {"missed_impacts": 1.0}),
    "one doubled": (
        solution(TWICE, impact_times=moved(TIMES[TWICE], {8: 9.01})),
        {"extra_impacts": 1.0},
    ),
    # The nearer one is the partner.
    "one doubled, off": (
        solution(TWICE, impact_times=moved(TIMES[TWICE], {8: 9.01, 9: 9.02})),
        {"extra_impacts": 1.0, "impact_time_error": 1e-2},
    ),
    "the wrong wall": (
        solution(impact_sides=np.where(np.arange(10) == 8, 1, SIDES)),
        {"missed_impacts": 1.0, "extra_impacts": 1.0},
    ),
    # What a burst that is closed early leaves out is unresolved; a gap in it is missed.
    "a burst closed early": (solution(without(4, 5, 6, 7)), {}),
    "a burst closed at once": (solution(without(3, 4, 5, 6, 7)), {}),
    "a gap in a burst": (solution(without(3, 5, 6, 7)), {"missed_impacts": 1.0}),
    "a burst that is not closed": (
        solution(without(3, 4, 5, 6, 7), **NEVER),
        {"missed_impacts": 2.0, "missed_sticks": 1.0, "missed_releases": 1.0} | MISSED,
    ),
    # By its speed it is the one at 5.9, by its time the one at 5.99, which the stick leaves out.
    "one between two": (
        solution(without(4, 5, 6, 7), impact_times=moved(TIMES, {3: 5.99})[without(4, 5, 6, 7)]),
        {"impact_time_error": 0.09},
    ),
    # A hundredth of the period is 0.0628.
    **{
        f"sticking for {length}": (
            solution(stick_times=np.array([6.0, 9.0]), release_times=np.array([7.0, 9.0 + length])),
            {"extra_sticks": extra},
        )
        for length, extra in ((0.06, 0.0), (0.07, 1.0))
    },
    "what was not reached": (
        solution(
            slice(0, 8), **NEVER, end_state=np.full(4, np.nan), outcome=STALLED, reached=5.99999
        ),
        MISSED | {"state_error": np.nan},
    ),
}


@pytest.mark.parametrize("name", KNOWN)
def test_errors_of_what_is_known(name: str) -> None:
    given, expected = KNOWN[name]
    check(given, **expected)
    assert errors.counted_impacts(REFERENCE) == COUNTED


def test_slow_impacts_while_the_masses_stick_are_noise() -> None:
    more = np.insert(np.arange(10), 8, 7)
    times, speeds = TIMES[more].copy(), SPEEDS[more].copy()
    times[8], speeds[8] = 6.5, 8.9e-3
    check(solution(more, impact_times=times, approach_speeds=speeds))
    speeds[8] = 9.1e-3
    check(solution(more, impact_times=times, approach_speeds=speeds), extra_impacts=1.0)
    times[8], speeds[8] = 7.5, 8.9e-3
    check(solution(more, impact_times=times, approach_speeds=speeds), extra_impacts=1.0)


@pytest.mark.parametrize(("time", "side"), [(7.5, 1), (5.5, -1)])
def test_what_fits_by_speed_alone_is_extra(time: float, side: int) -> None:
    # After sticking, or on the other wall; the burst is closed after its second impact.
    keep = without(3, 4, 5, 6, 7)
    check(
        solution(
            impact_times=np.insert(TIMES[keep], 3, time),
            impact_sides=np.insert(SIDES[keep], 3, side),
            approach_speeds=np.insert(SPEEDS[keep], 3, 0.1),
        ),
        extra_impacts=1.0,
    )


def test_late_burst_is_matched_by_speed() -> None:
    # Later by more than half of the way to the next impact of the burst, but the same impacts.
    times = TIMES.copy()
    times[3:8] += 0.05
    check(
        solution(impact_times=times, stick_times=np.array([6.05])),
        impact_time_error=0.05,
        accumulation_error=0.05,
    )
    # By speeds that do not fit it is not.
    speeds = SPEEDS.copy()
    speeds[3:8] *= 0.3
    found = errors.measure_errors(
        SCENE, REFERENCE, solution(impact_times=times, approach_speeds=speeds)
    )
    assert found["extra_impacts"] == 1.0


def test_speeds_do_not_match_across_sticking() -> None:
    # The burst is closed after its second impact; the next one on that wall is another one,
    # however well its speed fits.
    speeds = SPEEDS.copy()
    speeds[9] = 0.1
    wanted = SimpleNamespace(**vars(REFERENCE) | {"approach_speeds": speeds})
    wanted.impact_sides = np.where(np.arange(10) == 8, 1, SIDES)
    keep = without(3, 4, 5, 6, 7, 8)
    closed = solution(keep, impact_sides=wanted.impact_sides[keep], approach_speeds=speeds[keep])
    found = errors.measure_errors(SCENE, wanted, closed)  # type: ignore[arg-type]
    assert found["missed_impacts"] == 1.0  # the one at 9
    assert found["impact_time_error"] == 0.0
    # Nor where no sticking was found, once times have matched it to a later one.
    never = replace(closed, stick_times=np.empty(0))
    found = errors.measure_errors(SCENE, wanted, never)  # type: ignore[arg-type]
    assert found["impact_time_error"] == 0.0
    assert found["missed_impacts"] == 3.0


def test_plastic_impact_is_a_burst_of_one() -> None:
    plastic = SimpleNamespace(
        impact_times=np.array([2.0]),
        impact_sides=np.array([1]),
        approach_speeds=np.array([0.5]),
        stick_times=np.array([2.0]),
        release_times=np.array([3.0]),
        final_state=np.zeros(4),
    )
    assert errors.counted_impacts(plastic) == 1  # type: ignore[arg-type]
    found = errors.measure_errors(
        SCENE,
        plastic,  # type: ignore[arg-type]
        Solution(
            impact_times=np.array([2.0 + 1e-6]),
            impact_sides=np.array([1]),
            approach_speeds=np.array([0.5]),
            stick_times=np.array([2.0 - 1e-6]),
            release_times=np.array([3.0]),
            reached=20.0,
        ),
    )
    assert found["impact_time_error"] == pytest.approx(1e-6)
    assert found["accumulation_error"] == pytest.approx(1e-6)
    assert found["missed_impacts"] == found["extra_impacts"] == found["missed_sticks"] == 0.0
    # The only event of its kind is looked for half a period about it, no further.
    far = Solution(
        impact_times=np.array([2.0 + 3.2]),
        impact_sides=np.array([1]),
        approach_speeds=np.array([0.5]),
        reached=20.0,
    )
    found = errors.measure_errors(SCENE, plastic, far)  # type: ignore[arg-type]
    assert found["missed_impacts"] == found["extra_impacts"] == 1.0


def test_outcomes() -> None:
    good = solution()
    stalled = solution(outcome=STALLED)
    nothing = dict(NOTHING_WRONG)
    assert errors.outcome(SCENE, good, nothing) == "good"
    assert len(errors.MISSES) == 5
    for name in errors.MISSES:
        assert errors.outcome(SCENE, good, nothing | {name: 1.0}) == "missed"
    outside = nothing | {"penetration": 0.0026}
    assert errors.outcome(SCENE, good, nothing | {"penetration": 0.0024}) == "good"
    assert errors.outcome(SCENE, good, outside | {"missed_impacts": 3.0}) == "left_box"
    assert errors.outcome(SCENE, stalled, outside) == "stalled"
    assert errors.outcome(SCENE, good, outside | {"state_error": np.nan}) == FAILED

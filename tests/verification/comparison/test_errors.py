"""Errors of solutions made by hand, whose errors are known."""

from dataclasses import replace
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from scenes import SLOW

from damper.verification.comparison import errors
from damper.verification.comparison.solvers import Solution, read_scene

SCENE = read_scene(SLOW | {"frequency_ratio": 1.0, "restitution": 0.1}, 20.0)
#: Left, right, then a complete burst on the right whose speeds fall by 10 each, stick at 6,
#: release at 7, left, a grazing impact on the right.
TIMES = np.array([1.0, 3.0, 5.0, 5.9, 5.99, 5.999, 5.9999, 5.99999, 9.0, 12.0])
SIDES = np.array([-1, 1, 1, 1, 1, 1, 1, 1, -1, 1])
SPEEDS = np.array([1.0, 0.9, 0.8, 0.1, 1e-2, 1e-3, 1e-4, 1e-5, 0.5, 1e-9])
FINAL = np.array([1.0, 2.0, 3.0, 4.0])
REFERENCE: Any = SimpleNamespace(
    impact_times=TIMES,
    impact_sides=SIDES,
    approach_speeds=SPEEDS,
    stick_times=np.array([6.0]),
    release_times=np.array([7.0]),
    final_state=FINAL,
)
#: 3.0 belongs to the burst as well: the same wall, nothing in between. So the floor is 9e-3.
COUNTED = 7
NEVER: dict[str, Any] = {"stick_times": np.empty(0), "release_times": np.empty(0)}


def solution(lost: tuple[int, ...] = (), **changes: Any) -> Solution:
    """The reference's own events without some impacts, with changes."""
    keep = np.setdiff1d(np.arange(len(TIMES)), lost)
    same = Solution(
        impact_times=TIMES[keep],
        impact_sides=SIDES[keep],
        approach_speeds=SPEEDS[keep],
        stick_times=REFERENCE.stick_times,
        release_times=REFERENCE.release_times,
        end_state=FINAL,
        penetration=1e-9,
        evaluations=77,
        reached=20.0,
    )
    return replace(same, **changes)


def moved(**changes: float) -> np.ndarray:
    """Times of all impacts, some of them by name ("_8") at another time."""
    times = TIMES.copy()
    for name, time in changes.items():
        times[int(name[1:])] = time
    return times


#: A good solution -> its errors that are not 0.
GOOD: dict[str, tuple[Solution, dict[str, float]]] = {
    "the reference itself": (solution(), {}),
    "the largest shift": (
        solution(impact_times=moved(_0=1.001, _1=2.998, _8=9.0015)),
        {"impact_time_error": 2e-3},
    ),
    "below the floor, shifted": (solution(impact_times=moved(_6=TIMES[6] + 3e-5)), {}),
    "below the floor, missed": (solution((6, 7)), {}),
    "a burst closed early": (solution((4, 5, 6, 7)), {}),
    "a burst closed at once": (solution((2, 3, 4, 5, 6, 7)), {}),
    "a late burst": (
        solution(
            impact_times=TIMES + 0.05 * ((TIMES > 5.5) & (TIMES < 6)), stick_times=np.array([6.05])
        ),
        {"impact_time_error": 0.05, "accumulation_error": 0.05},
    ),
    "a late release": (solution(release_times=np.array([7.25])), {"release_error": 0.25}),
    "another end": (solution(end_state=np.add(FINAL, [0, 0.5, 0, -0.25])), {"state_error": 0.5}),
}


@pytest.mark.parametrize("name", GOOD)
def test_errors_of_what_is_known(name: str) -> None:
    given, expected = GOOD[name]
    outcome, found = errors.measure_errors(SCENE, REFERENCE, given)
    assert outcome == "good"
    assert list(found) == [variable.name for variable in errors.MEASURES]
    right = dict.fromkeys(found, 0.0) | {"penetration": 1e-9, "evaluations": 77.0} | expected
    assert found == pytest.approx(right, rel=1e-9, abs=1e-15)
    assert errors.counted_impacts(REFERENCE) == COUNTED


OTHERS: dict[str, Solution] = {
    "one missed": solution((0,)),
    "a slow one missed": solution((9,)),  # however slow: it is in no complete burst
    "the wrong wall": solution(impact_sides=np.where(np.arange(10) == 8, 1, SIDES)),
    "all of a burst missed": solution((1, 2, 3, 4, 5, 6, 7)),
    "one doubled": solution(
        impact_times=np.insert(TIMES, 8, 9.01),
        impact_sides=np.insert(SIDES, 8, -1),
        approach_speeds=np.insert(SPEEDS, 8, 0.5),
    ),
    "the other wall within a burst": solution(
        impact_times=np.insert(TIMES, 8, 5.999999),
        impact_sides=np.insert(SIDES, 8, -1),
        approach_speeds=np.insert(SPEEDS, 8, 0.5),
    ),
    "no sticking": solution(**NEVER),
    "no release": solution(release_times=np.empty(0)),
    "sticking twice": solution(stick_times=np.array([6.0, 9.0])),
}


@pytest.mark.parametrize("name", OTHERS)
def test_other_events_are_missed_events(name: str) -> None:
    outcome, found = errors.measure_errors(SCENE, REFERENCE, OTHERS[name])
    assert outcome == "missed"
    assert np.isnan(
        [found[f"{of}_error"] for of in ("impact_time", "accumulation", "release")]
    ).all()

"""Scores of made-up cubes whose answers are known by hand."""

import math
from typing import Any

import numpy as np
import pytest
import xarray as xr

from damper.papers.base import Tolerances
from damper.papers.ranges import Range, range_of
from damper.papers.statements import SCORES

EXACT = Tolerances(onset=2.0, duration=0.5, ratio=0.1)
FREQUENCIES = [0.2, 0.25, 0.3]


def value(name: str, cube: xr.Dataset) -> list[float]:
    """Scores of the sets, which lie along one axis."""
    found = SCORES[name].measure(cube, EXACT).score
    assert ((found >= 0.0) & (found <= 1.0)).all()
    return found.values.ravel().tolist()


def bursts_at(onset: float, duration: float, complete: int) -> xr.Dataset:
    """Cube of one set whose burst at the lowest frequency is given; the others' are far off."""
    dims = ("clearance", "frequency_ratio")
    return xr.Dataset(
        {
            "burst_at_onset": (dims, [[onset, 0.0, 0.0]]),
            "burst_at_duration": (dims, [[duration, 0.0, 0.0]]),
            "burst_at_complete": (dims, np.array([[complete, 1, 1]], dtype="i1")),
        },
        {"clearance": [0.03], "frequency_ratio": FREQUENCIES},
    )


@pytest.mark.parametrize(
    ("onset", "duration", "expected"),
    [
        (332.0, 11.0, 1.0),
        (334.0, 11.0, 0.5),
        (330.0, 11.0, 0.5),
        (332.0, 10.5, 0.5),
        (334.0, 11.5, 0.25),
        (332.0 + math.sqrt(2.0), 11.0 - math.sqrt(0.125), 0.5),
        (336.0, 11.0, 2.0**-4),
    ],
)
def test_a3_halves_at_its_tolerances(onset: float, duration: float, expected: float) -> None:
    assert value("A3", bursts_at(onset, duration, 1)) == pytest.approx([expected])
    assert value("A3", bursts_at(onset, duration, 0)) == [0.0]


def counted(
    chatter: Any, complete: Any, sticking: Any, duration: Any, onset: float = 100.0
) -> xr.Dataset:
    """Cube of one set: counts and durations of [whole, late] at each of the frequencies."""
    dims = ("clearance", "frequency_ratio", "since")

    def along(values: Any) -> tuple[tuple[str, ...], np.ndarray]:
        return dims, np.array([values])

    return xr.Dataset(
        {
            "chatter_bursts": along(chatter),
            "chatter_complete": along(complete),
            "sticking_bursts": along(sticking),
            "chatter_duration": along(duration),
            "chatter_onset": (dims, np.full((1, 3, 2), onset)),
        },
        {"clearance": [0.03], "frequency_ratio": FREQUENCIES, "since": [0.0, 15.0]},
    )


NAN = math.nan
STEADY = {
    "chatter": [[40, 20], [40, 20], [40, 20]],
    "complete": [[30, 20], [30, 20], [2, 0]],
    "sticking": [[30, 20], [30, 20], [2, 0]],
    "duration": [[7.0, 10.0], [7.0, 10.0], [3.0, NAN]],
}


#: What is counted instead -> the scores. Of 40 bursts with sticking since the start 38 are
#: incomplete chatter; the burst of A7 begins at 100 of 332.
COUNTED: list[tuple[dict[str, Any], dict[str, float]]] = [
    ({}, {"A4": 1.0, "A5": 1.0, "A5_record": 38 / 40, "A7": 100 / 332}),
    *(
        ({"duration": [[7.0, 10.0], [7.0, 10.0 * ratio], [3.0, NAN]]}, {"A4": 0.5})
        for ratio in (0.9, 1.1)
    ),
    ({"complete": [[30, 20]] * 3, "sticking": [[30, 20]] * 3}, {"A5": 0.0}),
    ({"chatter": [[40, 20], [40, 20], [9, 0]]}, {"A5": 0.0}),
    # Bursts of fewer impacts than make chatter stick as well.
    ({"sticking": [[30, 20], [30, 20], [25, 20]]}, {"A5": 0.5}),
    *(({"onset": first}, {"A7": part}) for first, part in ((332, 1), (400, 1), (83, 0.25))),
    # Of runs that stopped.
    (
        {name: [[-1, -1]] * 3 for name in ("chatter", "complete", "sticking")}
        | {"duration": [[NAN, NAN]] * 3, "onset": NAN},
        dict.fromkeys(("A4", "A5", "A5_record", "A7"), 0.0),
    ),
]


@pytest.mark.parametrize(("changed", "scores"), COUNTED, ids=str)
def test_scores_of_counts(changed: dict[str, Any], scores: dict[str, float]) -> None:
    found = {name: value(name, counted(**STEADY | changed)) for name in scores}
    assert found == {name: pytest.approx([score]) for name, score in scores.items()}


# --- A1


def over_clearance(chatter: list[int], impacts: list[float] | None = None) -> xr.Dataset:
    clearance = [0.0, 0.5, 1.0, 1.35, 1.4, 2.0]
    return xr.Dataset(
        {
            "chatter": (("restitution", "clearance"), np.array([chatter], dtype="i1")),
            "impacts_per_period": (("restitution", "clearance"), [impacts or [2.0] * 6]),
        },
        {"restitution": [0.6], "clearance": clearance},
    )


@pytest.mark.parametrize(
    ("chatter", "expected"),
    [
        ([0, 2, 1, 1, 0, 0], 1.0),
        ([1, 2, 1, 1, 0, 0], 1.0),  # without clearance nothing is said
        ([0, 0, 1, 1, 0, 0], 2 / 3),
        ([0, 2, 2, 2, 1, 0], 0.5),
        ([0, 0, 1, 1, 1, 0], 2 / 3 * 0.5),
        ([0, 0, 0, 0, 0, 0], 0.0),
        ([0, 2, 2, 2, 2, 2], 0.0),
    ],
)
def test_a1_is_the_product_of_both_parts(chatter: list[int], expected: float) -> None:
    assert value("A1", over_clearance(chatter)) == pytest.approx([expected])
    assert value("A1_contact", over_clearance(chatter)) == pytest.approx([expected])


# --- B1 to B3

R = [0.4, 0.5, 0.6, 0.7, 0.8, 0.9, 1.0]


def over_restitution(ends: dict[tuple[float, float], tuple[float, float]]) -> xr.Dataset:
    """Cube of one set; (mass ratio, frequency ratio) -> the interval of complete chatter."""
    masses = sorted({mu for mu, _ in ends}, reverse=True)
    frequencies = sorted({omega for _, omega in ends})
    chatter = np.zeros((1, len(masses), len(frequencies), len(R)), dtype="i1")
    for (mu, omega), (low, high) in ends.items():
        inside = [2 if low <= r <= high else 0 for r in R]
        chatter[0, masses.index(mu), frequencies.index(omega)] = inside
    dims = ("clearance", "mass_ratio", "frequency_ratio", "restitution")
    coords = {
        "clearance": [0.05],
        "mass_ratio": masses,
        "frequency_ratio": frequencies,
        "restitution": R,
    }
    return xr.Dataset({"chatter": (dims, chatter)}, coords)


def complete(name: str, cube: xr.Dataset, resonance: str = "above") -> float:
    found = SCORES[name].measure(cube, EXACT).score
    return float(found.sel(counted="complete", resonance=resonance).item())


#: Wider for smaller masses, narrower for higher frequencies.
AS_STATED = {
    (0.1, 1.2): (0.5, 0.8),
    (0.1, 1.5): (0.5, 0.7),
    (0.2, 1.2): (0.5, 0.7),
    (0.2, 1.5): (0.5, 0.6),
}


NONE = (2.0, 2.0)
MIRRORED = {(round(0.3 - m, 1), round(2.7 - w, 1)): ends for (m, w), ends in AS_STATED.items()}
BELOW = {(m, round(2.0 - w, 1)): ends for (m, w), ends in AS_STATED.items()}


@pytest.mark.parametrize(
    ("ends", "b2", "b3"),
    [
        (AS_STATED, 1.0, 1.0),
        (MIRRORED, 0.0, 0.0),
        # Of two steps in the mass one goes as stated and one stays.
        (AS_STATED | {(0.1, 1.5): (0.5, 0.6)}, 0.5, 1.0),
        # Steps where nothing chatters do not count.
        (AS_STATED | {(mu, omega): NONE for mu in (0.1, 0.2) for omega in (1.8, 1.9)}, 1.0, 1.0),
        (AS_STATED | BELOW, 1.0, 1.0),
    ],
)
def test_b_counts_the_steps_that_go_as_stated(ends: dict, b2: float, b3: float) -> None:
    cube = over_restitution(ends)
    assert (complete("B2", cube), complete("B3", cube)) == (b2, b3)


def test_every_statement_has_a_score() -> None:
    cubes = {"A1": over_clearance([0, 2, 1, 1, 0, 0]), "A3": bursts_at(332.0, 11.0, 1)}
    for name in SCORES:
        cube = cubes.get(name.removesuffix("_contact")) or (
            over_restitution(AS_STATED) if name[0] == "B" else counted(**STEADY)
        )
        found = SCORES[name].measure(cube, EXACT)
        assert not set(found.score.dims) & set(SCORES[name].axes), name


def test_a_range_is_the_hull_of_runs_of_three() -> None:
    """Its length counts single values, too."""
    holds = np.array([1, 1, 0, 1, 1, 1, 0, 0, 1, 0], dtype=bool)
    found = range_of(np.arange(10.0), holds)
    assert found == Range(low=3.0, high=5.0, length=6.0, span=3.0)
    assert math.isnan(range_of(np.arange(2.0), holds[:2]).low)

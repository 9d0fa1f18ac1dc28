"""Scores of made-up cubes whose answers are known by hand."""

import math
from typing import Any

import numpy as np
import pytest
import xarray as xr

from damper.papers.base import Tolerances
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


def test_as_stated() -> None:
    cube = counted(**STEADY)
    assert value("A4", cube) == value("A5", cube) == [1.0]
    # Of the 38 incomplete chatters and 2 stickings since the start.
    assert value("A5_record", cube) == pytest.approx([38 / 40])
    assert value("A7", cube) == pytest.approx([100 / 332])


@pytest.mark.parametrize("ratio", [0.9, 1.1])
def test_a4_halves_at_its_tolerance(ratio: float) -> None:
    duration = [[7.0, 10.0], [7.0, 10.0 * ratio], [3.0, NAN]]
    assert value("A4", counted(**STEADY | {"duration": duration})) == pytest.approx([0.5])


@pytest.mark.parametrize("frequency", [0, 1])
@pytest.mark.parametrize("chatter", [0, 20])
def test_a4_is_zero_without_complete_chatter(frequency: int, chatter: int) -> None:
    changed = {key: [list(row) for row in STEADY[key]] for key in STEADY}
    changed["chatter"][frequency][1] = chatter
    changed["complete"][frequency][1] = 0
    changed["duration"][frequency][1] = NAN
    assert value("A4", counted(**changed)) == [0.0]


def test_a5_is_zero_where_all_sticks_or_nothing_chatters() -> None:
    everything = {"complete": [[30, 20]] * 3, "sticking": [[30, 20]] * 3}
    assert value("A5", counted(**STEADY | everything)) == [0.0]
    nothing = {"chatter": [[40, 20], [40, 20], [9, 0]]}
    assert value("A5", counted(**STEADY | nothing)) == [0.0]


def test_a5_is_spoilt_by_sticking_without_chatter() -> None:
    """Bursts of fewer impacts than make chatter stick as well."""
    sticking = [[30, 20], [30, 20], [25, 20]]
    assert value("A5", counted(**STEADY | {"sticking": sticking})) == pytest.approx([0.5])


@pytest.mark.parametrize(("first", "expected"), [(332.0, 1.0), (400.0, 1.0), (83.0, 0.25)])
def test_a7_is_the_part_of_the_time_before_chatter(first: float, expected: float) -> None:
    assert value("A7", counted(**STEADY, onset=first)) == [expected]


def test_stopped_runs_speak_for_nothing() -> None:
    missing = {
        "chatter": [[-1, -1]] * 3,
        "complete": [[-1, -1]] * 3,
        "sticking": [[-1, -1]] * 3,
        "duration": [[NAN, NAN]] * 3,
    }
    for name in ("A4", "A5", "A5_record", "A7"):
        assert value(name, counted(**missing, onset=NAN)) == [0.0]


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


def test_a1_beyond_the_last_contact_is_trivial() -> None:
    cube = over_clearance([0, 2, 1, 1, 0, 0], [9.0, 9.0, 9.0, 9.0, 2.0, 0.0])
    assert value("A1", cube) == [1.0]
    assert value("A1_contact", cube) == [0.5]


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


def test_b_as_stated() -> None:
    cube = over_restitution(AS_STATED)
    assert complete("B2", cube) == complete("B3", cube) == 1.0
    # .5 to .8 of the values .5 to .9.
    assert complete("B1", cube) == pytest.approx(4 / 5)
    measured = SCORES["B1"].measure(cube, EXACT).measured
    ends = [float(array.sel(counted="complete").squeeze()) for array in measured.values()]
    assert ends == [0.5, 0.8]


def test_b_reversed_is_zero() -> None:
    swapped = {(0.3 - mu, 2.7 - omega): ends for (mu, omega), ends in AS_STATED.items()}
    cube = over_restitution({(round(m, 1), round(w, 1)): e for (m, w), e in swapped.items()})
    assert complete("B2", cube) == complete("B3", cube) == 0.0


def test_b_counts_the_steps() -> None:
    """Of two steps in the mass one goes as stated and one stays."""
    cube = over_restitution(AS_STATED | {(0.1, 1.5): (0.5, 0.6)})
    assert complete("B2", cube) == 0.5
    assert complete("B3", cube) == 1.0


def test_b_leaves_out_steps_where_nothing_chatters() -> None:
    cube = over_restitution(AS_STATED | {(0.1, 1.8): (2.0, 2.0), (0.2, 1.8): (2.0, 2.0)})
    assert complete("B2", cube) == 1.0
    empty = {(mu, omega): (2.0, 2.0) for mu in (0.1, 0.2) for omega in (1.8, 1.9)}
    assert complete("B3", over_restitution(AS_STATED | empty)) == 1.0


def test_b_without_chatter_is_zero() -> None:
    cube = over_restitution(dict.fromkeys(AS_STATED, (2.0, 2.0)))
    for name in ("B1", "B2", "B3"):
        assert complete(name, cube) == 0.0


def test_b_looks_at_one_side_of_the_resonance_at_a_time() -> None:
    below = {(mu, 2.0 - omega): ends for (mu, omega), ends in AS_STATED.items()}
    cube = over_restitution(AS_STATED | {(m, round(w, 1)): e for (m, w), e in below.items()})
    assert complete("B3", cube, "above") == 1.0
    assert complete("B3", cube, "below") == 0.0
    assert complete("B2", cube, "below") == complete("B2", cube, "above") == 1.0
    assert SCORES["B3"].measure(cube, EXACT).score.resonance.values.tolist() == ["below", "above"]


def test_b_needs_two_frequencies_on_a_side() -> None:
    cube = over_restitution({(0.1, 0.8): (0.5, 0.8), (0.2, 1.2): (0.5, 0.8)})
    with pytest.raises(ValueError, match="two values or more on one side of 1"):
        SCORES["B2"].measure(cube, EXACT)


def test_every_statement_has_a_score() -> None:
    cubes = {"A1": over_clearance([0, 2, 1, 1, 0, 0]), "A3": bursts_at(332.0, 11.0, 1)}
    for name in SCORES:
        cube = cubes.get(name.removesuffix("_contact")) or (
            over_restitution(AS_STATED) if name[0] == "B" else counted(**STEADY)
        )
        found = SCORES[name].measure(cube, EXACT)
        assert not set(found.score.dims) & set(SCORES[name].axes), name

"""Single bursts, chatter and sticking, against the event list of the same run."""

import math
from typing import Any

import numpy as np
import pytest
import xarray as xr

from damper import Parameters, events, simulate
from damper.analysis.stretches import (
    Burst,
    half_gap,
    listed_bursts,
    listed_until,
    rows_between,
    sticking,
)

COMPLETE = {
    "mass_ratio": 0.1,
    "damping_ratio": 0.05,
    "frequency_ratio": 0.2,
    "clearance": 0.25,
    "restitution": 0.6,
}
INCOMPLETE = {
    "mass_ratio": 0.2,
    "damping_ratio": 0.01,
    "frequency_ratio": 0.3,
    "clearance": 0.03,
    "restitution": 0.8,
}
#: Places with complete or incomplete chatter, both or none: the kinds (whether it
#: completes), and whether the masses stick in the sampled stretch.
SCENES = [
    (COMPLETE, {True}, True),
    (INCOMPLETE, {True, False}, False),
    *(
        (
            {
                "mass_ratio": 0.1,
                "damping_ratio": 0.02,
                "clearance": 0.05,
                "restitution": restitution,
                "frequency_ratio": omega,
            },
            kinds,
            sticks,
        )
        for restitution, omega, kinds, sticks in (
            (0.6, 1.5, {True, False}, True),
            (0.8, 1.1, {True, False}, True),
            (0.9, 1.1, {False}, False),
            (0.75, 1.5, {False}, False),
            (0.3, 1.5, set(), True),
            (0.9, 2.0, set(), False),
        )
    ),
]
PERIODS, START, LENGTH = 9, 1.25, 3
THRESHOLD = 0.03
IMPACT, STICK, RELEASE = 0, 1, 2


def transient(values: dict[str, float]) -> int:
    """Two of the scenes begin at rest."""
    return 0 if values in (COMPLETE, INCOMPLETE) else 5


def run(values: dict[str, float], records: int = 100, **trajectory: Any) -> xr.Dataset:
    return simulate(
        **values,
        transient=transient(values),
        periods=PERIODS,
        observers={"bursts": {"records": records}, "trajectory": trajectory},
    )


def from_events(values: dict[str, float]) -> list[dict[str, float]]:
    """Whole bursts within the record, grouped from the event list; times from its start."""
    period = 2.0 * math.pi / values["frequency_ratio"]
    zero = transient(values) * period
    done: list[dict[str, float]] = []
    impacts: list[Any] = []
    for row in events(Parameters(**values), until=zero + PERIODS * period):
        if row["kind"] == RELEASE and done:
            done[-1]["release"] = row["time"] - zero
        elif row["kind"] == STICK or (impacts and row["side"] != impacts[0]["side"]):
            if impacts:
                first, last = impacts[0], impacts[-1]
                speeds = np.array([impact["approach_speed"] for impact in impacts])
                complete = row["kind"] == STICK
                done.append(
                    {
                        "onset": first["time"] - zero,
                        "wall": first["side"],
                        "end": (row["time"] if complete else last["time"]) - zero,
                        "visible": (speeds >= THRESHOLD * speeds[0]).sum(),
                        "complete": complete,
                        "release": math.nan,
                    }
                )
            impacts = []
        if row["kind"] == IMPACT:
            impacts.append(row)
    return done


@pytest.mark.parametrize(("values", "kinds"), [scene[:2] for scene in SCENES])
def test_bursts_are_those_of_the_event_list(values: dict[str, float], kinds: set[bool]) -> None:
    expected = [row for row in from_events(values) if row["onset"] > 0.0]
    found = listed_bursts(run(values))
    assert len(found) == len(expected) > 5
    for burst, row in zip(found, expected, strict=True):
        assert burst.onset == pytest.approx(row["onset"], abs=1e-9)
        assert burst.end == pytest.approx(row["end"], abs=1e-9)
        assert burst.wall == row["wall"]
        assert burst.visible == row["visible"]
        assert burst.complete == row["complete"]
        assert burst.chatter == (row["visible"] >= 5)
        if burst.complete and not math.isnan(row["release"]):
            assert burst.release == pytest.approx(row["release"], abs=1e-9)
    assert {burst.complete for burst in found if burst.chatter} == kinds


def test_an_incomplete_burst_has_no_release_of_its_own() -> None:
    burst = Burst(2.0, -1, 3.0, 6, False, math.nan)
    assert burst.end == burst.release == 5.0


def test_times_count_from_the_start_of_the_record_wherever_sampling_starts() -> None:
    late, whole = run(COMPLETE, start=1.5), run(COMPLETE)
    np.testing.assert_array_equal(listed_bursts(whole), listed_bursts(late))
    period = 2 * math.pi / COMPLETE["frequency_ratio"]
    assert float(late.trajectory_start) == pytest.approx(1.5 * period, rel=1e-14)
    assert float(whole.trajectory_start) == 0.0
    # A sample of one is the same moment of the other.
    moment = float(late.trajectory_time[0] + late.trajectory_start)
    (row,) = np.flatnonzero(abs(whole.trajectory_time.values - moment) < 1e-9)
    assert late.trajectory_displacement[0] == whole.trajectory_displacement[row]


def test_a_full_list_ends_with_its_last_burst() -> None:
    assert listed_until(run(COMPLETE)) == math.inf
    few = run(COMPLETE, records=3)
    assert len(listed_bursts(few)) == 3
    assert listed_until(few) == listed_bursts(few)[-1].end


@pytest.mark.parametrize(("values", "sticks"), [scene[::2] for scene in SCENES])
def test_sticking_is_that_of_the_event_list(values: dict[str, float], sticks: bool) -> None:
    cube = run(values, start=START, length=LENGTH)
    known = np.isfinite(cube.trajectory_time.values)
    found = sticking(cube.trajectory_time.values[known], cube.trajectory_mode.values[known])
    period = 2.0 * math.pi / values["frequency_ratio"]
    zero, end = START * period, LENGTH * period
    stuck = [
        (row["end"] - zero, row["release"] - zero) for row in from_events(values) if row["complete"]
    ]
    inside = [(a, b) for a, b in stuck if b > 0.0 and a < end]
    # A sample is the first or last row of what the stretch cuts.
    step = period / 100
    assert len(found) == len(inside)
    for (a, b), (start, stop) in zip(found, inside, strict=True):
        assert a == pytest.approx(start, abs=1e-9) if start > 0.0 else 0.0 <= a <= step
        assert b == pytest.approx(stop, abs=1e-9) if stop < end else end - step <= b <= end + 1e-9
    assert bool(inside) is sticks


def test_sticking_at_both_ends() -> None:
    time = np.array([0.0, 1.0, 2.0, 3.0, 4.0])
    assert sticking(time, np.array([1, 1, 0, 0, 1])) == [(0.0, 2.0), (4.0, 4.0)]
    assert sticking(time, np.zeros(5)) == []


def test_half_gap_in_either_system() -> None:
    assert half_gap(xr.Dataset(coords={"clearance": 0.3})) == 0.3
    assert half_gap(xr.Dataset(coords={"gap": 0.3})) == 0.15


def test_rows_between() -> None:
    time = np.array([0.0, 0.5, 1.0, 1.5, np.nan])
    assert rows_between(time, 0.0, None) == slice(0, 4)
    assert rows_between(time, 0.7, 1.2) == slice(1, 4)
    assert rows_between(time, 0.5, 0.6) == slice(1, 3)
    with pytest.raises(ValueError, match=r"start = 1.5: the trajectory ends 1.5 forcing periods"):
        rows_between(time, 1.5, None)

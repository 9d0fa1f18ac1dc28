"""When a run chatters and sticks, against the event list."""

import math
from typing import Any

import numpy as np
import pytest
import xarray as xr

from damper import Parameters, events, simulate
from damper.study.chatter_spans import Burst, list_is_full, listed_bursts, sticking_spans

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
THRESHOLD = 0.03
IMPACT, STICK, RELEASE = 0, 1, 2


def run(values: dict[str, float], periods: int = 4, records: int = 100, **more: Any) -> xr.Dataset:
    observers = {"bursts": {"records": records}, "trajectory": more}
    return simulate(**values, transient=0, periods=periods, observers=observers)


def from_events(values: dict[str, float], until: float) -> list[dict[str, float]]:
    """Bursts that end before `until`, grouped from the event list."""
    done: list[dict[str, float]] = []
    impacts: list[Any] = []
    for row in events(Parameters(**values), until=until):
        if row["kind"] == RELEASE and done:
            done[-1]["release"] = row["time"]
        elif row["kind"] == STICK or (impacts and row["side"] != impacts[0]["side"]):
            if impacts:
                first, last = impacts[0], impacts[-1]
                speeds = np.array([impact["approach_speed"] for impact in impacts])
                complete = row["kind"] == STICK
                done.append(
                    {
                        "onset": first["time"],
                        "wall": first["side"],
                        "end": row["time"] if complete else last["time"],
                        "visible": (speeds >= THRESHOLD * speeds[0]).sum(),
                        "complete": complete,
                        "release": math.nan,
                    }
                )
            impacts = []
        if row["kind"] == IMPACT:
            impacts.append(row)
    return done


@pytest.mark.parametrize("values", [COMPLETE, INCOMPLETE], ids=["complete", "incomplete"])
def test_bursts_are_those_of_the_event_list(values: dict[str, float]) -> None:
    cube = run(values)
    expected = from_events(values, 4 * 2 * math.pi / values["frequency_ratio"])
    found = listed_bursts(cube)
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
    kinds = {burst.complete for burst in found if burst.chatter}
    assert kinds == {values is COMPLETE}


def test_an_incomplete_burst_has_no_release_of_its_own() -> None:
    burst = Burst(2.0, -1, 3.0, 6, False, math.nan)
    assert burst.end == burst.release == 5.0


def test_times_count_from_the_start_of_the_record_wherever_sampling_starts() -> None:
    np.testing.assert_array_equal(
        listed_bursts(run(COMPLETE)), listed_bursts(run(COMPLETE, start=1.5))
    )
    period = 2 * math.pi / COMPLETE["frequency_ratio"]
    late, whole = run(COMPLETE, start=1.5), run(COMPLETE)
    assert float(late.trajectory_start) == pytest.approx(1.5 * period, rel=1e-14)
    assert float(whole.trajectory_start) == 0.0
    # A sample of one is the same moment of the other.
    moment = float(late.trajectory_time[0] + late.trajectory_start)
    (row,) = np.flatnonzero(abs(whole.trajectory_time.values - moment) < 1e-9)
    assert late.trajectory_displacement[0] == whole.trajectory_displacement[row]


def test_a_full_list_is_told() -> None:
    assert list_is_full(run(COMPLETE, records=3))
    assert not list_is_full(run(COMPLETE))


def test_sticking_is_that_of_the_event_list() -> None:
    cube = run(COMPLETE)
    known = np.isfinite(cube.trajectory_time.values)
    time, mode = cube.trajectory_time.values[known], cube.trajectory_mode.values[known]
    found = events(Parameters(**COMPLETE), until=4 * 2 * math.pi / 0.2)
    starts = found["time"][found["kind"] == STICK]
    ends = found["time"][found["kind"] == RELEASE]
    spans = sticking_spans(time, mode)
    assert len(starts) >= 1
    np.testing.assert_allclose([a for a, _ in spans], starts, rtol=1e-12)
    np.testing.assert_allclose([b for _, b in spans][: len(ends)], ends, rtol=1e-12)

"""Stretches of chatter and sticking against the event list of the same run."""

import math
from typing import Any

import numpy as np
import pytest
import xarray as xr

from damper import events, simulate
from damper.figures.stretches import chatter, half_gap, listed_until, rows_between, sticking
from damper.parameters import Parameters

POINT = {"mass_ratio": 0.1, "damping_ratio": 0.02, "clearance": 0.05}
TRANSIENT, PERIODS, START, LENGTH = 5, 9, 1.25, 3
#: Restitution, frequency ratio: complete and incomplete chatter, both kinds mixed, none.
SCENES = [(0.6, 1.5), (0.8, 1.1), (0.9, 1.1), (0.75, 1.5), (0.3, 1.5), (0.9, 2.0)]


def simulated(r: float, omega: float, **trajectory: Any) -> xr.Dataset:
    return simulate(
        **POINT,
        restitution=r,
        frequency_ratio=omega,
        transient=TRANSIENT,
        periods=PERIODS,
        observers={
            "bursts": {"records": 60},
            "trajectory": {"start": START, "length": LENGTH, **trajectory},
        },
    )


def bursts_of_events(r: float, omega: float) -> tuple[list[Any], list[tuple[float, float]]]:
    """Chatter and sticking from the event list alone; times from the start of the stretch."""
    period = 2.0 * math.pi / omega
    p = Parameters(**POINT, restitution=r, frequency_ratio=omega)
    rows = events(p, until=(TRANSIENT + PERIODS) * period)
    found, stuck, burst = [], [], []
    zero = (TRANSIENT + START) * period

    def close(stop: float, complete: bool) -> None:
        visible = sum(speed >= 0.03 * burst[0][1] for _, speed in burst)
        if visible >= 5:
            found.append((burst[0][0] - zero, stop - zero, complete))

    side = 0
    for row in rows:
        if row["kind"] == 0:
            if burst and row["side"] != side:
                close(burst[-1][0], False)
                burst = []
            side = row["side"]
            burst.append((row["time"], row["approach_speed"]))
        elif row["kind"] == 1:
            close(row["time"], True)
            burst, began = [], row["time"]
        else:
            stuck.append((began - zero, row["time"] - zero))
    return found, stuck


@pytest.mark.parametrize(("r", "omega"), SCENES)
def test_chatter_is_that_of_the_event_list(r: float, omega: float) -> None:
    cube = simulated(r, omega)
    expected, _ = bursts_of_events(r, omega)
    end = LENGTH * 2.0 * math.pi / omega
    expected = [burst for burst in expected if burst[0] > 0.0 and burst[1] < end]
    found = [burst for burst in chatter(cube) if burst.start > 0.0 and burst.stop < end]
    assert [burst.complete for burst in found] == [burst[2] for burst in expected]
    assert bool(expected) is ((r, omega) not in ((0.3, 1.5), (0.9, 2.0)))
    if expected:
        np.testing.assert_allclose(
            [burst[:2] for burst in found], [burst[:2] for burst in expected], atol=1e-9
        )


@pytest.mark.parametrize(("r", "omega"), SCENES)
def test_sticking_is_that_of_the_event_list(r: float, omega: float) -> None:
    cube = simulated(r, omega)
    time, mode = cube.trajectory_time.values, cube.trajectory_mode.values
    known = np.isfinite(time)
    found = sticking(time[known], mode[known])
    end = LENGTH * 2.0 * math.pi / omega
    _, expected = bursts_of_events(r, omega)
    inside = [(a, b) for a, b in expected if b > 0.0 and a < end]
    # A sample is the first or last row of what the stretch cuts.
    step = end / LENGTH / 100
    assert len(found) == len(inside)
    for (a, b), (start, stop) in zip(found, inside, strict=True):
        assert a == pytest.approx(start, abs=1e-9) if start > 0.0 else 0.0 <= a <= step
        assert b == pytest.approx(stop, abs=1e-9) if stop < end else end - step <= b <= end + 1e-9
    assert bool(inside) is (r < 0.85 and (r, omega) != (0.75, 1.5))


def test_start_of_the_stretch_is_in_the_cube() -> None:
    cube = simulated(0.6, 1.5)
    assert float(cube.trajectory_start) == pytest.approx(START * 2.0 * math.pi / 1.5, rel=1e-15)
    assert float(simulated(0.6, 1.5, start=0.0).trajectory_start) == 0.0


def test_a_full_list_ends_with_its_last_burst() -> None:
    cube = simulated(0.6, 1.5)
    assert listed_until(cube) == np.inf
    few = cube.isel(burst=slice(3))
    last = chatter(few)[-1]
    assert listed_until(few) == last.stop
    assert 1 <= len(chatter(few)) < len(chatter(cube))


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

"""Single bursts, chatter and sticking, against the event list of the same run."""

import math
from typing import Any

import numpy as np
import pytest
import xarray as xr
from plain_events import Scene
from scenes import PAPER_A, SLOW

from damper import simulate
from damper.analysis import stretches

PERIODS, START, LENGTH = 9, 1.25, 3


def run(values: dict[str, float], records: int = 100, **trajectory: Any) -> xr.Dataset:
    return simulate(
        **values,
        transient=0,
        periods=PERIODS,
        observers={"bursts": {"records": records}, "trajectory": trajectory},
    )


@pytest.mark.parametrize(
    ("values", "sticks"), [(SLOW, True), (PAPER_A | {"frequency_ratio": 0.3}, False)]
)
def test_bursts_and_sticking_are_those_of_the_event_list(
    values: dict[str, float], sticks: bool
) -> None:
    cube = run(values, start=START, length=LENGTH)
    scene = Scene(values, 0, PERIODS)
    expected = scene.ended
    found = stretches.listed_bursts(cube)
    assert len(found) == len(expected) > 5
    for burst, plain in zip(found, expected, strict=True):
        assert burst.end == pytest.approx(plain.end)
        assert burst.chatter == (plain.visible(scene.restitution(plain.wall)) >= 5)
        if not math.isnan(burst.sticking):
            assert burst.release == pytest.approx(plain.release)
    known = np.isfinite(cube.trajectory_time.values)
    stuck = stretches.sticking(
        cube.trajectory_time.values[known], cube.trajectory_mode.values[known]
    )
    zero, end = START * scene.cycle, LENGTH * scene.cycle
    whole = [(b.stick - zero, b.release - zero) for b in expected if b.complete]
    inside = [(a, b) for a, b in whole if b > 0.0 and a < end]
    # A sample is the first or last row of what the stretch cuts.
    step = scene.cycle / 100
    assert len(stuck) == len(inside)
    for (a, b), (start, stop) in zip(stuck, inside, strict=True):
        assert a == pytest.approx(start, abs=1e-9) if start > 0.0 else 0.0 <= a <= step
        assert b == pytest.approx(stop, abs=1e-9) if stop < end else end - step <= b <= end + 1e-9
    assert bool(inside) is sticks


def test_times_count_from_the_start_of_the_record_wherever_sampling_starts() -> None:
    late, whole = run(SLOW, start=1.5), run(SLOW)
    np.testing.assert_array_equal(stretches.listed_bursts(whole), stretches.listed_bursts(late))
    period = 2 * math.pi / SLOW["frequency_ratio"]
    assert float(late.trajectory_start) == pytest.approx(1.5 * period, rel=1e-14)
    assert float(whole.trajectory_start) == 0.0
    # A sample of one is the same moment of the other.
    moment = float(late.trajectory_time[0] + late.trajectory_start)
    (row,) = np.flatnonzero(abs(whole.trajectory_time.values - moment) < 1e-9)
    assert late.trajectory_displacement[0] == whole.trajectory_displacement[row]


def test_rows_between() -> None:
    time = np.array([0.0, 0.5, 1.0, 1.5, np.nan])
    assert stretches.rows_between(time, 0.0, None) == slice(0, 4)
    assert stretches.rows_between(time, 0.7, 1.2) == slice(1, 4)
    assert stretches.rows_between(time, 0.5, 0.6) == slice(1, 3)
    with pytest.raises(ValueError, match=r"start = 1.5: the trajectory ends 1.5 cycles"):
        stretches.rows_between(time, 1.5, None)
    with pytest.raises(ValueError, match=r"start = 1, stop = 0.5: start must be less than stop"):
        stretches.rows_between(time, 1.0, 0.5)
    with pytest.raises(TypeError, match="stop = 'end': must be a real number"):
        stretches.rows_between(time, 1.0, "end")  # type: ignore[arg-type]

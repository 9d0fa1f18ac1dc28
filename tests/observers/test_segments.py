"""Segments: the motion that follows from the rows is the sampled one, to the last digits."""

import numpy as np
import pytest

from damper import Parameters
from damper.engine.segment import IMPACT, TAIL
from damper.models import start_run
from damper.sweep.runs import run_points

POINT = {"mass_ratio": 0.1, "damping_ratio": 0.05, "frequency_ratio": 0.2, "clearance": 0.25}
RUN = {"transient": 5, "periods": 6}


def rows_of(restitution: float, **settings: int) -> dict[str, np.ndarray]:
    arrays, _ = run_points([POINT | {"restitution": restitution}], {"segments": settings}, **RUN)
    found = {name.removeprefix("segment_"): array[0] for name, array in arrays.items()}
    used = np.isfinite(found["time"])
    return {name: array[used] for name, array in found.items() if name != "status"}


@pytest.mark.parametrize("restitution", [0.3, 0.6, 0.9])
def test_rows_are_the_run(restitution: float) -> None:
    """At its starts of segments a run has the states of the rows."""
    rows = rows_of(restitution, periods=2, rows=1000)
    assert (np.diff(rows["time"]) >= 0.0).all()
    assert len(rows["time"]) > 8
    trajectory = start_run(Parameters(**POINT, restitution=restitution))
    first = RUN["transient"] + RUN["periods"] - 2
    trajectory.skip(first)
    for time, x, v, cause in zip(
        rows["time"], rows["displacement"], rows["velocity"], rows["cause"], strict=True
    ):
        if time < 0.0:
            continue
        periods, local = divmod(time, trajectory.cycle)
        trajectory.skip(first + periods, local)
        state = trajectory.state_at(first + periods, local)
        assert state.x == pytest.approx(x, abs=1e-13)
        if cause != IMPACT:  # at an impact the velocity jumps
            assert state.v == pytest.approx(v, abs=1e-12)


def test_the_first_row_begins_where_the_stretch_does() -> None:
    for restitution in (0.3, 0.6, 0.9):
        rows = rows_of(restitution, periods=2)
        assert rows["time"][0] == 0.0 or rows["mode"][0] == TAIL


def test_the_last_rows_are_kept() -> None:
    every, some = rows_of(0.6, periods=3), rows_of(0.6, periods=3, rows=5)
    for name, kept in some.items():
        np.testing.assert_array_equal(kept, every[name][-5:])

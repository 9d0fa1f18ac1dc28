"""What holds for every observer: pieces of the log, neighbours and early stops change nothing."""

from typing import Any

import numpy as np
import pytest
from scenes import PAPER_A, SLOW

from damper import Parameters
from damper.engine.segment import COLUMNS
from damper.engine.trajectory import LOG_ROWS
from damper.models import start_run
from damper.observers import OBSERVERS, make_observers
from damper.observers.common.base import Window, record_type
from damper.sweep.runs import run_points

#: Settings with which observers write all that they can.
SETTINGS: dict[str, dict[str, Any]] = {
    "stroboscopic_section": {"free_mass": True, "when": 0.3},
    "impact_section": {"free_mass": True},
    "impacts": {"speeds": 50},
    "bursts": {"records": 20, "compare_thresholds": [0.1, 0.01]},
    "burst_at": {"time": 40.0},
    "chatter_bursts": {"since": [0, 2]},
    "trajectory": {"samples_per_period": 9, "start": 0.4},
}
each = pytest.mark.parametrize("name", OBSERVERS)


@each
def test_pieces_of_the_log_do_not_matter(name: str) -> None:
    """They end within chatter sequences and sticking, too."""
    results = []
    for rows in (LOG_ROWS, 3, 1):
        trajectory = start_run(Parameters(**SLOW | {"restitution": 0.3}))
        trajectory.skip(2)
        (observer,) = make_observers({name: SETTINGS.get(name, {})})
        observer.allocate(1, 4)
        observer.begin(0, trajectory, Window(2.0, 0.0, 4))
        for log in trajectory.segments(6, 0.0, np.empty((rows, COLUMNS))):
            observer.observe(log)
        observer.finish(True)
        results.append({key: array.tobytes() for key, array in observer.arrays.items()})
    assert results[0] == results[1] == results[2]


@each
def test_runs_do_not_mix(name: str) -> None:
    """Neither a run that stops inside a chatter sequence nor one without impacts leaves anything.

    A run that stops early has no value of its own, and keeps what it listed before the stop.
    """
    points = [SLOW, PAPER_A, SLOW | {"clearance": 50.0}, SLOW | {"restitution": 0.0}]
    ask = {name: SETTINGS.get(name, {})}
    run = {"transient": 0, "periods": 6, "max_events": 200}
    found, (observer,) = run_points(points, ask, **run)
    assert found["status"].tolist() == [0, 1, 0, 0]
    whole, _ = run_points([PAPER_A], ask, transient=0, periods=6)
    for number, point in enumerate(points):
        alone, _ = run_points([point], ask, **run)
        for key, array in found.items():
            np.testing.assert_array_equal(array[number], alone[key][0], key)
    for variable in observer.variables:
        stopped = found[variable.name][1]
        missing = np.isnan(stopped) if stopped.dtype.kind == "f" else stopped == -1
        if not variable.dims:
            # What the stretch is does not depend on how it ends, and laws hold up to the stop.
            assert missing or name in ("trajectory", "laws"), variable.name
        elif name in ("stroboscopic_section", "impact_section", "trajectory"):
            kept = whole[variable.name][0][~missing]
            np.testing.assert_array_equal(stopped[~missing], kept)


@each
def test_a_run_that_stops_in_its_transient_writes_nothing(name: str) -> None:
    ask = {name: SETTINGS.get(name, {})}
    found, (observer,) = run_points([SLOW], ask, transient=9, periods=3, max_events=5)
    assert found["status"].tolist() == [1]
    for variable in observer.variables:
        # What the stretch is, and that no event is left out of it, is known.
        if variable.name not in ("trajectory_start", "trajectory_events_left_out"):
            stopped = found[variable.name]
            assert (np.isnan(stopped) if stopped.dtype.kind == "f" else stopped == -1).all()


def test_a_field_that_records_hide_is_refused() -> None:
    """Plain Python would read NumPy's attribute in its place, and compiled code the field."""
    with pytest.raises(ValueError, match="size already"):
        record_type("gap", "size")

"""Many points through engine and observers: these do not touch each other, nor do runs."""

import subprocess
import sys
import threading
from typing import Any

import numpy as np
import pytest
from scenes import STUDY as POINT

from damper.engine.compiled import COMPILED
from damper.observers import OBSERVERS
from damper.sweep.runs import run_points

#: One point of each kind; the last run stops at LIMIT events.
POINTS = [
    POINT,
    {**POINT, "restitution": 0.9, "clearance": 0.4},
    {**POINT, "restitution": 0.0},
    {**POINT, "clearance": 0.0},
    {**POINT, "clearance": 50.0},
    {**POINT, "restitution": 1.0, "clearance": 0.0003},
]
LIMIT = 700
SECTIONS = ("stroboscopic_section", "impact_section")
#: All that go together: every pair is among those.
SUBSETS = [tuple(name for name in OBSERVERS if name != section) for section in SECTIONS]
SETTINGS: dict[str, dict[str, Any]] = {name: {} for name in OBSERVERS} | {
    "stroboscopic_section": {"when": 0.3, "free_mass": True},
    "impact_section": {"samples": 30, "free_mass": True},
    "impacts": {"threshold": 0.01},
    "bursts": {"compare_thresholds": [0.1], "records": 5},
    "burst_at": {"time": 20.0},
    "chatter_bursts": {"since": [0, 2]},
    "motion": {"longest": 3},
    "accumulation": {"bursts": 4, "impacts": 9},
    "trajectory": {"samples_per_period": 7, "events": 40},
    "segments": {"periods": 2, "rows": 30},
}


# --- what is observed


@pytest.mark.parametrize("transient", [0, 4])
def test_status_does_not_depend_on_what_is_observed(transient: int) -> None:
    """A run that stops within the record says so, even if nobody looks."""
    run = {"transient": transient, "periods": 12, "max_events": LIMIT}
    seen, _ = run_points(POINTS, ["impacts"], **run)
    unseen, _ = run_points(POINTS, [], **run)
    assert unseen["status"].tolist() == seen["status"].tolist()


@pytest.mark.parametrize("subset", SUBSETS, ids="+".join)
def test_results_of_an_observer_do_not_depend_on_the_others(subset: tuple[str, ...]) -> None:
    run = {"transient": 4, "periods": 6, "max_events": LIMIT}
    together, made = run_points(POINTS, {name: SETTINGS[name] for name in subset}, **run)
    assert len(made) == len(subset)
    for name in subset:
        alone, _ = run_points(POINTS, {name: SETTINGS[name]}, **run)
        for variable, array in alone.items():
            np.testing.assert_array_equal(together[variable], array)


@pytest.mark.parametrize("after", [None, [1, 2, -1, -1, 3, -1]])
def test_progress_counts_runs(after: list[int] | None) -> None:
    done: list[tuple[int, int]] = []
    run = {"transient": 0, "periods": 1, "progress": lambda *number: done.append(number)}
    run_points(POINTS, ["impacts"], predecessor=after, **run)
    assert done == [(1, 6), (2, 6), (3, 6), (4, 6), (5, 6), (6, 6)]


# --- threads


@pytest.mark.compiled
def test_same_bytes_for_any_number_of_threads() -> None:
    points = [{**POINT, "clearance": float(d)} for d in np.geomspace(3e-4, 3.0, 24)]
    points[5] = POINTS[-1]
    # Two chains in opposite directions, and three runs alone.
    after = [-1, *range(11), *range(13, 22), -1, -1, -1]
    settings = {name: SETTINGS[name] for name in (SECTIONS[0], "impacts", "bursts")}
    run = {"transient": 2, "periods": 6, "max_events": LIMIT, "predecessor": after}
    one, three = (run_points(points, settings, **run, workers=n)[0] for n in (1, 3))
    assert {0, 1} <= set(one["status"].tolist())
    assert list(three) == list(one)
    for name, array in one.items():
        assert three[name].tobytes() == array.tobytes(), name


def test_an_error_in_any_thread_stops_all() -> None:
    def progress(number: int, total: int) -> None:
        if number == 5:
            raise RuntimeError("no more")

    with pytest.raises(RuntimeError, match="no more"):
        run_points([POINT] * 1000, [], transient=0, periods=1, progress=progress, workers=3)
    assert threading.active_count() == 1


LONG_RUN = """
import signal, sys, threading
import damper
from damper.engine import compiled
signal.signal(signal.SIGINT, signal.default_int_handler)
compiled.compile_at_once()
point = dict({point})
def call(length, workers=1):
    if {what!r} == "events":
        p = damper.Parameters(**point)
        return damper.events(p, until=4.0 * length, max_events=10**14)
    run = dict(transient=1, periods=1, observers={observers!r}, max_events=10**14)
    point["phase"] = [0.0, 1.0][:workers]
    return damper.simulate(**point, **(run | {{{what!r}: length}}), workers=workers)
call(2)  # compiled now
threading.Timer(0.5, signal.raise_signal, [signal.SIGINT]).start()
call(10**9 - 1, {workers})
"""


@pytest.mark.skipif(not COMPILED, reason="plain Python notices interrupts anyway")
@pytest.mark.parametrize(
    ("what", "observers", "workers"),
    [("events", [], 1), ("transient", ["impacts"], 1), ("periods", ["impacts"], 2)],
)
def test_interrupt_within_a_long_run(what: str, observers: list[str], workers: int) -> None:
    code = LONG_RUN.format(point=POINT, what=what, observers=observers, workers=workers)
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True)
    assert done.stderr.count("Traceback") == 1, done.stderr
    assert done.stderr.endswith("KeyboardInterrupt\n")

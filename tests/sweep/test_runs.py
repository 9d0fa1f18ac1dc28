"""Many points through engine and observers: observers only read, runs do not touch each other."""

import signal
import subprocess
import sys
import threading
from collections.abc import Iterator
from typing import Any

import numpy as np
import pytest
from new_process import in_new_process
from scenes import STUDY as POINT

from damper import State
from damper.engine.compiled import COMPILED
from damper.engine.trajectory import Trajectory
from damper.models import start_run
from damper.observers import OBSERVERS
from damper.sweep import runs
from damper.sweep.grid import product
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


class Recorder:
    """Stands for a trajectory; keeps the bytes of the log before and after observers saw it."""

    def __init__(self, trajectory: Trajectory) -> None:
        self.trajectory = trajectory
        self.before: list[bytes] = []
        self.after: list[bytes] = []

    def __getattr__(self, name: str) -> Any:
        return getattr(self.trajectory, name)

    def segments(self, *arguments: Any) -> Iterator[np.ndarray]:
        for log in self.trajectory.segments(*arguments):
            self.before.append(log.tobytes())
            yield log
            self.after.append(log.tobytes())

    def outcome(self) -> tuple[bytes, bytes, int, int, tuple]:
        run = self.trajectory
        return b"".join(self.before), run._state.tobytes(), run.events, run.status, run.model


def recorded(
    monkeypatch: pytest.MonkeyPatch, observers: Any, **run: Any
) -> tuple[list[tuple], dict[str, np.ndarray]]:
    """Log, final state and so on of every run, and the results."""
    made = []

    def start(*arguments: Any) -> Recorder:
        made.append(Recorder(start_run(*arguments)))
        return made[-1]

    monkeypatch.setattr(runs, "start_run", start)
    arrays, _ = run_points(POINTS, observers, **run)
    for one in made:
        assert one.before == one.after, "an observer wrote into the log"
    return [one.outcome() for one in made], arrays


# --- observers only read


@pytest.mark.parametrize("subset", SUBSETS, ids="+".join)
def test_event_rows_are_identical_under_every_set_of_observers(
    monkeypatch: pytest.MonkeyPatch, subset: tuple[str, ...]
) -> None:
    run = {"transient": 4, "periods": 12, "max_events": LIMIT}
    reference, _ = recorded(monkeypatch, ["stroboscopic_section"], **run)
    assert all(log for log, *_ in reference[:5])
    assert len(reference) == len(POINTS)
    found, arrays = recorded(monkeypatch, {name: SETTINGS[name] for name in subset}, **run)
    assert found == reference
    assert arrays["status"].tolist() == [0, 0, 0, 0, 0, 1]


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


@pytest.mark.parametrize("workers", [0, -1, 1.5])
def test_number_of_threads_is_checked(workers: float) -> None:
    with pytest.raises(ValueError, match=r"workers = .*: must be a whole number >= 1"):
        run_points([POINT], [], transient=0, periods=1, workers=workers)


def test_an_error_in_any_thread_stops_all() -> None:
    def progress(number: int, total: int) -> None:
        if number == 5:
            raise RuntimeError("no more")

    with pytest.raises(RuntimeError, match="no more"):
        run_points([POINT] * 1000, [], transient=0, periods=1, progress=progress, workers=3)
    assert threading.active_count() == 1


INTERRUPTED = """
import os, signal
from damper.sweep.runs import run_points
# A shell starts what runs in its background with interrupts ignored.
signal.signal(signal.SIGINT, signal.default_int_handler)
def progress(number, total):
    if number == 20:
        os.kill(os.getpid(), signal.SIGINT)
run_points([{point}] * 100_000, ["impacts"], transient=0, periods=5, progress=progress, workers=3)
"""


@pytest.mark.skipif(sys.platform == "win32", reason="no such signals")
def test_interrupt_stops_all_threads() -> None:
    code = INTERRUPTED.format(point=POINT)
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True)
    assert done.returncode == -signal.SIGINT
    assert done.stderr.count("Traceback") == 1
    assert "concurrent" not in done.stderr


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


# --- refusals come before anything is run


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"transient": -1}, "transient = -1"),
        ({"transient": 1.5}, "transient = 1.5"),
        ({"periods": 0}, "periods = 0"),
        ({"periods": 2.5}, "periods = 2.5"),
        ({"accuracy": 0.1}, "accuracy = 0.1"),
        ({"accuracy": 0.0}, "accuracy = 0.0"),
        ({"max_events": 0}, "max_events = 0"),
        ({"max_events": 1.5}, "max_events = 1.5"),
        ({"points": [POINT, {**POINT, "restitution": 1.2}]}, "restitution = 1.2"),
        ({"points": [POINT, {**POINT, "mass_ratio": -0.1}]}, "mass_ratio = -0.1"),
        ({"observers": ["impacts", "sound"]}, "unknown observer 'sound'.*bursts"),
        ({"observers": SECTIONS}, "both write 'displacement'"),
        ({"observers": {"impacts": {"threshold": 7}}}, "threshold = 7"),
        (
            {
                "points": [{**POINT, "clearance": 1.0}, {**POINT, "clearance": 0.1}],
                "state": State(0.0, 0.0, 0.5, 0.0),
            },
            "outside the box",
        ),
    ],
    ids=lambda value: value if isinstance(value, str) else "-".join(value),
)
def test_refusals_come_before_anything_is_run(change: dict[str, Any], message: str) -> None:
    done: list[int] = []
    arguments = {"points": [POINT, POINT], "observers": ["impacts"]}
    arguments |= {"transient": 1, "periods": 1, "progress": done.append, **change}
    with pytest.raises(ValueError, match=message):
        run_points(**arguments)
    assert done == []


def test_product_has_the_last_axis_fastest() -> None:
    sets = product({"clearance": (1, 2), "restitution": (0.1, 0.2, 0.3)}, {"phase": 0.5})
    pairs = [(1, 0.1), (1, 0.2), (1, 0.3), (2, 0.1), (2, 0.2), (2, 0.3)]
    assert sets == [{"phase": 0.5, "clearance": d, "restitution": r} for d, r in pairs]
    assert product({}, {"phase": 0.5}) == [{"phase": 0.5}]
    assert product({"clearance": ()}, {"phase": 0.5}) == []


# --- what is not asked for is not loaded


LOADED = """
import json, sys
from damper.sweep.runs import run_points
from damper.observers import OBSERVERS
def loaded():
    return {{name for name in OBSERVERS if "damper.observers." + name in sys.modules}}
before, new = loaded(), {{}}
for name in OBSERVERS:
    known = loaded()
    run_points([{point}], [name], transient=1, periods=2)
    new[name] = sorted(loaded() - known)
heavy = [m for m in ("xarray", "netCDF4", "matplotlib", "scipy", "pydantic") if m in sys.modules]
print(json.dumps([sorted(before), new, heavy]))
"""


def test_observer_not_asked_for_is_not_imported() -> None:
    """Nor compiled then: a compiled pass lives in its module."""
    before, new, heavy = in_new_process(LOADED.format(point=POINT), DAMPER_COMPILE="0")
    assert (before, heavy) == ([], [])
    # What reads whole bursts builds on the observer that finds them, decay on that of energies.
    built_on = {"burst_at": {"bursts"}, "chatter_bursts": {"bursts"}, "decay": {"response"}}
    for name, loaded in new.items():
        assert {*loaded} <= {name} | built_on.get(name, set())

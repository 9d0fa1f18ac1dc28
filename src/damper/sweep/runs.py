"""Many points through engine and observers, one run each.

The loop over runs is plain Python (some ten microseconds a run); everything inside a run is
compiled and does not hold the interpreter's lock, so threads share the cores. Memory is one log
buffer a thread plus what the observers were asked to keep.
"""

import math
import os
import threading
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from concurrent.futures import Future, ThreadPoolExecutor, wait
from typing import Any, TypeVar

import numpy as np

from damper.engine.compiled import COMPILED, compiling
from damper.engine.loop import FINISHED
from damper.engine.segment import COLUMNS
from damper.engine.trajectory import LOG_ROWS, NO_LOG, Trajectory
from damper.models import check_state, start_run
from damper.observers import make_observers
from damper.observers.common.base import Observer, Window
from damper.parameters import State
from damper.parameters.forcing import HARMONIC, Forcing
from damper.parameters.models import models_of
from damper.parameters.names import unknown_name
from damper.parameters.quantity import whole
from damper.parameters.run import RunSettings
from damper.parameters.state import require_state
from damper.parameters.tables import beside_numbers
from damper.parameters.variables import Variable
from damper.sweep.estimate import WORTH_COMPILING, Workload
from damper.sweep.grid import lies_at
from damper.sweep.points import Point, read_point
from damper.sweep.progress import Progress

Result = TypeVar("Result")

#: Row of each point that an observer observes, by the number of the point.
Rows = Mapping[int, int] | range

#: Fewest points for which one more thread is worth its start, where their number is left open.
_POINTS_A_THREAD = 4


def run_points(
    points: Iterable[Mapping[str, float]],
    observers: Iterable[str] | Mapping[str, Mapping[str, Any] | None],
    *,
    primary: str = "rest",
    forcing: Forcing | str | None = None,
    masses: int = 0,
    tables: Mapping[str, Any] | None = None,
    state: State | None = None,
    predecessor: Sequence[int] | None = None,
    progress: Progress | None = None,
    workers: int | None = 1,
    **run: Any,
) -> tuple[dict[str, np.ndarray], list[Observer]]:
    """Run every point and observe it.

    Parameters
    ----------
    points : iterable of mapping
        Name -> value of each point: the parameters, dimensionless or in SI units, and initial
        quantities that are not zero; see `damper.parameters.quantities`.
    observers : iterable of str, or mapping of str to settings
        As for `damper.observers.make_observers`.
    primary : {"rest", "steady"}
        Where the primary starts: at rest, or on its steady linear response.
    forcing : Forcing or str, optional
        What drives every damper, as for `damper.Parameters`; else what each point says.
    masses : int, default 0
        Number of free masses of every damper; points may give quantities of single masses. With 0,
        the points list the masses.
    tables : mapping, optional
        Tables of the restitution of every damper, as for `damper.parameters.tables.beside_numbers`.
    state : State, optional
        Start of every run, in place of `primary` and initial quantities.
    predecessor : sequence of int, optional
        Continuation: for each point the number of the point from whose end it starts, or -1.
        Primary and relative velocity go on; the free mass keeps its place *between* the walls, as a
        part of the clearance, so that contact stays contact. A run whose predecessor stopped early
        starts like the first runs.
    progress : callable, optional
        Called with the number of runs done, and of all, after each one.
    workers : int, default 1
        Number of threads; the bytes are the same for any number. By None, a thread for each core of
        this process, at most one for every four points. Runs that follow each other share a thread.
        Without numba a single thread runs: the interpreter's lock lets only one work, and processes
        would have to load everything again, from a script that has to guard against that.
    **run
        Settings of every run, those of `RunSettings`.

    Returns
    -------
    arrays : dict of str to ndarray
        Each observer's variables with the point as first axis, those of its `place` alone, and
        `status`. Dimensionless, also
        for points in SI units.
    observers : list of Observer
        The observers, for their descriptions.

    Raises
    ------
    ValueError, TypeError
        For values out of range, and for what cannot end or does not go into memory, before
        anything is run.
    """
    every: dict[str, Any] = {} if forcing is None else {"forcing": forcing}
    every |= beside_numbers(masses, tables)
    points = [{**values, **every} for values in points] if every else list(points)
    read = [read_point(values, primary) for values in points]
    chains = _chains(predecessor, len(read))
    threads = _threads(workers, len(read), len(chains))
    asked = list(observers) if isinstance(observers, Iterator) else observers
    # Observers hold what they know of a run; only the arrays are shared.
    observer_sets = [make_observers(asked) for _ in range(threads)]
    made = observer_sets[0]
    forces = [point.parameters.forcing for point in read]
    dearest = max(forces, key=lambda force: force.samples + force.terms, default=HARMONIC)
    settings = RunSettings(**run)
    require_state(state)
    if settings.timed:
        lengths = [_cycles(point, settings, state) for point in read] or [(0.0, 0.0)]
    else:
        lengths = [settings.cycles(1.0, 0.0)]
    longest = max(lengths, key=sum)
    ends = lengths if settings.timed else lengths * len(read)
    stationary = [observer for observer in made if observer.throughout]
    for point, cycles in zip(read, ends, strict=False) if stationary else ():
        force, unit = point.parameters.forcing, point.units.time
        begun = state.time if state else 0.0
        end = begun + point.parameters.cycle * unit * sum(cycles)
        for observer in stationary:
            observer.require_drive(force.kind, force.end * unit, end)
    copies = len(set(map(id, forces)))
    rows = [_observed(points, observer) for observer in made]
    parts = {one.name: len(own) / len(read) for one, own in zip(made, rows, strict=True) if read}
    work = Workload(
        {"points": len(read)}, *longest, made, forcing=dearest, copies=copies, parts=parts
    )
    work.refuse_excess()
    if state:
        for point in read:
            check_state(point.parameters, state.over(point.units), point.units)
    most = math.ceil(max(length for _, length in lengths))
    for place, observer in enumerate(made):
        observer.allocate(len(rows[place]), most)
        for one_set in observer_sets[1:]:
            one_set[place].arrays = observer.arrays
    sweep = _Sweep(read, rows, state, settings, progress)
    with compiling(work.run_seconds > WORTH_COMPILING):
        sweep.run(chains, observer_sets)
    arrays = {"status": sweep.status}
    for observer in made:
        arrays |= observer.arrays
    return arrays, made


def in_threads(
    calls: Sequence[Callable[[], Result]], workers: int | None, progress: Progress | None = None
) -> list[Result]:
    """Return what all these return, which no number of threads changes; `workers` as above.

    Where one fails or the user interrupts, those that have not begun never do.
    """
    threads = _threads(workers, len(calls), len(calls))
    found = []
    with ThreadPoolExecutor(threads) as pool:
        working = [pool.submit(call) for call in calls]
        try:
            for done, result in enumerate(_in_turn(working), 1):
                found.append(result)
                if progress:
                    progress(done, len(calls))
        finally:
            pool.shutdown(cancel_futures=True)
    return found


def _in_turn(working: Iterable[Future[Result]]) -> Iterator[Result]:
    """Yield what each of these returns, as soon as it does."""
    for each in working:
        # By turns: a wait without an end does not notice every interrupt.
        while wait([each], timeout=0.1).not_done:
            pass
        yield each.result()


def _observed(points: Sequence[Mapping[str, Any]], observer: Observer) -> Rows:
    """Numbers of the points that an observer observes -> their rows in its arrays."""
    place = observer.place
    if not place:
        return range(len(points))
    for name in place:
        if points and name not in points[0]:
            raise ValueError(f"{observer.name}.at: {unknown_name('axis', name, points[0])}")
    found = (k for k, point in enumerate(points) if lies_at(point, place))
    return {number: row for row, number in enumerate(found)}


def _cycles(point: Point, settings: RunSettings, start: State | None) -> tuple[float, float]:
    """Cycles before the window of a run, and in it; `start` is in the units of the point."""
    cycle, time = point.parameters.cycle, point.units.time
    begun = start.time if start else 0.0
    return settings.cycles(cycle * time, point.parameters.forcing.end * time - begun)


class _Sweep:
    """The runs of many points, and how many of them are done."""

    def __init__(
        self,
        points: list[Point],
        rows: list[Rows],
        state: State | None,
        settings: RunSettings,
        progress: Progress | None,
    ) -> None:
        self.status = np.zeros(len(points), dtype="i1")
        self._points: list[Any] = points
        self._rows = rows
        self._state = state
        self._settings = settings
        self._progress = progress
        self._done = 0
        self._lock = threading.Lock()
        self._stopped = False

    def run(self, chains: list[list[int]], observer_sets: list[list[Observer]]) -> None:
        """Run all chains, in one thread for each set of observers.

        Where one fails or the user interrupts, the others stop soon after. Several threads leave
        the calling one idle: an interrupt in the midst of compiling, which only that one notices,
        would leave numba's lock closed to the others.
        """
        waiting = iter(chains)
        if len(observer_sets) == 1:
            self._work(waiting, observer_sets[0])
            return
        try:
            with ThreadPoolExecutor(len(observer_sets)) as pool:
                working = [pool.submit(self._work, waiting, one_set) for one_set in observer_sets]
                try:
                    for _ in _in_turn(working):
                        pass
                finally:
                    self._stopped = True
        except KeyboardInterrupt:
            # Without the frames of the pool.
            raise KeyboardInterrupt from None

    def _work(self, waiting: Iterator[list[int]], observers: list[Observer]) -> None:
        """Run one chain after another until none is left."""
        buffer = np.empty(LOG_ROWS * COLUMNS)
        try:
            while not self._stopped:
                with self._lock:
                    chain = next(waiting, None)
                if chain is None:
                    return
                self._run_chain(chain, observers, buffer)
        except _StoppedError:
            return
        except BaseException:
            self._stopped = True
            raise

    def _run_chain(self, chain: list[int], observers: list[Observer], buffer: np.ndarray) -> None:
        points = [self._points[number] for number in chain]
        for number in chain:
            # It goes with its run, which leaves much beside it.
            self._points[number] = None
        runs = _chained(points, self._settings, self._state)
        for number, (_, trajectory, window) in zip(chain, runs, strict=False):
            self._observe(number, trajectory, window, observers, buffer)
            self.status[number] = trajectory.status
            with self._lock:
                self._done += 1
                if self._progress:
                    self._progress(self._done, len(self._points))

    def _observe(
        self,
        number: int,
        trajectory: Trajectory,
        window: Window,
        observers: list[Observer],
        buffer: np.ndarray,
    ) -> None:
        """Run to the end of the window; observers read the log from its start."""
        if window.periods > trajectory.start[0]:
            for _ in self._watched(trajectory.segments(window.periods, window.time, NO_LOG)):
                pass
        rows = [
            (one, own[number])
            for one, own in zip(observers, self._rows, strict=True)
            if number in own
        ]
        observers = [observer for observer, _ in rows]
        for observer, row in rows:
            observer.begin(row, trajectory, window)
        end = window.periods + window.length, window.time
        # Rows of several masses are wider; there are fewer of them.
        count = len(buffer) // trajectory.columns
        kept = buffer[: count * trajectory.columns].reshape(count, trajectory.columns)
        for log in self._watched(trajectory.segments(*end, kept if observers else NO_LOG)):
            for observer in observers:
                observer.observe(log)
        for observer in observers:
            observer.finish(trajectory.status == FINISHED)

    def _watched(self, pieces: Iterator[np.ndarray]) -> Iterator[np.ndarray]:
        """Yield the pieces of a run, which ends where the sweep was stopped meanwhile."""
        for piece in pieces:
            yield piece
            if self._stopped:
                raise _StoppedError


def last_of_chain(
    points: Sequence[Mapping[str, float]], primary: str = "rest", **run: Any
) -> tuple[State | None, Trajectory, Window]:
    """Run a chain, each point from the end of the one before, up to the start of its last run.

    Points, `primary` and settings are as for `run_points`. Returned are the dimensionless state
    that the last run starts from (None is rest), that run, and its window.
    """
    runs = _chained([read_point(values, primary) for values in points], RunSettings(**run))
    for _ in points[1:]:
        _, trajectory, window = next(runs)
        trajectory.skip(*window.end(trajectory.cycle))
    return next(runs)


def _chained(
    points: Iterable[Point], settings: RunSettings, state: State | None = None
) -> Iterator[tuple[State | None, Trajectory, Window]]:
    """Yield each run of a chain with its start and window; it has to be run before the next."""
    before: tuple[Point, State] | None = None
    for point in points:
        start = state.over(point.units) if state else point.start()
        if before is not None:
            start = point.carried_over(*before)
        trajectory = start_run(point.parameters, start, settings.accuracy, settings.max_events)
        trajectory.units = point.units
        periods, time = trajectory.start
        transient, length = _cycles(point, settings, state)
        window = Window(periods + transient, time, length)
        yield start, trajectory, window
        before = None
        if trajectory.status == FINISHED:
            before = point, trajectory.state_at(*window.end(trajectory.cycle))


def observed(
    trajectory: Trajectory,
    window: Window,
    observers: Iterable[str] | Mapping[str, Mapping[str, Any] | None],
    *others: Any,
) -> list[tuple[Variable, np.ndarray]]:
    """Let observers see a window of one run, with others that have an `observe` of their own.

    Returned are their variables and what they are in this run, dimensionless.
    """
    made = make_observers(observers, "structure" in models_of(trajectory.model))
    trajectory.skip(window.periods, window.time)
    for observer in made:
        observer.allocate(1, math.ceil(window.length))
        observer.begin(0, trajectory, window)
    for log in trajectory.segments(*window.end(trajectory.cycle)):
        for observer in (*made, *others):
            observer.observe(log)
    for observer in made:
        observer.finish(trajectory.status == FINISHED)
    return [(v, observer.arrays[v.name][0]) for observer in made for v in observer.variables]


class _StoppedError(Exception):
    """The sweep was stopped during a run."""


def _chains(predecessor: Sequence[int] | None, count: int) -> list[list[int]]:
    """Chains of runs in which each run starts from the end of the run before."""
    if predecessor is None:
        return [[number] for number in range(count)]
    following = {previous: number for number, previous in enumerate(predecessor) if previous >= 0}
    chains = []
    for first in range(min(count, len(predecessor))):
        if predecessor[first] < 0:
            chain = [first]
            while chain[-1] in following:
                chain.append(following[chain[-1]])
            chains.append(chain)
    if sorted(number for chain in chains for number in chain) != list(range(count)):
        raise ValueError(f"predecessor: must make chains of all {count} points, each run once")
    return chains


def _threads(workers: int | None, points: int, chains: int) -> int:
    """Threads to use for so many points in so many chains."""
    if workers is None:
        # Not all cores may be this process's own.
        affinity = getattr(os, "sched_getaffinity", None)
        cores = len(affinity(0)) if affinity else os.cpu_count() or 1
        workers = min(cores, points // _POINTS_A_THREAD) or 1
    workers = whole("workers", workers, 1)
    return min(workers, chains) or 1 if COMPILED else 1

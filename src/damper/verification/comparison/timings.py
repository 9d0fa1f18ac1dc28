"""How long every solver takes, and what its first use costs.

Times belong to the machine and the moment, so nothing here goes into a file whose bytes are
compared. What makes them comparable with each other: one process, one thread, and repetitions
that take turns, so that a machine that slows down for a second slows all solvers down.
"""

import gc
import math
import os
import pickle
import platform
import subprocess
import sys
from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from importlib.metadata import PackageNotFoundError, version
from math import nan
from statistics import median
from time import perf_counter

import numpy as np

from damper.engine.compiled import compile_at_once
from damper.verification.comparison.best import LONGER, PEERS
from damper.verification.comparison.runs import NOT_APPLICABLE, most_evaluations, solver_names
from damper.verification.comparison.scene import Scene
from damper.verification.comparison.solution import FINISHED, OUTCOMES, Solution
from damper.verification.comparison.solvers import load
from damper.verification.cost.machine import processor

#: A run shorter than this, in seconds, is repeated within a sample until the sample is as long.
SHORTEST = 1e-3
#: New processes of which the median is the cost of a solver's first use.
PROCESSES = 3
#: Length of a run that ends at once, in that of the scene.
_AT_ONCE = 1e-6
#: Packages named with the machine.
PACKAGES = ("numpy", "numba", "scipy")

_FIRST_USE = """
import sys, time
started = time.perf_counter()
from damper.verification.comparison.solvers import load
solver = load(sys.argv[1])
imported = time.perf_counter()
from damper.engine.compiled import compile_at_once
compile_at_once()
import pickle
scene, setting, most = pickle.loads(sys.stdin.buffer.read())
times = [time.perf_counter()]
for _ in range(2):
    solver.solve(scene, setting, max_evaluations=most)
    times.append(time.perf_counter())
print(imported - started, (times[1] - times[0]) - (times[2] - times[1]))
"""


def time_solvers(
    scenes: Mapping[str, Scene],
    settings: Mapping[str, Sequence[float]],
    repeats: int,
    cap: float,
    spend: float = 0.2,
) -> dict[str, np.ndarray]:
    """Time the bare runs, without states at given times and without energy balance.

    Parameters
    ----------
    scenes : mapping of str to Scene
    settings : mapping of str to sequence of float
        Levels of each solver, coarse to fine.
    repeats : int
        Samples of each point: scene, solver and level.
    cap : float
        What a run may cost; see `damper.verification.comparison.runs.run_scene`.
    spend : float, default 0.2
        Seconds for one point: once they are spent, no further repetition of it starts. Every point
        is sampled at least once.

    Returns
    -------
    dict of str to ndarray
        Of shape (scene, solver, level), NaN where a solver does not apply: ``run_time``, the
        median, and its quartiles ``run_time_low`` and ``run_time_high`` in s, ``repeats`` that were
        made (0 where none), ``outcome`` as in `damper.verification.comparison.runs.run_scene`. Of
        shape (solver,): ``import_time`` of the solver's module in a new process, and
        ``warm_up_time``, what its first run there took longer than its second one; compiled code
        that numba has left on disk is loaded, not compiled. Of shape (scene,): ``periods``.

    Raises
    ------
    ValueError
        For an unknown solver or levels that are not positive.
    """
    names = solver_names(settings)
    levels = max(map(len, settings.values()))
    shape = (len(scenes), len(names), levels)
    arrays: dict[str, np.ndarray] = {
        name: np.full(shape, nan) for name in ("run_time", "run_time_low", "run_time_high")
    }
    arrays["repeats"] = np.zeros(shape, dtype="i4")
    arrays["outcome"] = np.full(shape, NOT_APPLICABLE, dtype="i1")
    arrays["import_time"] = np.full(len(names), nan)
    arrays["warm_up_time"] = np.full(len(names), nan)
    for row, name in enumerate(names):
        models = load(name).models
        first = next((scene for scene in scenes.values() if scene.model in models), None)
        if first is not None:
            costs = first_use(name, first, settings[name][0], cap)
            arrays["import_time"][row], arrays["warm_up_time"][row] = costs
    compile_at_once()
    warm: set[tuple[str, str]] = set()
    for number, scene in enumerate(scenes.values()):
        points: dict[tuple[int, int], _Point] = {}
        for row, name in enumerate(names):
            if scene.model in load(name).models:
                runs = [_bare(name, scene, setting, cap) for setting in settings[name]]
                points |= {(row, level): _Point(run) for level, run in enumerate(runs)}
                if (name, scene.model) not in warm:
                    runs[0]()
                    warm.add((name, scene.model))
        _take_turns(list(points.values()), repeats, spend)
        for (row, level), point in points.items():
            at = (number, row, level)
            low, middle, high = np.quantile(point.samples, (0.25, 0.5, 0.75))
            arrays["run_time"][at] = middle
            arrays["run_time_low"][at], arrays["run_time_high"][at] = low, high
            arrays["repeats"][at] = len(point.samples)
            arrays["outcome"][at] = OUTCOMES.index(point.outcome)
    arrays["periods"] = np.array([scene.periods for scene in scenes.values()])
    return arrays


def time_peers(
    scenes: Mapping[str, Scene],
    settings: Mapping[str, Sequence[float]],
    repeats: int,
    cap: float,
    spend: float = 0.2,
) -> dict[str, np.ndarray]:
    """Tell the fixed cost of a call apart from what the motion costs, for the solvers in `PEERS`.

    Parameters
    ----------
    scenes, settings, repeats, cap, spend
        As for `time_solvers`.

    Returns
    -------
    dict of str to ndarray
        Of shape (scene, solver, level), NaN for other solvers and for runs that fail: ``call_time``
        of a run that ends at once; ``stretch_time`` and ``stretch_impacts``, the further time and
        the impacts of a run `LONGER` times as long as the scene, both over `LONGER`.
    """
    names = solver_names(settings)
    shape = (len(scenes), len(names), max(map(len, settings.values())))
    found = ("call_time", "stretch_time", "stretch_impacts")
    arrays = {name: np.full(shape, nan) for name in found}
    compile_at_once()
    for number, scene in enumerate(scenes.values()):
        start, length = scene.state.time, scene.until - scene.state.time
        short = replace(scene, until=start + _AT_ONCE * length)
        long = replace(scene, until=start + LONGER * length)
        pairs = {
            (row, level): (
                _Point(_bare(name, short, setting, cap)),
                _Point(_bare(name, long, setting, LONGER * cap)),
            )
            for row, name in enumerate(names)
            if name in PEERS and scene.model in load(name).models
            for level, setting in enumerate(settings[name])
        }
        for call, _ in pairs.values():
            call.run()
        _take_turns([point for pair in pairs.values() for point in pair], repeats, spend)
        for (row, level), (call, stretch) in pairs.items():
            if call.outcome == stretch.outcome == FINISHED:
                fixed = median(call.samples)
                times = fixed, (median(stretch.samples) - fixed) / LONGER
                values = *times, stretch.impacts / LONGER
                for name, value in zip(found, values, strict=True):
                    arrays[name][number, row, level] = value
    return arrays


def first_use(name: str, scene: Scene, setting: float, cap: float) -> tuple[float, float]:
    """Seconds to import a solver, and of its first run beyond its second, in new processes."""
    given = pickle.dumps((scene, setting, most_evaluations(load(name), cap)))
    costs = []
    for _ in range(PROCESSES):
        done = subprocess.run(
            [sys.executable, "-c", _FIRST_USE, name], input=given, capture_output=True, check=True
        )
        costs.append([float(text) for text in done.stdout.split()])
    importing, warming = np.median(costs, axis=0)
    return float(importing), float(warming)


def machine() -> dict[str, str]:
    """Name what the times were taken on: processor, system, versions.

    Returns
    -------
    dict of str to str
    """
    found = {
        "processor": processor(),
        "cores": str(os.cpu_count()),
        "system": f"{platform.system()} {platform.release()}",
        "python": platform.python_version(),
    }
    for package in PACKAGES:
        try:
            found[package] = version(package)
        except PackageNotFoundError:
            found[package] = "not installed"
    return found


class _Point:
    """Samples of one scene, solver and level."""

    def __init__(self, run: Callable[[], Solution]) -> None:
        self.run = run
        self.calls = 1
        self.samples: list[float] = []
        self.spent = 0.0
        self.outcome = ""
        self.impacts = 0

    def sample(self) -> None:
        started = perf_counter()
        for _ in range(self.calls):
            solution = self.run()
        spent = perf_counter() - started
        self.spent += spent
        if not self.outcome:
            self.outcome = solution.outcome
            self.impacts = len(solution.impact_times)
            self.calls = max(math.ceil(SHORTEST / max(spent, 1e-9)), 1)
            if self.calls > 1:  # too short to count
                self.sample()
                return
        self.samples.append(spent / self.calls)


def _take_turns(points: Sequence[_Point], repeats: int, spend: float) -> None:
    collecting = gc.isenabled()
    gc.disable()  # as timeit does: garbage of one solver is not the time of the next
    try:
        for _ in range(repeats):
            for point in points:
                if not point.samples or point.spent < spend:
                    point.sample()
    finally:
        if collecting:
            gc.enable()


def _bare(name: str, scene: Scene, setting: float, cap: float) -> Callable[[], Solution]:
    solver = load(name)
    most = most_evaluations(solver, cap)
    return lambda: solver.solve(scene, setting, max_evaluations=most)

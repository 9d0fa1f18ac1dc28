"""How long every solver takes, and what its first use costs.

Times belong to the machine and the moment, so nothing here goes into a file whose bytes are
compared. All runs share one process and one thread, and take turns.
"""

import pickle
import subprocess
import sys
from collections.abc import Mapping, Sequence
from dataclasses import replace
from math import nan

import numpy as np

from damper.engine.compiled import compile_at_once
from damper.verification.comparison.best import LONGER, PEERS
from damper.verification.comparison.runs import NOT_APPLICABLE, most_evaluations, solver_names
from damper.verification.comparison.scene import Scene
from damper.verification.comparison.solution import FINISHED, OUTCOMES, Solution
from damper.verification.comparison.solvers import load
from damper.verification.timing import take_turns

#: Lower quartile, median and upper quartile.
TIMES = ("run_time_low", "run_time", "run_time_high")
#: New processes of which the median is the cost of a solver's first use.
PROCESSES = 3
#: Length of a run that ends at once, in that of the scene.
_AT_ONCE = 1e-6

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
    arrays: dict[str, np.ndarray] = {name: np.full(shape, nan) for name in TIMES}
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
        calls: dict[tuple[int, int], _Run] = {}
        for row, name in enumerate(names):
            if scene.model in load(name).models:
                here = [_Run(name, scene, setting, cap) for setting in settings[name]]
                calls |= {(row, level): call for level, call in enumerate(here)}
                if (name, scene.model) not in warm:
                    here[0]()
                    warm.add((name, scene.model))
        samples = take_turns(list(calls.values()), repeats, spend)
        quartiles = np.nanquantile(samples, (0.25, 0.5, 0.75), axis=0)
        for column, ((row, level), call) in enumerate(calls.items()):
            at = (number, row, level)
            for name, value in zip(TIMES, quartiles[:, column], strict=True):
                arrays[name][at] = value
            arrays["repeats"][at] = np.isfinite(samples[:, column]).sum()
            arrays["outcome"][at] = OUTCOMES.index(call.solution.outcome)
    arrays["periods"] = np.array([scene.periods for scene in scenes.values()])
    return arrays


def time_peers(
    scenes: Mapping[str, Scene],
    settings: Mapping[str, Sequence[float]],
    repeats: int,
    cap: float,
    spend: float = 0.2,
) -> dict[str, np.ndarray]:
    """Separate the fixed cost of a call from that of the motion, for the solvers in `PEERS`.

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
        places = [
            (row, level, setting)
            for row, name in enumerate(names)
            if name in PEERS and scene.model in load(name).models
            for level, setting in enumerate(settings[name])
        ]
        calls = [_Run(names[row], short, setting, cap) for row, _, setting in places]
        stretches = [_Run(names[row], long, setting, LONGER * cap) for row, _, setting in places]
        for call in calls:
            call()
        samples = take_turns([*calls, *stretches], repeats, spend)
        call_times, stretch_times = np.split(np.nanmedian(samples, axis=0), 2)
        for k, (row, level, _) in enumerate(places):
            solution = stretches[k].solution
            if calls[k].solution.outcome == solution.outcome == FINISHED:
                values = (
                    call_times[k],
                    (stretch_times[k] - call_times[k]) / LONGER,
                    len(solution.impact_times) / LONGER,
                )
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


class _Run:
    """The bare run of a solver, without states at given times and energy balance."""

    solution: Solution

    def __init__(self, name: str, scene: Scene, setting: float, cap: float) -> None:
        self._solver, self._scene, self._setting = load(name), scene, setting
        self._most = most_evaluations(self._solver, cap)

    def __call__(self) -> None:
        self.solution = self._solver.solve(self._scene, self._setting, max_evaluations=self._most)

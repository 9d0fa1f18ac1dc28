"""How long every solver takes.

Times belong to the machine and the moment, so nothing here goes into a file whose bytes are
compared. All runs share one process and one thread, and take turns.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from math import nan
from typing import Any

import numpy as np

from damper.engine.compiled import compile_at_once
from damper.parameters.lazy import xr
from damper.verification.comparison.best import LONGER, PEERS
from damper.verification.comparison.cube import TIMES, dataset
from damper.verification.comparison.scene import Scene, read_scene
from damper.verification.comparison.solution import FINISHED, Solution
from damper.verification.comparison.solvers import in_order, load
from damper.verification.timing import machine, take_turns

#: Lower quartile, median and upper quartile.
QUARTILES = ("run_time_low", "run_time", "run_time_high")
#: Length of a run that ends at once, in that of the scene.
_AT_ONCE = 1e-6


def measure(
    scenes: Mapping[str, Mapping[str, Any]],
    solvers: Mapping[str, Sequence[float]],
    titles: Mapping[str, str],
    attributes: Mapping[str, Any],
    **times: Any,
) -> xr.Dataset:
    """Time all solvers as a job of the workflow.

    `scenes` are arguments of `read_scene`, `times` of `time_solvers`.
    """
    read = {name: read_scene(**scene) for name, scene in scenes.items()}
    arrays = time_solvers(read, solvers, **times)
    return dataset(arrays, TIMES, solvers, titles, {**attributes, **machine()})


def time_solvers(
    scenes: Mapping[str, Scene],
    settings: Mapping[str, Sequence[float]],
    repeats: int,
    cap: float,
    spend: float = 0.2,
) -> dict[str, np.ndarray]:
    """Time all solvers, and separate a call's fixed cost from that of the motion for the `PEERS`.

    Each point (scene, solver, level) is sampled at least once, and up to `repeats` times until
    `spend` seconds are spent on it; `cap` is as for `run_scene`. Arrays are over (scene, solver,
    level), NaN where a solver has no such level: ``run_time``, the median, and its quartiles
    ``run_time_low`` and ``run_time_high`` in s. Of the peers, where the run finishes, ``call_time``
    of one that ends at once, and ``stretch_time`` and ``stretch_impacts``, the further time and the
    impacts of one that is `LONGER` times as long as the scene, both over `LONGER`.
    """
    names = in_order(settings)
    shape = len(scenes), len(names), max(map(len, settings.values()))
    arrays = {variable.name: np.full(shape, nan) for variable in TIMES}
    places = [(row, level) for row, n in enumerate(names) for level in range(len(settings[n]))]
    compile_at_once()
    for number, scene in enumerate(scenes.values()):
        length = scene.until - scene.state.time
        points = [(names[row], settings[names[row]][level]) for row, level in places]
        runs = [_Run(*point, scene, cap) for point in points]
        ends = [replace(scene, until=scene.state.time + k * length) for k in (_AT_ONCE, LONGER)]
        peers = [k for k, (name, _) in enumerate(points) if name in PEERS]
        short = [_Run(*points[k], ends[0], cap) for k in peers]
        long = [_Run(*points[k], ends[1], LONGER * cap) for k in peers]
        for row in range(len(names)):  # each is warm before it is timed
            runs[places.index((row, 0))]()
        samples = take_turns([*runs, *short, *long], repeats, spend)
        quartiles = np.nanquantile(samples, (0.25, 0.5, 0.75), axis=0)
        for place, values in zip(places, quartiles.T, strict=False):
            for name, value in zip(QUARTILES, values, strict=True):
                arrays[name][number, *place] = value
        calls, stretches = np.split(quartiles[1, len(runs) :], 2)
        for k, call, stretch, run in zip(peers, calls, stretches, long, strict=True):
            if run.solution.outcome == FINISHED:
                at = number, *places[k]
                arrays["call_time"][at] = call
                arrays["stretch_time"][at] = (stretch - call) / LONGER
                arrays["stretch_impacts"][at] = len(run.solution.impact_times) / LONGER
    return arrays


class _Run:
    """A run of a solver, and what came of it when it was last made."""

    solution: Solution

    def __init__(self, name: str, setting: float, scene: Scene, cap: float) -> None:
        self._solver, self._scene, self._setting = load(name), scene, setting
        self._most = self._solver.most_evaluations(cap)

    def __call__(self) -> None:
        self.solution = self._solver.solve(self._scene, self._setting, self._most)

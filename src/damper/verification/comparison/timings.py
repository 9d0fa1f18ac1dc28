"""How long every solver takes.

Times belong to the machine and the moment, so nothing here goes into a file whose bytes are
compared. All runs share one process and one thread, and take turns.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from functools import partial
from math import nan
from typing import Any

import numpy as np

from damper.engine.compiled import compile_at_once
from damper.parameters.lazy import xr
from damper.verification.comparison.cube import RUN_TIME, dataset
from damper.verification.comparison.scene import Scene, read_scene
from damper.verification.comparison.solvers import in_order, load
from damper.verification.timing import machine, take_turns


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
    arrays = {RUN_TIME.name: time_solvers(read, solvers, **times)}
    return dataset(arrays, [RUN_TIME], solvers, titles, {**attributes, **machine()})


def time_solvers(
    scenes: Mapping[str, Scene],
    settings: Mapping[str, Sequence[float]],
    repeats: int,
    cap: float,
    spend: float = 0.2,
) -> np.ndarray:
    """Time all solvers: medians in s over (scene, solver, level); NaN for no such level.

    Each point (scene, solver, level) is sampled at least once, and up to `repeats` times until
    `spend` seconds are spent on it; `cap` is as for `run_scene`.
    """
    names = in_order(settings)
    medians = np.full((len(scenes), len(names), max(map(len, settings.values()))), nan)
    places = [(row, level) for row, n in enumerate(names) for level in range(len(settings[n]))]
    compile_at_once()
    for number, scene in enumerate(scenes.values()):
        runs = []
        for row, level in places:
            solver, setting = load(names[row]), settings[names[row]][level]
            runs.append(partial(solver.solve, scene, setting, solver.most_evaluations(cap)))
        for row in range(len(names)):  # each is warm before it is timed
            runs[places.index((row, 0))]()
        found = np.nanmedian(take_turns(runs, repeats, spend), axis=0)
        medians[number][tuple(np.transpose(places))] = found
    return medians

"""Jobs of a comparison: errors of every solver on a scene, run times, and both as datasets.

Errors go into one file, with the same bytes every time; run times, which belong to the machine and
the moment, into another.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from functools import partial
from math import nan
from typing import Any

import numpy as np

from damper.analysis.labels import label_of
from damper.engine.compiled import compile_at_once
from damper.parameters.lazy import xr
from damper.parameters.variables import TIME, Variable
from damper.sweep.parts import PartData
from damper.verification.comparison import OUTCOMES, SOLVERS
from damper.verification.comparison.errors import (
    MEASURES,
    Reference,
    counted_impacts,
    measure_errors,
)
from damper.verification.comparison.solvers import Scene, load, read_scene
from damper.verification.timing import machine, take_turns

_DIMS = ("scene", "solver", "level")
#: What `run_scene` finds.
_FOUND = (
    Variable("reference_impacts", "impacts of the reference that count", "1"),
    Variable("until", "end of the run", TIME),
    Variable("periods", "forcing periods from start to end", "1"),
    *MEASURES,
    Variable("reached", "time at which the run ended", TIME),
)
_OUTCOME = Variable(
    "outcome",
    "what became of the run",
    "1",
    comment="errors are those of the events found: judge missed ones by this; missing where "
    "the solver has no such level",
    flags=OUTCOMES,
)
#: What `time_solvers` finds.
RUN_TIME = Variable("run_time", "run time, median of the repetitions", "s")

#: Solver -> values of its setting, from coarse to fine: its levels.
Levels = Mapping[str, Sequence[float]]


def run_part(
    needed: Sequence[PartData], scene: Mapping[str, Any], solvers: Levels, cap: float
) -> PartData:
    """Run all solvers on a scene as a job of the workflow, which needs its reference."""
    (about,) = (part.about for part in needed)
    numbers = ([float(text) for text in about[name]] for name in Reference._fields)
    reference = Reference(*map(np.array, numbers))
    return PartData(run_scene(read_scene(**scene), solvers, reference, cap))


def run_scene(
    scene: Scene, solvers: Levels, reference: Reference, cap: float
) -> dict[str, np.ndarray]:
    """Run all levels of all solvers on one scene.

    `cap` is what a run may cost, in seconds of a nominal machine; see `Solver.most_evaluations`.
    Arrays have the shape (solver, level), solvers in the order of `SOLVERS`, padded to the solver
    with the most levels: `MEASURES` and ``reached`` (NaN where there is no run), and ``outcome``
    (index in `OUTCOMES`, -1 where there is no run). And of the scene, without dimensions:
    ``reference_impacts`` that count, ``until``, ``periods``.
    """
    shape = _settings(solvers).shape
    arrays = {name: np.full(shape, nan) for name in (*(v.name for v in MEASURES), "reached")}
    arrays["outcome"] = np.full(shape, -1, dtype="i1")
    for row, name in enumerate(_in_order(solvers)):
        solver = load(name)
        for level, setting in enumerate(solvers[name]):
            solution = solver.solve(scene, setting, solver.most_evaluations(cap))
            outcome, measured = measure_errors(scene, reference, solution)
            for key, value in measured.items():
                arrays[key][row, level] = value
            arrays["outcome"][row, level] = OUTCOMES.index(outcome)
            arrays["reached"][row, level] = solution.reached
    return arrays | {
        "reference_impacts": np.array(counted_impacts(reference)),
        "until": np.array(scene.until),
        "periods": np.array(scene.periods),
    }


def gather(
    parts: Sequence[PartData],
    solvers: Levels,
    titles: Mapping[str, str],
    attributes: Mapping[str, Any],
) -> xr.Dataset:
    """Put the runs of all scenes, as `run_scene` returned them, together in the order to be shown.

    Dimensions are ``scene``, ``solver``, ``level``. `titles` has a few words for each scene.
    """
    from damper.sweep.cube import described

    names = [variable.name for variable in (*_FOUND, _OUTCOME)]
    arrays = {name: np.stack([part.arrays[name] for part in parts]) for name in names}
    cube = dataset(arrays, _FOUND, solvers, titles, attributes)
    cube["outcome"] = described(_OUTCOME, arrays["outcome"], _DIMS, missing=True)
    return cube


def measure(
    scenes: Mapping[str, Mapping[str, Any]],
    solvers: Levels,
    titles: Mapping[str, str],
    attributes: Mapping[str, Any],
    **times: Any,
) -> xr.Dataset:
    """Time all solvers as a job of the workflow.

    `scenes` are arguments of `read_scene`, `times` of `time_solvers`.
    """
    read = [read_scene(**scene) for scene in scenes.values()]
    arrays = {RUN_TIME.name: time_solvers(read, solvers, **times)}
    return dataset(arrays, [RUN_TIME], solvers, titles, {**attributes, **machine()})


def time_solvers(
    scenes: Sequence[Scene], solvers: Levels, repeats: int, cap: float, spend: float = 0.2
) -> np.ndarray:
    """Time all solvers in one process: medians in s over (scene, solver, level); NaN for no level.

    The runs of a scene take turns. Each is timed at least once, and up to `repeats` times until
    `spend` seconds are spent on it; `cap` is as for `run_scene`.
    """
    settings = _settings(solvers)
    medians = np.full((len(scenes), *settings.shape), nan)
    compile_at_once()
    for number, scene in enumerate(scenes):
        runs = {}
        for row, name in enumerate(_in_order(solvers)):
            solver = load(name)
            for level, setting in enumerate(solvers[name]):
                most = solver.most_evaluations(cap)
                runs[row, level] = partial(solver.solve, scene, setting, most)
            runs[row, 0]()  # each is warm before it is timed
        found = np.nanmedian(take_turns(list(runs.values()), repeats, spend), axis=0)
        medians[number][tuple(np.transpose(list(runs)))] = found
    return medians


def dataset(
    arrays: Mapping[str, np.ndarray],
    variables: Iterable[Variable],
    solvers: Levels,
    titles: Mapping[str, str],
    attributes: Mapping[str, Any],
) -> xr.Dataset:
    """Arrays over scene, solver and level, or the first of these, as a dataset."""
    from damper.sweep.cube import described

    names, settings = _in_order(solvers), _settings(solvers)
    coordinates = {
        "scene": ("scene", list(titles), "scene"),
        "solver": ("solver", names, "solver"),
        "level": ("level", np.arange(1, settings.shape[1] + 1), "level, from coarse to fine"),
        "title": ("scene", list(titles.values()), "title of the scene"),
        "label": ("solver", [label_of(name) for name in names], "name of the solver in print"),
        "setting_name": ("solver", [SOLVERS[name] for name in names], "what is varied"),
    }
    coords = {
        name: described(Variable(name, words, "", (dim,)), values)
        for name, (dim, values, words) in coordinates.items()
    }
    setting = Variable("setting", "the solver's setting", "1", _DIMS[1:])
    data = {"setting": described(setting, settings)}
    for variable in variables:
        array = arrays[variable.name]
        data[variable.name] = described(variable, array, _DIMS[: array.ndim])
    return xr.Dataset(data, coords, dict(attributes))


def _in_order(solvers: Levels) -> list[str]:
    return [name for name in SOLVERS if name in solvers]


def _settings(solvers: Levels) -> np.ndarray:
    """Settings over (solver, level), NaN for no such level."""
    settings = np.full((len(solvers), max(map(len, solvers.values()))), nan)
    for row, name in enumerate(_in_order(solvers)):
        settings[row, : len(solvers[name])] = solvers[name]
    return settings

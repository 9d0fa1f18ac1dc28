"""Cubes of the comparison of solvers: errors and outcomes in one, run times in another."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping, Sequence
from typing import Any

import numpy as np

from damper.analysis.labels import label_of
from damper.parameters.lazy import xr
from damper.parameters.variables import TIME, Variable
from damper.sweep.parts import PartData
from damper.verification.comparison.errors import MEASURES, OUTCOMES
from damper.verification.comparison.solvers import in_order, load

_DIMS = ("scene", "solver", "level")
#: What `damper.verification.comparison.runs.run_scene` finds.
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
#: What `damper.verification.comparison.timings.time_solvers` finds.
RUN_TIME = Variable("run_time", "run time, median of the repetitions", "s")


def gather(
    parts: Sequence[PartData],
    solvers: Mapping[str, Sequence[float]],
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


def dataset(
    arrays: Mapping[str, np.ndarray],
    variables: Iterable[Variable],
    settings: Mapping[str, Sequence[float]],
    titles: Mapping[str, str],
    attributes: Mapping[str, Any],
) -> xr.Dataset:
    """Arrays over scene, solver and level, or the first of these, as a dataset."""
    from damper.sweep.cube import described

    names = in_order(settings)
    solvers = [load(name) for name in names]
    levels = np.full((len(names), max(map(len, settings.values()))), math.nan)
    for row, name in enumerate(names):
        levels[row, : len(settings[name])] = settings[name]
    coordinates = {
        "scene": ("scene", list(titles), "scene"),
        "solver": ("solver", names, "solver"),
        "level": ("level", np.arange(1, levels.shape[1] + 1), "level, from coarse to fine"),
        "title": ("scene", list(titles.values()), "title of the scene"),
        "label": ("solver", [label_of(name) for name in names], "name of the solver in print"),
        "setting_name": ("solver", [solver.setting for solver in solvers], "what is varied"),
    }
    coords = {
        name: described(Variable(name, words, "", (dim,)), values)
        for name, (dim, values, words) in coordinates.items()
    }
    setting = Variable("setting", "the solver's setting", "1", _DIMS[1:])
    data = {"setting": described(setting, levels)}
    for variable in variables:
        array = arrays[variable.name]
        data[variable.name] = described(variable, array, _DIMS[: array.ndim])
    return xr.Dataset(data, coords, dict(attributes))

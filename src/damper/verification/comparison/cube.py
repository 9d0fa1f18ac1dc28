"""Cubes of the comparison of solvers: errors and outcomes in one, run times in another."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping, Sequence
from itertools import combinations
from statistics import median
from typing import Any

import numpy as np

from damper.analysis.labels import label_of
from damper.engine.roundoff import EPSILON
from damper.parameters.lazy import xr
from damper.parameters.variables import TIME, Variable
from damper.sweep.parts import PartData
from damper.verification.comparison.errors import GOOD, MEASURES, OUTCOMES
from damper.verification.comparison.solvers import in_order, load

#: Errors of which a solver's order is estimated.
ERRORS = ("impact_time_error", "accumulation_error", "release_error", "state_error")
#: Rounding of an error in units of the last place, before it has grown with the motion.
_ROUNDING = 100.0
#: Fewest levels above roundoff that give an order.
_FEWEST = 3

_DIMS = ("scene", "solver", "level")
#: What `damper.verification.comparison.runs.run_scene` finds.
_FOUND = (
    Variable("reference_impacts", "impacts of the reference that count", "1"),
    Variable("sensitivity", "largest growth of a small change of the start until the end", "1"),
    Variable("until", "end of the run", TIME),
    Variable("periods", "forcing periods from start to end", "1"),
    *MEASURES.values(),
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
TIMES = (
    Variable("run_time", "run time, median of the repetitions", "s"),
    Variable("run_time_low", "run time, lower quartile", "s"),
    Variable("run_time_high", "run time, upper quartile", "s"),
    Variable("call_time", "fixed cost of a call: run time of a run that ends at once", "s"),
    Variable(
        "stretch_time", "run time beyond that, in a long run, for each length of the scene", "s"
    ),
    Variable("stretch_impacts", "impacts in a long run for each length of the scene", "1"),
)


def gather(
    parts: Sequence[PartData],
    solvers: Mapping[str, Sequence[float]],
    titles: Mapping[str, str],
    attributes: Mapping[str, Any],
) -> xr.Dataset:
    """Put the runs of all scenes, as `run_scene` returned them, together in the order to be shown.

    Dimensions are ``scene``, ``solver``, ``level``. For each error there is an order, ``order_``
    and its name, over scene and solver. `titles` has a few words for each scene.
    """
    from damper.sweep.cube import described

    names = [variable.name for variable in (*_FOUND, _OUTCOME)]
    arrays = {name: np.stack([part.arrays[name] for part in parts]) for name in names}
    cube = dataset(arrays, _FOUND, solvers, titles, attributes)
    cube["outcome"] = described(_OUTCOME, arrays["outcome"], _DIMS, missing=True)
    for name in ERRORS:
        orders = [
            [order_at(cube.isel(scene=scene, solver=row), name) for row in range(len(solvers))]
            for scene in range(len(parts))
        ]
        about = Variable(f"order_{name}", f"observed order: {cube[name].long_name}", "1")
        cube[about.name] = described(about, np.array(orders, dtype=float), _DIMS[:2])
    return cube


def order_at(place: xr.Dataset, name: str) -> float:
    """Observed order of one error at one scene and solver.

    The median of the slopes of log error over log refinement between all pairs of levels that are
    good and above rounding: 1 where the error halves as the setting (or, where larger is finer, its
    inverse) is halved. NaN if these are fewer than 3.
    """
    error, setting = place[name].values, place.setting.values
    floor = _ROUNDING * EPSILON * max(float(place.sensitivity), float(place.until), 1.0)
    good = (place.outcome.values == GOOD) & (error > floor)
    points = list(zip(np.log(setting[good]), np.log(error[good]), strict=True))
    if len(points) < _FEWEST:
        return math.nan
    slopes = [(b[1] - a[1]) / (b[0] - a[0]) for a, b in combinations(points, 2)]
    return -float(place.finer) * median(slopes)


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
        "finer": (
            "solver",
            np.array([solver.finer for solver in solvers], dtype="i1"),
            "1 where a larger setting is the finer one, else -1",
        ),
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

"""Cubes of the comparison of solvers: errors and outcomes in one, run times in another."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from itertools import combinations
from statistics import median
from typing import TYPE_CHECKING, Any

import numpy as np

from damper.parameters.variables import TIME
from damper.verification.comparison.errors import MEASURES, VERDICTS
from damper.verification.comparison.runs import solver_names
from damper.verification.comparison.solution import OUTCOMES
from damper.verification.comparison.solvers import load
from damper.verification.labels import label_of

if TYPE_CHECKING:
    import xarray as xr

#: Errors of which a solver's order is estimated.
ERRORS = (
    "impact_time_error",
    "accumulation_error",
    "release_error",
    "state_error",
    "penetration",
    "energy_residual",
)
#: Errors that grow with the sensitivity of the motion, rounding included.
_GROWING = ("impact_time_error", "accumulation_error", "release_error", "state_error")
#: Rounding in units of the last place: of an error, before it has grown; of the balance, a sum of
#: some 1e5 terms.
_ROUNDING, _BALANCE = 100.0, 1000.0
_EPS = float(np.finfo(float).eps)
#: Fewest levels above roundoff that give an order.
_FEWEST = 3

_SCENE = {
    "reference_impacts": ("impacts of the reference that count", "1"),
    "sensitivity": ("largest growth of a small change of the start until the end", "1"),
    "until": ("end of the run", TIME),
    "periods": ("forcing periods from start to end", "1"),
    "rigid": ("1 rigid walls, 0 compliant contact", "1"),
}
_LEVEL = {
    "setting": ("the solver's setting", "1"),
    **MEASURES,
    "reached": ("time at which the run ended", TIME),
}
_TIMES = {
    "run_time": ("run time, median of the repetitions", "s"),
    "run_time_low": ("run time, lower quartile", "s"),
    "run_time_high": ("run time, upper quartile", "s"),
    "repeats": ("repetitions timed", "1"),
    "call_time": ("fixed cost of a call: run time of a run that ends at once", "s"),
    "stretch_time": ("run time beyond that, in a long run, for each length of the scene", "s"),
    "stretch_impacts": ("impacts in a long run for each length of the scene", "1"),
}
_FIRST = {
    "import_time": ("import of the solver in a new process", "s"),
    "warm_up_time": ("what the first run in a process takes longer than the second", "s"),
}
_COMMENTS = {
    "state_error": "velocities in F0/sqrt(K M)",
    "evaluations": "what one costs differs from solver to solver",
    "verdict": "errors are those of the events found: judge missed ones by the verdict",
}


def gather_errors(
    parts: Mapping[str, Mapping[str, np.ndarray]],
    settings: Mapping[str, Sequence[float]],
    titles: Mapping[str, str],
    attributes: Mapping[str, Any],
) -> xr.Dataset:
    """Put the runs of all scenes together.

    Parameters
    ----------
    parts : mapping of str to mapping
        For each scene, in the order to be shown, what
        `damper.verification.comparison.runs.run_scene` returned.
    settings : mapping of str to sequence of float
        Levels of each solver, as given there.
    titles : mapping of str to str
        A few words for each scene.
    attributes : mapping
        Global attributes.

    Returns
    -------
    xarray.Dataset
        Dimensions ``scene``, ``solver``, ``level``. For each error an order, ``order_`` and its
        name, over scene and solver.
    """

    import xarray as xr

    dims = ("scene", "solver", "level")
    names = solver_names(settings)
    data: dict[str, Any] = {}
    for name, (long_name, units) in _SCENE.items():
        values = np.array([part[name] for part in parts.values()])
        data[name] = ("scene", values, {"long_name": long_name, "units": units})
    for name, (long_name, units) in _LEVEL.items():
        values = np.stack([part[name] for part in parts.values()])
        attrs = {"long_name": long_name, "units": units}
        if name == "setting":  # the same in all scenes
            data[name] = (dims[1:], values[0], attrs)
        else:
            data[name] = (dims, values, attrs)
    for name, long_name, meanings in (
        ("outcome", "how the solver ended", OUTCOMES),
        ("verdict", "what became of the run", VERDICTS),
    ):
        values = np.stack([part[name] for part in parts.values()])
        data[name] = _flags(dims, values, long_name, meanings)
    cube = xr.Dataset(data, _coordinates(list(parts), settings, titles), dict(attributes))
    for name in ERRORS:
        orders = [
            [order_at(cube.isel(scene=scene, solver=row), name) for row in range(len(names))]
            for scene in range(len(parts))
        ]
        attrs = {"long_name": f"observed order: {MEASURES[name][0]}", "units": "1"}
        cube[f"order_{name}"] = (dims[:2], np.array(orders, dtype=float), attrs)
    for name, text in _COMMENTS.items():
        cube[name].attrs["comment"] = "; ".join(
            filter(None, [text, cube[name].attrs.get("comment", "")])
        )
    return cube


def gather_timings(
    arrays: Mapping[str, np.ndarray],
    scenes: Sequence[str],
    settings: Mapping[str, Sequence[float]],
    titles: Mapping[str, str],
    attributes: Mapping[str, Any],
) -> xr.Dataset:
    """Put run times into a cube.

    Parameters
    ----------
    arrays : mapping of str to ndarray
        What `time_solvers` and `time_peers` of `damper.verification.comparison.timings` returned.
    scenes : sequence of str
        Names of the scenes, in the order given there.
    settings, titles : mapping
        As for `gather_errors`.
    attributes : mapping
        Global attributes; with `damper.verification.timing.machine`.

    Returns
    -------
    xarray.Dataset
        Dimensions ``scene``, ``solver``, ``level``.
    """

    import xarray as xr

    dims = ("scene", "solver", "level")
    names = solver_names(settings)
    setting = np.full(arrays["run_time"].shape[1:], math.nan)
    for row, name in enumerate(names):
        setting[row, : len(settings[name])] = settings[name]
    data: dict[str, Any] = {
        "setting": (dims[1:], setting, {"long_name": _LEVEL["setting"][0], "units": "1"})
    }
    for kind, over in ((_TIMES, dims), (_FIRST, dims[1:2])):
        for name, (long_name, units) in kind.items():
            data[name] = (over, arrays[name], {"long_name": long_name, "units": units})
    long_name, units = _SCENE["periods"]
    data["periods"] = ("scene", arrays["periods"], {"long_name": long_name, "units": units})
    data["outcome"] = _flags(dims, arrays["outcome"], "how the solver ended", OUTCOMES)
    return xr.Dataset(data, _coordinates(scenes, settings, titles), dict(attributes))


def order_at(place: xr.Dataset, name: str) -> float:
    """Observed order of one error at one scene and solver.

    Parameters
    ----------
    place : xarray.Dataset
        With the dimension ``level`` alone.
    name : str
        One of `ERRORS`.

    Returns
    -------
    float
        The median of the slopes of log error over log refinement between all pairs of levels that
        are good and above rounding: 1 where the error halves as the setting (or, where larger is
        finer, its inverse) is halved. NaN if these are fewer than 3.
    """
    error, setting = place[name].values, place.setting.values
    if name == "penetration" and not int(place.rigid):  # of compliant contact it is no error
        return math.nan
    floor = rounding(place) if name in _GROWING else _BALANCE * _EPS
    good = (place.verdict.values == VERDICTS.index("good")) & (error > floor)
    points = list(zip(np.log(setting[good]), np.log(error[good]), strict=True))
    if len(points) < _FEWEST:
        return math.nan
    slopes = [(b[1] - a[1]) / (b[0] - a[0]) for a, b in combinations(points, 2)]
    return -float(place.finer) * median(slopes)


def rounding(place: xr.Dataset) -> float:
    """Error that rounding alone may make: some units in the last place, grown with the motion."""
    return _ROUNDING * _EPS * max(float(place.sensitivity), float(place.until), 1.0)


def _coordinates(
    scenes: Sequence[str], settings: Mapping[str, Sequence[float]], titles: Mapping[str, str]
) -> dict[str, Any]:
    names = solver_names(settings)
    levels = max(map(len, settings.values()))
    solvers = [load(name) for name in names]
    of_solvers = {
        "label": ([label_of(name) for name in names], "name of the solver in print"),
        "setting_name": ([solver.setting for solver in solvers], "what is varied"),
        "finer": (
            np.array([solver.finer for solver in solvers], dtype="i1"),
            "1 where a larger setting is the finer one, else -1",
        ),
    }
    return {
        "scene": ("scene", list(scenes), {"long_name": "scene"}),
        "level": ("level", np.arange(1, levels + 1), {"long_name": "level, from coarse to fine"}),
        "solver": ("solver", list(names), {"long_name": "solver"}),
        "title": ("scene", [titles[name] for name in scenes], {"long_name": "title of the scene"}),
        **{
            name: ("solver", values, {"long_name": long_name})
            for name, (values, long_name) in of_solvers.items()
        },
    }


def _flags(
    dims: tuple[str, ...], values: np.ndarray, long_name: str, meanings: Sequence[str]
) -> tuple[Any, ...]:
    from damper.sweep.cube import integers

    attrs = {
        "long_name": long_name,
        "units": "1",
        "flag_values": np.arange(len(meanings), dtype="i1"),
        "flag_meanings": " ".join(meanings),
        "comment": "missing where the solver cannot take the scene",
    }
    return integers(dims, values, attrs)

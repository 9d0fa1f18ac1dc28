"""Grids of runs on a structure, and the cube of what was measured."""

from __future__ import annotations

import json
from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import replace
from functools import partial
from itertools import product
from typing import Any

import numpy as np

from damper.observers import make_observers, of_all_masses
from damper.parameters.lazy import xr
from damper.parameters.masses import listed, own_values
from damper.parameters.names import OF_A_MASS_STRUCTURE
from damper.parameters.run import RunSettings
from damper.parameters.structural import StructureParameters
from damper.parameters.structure_results import MOST_POINTS, VARIABLES
from damper.parameters.tables import WALL_TABLES
from damper.parameters.unit_text import number_in
from damper.parameters.variables import SI_UNITS
from damper.sweep.cube import described
from damper.sweep.estimate import MOST_CYCLES
from damper.sweep.progress import Progress

#: Work of runs (`StructureParameters.work`) that takes plain Python longer than to compile.
_WORTH_COMPILING = 20_000.0


def measured_grid(
    parameters: StructureParameters,
    axes: Mapping[str, Sequence[float]],
    cycles: tuple[float, float],
    samples: int = 0,
    history: int = 0,
    engine: Mapping[str, Any] | None = None,
    state: Any = None,
    progress: Progress | None = None,
    observers: Mapping[str, Mapping[str, Any]] | None = None,
    workers: int | None = 1,
    start: Mapping[str, Sequence[float]] | None = None,
) -> dict[str, np.ndarray]:
    """Measure runs at all combinations of values, which are checked before any of them starts.

    Arguments are those of `damper.sweep.measured.measured`; `start` is that of
    `StructureParameters.started`, in place of a state. The arrays have the axes first.
    """
    from damper.engine.compiled import compiling
    from damper.sweep.measured import measured  # the engine with it
    from damper.sweep.runs import in_threads

    places = [dict(zip(axes, values, strict=True)) for values in product(*axes.values())]
    points = [parameters.having(place) if place else parameters for place in places]
    states = [state if start is None else point.started(**start) for point in points]
    made, begun = make_observers(observers or {}, boxes=True), state.time if state else 0.0
    for point, one in product(points, made):
        end = begun + point.cycle * sum(cycles)
        one.require_drive(point.forcing.kind, point.forcing.end, end)
    runs = [
        partial(measured, point, cycles, samples, history, own, engine, observers)
        for point, own in zip(points, states, strict=True)
    ]
    pays = len(runs) * parameters.work(sum(cycles)) > _WORTH_COMPILING
    with compiling(pays):
        found = in_threads(runs, workers, progress)
    shape = tuple(map(len, axes.values()))
    return {
        name: np.stack([one[name] for one in found]).reshape((*shape, *np.shape(found[0][name])))
        for name in found[0]
    }


def structure_cube(
    arrays: Mapping[str, np.ndarray],
    axes: Mapping[str, tuple[Sequence[float], str, str]],
    points: Sequence[str],
    attributes: Mapping[str, Any],
    fixed: Mapping[str, tuple[float, str, str]] | None = None,
    observers: Mapping[str, Mapping[str, Any]] | None = None,
) -> xr.Dataset:
    """Make a cube of arrays that have the axes first.

    Of each axis the values, their unit, and words; of what is `fixed` the value. `observers` are
    those that wrote further arrays.
    """
    data = {
        v.name: described(v, arrays[v.name], tuple(axes)) for v in VARIABLES if v.name in arrays
    }
    coords: dict[str, Any] = {
        name: (name, list(values), {"long_name": words, "units": unit})
        for name, (values, unit, words) in axes.items()
    }
    coords |= {
        name: ((), value, {"long_name": words, "units": unit})
        for name, (value, unit, words) in (fixed or {}).items()
    }
    coords |= {"point": list(points), "mode": np.arange(1, arrays["mean_energy"].shape[-1] + 1)}
    coords["body"] = np.arange(arrays["impact_power"].shape[-1])
    for one in make_observers(observers or {}, boxes=True):
        for name, along in one.coordinates().items():
            coords.setdefault(name, along)
        for v in one.variables:
            own = replace(v, units=SI_UNITS.get(v.units, v.units))
            data[v.name] = described(own, arrays[v.name], tuple(axes), True)
    status = arrays["status"]
    counts = {"runs": status.size, "runs_stopped_early": int((status != 0).sum())}
    return xr.Dataset(data, coords, {**attributes, **counts})


def simulate_structure(
    parameters: StructureParameters | None,
    given: Mapping[str, Any],
    run: Mapping[str, Any],
    state: Any = None,
    progress: Progress | None = None,
    observers: Mapping[str, Mapping[str, Any] | None] | None = None,
    workers: int | None = None,
) -> xr.Dataset:
    """Measure every combination of the given values, as `damper.simulate` for a structure.

    Parameters
    ----------
    parameters : StructureParameters, optional
    given : mapping
        Values by name; a sequence makes a dimension, also among those of `masses`.
    run : mapping
        Settings of every run, those of `RunSettings`.
    state : State, optional
        Start of every run.
    progress : callable, optional
        Called with the number of points done, and of all.
    observers : mapping of str to settings, optional
        Those of `damper.simulate` that know structures; they observe every free mass.
    workers : int, optional
        Threads, as for `damper.simulate`.

    Raises
    ------
    ValueError, TypeError
        As `damper.SIParameters`, and for too many points.
    """
    values = dict(given)
    if values.get("masses") is not None:
        masses = listed(values["masses"], (*OF_A_MASS_STRUCTURE, *WALL_TABLES))
        own = {name: v for name, v in own_values(masses).items() if _runs(v)}
        values["masses"] = [
            {n: v[0] if f"{n}_{k}" in own else v for n, v in one.items()}
            for k, one in enumerate(masses)
        ]
        values |= own
    run_through = [name for name in values if _runs(values[name]) and name not in WALL_TABLES]
    named = {name: values.pop(name) for name in run_through}
    if parameters is None:
        first = values | {name: _sequence(name, along)[0] for name, along in named.items()}
        made = {name: first.pop(name) for name in [*first] if name in _KNOWN}
        parameters = StructureParameters.of_any(**made).having(first)
    else:
        parameters = parameters.having(values)
    axes = {name: _numbers(parameters, name, along) for name, along in named.items()}
    if np.prod([len(v) for v in axes.values()]) > MOST_POINTS:
        raise ValueError(f"{' x '.join(axes)}: too many points, at most {MOST_POINTS}")
    settings = RunSettings(**run)
    begun = 0.0 if state is None else state.time
    cycles = settings.cycles(parameters.cycle, parameters.forcing.end - begun)
    if sum(cycles) > MOST_CYCLES:
        raise ValueError(
            f"periods: {cycles[0]:g} + {cycles[1]:g} cycles (transient + periods): must be at most "
            f"{MOST_CYCLES} in a run on a structure"
        )
    engine = {"accuracy": settings.accuracy, "max_events": settings.max_events}
    watching = of_all_masses(observers or {}, len(parameters.each))
    more = {
        "engine": engine,
        "state": state,
        "progress": progress,
        "observers": watching,
        "workers": workers,
    }
    arrays = measured_grid(parameters, axes, cycles, **more)
    units = {name: parameters.quantity_of(name).units for name in axes}
    attributes = {
        "title": "Impact dampers on a structure",
        "structure": repr(parameters.structure),
        "forcing": json.dumps(parameters.forcing.settings),
        "transient_periods": cycles[0],
        "recorded_periods": cycles[1],
        **engine,
    }
    along = {n: (values, units[n], parameters.words_of(n)) for n, values in axes.items()}
    names = [*parameters.structure.points]
    return structure_cube(arrays, along, names, attributes, observers=watching)


#: Arguments of `damper.SIParameters` for a structure.
_KNOWN = frozenset(StructureParameters.__dataclass_fields__)


def _runs(value: Any) -> bool:
    """Whether a value makes a dimension."""
    if hasattr(value, "__array__"):
        return np.ndim(value) > 0
    return isinstance(value, list | tuple | range) and not (
        len(value) and isinstance(value[0], dict)
    )


def _numbers(parameters: StructureParameters, name: str, along: Any) -> list[float]:
    """Check the values of an axis."""
    quantity = parameters.quantity_of(name)
    along = number_in(name, along, [quantity.units])
    found = [
        quantity.check(v.item() if isinstance(v, np.generic) else v) for v in _sequence(name, along)
    ]
    most, times = Counter(found).most_common(1)[0]
    if times > 1:
        raise ValueError(f"{name}: {most!r} is given {times} times")
    return found


def _sequence(name: str, along: Any) -> list[Any]:
    """Return the values of an axis as a list, whatever class they come in."""
    along = np.asarray(along).tolist() if hasattr(along, "__array__") else along
    if np.ndim(along) != 1 or len(along) == 0:
        raise ValueError(f"{name}: must be a number or a non-empty one-dimensional sequence")
    return list(along)

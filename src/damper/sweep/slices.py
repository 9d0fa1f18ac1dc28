"""Slices: the part of a study's cube that one simulation job makes, as an .npz file.

No xarray here: a simulation job writes plain arrays, with the same bytes each time, and the
descriptions that gathering needs as one JSON text.
"""

import json
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import asdict, dataclass, field, replace
from io import BytesIO
from pathlib import Path
from typing import Any
from zipfile import BadZipFile

import numpy as np

from damper.observers import make_observers
from damper.parameters import State
from damper.parameters.quantities import is_si
from damper.parameters.run import RunSettings
from damper.parameters.variables import SI_UNITS, Variable
from damper.sweep.branches import Branches, branches
from damper.sweep.estimate import Job, run_sizes
from damper.sweep.grid import product
from damper.sweep.progress import Progress

_DESCRIPTION = "__description__"


@dataclass(frozen=True)
class Slice:
    """What a simulation job made: arrays over its runs, their descriptions and coordinates.

    The runs are the product of the job's axes and of `branches`, such as both directions of a
    continuation. `labels` are drawn quantities along the branch dimension `draw`.
    """

    arrays: dict[str, np.ndarray]
    variables: tuple[Variable, ...]
    coordinates: dict[str, list[float]]
    branches: dict[str, list[Any]] = field(default_factory=dict)
    labels: dict[str, list[float]] = field(default_factory=dict)


def simulate_slice(
    fixed: Mapping[str, float],
    axes: Mapping[str, Sequence[float]],
    *,
    observers: Iterable[str] | Mapping[str, Mapping[str, Any] | None],
    primary: str = "rest",
    draws: Mapping[str, Any] | None = None,
    follow: Mapping[str, str] | None = None,
    state: State | None = None,
    progress: Progress | None = None,
    workers: int | None = 1,
    **run: Any,
) -> Slice:
    """Simulate one slice.

    Parameters
    ----------
    fixed : mapping of str to float
        Fixed quantities, and the slice's place along the fanned axes.
    axes : mapping of str to values
        The axes that run inside the job.
    observers, primary, state, progress, workers, **run
        As for `damper.sweep.runs.run_points`.
    draws : mapping, optional
        As for `damper.sweep.branches.draw`.
    follow : mapping of str to str, optional
        The axis to be followed by continuation -> "up", "down" or "both".

    Returns
    -------
    Slice
        In SI units if the points are given in them.

    Raises
    ------
    ValueError, TypeError
        As `run_points`, and for too many runs before they are listed.
    """
    # Loads the engine, and numba with it; reading a slice needs neither.
    from damper.sweep.runs import run_points

    settings = RunSettings(**run)
    observers = list(observers) if isinstance(observers, Iterator) else observers
    counts = {name: len(values) for name, values in axes.items()}
    draws = draws or {}
    sizes = run_sizes(counts, draws.get("count"), follow or {})
    made = make_observers(observers)
    Job(sizes, settings.transient, settings.periods, made).refuse_excess()
    plan = branches(product(axes, fixed), axes, draws, follow or {})
    arrays, made = run_points(
        plan.points,
        observers,
        primary=primary,
        state=state,
        after=plan.after,
        progress=progress,
        workers=workers,
        **run,
    )
    variables = tuple(variable for observer in made for variable in observer.variables)
    if is_si([*fixed, *axes, *plan.labels]):
        variables = _in_si(arrays, variables, plan)
    return Slice(
        arrays,
        variables,
        {k: v.tolist() for observer in made for k, v in observer.coordinates().items()},
        plan.dimensions,
        plan.labels,
    )


def _in_si(
    arrays: dict[str, np.ndarray], variables: tuple[Variable, ...], plan: Branches
) -> tuple[Variable, ...]:
    """Scale arrays to SI units, each run by its own; return their descriptions."""
    from damper.sweep.points import read_point

    units = [read_point(point).units for point in plan.points]
    for variable in variables:
        if variable.units in SI_UNITS:
            array = arrays[variable.name]
            sizes = np.array([unit.size(variable.units) for unit in units])
            array *= sizes.reshape(-1, *[1] * (array.ndim - 1))
    return tuple(replace(v, units=SI_UNITS.get(v.units, v.units)) for v in variables)


def write_slice(part: Slice, path: Path) -> None:
    """Write a slice as .npz."""
    description = {
        "arrays": list(part.arrays),
        "variables": [asdict(variable) for variable in part.variables],
        "coordinates": part.coordinates,
        "branches": part.branches,
        "labels": part.labels,
    }
    text = json.dumps(description, sort_keys=True)
    arrays: dict[str, Any] = {_DESCRIPTION: np.array(text), **part.arrays}
    np.savez(path, **arrays)


class DamagedSliceError(Exception):
    """A file is not, or no longer, what a job wrote."""


def read_arrays(path: Path) -> dict[str, np.ndarray]:
    """Read an .npz file.

    Raises
    ------
    DamagedSliceError
        With the path, where the file was cut or changed.
    """
    stream = BytesIO(path.read_bytes())
    try:
        with np.load(stream) as file:
            if bad := file.zip.testzip():
                raise ValueError(f"the bytes of {bad} have changed")
            return {name: file[name] for name in file.files}
    except (BadZipFile, EOFError, KeyError, NotImplementedError, ValueError) as error:
        raise DamagedSliceError(f"{path} is damaged: {error}") from None


def read_part(path: Path) -> dict[str, np.ndarray]:
    """Read an .npz file for a job; one that is damaged is removed, and SystemExit names it."""
    try:
        return read_arrays(path)
    except DamagedSliceError as error:
        path.unlink(missing_ok=True)
        message = f"{error}\nIt is removed: the same command again makes it anew."
        raise SystemExit(message) from None


def read_slice(path: Path) -> Slice:
    """Read what `write_slice` wrote.

    Raises
    ------
    DamagedSliceError
        With the path, where a file was cut or changed.
    """
    arrays = read_arrays(path)
    try:
        description = json.loads(str(arrays.pop(_DESCRIPTION)))
        if list(arrays) != description["arrays"]:
            raise ValueError("arrays are missing")
    except (KeyError, ValueError) as error:
        raise DamagedSliceError(f"{path} is damaged: {error}") from None
    variables = tuple(
        Variable(**{**entry, "dims": tuple(entry["dims"])}) for entry in description["variables"]
    )
    return Slice(
        arrays,
        variables,
        description["coordinates"],
        description["branches"],
        description["labels"],
    )

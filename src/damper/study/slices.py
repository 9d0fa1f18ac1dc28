"""Slices: the part of a study's cube that one simulation job makes, as an .npz file.

No xarray here: a simulation job writes plain arrays, with the same bytes each time, and the
descriptions that gathering needs as one JSON text.
"""

import json
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

import numpy as np

from damper.parameters import State
from damper.variables import Variable

_DESCRIPTION = "__description__"


@dataclass(frozen=True)
class Slice:
    """What a simulation job made: arrays over its lanes, their descriptions and coordinates."""

    arrays: dict[str, np.ndarray]
    variables: tuple[Variable, ...]
    coordinates: dict[str, list[float]]


def simulate_slice(
    fixed: Mapping[str, float],
    axes: Mapping[str, Sequence[float]],
    *,
    transient: int,
    periods: int,
    observers: Iterable[str] | Mapping[str, Mapping[str, Any] | None],
    accuracy: float,
    max_events: int,
    state: State | None = None,
    progress: Callable[[int], None] | None = None,
) -> Slice:
    """Simulate one slice.

    Parameters
    ----------
    fixed : mapping of str to float
        Fixed parameters, and the slice's place along the fanned axes.
    axes : mapping of str to values
        The axes that run inside the job.
    transient, periods, observers, accuracy, max_events, state, progress
        As for `damper.lanes.run_lanes`.

    Returns
    -------
    Slice
    """
    # Loads the engine, and numba with it; reading a slice needs neither.
    from damper.lanes import product, run_lanes

    arrays, made = run_lanes(
        product(axes, fixed),
        observers,
        transient=transient,
        periods=periods,
        accuracy=accuracy,
        max_events=max_events,
        state=state,
        progress=progress,
    )
    return Slice(
        arrays,
        tuple(variable for observer in made for variable in observer.variables),
        {k: v.tolist() for observer in made for k, v in observer.coordinates().items()},
    )


def write_slice(part: Slice, path: Path) -> None:
    """Write a slice as .npz."""
    description = {
        "variables": [asdict(variable) for variable in part.variables],
        "coordinates": part.coordinates,
    }
    text = json.dumps(description, sort_keys=True)
    np.savez(path, **{_DESCRIPTION: np.array(text)}, **part.arrays)


def read_slice(path: Path) -> Slice:
    """Read what `write_slice` wrote."""
    with np.load(path) as file:
        arrays = {name: file[name] for name in file.files}
    description = json.loads(str(arrays.pop(_DESCRIPTION)))
    variables = tuple(
        Variable(**{**entry, "dims": tuple(entry["dims"])}) for entry in description["variables"]
    )
    return Slice(arrays, variables, description["coordinates"])

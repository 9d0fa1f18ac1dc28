"""Parts of the stress study: one job's runs and what it found; .npz of the same bytes always."""

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from damper.parameters.quantities import ALL, INITIAL_NAMES, PARAMETER_NAMES
from damper.parameters.variables import Variable

#: Quantities of a run; those that it does not give have their defaults.
POINT_NAMES = (*PARAMETER_NAMES, *INITIAL_NAMES)


def write_part(
    path: Path, points: Sequence[Mapping[str, float]], arrays: Mapping[str, np.ndarray]
) -> None:
    """Write points and what was found of their runs.

    Parameters
    ----------
    path : Path
    points : sequence of mapping
    arrays : mapping of str to ndarray (points,)
    """
    given = {
        name: np.array([point.get(name, ALL[name].default) for point in points], dtype=float)
        for name in POINT_NAMES
    }
    # The stubs take what is unpacked for `allow_pickle`, too.
    np.savez(path, **given, **arrays)  # type: ignore[arg-type]


def read_parts(paths: Sequence[Path]) -> dict[str, np.ndarray]:
    """Put parts back together, in the order of the runs before `verification.stress.box.part`."""
    parts = []
    for path in paths:
        with np.load(path) as file:
            parts.append({name: file[name] for name in file.files})
    count = sum(len(part["status"]) for part in parts)
    whole = {}
    for name, first in parts[0].items():
        whole[name] = np.empty(count, dtype=first.dtype)
        for number, part in enumerate(parts):
            whole[name][number :: len(parts)] = part[name]
    return whole


def point_of(arrays: Mapping[str, np.ndarray], number: int) -> dict[str, float]:
    """Return the quantities of a run that are not their defaults, as `read_point` takes them.

    Parameters
    ----------
    arrays : mapping of str to ndarray (runs,)
        Of `read_parts`, or the variables of the cube.
    number : int
    """
    values = {name: float(arrays[name][number]) for name in POINT_NAMES}
    return {name: value for name, value in values.items() if value != ALL[name].default}


def attributes_of(
    name: str, variables: Mapping[str, Variable], flags: Mapping[int, str]
) -> dict[str, Any]:
    """Return the attributes of a variable of a cube: a quantity, or one of `variables`."""
    about: Any = ALL[name] if name in POINT_NAMES else variables[name]
    attrs: dict[str, Any] = {"long_name": about.long_name, "units": about.units}
    if getattr(about, "comment", ""):
        attrs["comment"] = about.comment
    if flags:
        words = (meaning.replace(" ", "_").replace("-", "_") for meaning in flags.values())
        attrs |= {
            "flag_values": np.array(list(flags), dtype="i1"),
            "flag_meanings": " ".join(words),
        }
    return attrs

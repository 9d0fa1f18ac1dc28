"""The stress study as one dataset: all runs with their quantities and results."""

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
import xarray as xr

from damper.verification.stress.laws import LAW_VARIABLES, RUN_OUTCOMES, RUN_VARIABLES
from damper.verification.stress.parts import attributes_of, read_parts

_VARIABLES = {variable.name: variable for variable in (*LAW_VARIABLES, *RUN_VARIABLES)}


def gather_checks(parts: Mapping[str, Sequence[Path]], attributes: Mapping[str, Any]) -> xr.Dataset:
    """Put all parts together.

    Parameters
    ----------
    parts : mapping of str to sequence of Path
        Origin of the runs (``corner``, ``random``, ``long``) -> its parts in order.
    attributes : mapping
        Global attributes.

    Returns
    -------
    xarray.Dataset
        With the one dimension ``run``. Quantities that a point does not give have their defaults,
        an infinite contact stiffness among them: a rigid wall.
    """
    wholes = {origin: read_parts(paths) for origin, paths in parts.items()}
    counts = {origin: len(whole["status"]) for origin, whole in wholes.items()}
    origins = np.concatenate([np.full(count, origin) for origin, count in counts.items()])
    data: dict[str, Any] = {
        "origin": ("run", origins, {"long_name": "where the run comes from"}),
    }
    for name in next(iter(wholes.values())):
        values = np.concatenate([whole[name] for whole in wholes.values()])
        flags = dict(enumerate(RUN_OUTCOMES)) if name == "status" else {}
        data[name] = ("run", values, attributes_of(name, _VARIABLES, flags))
    coords = {"run": ("run", np.arange(len(origins)), {"long_name": "run", "units": "1"})}
    return xr.Dataset(data, coords, dict(attributes))

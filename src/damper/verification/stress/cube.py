"""The stress study as one dataset: all runs with their quantities and results."""

from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
import xarray as xr

from damper.parameters.quantities import ALL
from damper.parameters.variables import Variable
from damper.verification.stress.laws import LAWS, OUTCOMES, RUN
from damper.verification.stress.parts import POINT_NAMES, read_parts


def gather(
    parts: Mapping[str, Sequence[Path]],
    attributes: Mapping[str, Any],
    more: Iterable[Variable] = (),
) -> xr.Dataset:
    """Put all parts together.

    Parameters
    ----------
    parts : mapping of str to sequence of Path
        Origin of the runs (``corner``, ``random``, ``long``) -> its parts in order.
    attributes : mapping
        Global attributes.
    more : iterable of Variable
        Descriptions of arrays beside those of `damper.verification.stress.laws`.

    Returns
    -------
    xarray.Dataset
        With the one dimension ``run``. Quantities that a point does not give have their defaults,
        an infinite contact stiffness among them: a rigid wall.
    """
    wholes = {origin: read_parts(paths) for origin, paths in parts.items()}
    counts = {origin: len(whole["status"]) for origin, whole in wholes.items()}
    origins = np.concatenate([np.full(count, origin) for origin, count in counts.items()])
    described = {variable.name: variable for variable in (*LAWS, *RUN, *more)}
    data: dict[str, Any] = {
        "origin": ("run", origins, {"long_name": "where the run comes from"}),
    }
    for name in next(iter(wholes.values())):
        values = np.concatenate([whole[name] for whole in wholes.values()])
        about: Any = ALL[name] if name in POINT_NAMES else described[name]
        attrs = {"long_name": about.long_name, "units": about.units}
        if getattr(about, "comment", ""):
            attrs["comment"] = about.comment
        if name == "status":
            attrs |= {
                "flag_values": np.arange(len(OUTCOMES), dtype="i1"),
                "flag_meanings": " ".join(OUTCOMES),
            }
        data[name] = ("run", values, attrs)
    coords = {"run": ("run", np.arange(len(origins)), {"long_name": "run", "units": "1"})}
    return xr.Dataset(data, coords, dict(attributes))

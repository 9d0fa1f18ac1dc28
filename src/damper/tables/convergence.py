"""How a compliant contact approaches the rigid wall as it stiffens: distances and their order."""

from __future__ import annotations

import csv
import io
import math
from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Annotated, Any

import numpy as np
from pydantic import Field

from damper.parameters.quantities import ALL, MODEL_NAMES
from damper.study.fields import Faults, ListOf, Text
from damper.study.products import (
    BURST_RECORDS,
    MOST_VARIABLES,
    Offer,
    Product,
    Role,
    check_written,
    fit_axis,
)
from damper.study.settings import SECTIONS
from damper.study.yaml_file import words
from damper.tables import About, fixed_values, markdown_table, remarks

if TYPE_CHECKING:
    import xarray as xr

#: Axes of stiffness, in either system of units.
STIFFNESSES = ("contact_stiffness_ratio", "contact_stiffness")
#: Cubes' own dimensions -> which place along them is compared: the last sample, the first burst.
_TAKEN = {"sample": -1, "burst": 0}


#: What may be compared with the rigid damper beside what has one value at each point -> observers.
_RECORDED = {
    "displacement": SECTIONS,
    "velocity": SECTIONS,
    **dict.fromkeys(BURST_RECORDS, ("bursts",)),
}

Compared = Annotated[
    tuple[str, ...],
    ListOf(Text(), least=1),
    Field(
        description="Variables of the cube, each with one value at each point; or displacement "
        "or velocity, of which the section's last sample counts, or burst_onset, burst_duration, "
        "burst_accumulation_time, burst_sticking_time, of which the first record counts "
        "(records: 1); 4 at most."
    ),
]
Stiffness = Annotated[str, Text(), Field(description="Axis of the contact's stiffness.")]
Conventions = Annotated[
    str | None,
    Text(),
    Field(description="Axis of whose values, two at most, each makes a line: contact_tension."),
]


def fit_convergence(settings: dict[str, Any], offer: Offer, faults: Faults) -> None:
    """Note what a comparison with the rigid damper asks of a study in vain."""
    names = settings.get("variables")
    for i, name in enumerate(names) if isinstance(names, list | tuple) else ():
        needed = _RECORDED.get(name) if isinstance(name, str) else None
        if needed is None:
            check_written(("variables", i), name, offer, faults)
        elif not any(observer in offer.observers for observer in needed):
            message = f"'{name}' needs {' or '.join(needed)} among the observers"
            faults.add(("variables", i), message, " or ".join(needed))
    if isinstance(names, list | tuple) and len(names) > MOST_VARIABLES:
        message = f"{len(names)} variables are too many for one figure"
        faults.add(("variables",), message, f"at most {MOST_VARIABLES}")
    along = settings.get("along")
    if isinstance(along, str) and along in offer.axes and along not in STIFFNESSES:
        faults.add(("along",), f"'{along}' is no stiffness of the contact", words(STIFFNESSES))
    for name in offer.axes:
        if name not in MODEL_NAMES["compliant"]:
            message = f"axis '{name}' is not of the contact: the rigid damper is run at one point"
            faults.add((), message, "a study with no axes but those of the contact")


class ConvergenceTable(Product):
    """The same as a table: value, rigid value and distance at each stiffness, and the order."""

    variables: Compared
    along: Stiffness
    lines: Conventions = None

    @classmethod
    def fit(cls, settings: dict[str, Any], offer: Offer, faults: Faults) -> None:
        fit_convergence(settings, offer, faults)
        for role, least, most in (("along", 2, None), ("lines", 1, 2)):
            fit_axis(role, Role(least, most), settings, offer, faults)


def rigid_values(cube: xr.Dataset, variables: Sequence[str]) -> dict[str, float]:
    """Values of the rigid damper that is otherwise the same, by one run of it.

    Parameters
    ----------
    cube : xarray.Dataset
        Of a study with no axes but those of the contact.
    variables : sequence of str
        Variables of the cube; of sections the last sample counts, of records the first burst.

    Raises
    ------
    ValueError
        When the cube has another axis or lacks a variable.
    """
    import yaml

    from damper.sweep.slices import simulate_slice

    for name in variables:
        if name not in cube:
            raise ValueError(
                f"no variable {name!r}: must be one of {', '.join(map(str, cube.data_vars))}"
            )
    contact = MODEL_NAMES["compliant"]
    fixed = {}
    for name in ALL:
        if name in cube.coords and name not in contact:
            if cube[name].ndim:
                raise ValueError(f"axis {name!r}: only the contact may vary here")
            fixed[name] = float(cube[name])
    observers = yaml.safe_load(cube.attrs["study"])["observers"]
    part = simulate_slice(
        fixed,
        {},
        transient=int(cube.attrs["transient_periods"]),
        periods=int(cube.attrs["recorded_periods"]),
        observers={name: _plain(settings) for name, settings in observers.items()},
        accuracy=float(cube.attrs["accuracy"]),
        max_events=int(cube.attrs["max_events"]),
    )
    dims = {variable.name: variable.dims for variable in part.variables}
    return {
        name: float(part.arrays[name][(0, *(_TAKEN[dim] for dim in dims[name]))])
        for name in variables
    }


def compared(cube: xr.Dataset, name: str) -> xr.DataArray:
    """Values of a variable that are compared, over the axes of the cube."""
    array = cube[name]
    return array.isel({dim: _TAKEN[str(dim)] for dim in array.dims if dim in _TAKEN})


def order_of(stiffness: np.ndarray, distance: np.ndarray) -> float:
    """Exponent of a power law, by least squares over the stiffer half; NaN without two points.

    Soft contacts are other systems, not approximations: only the stiffer half of decades counts.
    """
    stiff = stiffness >= np.sqrt(stiffness.min() * stiffness.max())
    good = np.isfinite(distance) & (distance > 0.0) & stiff
    if good.sum() < 2:
        return math.nan
    return float(np.polyfit(np.log(stiffness[good]), np.log(distance[good]), 1)[0])


def make(cube: xr.Dataset, settings: Mapping[str, Any], about: About) -> tuple[str, str]:
    """Write the distances to the rigid damper; see `damper.tables.make`."""
    along = settings["along"]
    variables = settings["variables"]
    rigid = rigid_values(cube, variables)
    stiffness = cube[along].values
    lines = settings.get("lines")
    values: list[Any] = cube[lines].values.tolist() if lines else [None]
    text = io.StringIO()
    writer = csv.writer(text, lineterminator="\n")
    head = [along, *([lines] if lines else [])]
    writer.writerow([*head, "variable", "value", "rigid_value", "distance"])
    rows = []
    for name in variables:
        for value in values:
            array = compared(cube, name)
            if lines:
                array = array.sel({lines: value})
            found = array.values.astype(float)
            distance = np.abs(found - rigid[name])
            for k, one, far in zip(stiffness, found, distance, strict=True):
                place = [repr(float(k)), *([repr(float(value))] if lines else [])]
                writer.writerow(
                    [*place, name, repr(float(one)), repr(rigid[name]), repr(float(far))]
                )
            rows.append(
                [
                    name.replace("_", " "),
                    *([f"{value:g}"] if lines else []),
                    f"{rigid[name]:.9g}",
                    *(f"{far:.2e}" for far in distance),
                    f"{order_of(stiffness, distance):.3f}",
                ]
            )
    heads = [
        "variable",
        *([lines.replace("_", " ")] if lines else []),
        "rigid value",
        *(f"{k:g}" for k in stiffness),
        "order",
    ]
    markdown = [
        f"# {about.title}: distance to the rigid damper",
        "",
        f"{fixed_values(about)} Columns of numbers: {along.replace('_', ' ')}. The rigid value is "
        "that of one run with rigid walls; the order is the exponent of the power law that fits "
        "the distances over the stiffer half of the decades best, -1/2 where they fall as the "
        "time of contact.",
        "",
        *markdown_table(heads, rows),
        *remarks(about),
    ]
    return text.getvalue(), "\n".join(markdown) + "\n"


def _plain(settings: Any) -> Any:
    """Observer settings without remarks on their origin."""
    if not isinstance(settings, Mapping):
        return settings
    return {
        key: _plain(value) for key, value in settings.items() if key not in ("assumed", "stated")
    }

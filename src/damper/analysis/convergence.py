"""How a compliant contact approaches the rigid wall as it stiffens: distances and their order."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from damper.analysis.places import fixed_values, require_axes, require_numbers
from damper.parameters.lazy import pd, xr
from damper.parameters.names import unknown_name
from damper.parameters.quantities import ALL, MODEL_NAMES
from damper.sweep.record import recorded

#: Cubes' own dimensions -> which place along them is compared: the last sample, the first burst.
_TAKEN = {"sample": -1, "burst": 0}


def distance_to_rigid(
    cube: xr.Dataset, variables: Sequence[str], along: str = "contact_stiffness_ratio"
) -> pd.DataFrame:
    """Distance of a compliant damper's values to those of the rigid damper.

    The rigid damper is run once, with the settings of the cube.

    Parameters
    ----------
    cube : xarray.Dataset
        Of a study with no axes but those of the contact.
    variables : sequence of str
        Variables of the cube; of sections the last sample counts, of records the first burst.
    along : str, default "contact_stiffness_ratio"
        Axis of the contact stiffness.

    Returns
    -------
    pandas.DataFrame
        One row for each variable, place along the other axes, and stiffness, in this order. Columns
        are the axes, ``variable``, ``value``, ``rigid_value`` and ``distance``, in the variable's
        units.

    Raises
    ------
    ValueError
        When the cube has an axis that is not of the contact, or lacks a variable or the axis.
    """
    require_axes(cube, along)
    _require_comparable(cube, variables)
    rigid = _rigid_values(cube, variables)
    frames = []
    for name in variables:
        array = cube[name]
        array = array.isel({dim: _TAKEN[str(dim)] for dim in array.dims if dim in _TAKEN})
        others = [str(dim) for dim in array.dims if dim != along]
        array = array.transpose(*others, along).reset_coords(drop=True).astype(float)
        frame = array.to_dataframe("value").reset_index()[[along, *others, "value"]]
        frame.insert(1 + len(others), "variable", name)
        frames.append(frame.assign(rigid_value=rigid[name]))
    found = pd.concat(frames, ignore_index=True)
    return found.assign(distance=(found["value"] - found["rigid_value"]).abs())


def order_of_convergence(parameter: np.ndarray, distance: np.ndarray) -> float:
    """Exponent of the power law that fits distances best, by least squares in logarithms.

    Only the upper half of the parameter's decades counts: soft contacts are other systems, not
    approximations.

    Parameters
    ----------
    parameter : ndarray, shape (n,)
        Such as the contact stiffness; positive.
    distance : ndarray, shape (n,)
        What is missing or zero does not count.

    Returns
    -------
    float
        NaN with fewer than two points.

    Examples
    --------
    >>> stiffness = np.geomspace(1e2, 1e8, 7)
    >>> round(order_of_convergence(stiffness, 3.0 * stiffness**-0.5), 6)
    -0.5
    """
    message = (
        "parameter and distance: must be two sequences of one length, and the parameter positive"
    )
    parameter, distance = (require_numbers(each, message) for each in (parameter, distance))
    if parameter.shape != distance.shape or not (parameter > 0.0).all():
        raise ValueError(message)
    if len(parameter) < 2:
        return math.nan
    upper = parameter >= np.sqrt(parameter.min() * parameter.max())
    good = np.isfinite(distance) & (distance > 0.0) & upper
    if good.sum() < 2:
        return math.nan
    return float(np.polyfit(np.log(parameter[good]), np.log(distance[good]), 1)[0])


def _require_comparable(cube: xr.Dataset, variables: Sequence[str]) -> None:
    """Raise ValueError or TypeError unless these are variables that the rigid damper has, too."""
    if isinstance(variables, str) or not isinstance(variables, Sequence) or not variables:
        raise TypeError(f"variables = {variables!r}: must be a list of one variable or more")
    for name in variables:
        if not isinstance(name, str) or name not in cube.data_vars:
            raise ValueError(str(unknown_name("variable", name, map(str, cube.data_vars))))
        for dim in cube[name].dims:
            if dim not in _TAKEN and dim not in ALL:
                raise ValueError(
                    f"{name} has values along {dim!r}: must be a variable with one value at each "
                    "point, of a section, or of the bursts listed"
                )


def _rigid_values(cube: xr.Dataset, variables: Sequence[str]) -> dict[str, float]:
    """Values of the rigid damper that is otherwise the same, by one run of it."""
    from damper.sweep.cube import without_missing
    from damper.sweep.slices import simulate_slice

    contact = MODEL_NAMES["compliant"]
    for name in ALL:
        if name in cube.coords and cube[name].ndim and name not in contact:
            raise ValueError(f"axis {name!r}: only the contact may vary here")
    fixed = {name: value for name, value in fixed_values(cube).items() if name not in contact}
    part = simulate_slice(fixed, {}, **recorded(cube))
    dims = {variable.name: variable.dims for variable in part.variables}
    return {
        name: float(
            without_missing(part.arrays[name])[(0, *(_TAKEN[dim] for dim in dims.get(name, ())))]
        )
        for name in variables
    }

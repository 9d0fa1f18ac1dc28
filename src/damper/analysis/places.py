"""Places of a cube along its axes, for what is computed at each of them."""

from __future__ import annotations

import json
import math
from collections.abc import Mapping, Sequence
from typing import Any, TypeVar

import numpy as np

from damper.parameters.lazy import pd, xr
from damper.parameters.names import unknown_name
from damper.parameters.quantities import ALL, quantities_in
from damper.parameters.unit_text import number_in
from damper.parameters.units import handy, own_number
from damper.sweep.grid import ROUNDING, nearest_value, product

#: Values of an axis, as they come.
Values = TypeVar("Values", float, np.ndarray, "xr.DataArray")


def places(array: xr.DataArray, *without: str) -> list[dict[str, Any]]:
    """Coordinates along all dimensions of an array but some, the last one fastest."""
    others = {str(name): array[name].values.tolist() for name in array.dims if name not in without}
    return product(others, {})


def fixed_values(cube: xr.Dataset) -> dict[str, float]:
    """Quantities of a cube that are no axes, with their values.

    ValueError where it has lost one since it was made.
    """
    require_coordinates(cube, *str(cube.attrs.get("quantities", "")).split())
    names = (n for n in quantities_in(cube.coords) if cube[n].ndim == 0)
    return {n: float(own_values(cube, n, cube[n].values)) for n in names}


def own_values(cube: xr.Dataset, name: str, values: Any) -> Any:
    """Return values of a coordinate in the own unit of its quantity; the cube may have Hz."""
    units = cube[name].attrs.get("units") if name in cube.coords else None
    return own_number(values, units)


def observed(cube: xr.Dataset, variables: Sequence[str]) -> xr.Dataset:
    """Return variables of a cube, at the place of those that were observed at one place alone."""
    part = cube[list(variables)]
    for name in variables:
        for axis, value in json.loads(cube[name].attrs.get("observed_at", "{}")).items():
            here = cube[axis].sel({axis: value})
            part = (
                part.sel({axis: value}) if axis in part.dims else part.assign_coords({axis: here})
            )
    return part


def within(values: Values, low: float = -math.inf, high: float = math.inf) -> Values:
    """Whether values of an axis lie in a band, its ends included.

    Values beside an end by rounding lie on it: 1.1 is within 10 % of 1, though 1.1 - 1 > 0.1.

    Examples
    --------
    >>> import numpy as np
    >>> within(np.arange(8, 13) / 10, 0.9, 1 + 0.1)
    array([False,  True,  True,  True, False])
    >>> within(np.array([0.1 + 0.2, 0.4]), high=0.3)
    array([ True, False])
    """
    ends = [end for end in (low, high) if math.isfinite(end)]
    near = ROUNDING * max(map(abs, ends), default=0.0)
    return (values >= low - near) & (values <= high + near)  # type: ignore[return-value]


def value_on(axis: xr.DataArray, value: Any) -> Any:
    """Return the value of an axis that a value means, as `nearest_value`.

    Text with a unit, such as 20 mm, is read in the axis's unit. Of a dimension that is no quantity,
    such as ``direction``, only its own values are taken.
    """
    name, values = str(axis.name), axis.values.ravel()
    if name not in ALL:
        known = {str(one): one for one in values.tolist()}
        if str(value) not in known:
            raise ValueError(f"{name} = {value!r}: must be one of {', '.join(known)}")
        return known[str(value)]
    units = axis.attrs.get("units", ALL[name].units)
    return nearest_value(name, values, number_in(name, ALL[name].number_of(value), [units]))


def rows_at(frame: pd.DataFrame, where: Mapping[str, Any]) -> pd.DataFrame:
    """Rows of a table in which all these columns have these values."""
    for name, value in where.items():
        frame = frame[frame[name] == value]
    return frame


def require_coordinates(cube: xr.Dataset, *names: str) -> None:
    """Raise ValueError where a cube has lost what its runs depend on."""
    for name in names:
        if name not in cube.coords:
            raise ValueError(
                f"the cube has lost {name!r}, which its runs depend on: "
                "keep it, as sel and isel do without drop=True"
            )


def require_cube(cube: Any) -> None:
    """Raise TypeError for what is no cube, such as the name of its file.

    ValueError for one without points, or without the values of an axis.
    """
    if not isinstance(cube, xr.Dataset):
        raise TypeError(
            f"cube is a {type(cube).__name__}: must be an xarray.Dataset, "
            "from damper.simulate or a study's cube.nc"
        )
    if {"point", "mode"} <= set(cube.dims):
        raise ValueError(
            "the cube is of runs on a structure, and this is of one primary mass: xarray draws its "
            "variables, and damper.run(parameters.having({...}), until) runs one of its points"
        )
    require_coordinates(cube, *quantities_in(cube.dims))
    for dim, size in cube.sizes.items():
        if size == 0:
            raise ValueError(f"the cube has nothing along {dim!r}: select at least one value")


def require_axes(cube: xr.Dataset, *names: str) -> None:
    """Raise ValueError unless a cube has axes of these names; TypeError when it is no cube."""
    require_cube(cube)
    axes = quantities_in(cube.dims)
    for k, name in enumerate(names):
        if not isinstance(name, str) or name not in axes:
            raise ValueError(str(unknown_name("axis", name, axes)))
        if name in names[:k]:
            raise ValueError(f"axis {name!r} is given twice: must be two axes")


def require_variables(
    cube: xr.Dataset, observer: str, *names: str, along: Sequence[str] = ()
) -> None:
    """Raise ValueError unless a cube has the variables of an observer; TypeError for no cube.

    Each has to have the dimensions `along`.
    """
    require_cube(cube)
    for name in names:
        if name not in cube.data_vars:
            raise ValueError(
                f"the cube has no variable {name!r}: make it with {observer!r} among the observers"
            )
        for dim in along:
            if dim not in cube[name].dims:
                raise ValueError(f"{name} has lost its dimension {dim!r}: must be all along it")


def require_known(array: xr.DataArray) -> None:
    """Raise ValueError where a variable is missing, because a run stopped early."""
    for place in np.argwhere(np.isnan(array.values))[:1]:
        where = {dim: array[dim].values[k].item() for dim, k in zip(array.dims, place, strict=True)}
        raise ValueError(f"{array.name} is not known: the run at {where} stopped early")


def require_numbers(values: Any, message: str) -> np.ndarray:
    """Return a sequence of numbers as an array; ValueError with the message for anything else."""
    try:
        array = np.asarray(values, dtype=float)
    except (TypeError, ValueError):
        raise ValueError(message) from None
    if array.ndim != 1:
        raise ValueError(message)
    return array


def in_handy_units(cube: xr.Dataset) -> xr.Dataset:
    """Return a cube with lengths in mm or another unit that their size asks for."""
    for name, array in cube.variables.items():
        if array.attrs.get("units") == "m":
            factor, unit = handy(float(abs(array).max()), "m")
            scaled = (array.dims, array.values / factor, array.attrs | {"units": unit})
            cube = cube.assign({name: scaled})
    return cube

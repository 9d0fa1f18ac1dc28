"""Places of a cube along its axes, for what is computed at each of them."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

from damper.parameters.quantities import ALL, unknown_name
from damper.sweep.grid import product

if TYPE_CHECKING:
    import pandas as pd
    import xarray as xr


def places(array: xr.DataArray, *without: str) -> list[dict[str, Any]]:
    """Coordinates along all dimensions of an array but some, the last one fastest."""
    others = {str(name): array[name].values.tolist() for name in array.dims if name not in without}
    return product(others, {})


def fixed_values(cube: xr.Dataset) -> dict[str, float]:
    """Quantities of a cube that are no axes, with their values.

    ValueError where it has lost one since it was made.
    """
    for name in str(cube.attrs.get("quantities", "")).split():
        if name not in cube.coords:
            raise ValueError(
                f"the cube has lost {name!r}, which its runs depend on: "
                "keep it, as sel and isel do without drop=True"
            )
    return {n: float(cube[n]) for n in ALL if n in cube.coords and cube[n].ndim == 0}


def rows_at(frame: pd.DataFrame, where: Mapping[str, Any]) -> pd.DataFrame:
    """Rows of a table in which all these columns have these values."""
    for name, value in where.items():
        frame = frame[frame[name] == value]
    return frame


def need_cube(cube: Any) -> None:
    """Raise TypeError for what is no cube, such as the name of its file."""
    import xarray as xr

    if not isinstance(cube, xr.Dataset):
        raise TypeError(
            f"cube is a {type(cube).__name__}: must be an xarray.Dataset, "
            "from damper.simulate or a study's cube.nc"
        )


def need_axes(cube: xr.Dataset, *names: str) -> None:
    """Raise ValueError unless a cube has axes of these names; TypeError when it is no cube."""
    need_cube(cube)
    for name in names:
        if name not in cube.dims:
            raise ValueError(str(unknown_name("axis", name, [str(dim) for dim in cube.dims])))


def need_variables(cube: xr.Dataset, observer: str, *names: str) -> None:
    """Raise ValueError unless a cube has the variables of an observer; TypeError for no cube."""
    need_cube(cube)
    for name in names:
        if name not in cube:
            raise ValueError(
                f"the cube has no variable {name!r}: make it with {observer!r} among the observers"
            )


def in_millimetres(cube: xr.Dataset) -> xr.Dataset:
    """Return a cube with lengths below a tenth of a metre in millimetres."""
    for name, array in cube.variables.items():
        if array.attrs.get("units") == "m" and abs(array).max() < 0.1:
            small = (array.dims, 1e3 * array.values, array.attrs | {"units": "mm"})
            cube = cube.assign({name: small})
    return cube

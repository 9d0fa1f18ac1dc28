"""Several runs at each point as one number: the worst of them, or the part with some property."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

from damper.parameters.quantities import unknown_name
from damper.parameters.quantity import in_range
from damper.parameters.variables import GREATER_IS_WORSE

if TYPE_CHECKING:
    import xarray as xr


def worst(array: xr.DataArray, over: str | Sequence[str]) -> xr.DataArray:
    """Worst value at each point of a variable of which more is worse.

    Parameters
    ----------
    array : xarray.DataArray
        Variable of a cube, such as ``cube.peak_displacement``.
    over : str or sequence of str
        Its dimensions whose values are the runs: ``draw``, ``direction``, or axes.

    Returns
    -------
    xarray.DataArray
        The greatest value, over the dimensions that are left; NaN where one of the runs stopped.

    Raises
    ------
    ValueError, TypeError
        When more of the variable is not worse, or it lacks a dimension.

    Examples
    --------
    >>> import damper
    >>> cube = damper.simulate(mass_ratio=0.1, damping_ratio=0.02, frequency_ratio=[1.0, 1.3],
    ...                        clearance=9, restitution=0.2, transient=100, periods=20,
    ...                        draws={"count": 3, "seed": 1, "initial_position": [-1, 1],
    ...                                 "initial_relative_velocity": [-1, 1]},
    ...                        observers=["response"])
    >>> worst(cube.amplitude_ratio, "draw").values > 1
    array([False,  True])
    >>> share(cube.amplitude_ratio, "draw", above=1).values
    array([0., 1.])
    """
    names = dimensions(array, over)
    if array.name not in GREATER_IS_WORSE:
        allowed = ", ".join(GREATER_IS_WORSE)
        raise ValueError(f"worst: more of {array.name!r} is not worse: must be one of {allowed}")
    found = array.max(names, skipna=False, keep_attrs=True)
    return found.assign_attrs(long_name=f"{_meaning(array)}, worst of {runs_over(array, names)}")


def share(array: xr.DataArray, over: str | Sequence[str], above: float) -> xr.DataArray:
    """Part of the runs at each point in which a variable is above a limit.

    Parameters
    ----------
    array : xarray.DataArray
        Variable of a cube, such as ``cube.amplitude_ratio``.
    over : str or sequence of str
        Its dimensions whose values are the runs: ``draw``, ``direction``, or axes.
    above : float
        The limit, in the variable's units: 1 for ratios, 0 for any `chatter`, 1 for complete one.

    Returns
    -------
    xarray.DataArray
        From 0 to 1, over the dimensions that are left; NaN where one of the runs stopped.

    Raises
    ------
    ValueError, TypeError
        When the variable lacks a dimension, or the limit is no finite number.
    """
    names = dimensions(array, over)
    limit = in_range("above", above)
    part = (array > limit).where(array.notnull()).mean(names, skipna=False)
    meaning = f"part of {runs_over(array, names)} above {limit:g}: {_meaning(array)}"
    part.attrs = {"long_name": meaning, "units": "1"}
    return part.rename(f"{array.name}_share")


def reduced(
    place: xr.Dataset,
    names: Sequence[str],
    worst_over: Sequence[str] | None,
    share_over: Sequence[str] | None,
    above: float | None,
) -> tuple[xr.Dataset, list[str]]:
    """Reduce variables of a piece of a cube to their worst, then to the share, as is asked for.

    Returns the piece, which has nothing else along these dimensions, and the variables' new names.
    """
    arrays = [place[name] for name in names]
    if worst_over:
        arrays = [worst(array, worst_over) for array in arrays]
    if share_over and above is not None:
        arrays = [share(array, share_over, above) for array in arrays]
    left = place.drop_vars(names).drop_dims([*(worst_over or ()), *(share_over or ())])
    return left.assign({array.name: array for array in arrays}), [str(a.name) for a in arrays]


def runs_over(array: xr.DataArray | xr.Dataset, names: Sequence[str]) -> str:
    """Say in words which runs dimensions hold.

    Examples
    --------
    >>> import xarray as xr
    >>> runs_over(xr.Dataset(coords={"draw": [0, 1, 2], "gap": [1.0, 2.0]}), ["draw", "gap"])
    '3 draws x 2 values of gap'
    """
    nouns = {"draw": "draws", "direction": "directions"}
    return " x ".join(
        f"{array.sizes[name]} {nouns.get(name, 'values of ' + name.replace('_', ' '))}"
        for name in names
    )


def dimensions(array: xr.DataArray, names: str | Sequence[str], key: str = "over") -> list[str]:
    """Return the dimensions of a variable that an argument names; an error if there are none."""
    import xarray as xr

    if not isinstance(array, xr.DataArray):
        kind = type(array).__name__
        raise TypeError(f"array is a {kind}: must be a variable of a cube, such as cube.rms_ratio")
    found = [names] if isinstance(names, str) else names
    if not isinstance(found, list | tuple) or not found:
        raise TypeError(f"{key} = {names!r}: must be a dimension or a list of dimensions")
    for k, name in enumerate(found):
        if name not in array.dims:
            raise ValueError(str(unknown_name("axis", name, map(str, array.dims))))
        if name in found[:k]:
            raise ValueError(f"{key}: {name!r} is given twice")
    return list(found)


def _meaning(array: xr.DataArray) -> str:
    return str(array.attrs.get("long_name", array.name))

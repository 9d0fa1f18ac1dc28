"""Several runs at each point as one number: the worst of them, or the part with some property.

Selects runs as well: the runs of the design whose worst case is best.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from damper.analysis.labels import label_of
from damper.parameters.lazy import xr
from damper.parameters.names import unknown_name
from damper.parameters.quantity import in_range
from damper.parameters.variables import WORST

#: Relative difference below which two values count as equal: a rest of the transient.
_EQUAL = 1e-6
#: Settings of a figure that reduce runs, in the order in which they do.
REDUCTIONS = ("worst", "band", "share", "choose")
#: Endings of the names that a cube gives to the spread of a variable.
MEDIAN, BEST, _SHARE = "_median", "_best", "_share"


def worst(array: xr.DataArray, over: str | Sequence[str]) -> xr.DataArray:
    """Worst value at each point: the greatest, or the least where less is worse.

    Parameters
    ----------
    array : xarray.DataArray
        Variable of a cube, such as ``cube.peak_displacement``.
    over : str or sequence of str
        Its dimensions whose values are the runs: ``draw``, ``direction``, or axes.

    Returns
    -------
    xarray.DataArray
        Over the dimensions that are left; NaN where one of the runs stopped.

    Raises
    ------
    ValueError, TypeError
        When no value of the variable is worse than another, or it lacks a dimension.

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
    if array.name not in WORST:
        message = f"worst: no value of {array.name!r} is worse than another: must be one of"
        raise ValueError(f"{message} {', '.join(WORST)}")
    extreme = array.max if WORST[array.name] == "greatest" else array.min
    found = extreme(names, skipna=False, keep_attrs=True)
    return found.assign_attrs(long_name=f"{_meaning(array)}, worst of {runs_over(array, names)}")


def spread(array: xr.DataArray, over: str | Sequence[str]) -> dict[str, xr.DataArray]:
    """Return the worst, the median (of three runs or more) and the best value at each point.

    Under the names of variables of a cube; NaN where one of the runs stopped.
    """
    names = dimensions(array, over)
    name, found = str(array.name), {str(array.name): worst(array, names)}
    best = array.min if WORST[name] == "greatest" else array.max
    found[name + BEST] = best(names, skipna=False, keep_attrs=True)
    if math.prod(array.sizes[dim] for dim in names) > 2:
        found[name + MEDIAN] = array.median(names, skipna=False, keep_attrs=True)
    return found


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
    return part.rename(f"{array.name}{_SHARE}")


def reduced(
    place: xr.Dataset, names: Sequence[str], settings: Mapping[str, Any]
) -> tuple[xr.Dataset, list[str]]:
    """Reduce variables of a piece of a cube as a figure asks for.

    First to the worst runs, with the spread of those in a `band`; then to the share of runs `above`
    a limit; then the axes to `choose` take, at each point, the values at which the first variable
    is best.

    Returns the piece, which has nothing else along these dimensions, and the variables' new names.
    """
    over, band, part, choose = (list(settings.get(key) or ()) for key in REDUCTIONS)
    found = {name: worst(place[name], over) if over else place[name] for name in names}
    if band:
        found = {key: each for array in found.values() for key, each in spread(array, band).items()}
    if part:
        shares = [share(found[name], part, settings["above"]) for name in names]
        found = {str(array.name): array for array in shares}
        names = list(found)
    left = place.drop_vars(place.data_vars).drop_dims([*over, *band, *part]).assign(found)
    return (chosen(left, names[0], choose) if choose else left), list(names)


def chosen(place: xr.Dataset, name: str, axes: Sequence[str]) -> xr.Dataset:
    """Set axes to the values at which a variable is best, at each point of the others.

    Of equals the first. The values chosen are coordinates of what is returned.
    """
    every = place.stack(choice=axes)
    which = WORST[name.removesuffix(_SHARE)]
    signed = every[name] if which == "greatest" else -every[name]
    index = xr.apply_ufunc(least, signed, input_core_dims=[["choice"]], vectorize=True)
    return every.isel(choice=index).drop_vars("choice")


def least(values: np.ndarray) -> int:
    """Index of the first of the least values; NaN is never the least, unless all are.

    Values that differ by a transient's rest are equal, so that where the masses never touch the
    choice is not left to rounding.

    Examples
    --------
    >>> least(np.array([np.nan, 3.0, 2.0000001, 2.0]))
    2
    """
    return int(np.argmax(as_low(values)))


def as_low(values: np.ndarray) -> np.ndarray:
    """Whether each value is the least or equals it; all if there is none."""
    values = np.where(np.isnan(values), np.inf, values)
    lowest = values.min()
    return values <= lowest + _EQUAL * abs(lowest)


def runs_over(array: xr.DataArray | xr.Dataset, names: Sequence[str]) -> str:
    """Say in words which runs dimensions hold.

    Examples
    --------
    >>> import xarray as xr
    >>> runs_over(xr.Dataset(coords={"draw": [0, 1, 2], "gap": [1.0, 2.0]}), ["draw", "gap"])
    '3 draws × 2 values of gap'
    """
    nouns = {"draw": "draws", "direction": "directions"}
    return " × ".join(
        f"{array.sizes[name]} {nouns.get(name, f'values of {label_of(name)}')}" for name in names
    )


def dimensions(array: xr.DataArray, names: str | Sequence[str], key: str = "over") -> list[str]:
    """Return the dimensions of a variable that an argument names; an error if there are none."""
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

"""How many distinct points a section has, and where along an axis that number changes."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from damper.analysis.places import require_numbers, require_variables
from damper.parameters.lazy import xr
from damper.parameters.quantity import in_range, whole

#: Part of the largest coordinate within which two points of a section are one.
SAME = 1e-6


def section_period(cube: xr.Dataset, same: float = SAME) -> xr.DataArray:
    """Cycles (or impacts) after which a motion repeats on its section.

    Parameters
    ----------
    cube : xarray.Dataset
        With the variables of a section, and twice as many samples as the longest period to find.
    same : float, default 1e-6
        Part of the largest coordinate within which two points are one; more than what is left of
        the transient.

    Returns
    -------
    xarray.DataArray of int
        Over all dimensions but ``sample``: the least period, up to half the number of samples; 0 if
        there is none (quasi-periodic, chaotic, or longer), or if a sample is missing.

    Examples
    --------
    >>> import damper
    >>> cube = damper.simulate(mass_ratio=0.1, damping_ratio=0.02, frequency_ratio=1.0,
    ...                        clearance=10.0, restitution=[0.3, 0.6], transient=200, periods=20)
    >>> section_period(cube).values
    array([1, 1])
    """
    require_variables(cube, "stroboscopic_section", "displacement", "velocity", along=["sample"])
    same = in_range("same", same, minimum=0, maximum=1)
    pairs = [cube[name].transpose(..., "sample").values for name in ("displacement", "velocity")]
    points = np.stack(pairs, axis=-1)
    periods = [period_of(run, same) for run in points.reshape(-1, *points.shape[-2:])]
    array = cube.displacement.transpose(..., "sample").isel(sample=0, drop=True)
    found = array.copy(data=np.array(periods).reshape(array.shape)).rename("section_period")
    found.attrs = {"long_name": "period on the section", "units": "1"}
    return found


def section_points(cube: xr.Dataset) -> xr.DataArray:
    """Number of distinct displacements that a motion leaves on its section.

    Parameters
    ----------
    cube : xarray.Dataset
        With the variables of a section.

    Returns
    -------
    xarray.DataArray of int
        Over all dimensions but ``sample``; 0 where a run stopped. Displacements within 1e-6 of the
        section's size are one: a periodic motion has as many as periods, a chaotic one as many as
        were taken. `section_period` takes their order into account.
    """
    require_variables(cube, "stroboscopic_section", "displacement", along=["sample"])
    array = cube.displacement.transpose(..., "sample")
    x = np.sort(array.values, axis=-1)
    size = SAME * (1.0 + np.abs(x).max(axis=-1, keepdims=True))
    distinct = 1 + (np.diff(x, axis=-1) > size).sum(axis=-1)
    distinct = np.where(np.isnan(x).any(axis=-1), 0, distinct)
    return array.isel(sample=0, drop=True).copy(data=distinct)


def period_of(points: np.ndarray, same: float = SAME) -> int:
    """Period of one section, points (n, m) in the order of their moments, as `section_period`.

    Examples
    --------
    >>> period_of(np.array([[1.0, 0.0], [2.0, 0.0]] * 4))
    2
    """
    if not np.isfinite(points).all():
        return 0
    near = same * np.abs(points).max(initial=0.0)
    for period in range(1, len(points) // 2 + 1):
        if (np.abs(points[period:] - points[:-period]) <= near).all():
            return period
    return 0


def first_lasting_change(periods: Sequence[int], least: int = 10) -> int | None:
    """Index of the first point after a change of the number of section points that lasts.

    The `least` grid points before the change have one number of points in common; all of the
    `least` grid points after the change have other numbers. Without this, the narrow windows in
    which a diagram falls back and forth would each count as a bifurcation.

    Parameters
    ----------
    periods : sequence of int
        `section_period` at every grid point; 0 is a number like the others, after the change.
    least : int, default 10
        Grid points on either side.

    Returns
    -------
    int or None
        None if there is no such change.

    Examples
    --------
    >>> first_lasting_change([1, 1, 1, 2, 1, 1, 1, 2, 0, 2], least=3)
    7
    """
    message = f"periods is a {type(periods).__name__}: must be `section_period` along one axis"
    if not np.isfinite(require_numbers(periods, message)).all():
        raise ValueError("periods: must be finite numbers")
    least = whole("least", least, 1)
    for index in range(least, len(periods) - least + 1):
        before = set(periods[index - least : index])
        if len(before) == 1 and 0 not in before and before.isdisjoint(periods[index:][:least]):
            return index
    return None

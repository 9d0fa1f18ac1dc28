"""The border between complete and incomplete bursts, beside its limit for a light free mass."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any

import numpy as np

from damper.analysis.closed_forms import damper_at, reduced_gap
from damper.analysis.intervals import bisected
from damper.analysis.places import fixed_values, need_axes, need_variables, places
from damper.parameters.lazy import pd, xr
from damper.parameters.quantity import in_range
from damper.sweep.record import recorded
from damper.theory.small_mass import critical_restitution

#: All bursts are complete from this fraction on: it is a quotient of whole numbers.
_ALL = 1.0 - 1e-12


def small_mass_border(cube: xr.Dataset, resolution: float = 1e-4) -> pd.DataFrame:
    """Border between complete and incomplete bursts at every clearance of a cube.

    Parameters
    ----------
    cube : xarray.Dataset
        With ``complete_fraction`` (observer ``bursts``) over restitution and clearance (or gap),
        and perhaps more axes; one run at each point.
    resolution : float, default 1e-4
        Restitution to which borders are bisected, between the last grid value up to which all
        bursts are complete and the next one.

    Returns
    -------
    pandas.DataFrame
        One row for each clearance, in the order of the other axes, then of the clearance. Columns
        are the other axes, ``clearance`` (or ``gap``) and

        - ``reduced_gap``: G = 2 d / A, A the steady amplitude of the primary alone;
        - ``critical_restitution``: the limit r_crit(G), NaN beyond G = pi;
        - ``border``: largest restitution up to which all bursts are complete, NaN if it is not on
          the axis, or if a run that should find it stopped early;
        - ``difference``: border less limit;
        - ``single``: False where bursts are all complete at some larger restitution again.

    Raises
    ------
    ValueError
        When the cube has no ``complete_fraction``, or more of its points cannot be run.
    """
    need_variables(cube, "bursts", "complete_fraction")
    in_range("resolution", resolution, minimum=0, above=True)
    run = recorded(cube, "bursts") | {"observers": ["bursts"]}
    over = gap_axis(cube)
    need_axes(cube, "restitution", over)
    cube = cube.sortby(["restitution", over])
    values = cube.restitution.values
    fixed = fixed_values(cube)
    others = [dim for dim in cube.complete_fraction.dims if dim not in (over, "restitution")]
    found = []
    for where in places(cube.complete_fraction, over, "restitution"):
        place = cube.sel(where)
        gaps = place[over].values.tolist()
        fractions = place.complete_fraction.transpose(over, "restitution").values
        reduced = [reduced_gap(damper_at(place, restitution=0.0, **{over: g})[0]) for g in gaps]
        critical = critical_restitution(reduced).tolist()
        for k, gap in enumerate(gaps):
            complete = fractions[k] >= _ALL
            failing = np.flatnonzero(~complete)
            border = math.nan
            if failing.size and failing[0] > 0 and np.isfinite(fractions[k][failing[0]]):
                first = failing[0]
                point = fixed | where | {over: gap}
                border = _bisect(values[first - 1], values[first], point, resolution, run)
            single = not complete[failing[0] :].any() if failing.size else True
            row = (gap, reduced[k], critical[k], border, border - critical[k], bool(single))
            found.append((*where.values(), *row))
    columns = ("reduced_gap", "critical_restitution", "border", "difference", "single")
    return pd.DataFrame(found, columns=[*others, over, *columns])


def gap_axis(cube: xr.Dataset) -> str:
    """Name of the axis that gives the free travel."""
    return "gap" if "gap" in cube.dims else "clearance"


def _bisect(
    low: float, high: float, fixed: Mapping[str, float], resolution: float, run: Mapping[str, Any]
) -> float:
    from damper.sweep.runs import run_points

    stopped = False

    def all_complete(restitution: float) -> bool:
        nonlocal stopped
        arrays, _ = run_points([{**fixed, "restitution": restitution}], **run)
        stopped = stopped or bool(arrays["status"][0])
        return bool(arrays["complete_fraction"][0] >= _ALL)

    border = 0.5 * sum(bisected(low, high, all_complete, resolution))
    return math.nan if stopped else border

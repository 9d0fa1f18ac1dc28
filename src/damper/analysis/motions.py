"""Motions that runs end in: classes of rms displacement and impacts per period, with names."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from damper.analysis.places import need_variables

if TYPE_CHECKING:
    import xarray as xr

#: Relative difference of rms displacements, and difference of impacts per period, of one motion.
_SAME, _IMPACTS = 1e-2, 0.05
#: Motions that get a name; rarer ones are `OTHERS`.
MOST = 6
OTHERS = "other motions"


def attractors(cube: xr.Dataset) -> tuple[xr.DataArray, list[str]]:
    """Class each run by the motion that it ends in.

    Parameters
    ----------
    cube : xarray.Dataset
        With the variables of the observers ``response`` and ``impacts``.

    Returns
    -------
    classes : xarray.DataArray of float
        Number of the motion at each point, NaN where a run stopped.
    names : list of str
        Of the motions, the most frequent one first: impacts per period and rms displacement.

    Examples
    --------
    >>> import damper
    >>> cube = damper.simulate(mass_ratio=0.25, damping_ratio=0.02, frequency_ratio=0.74,
    ...                        clearance=4.62, restitution=0.5, initial_displacement=[-2.0, 3.0],
    ...                        initial_relative_velocity=[3.0, 4.5], transient=250, periods=20,
    ...                        observers=["response", "impacts"])
    >>> attractors(cube)[1]
    ['3 impacts per period, rms 2.21', '2 impacts per period, rms 2.01']
    """
    need_variables(cube, "response", "rms_displacement")
    need_variables(cube, "impacts", "impacts_per_period")
    rms, impacts = (cube[name].values for name in ("rms_displacement", "impacts_per_period"))
    left = np.isfinite(rms) & np.isfinite(impacts)
    found = []
    while left.any():
        middle, count = rms[left].min(), impacts[left][rms[left].argmin()]
        one = left & (rms <= middle * (1.0 + _SAME)) & (np.abs(impacts - count) <= _IMPACTS)
        found.append((one, f"{_per_period(count)}, rms {middle:.3g}"))
        left &= ~one
    found.sort(key=lambda one: -int(one[0].sum()))
    classes = cube.rms_displacement.copy(data=np.full(rms.shape, np.nan)).rename("attractor")
    classes.attrs = {"long_name": "motion", "units": "1"}
    for index, (one, _) in enumerate(found):
        classes.values[one] = min(index, MOST)
    names = [name for _, name in found[:MOST]]
    return classes, [*names, OTHERS] if len(found) > MOST else names


def _per_period(impacts: float) -> str:
    return "no impacts" if impacts == 0.0 else f"{impacts:.3g} impacts per period"

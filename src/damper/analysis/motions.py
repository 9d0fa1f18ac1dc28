"""Motions that runs end in, as classes with names."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from damper.analysis.places import need_variables
from damper.observers.motion import ObservedMotion, in_words
from damper.parameters.units import units_of

if TYPE_CHECKING:
    import xarray as xr

#: What `motion` writes; two runs with the same values have the same motion.
_FOUND = tuple(variable.name for variable in ObservedMotion.variables)
#: Factor between neighbouring rms displacements of different motions without a period.
_APART = 1.2
#: Motions that get a name; rarer ones are `OTHERS`.
MOST = 6
OTHERS = "other motions"


def attractors(cube: xr.Dataset) -> tuple[xr.DataArray, list[str]]:
    """Class each run by the motion that it ends in.

    Periodic motions are of one class if they have the same period, symmetry, impacts and complete
    chatter sequences on each wall. So are a motion and its mirror image unless their impacts
    differ. Motions for which no period was found are parted where their rms displacements leave a
    gap of a fifth: a torus and chaos, for example.

    Parameters
    ----------
    cube : xarray.Dataset
        With the variables of the observers ``motion`` and ``response``.

    Returns
    -------
    classes : xarray.DataArray of float
        Number of the motion at each point, NaN where a run stopped.
    names : list of str
        Of the motions, the most frequent one first.

    Examples
    --------
    >>> import damper
    >>> cube = damper.simulate(mass_ratio=0.25, damping_ratio=0.02, frequency_ratio=0.74,
    ...                        clearance=4.62, restitution=0.5, initial_displacement=[-2.0, 3.0],
    ...                        initial_relative_velocity=[3.0, 4.5], transient=250, periods=20,
    ...                        observers=["motion", "response"])
    >>> attractors(cube)[1]
    ['period 1, impacts 1 left, 2 right', 'period 2, 2 impacts on each wall, not symmetric']
    """
    need_variables(cube, "motion", *_FOUND)
    need_variables(cube, "response", "rms_displacement")
    rms = cube.rms_displacement.values
    left = np.isfinite(cube.motion_period.values)
    values = np.stack([np.nan_to_num(cube[name].values, nan=-1.0) for name in _FOUND], axis=-1)
    found: list[tuple[np.ndarray, str]] = []
    for kind in np.unique(values[left], axis=0):
        one = left & (values == kind).all(axis=-1)
        name = in_words(dict(zip(_FOUND, kind.tolist(), strict=True)))
        found += [(one, name)] if kind[0] else _by_amplitude(cube.rms_displacement, one, name)
    found.sort(key=lambda each: -int(each[0].sum()))
    classes = cube.rms_displacement.copy(data=np.full(rms.shape, np.nan)).rename("attractor")
    classes.attrs = {"long_name": "motion", "units": "1"}
    for index, (one, _) in enumerate(found):
        classes.values[one] = min(index, MOST)
    names = [name for _, name in found[:MOST]]
    return classes, [*names, OTHERS] if len(found) > MOST else names


def _by_amplitude(rms: xr.DataArray, one: np.ndarray, name: str) -> list[tuple[np.ndarray, str]]:
    """Part a class where its rms displacements leave a gap."""
    ordered = np.sort(rms.values[one])
    lows = [ordered[0], *ordered[1:][ordered[1:] > _APART * ordered[:-1]]]
    if len(lows) == 1:
        return [(one, name)]
    part = np.digitize(rms.values, lows)
    units = units_of(rms.attrs)
    return [
        (here, f"{name}, rms {np.median(rms.values[here]):.3g} {units}")
        for here in (one & (part == k + 1) for k in range(len(lows)))
    ]

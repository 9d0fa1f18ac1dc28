"""Motions that runs end in, as classes with names."""

from __future__ import annotations

import numpy as np

from damper.analysis.places import require_variables
from damper.parameters.lazy import xr

#: Motions that get a name; rarer ones are `OTHERS`.
MOST = 9
OTHERS = "other motions"


def attractors(cube: xr.Dataset) -> tuple[xr.DataArray, list[str]]:
    """Class each run by the motion that it ends in.

    Runs are of one class if their motions have the same period, impacts and complete chatter
    sequences on each wall, and are symmetric or on the same side. So are all motions for which no
    period was found: quasi-periodic and chaotic ones are not told apart.

    Parameters
    ----------
    cube : xarray.Dataset
        With the variables of the observer ``motion``.

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
    ...                        observers=["motion"])
    >>> attractors(cube)[1]
    ['period 1, impacts 1 left, 2 right', 'period 2, 2 impacts on each wall, more to the left']
    """
    # Figures of other things load no engine.
    from damper.observers.motion import ObservedMotion, in_words

    # Two runs with the same values have the same motion; -1 would be the side of the left wall.
    found = [variable.name for variable in ObservedMotion.variables]
    require_variables(cube, "motion", *found)
    finished = np.isfinite(cube.motion_period.values)
    columns = {name: np.nan_to_num(cube[name].values, nan=-2.0) for name in found}
    values = np.stack(list(columns.values()), axis=-1)
    kinds, numbers, counts = np.unique(
        values[finished], axis=0, return_inverse=True, return_counts=True
    )
    order = np.argsort(-counts, kind="stable")
    classes = cube.motion_period.copy(data=np.full(finished.shape, np.nan)).rename("attractor")
    classes.attrs = {"long_name": "motion", "units": "1"}
    classes.values[finished] = np.minimum(np.argsort(order)[numbers.ravel()], MOST)
    named = [in_words(dict(zip(columns, kinds[k].tolist(), strict=True))) for k in order[:MOST]]
    return classes, [*named, OTHERS] if len(order) > MOST else named

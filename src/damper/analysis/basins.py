"""Basins of attraction: the share of initial conditions from which runs end in each motion."""

from __future__ import annotations

import math
from statistics import NormalDist

import numpy as np

from damper.analysis.motions import attractors
from damper.analysis.places import require_axes
from damper.parameters.lazy import pd, xr
from damper.parameters.quantities import INITIAL_NAMES
from damper.parameters.quantity import in_range


def basin_fractions(
    cube: xr.Dataset, along: str | None = None, confidence: float = 0.95
) -> pd.DataFrame:
    """Share of the starts that end in each motion, with confidence limits.

    Parameters
    ----------
    cube : xarray.Dataset
        With the variables of the observer ``motion``. All other axes and draws are starts.
    along : str, optional
        Axis at each of whose values to count.
    confidence : float, default 0.95
        Of the limits, which are Wilson's: as if the starts were drawn at random.

    Returns
    -------
    pandas.DataFrame
        Value of the axis, motion, starts that end in it and of all that ended, their part, and its
        limits `lower` and `upper`. Runs that stopped do not count.

    Raises
    ------
    ValueError
        When the cube lacks the axis or a variable, has no starts, or has several free masses.
    """
    if along is not None:
        require_axes(cube, along)
    in_range("confidence", confidence, minimum=0, maximum=1, below=True)
    classes, names = attractors(cube)
    if classes.sizes.get("body", 1) > 1:
        raise ValueError(
            "a start ends in one motion of each mass: choose one, as isel(body=0) does"
        )
    starts = {dim for name in INITIAL_NAMES if name in cube.coords for dim in cube[name].dims}
    if not starts & {*classes.dims} - {along}:
        raise ValueError(
            "the cube has no starts: make it with draws, or with axes, of initial quantities"
        )
    rows = []
    for value in [None] if along is None else cube[along].values.tolist():
        here = classes if value is None else classes.sel({along: value})
        found = here.values[np.isfinite(here.values)]
        for number, name in enumerate(names if found.size else ()):
            count = int((found == number).sum())
            lower, upper = wilson_limits(count, found.size, confidence)
            place = {} if value is None else {along: value}
            rows.append(
                place
                | {"motion": name, "starts": count, "of": found.size}
                | {"fraction": count / found.size, "lower": lower, "upper": upper}
            )
    columns = ["motion", "starts", "of", "fraction", "lower", "upper"]
    return pd.DataFrame(rows, columns=columns if along is None else [along, *columns])


def wilson_limits(count: int, of: int, confidence: float) -> tuple[float, float]:
    """Limits of a part by Wilson's score interval (J. Am. Stat. Assoc. 22, 1927, 209-212)."""
    z = NormalDist().inv_cdf(0.5 + 0.5 * confidence)
    part, more = count / of, z * z / of
    middle = part + 0.5 * more
    spread = z * math.sqrt(part * (1.0 - part) / of + 0.25 * more / of)
    # Of none and of all the limit is exact.
    lower = (middle - spread) / (1.0 + more) if count else 0.0
    return lower, (middle + spread) / (1.0 + more) if count < of else 1.0

"""Means under noise with their confidence limits, over all draws, beside their closed forms."""

from __future__ import annotations

import math

import numpy as np

from damper.analysis.closed_forms import damper_at
from damper.analysis.places import places, require_known, require_variables
from damper.observers.common.limits import mean_within
from damper.observers.statistics import MEANS
from damper.parameters.lazy import pd, xr
from damper.sweep.record import observers_of
from damper.theory.noise import means, missing_part


def means_under_noise(cube: xr.Dataset) -> pd.DataFrame:
    """Means of a cube under noise, with limits, and the closed form of white noise.

    Parameters
    ----------
    cube : xarray.Dataset
        With the variables of the observer ``statistics``, of rigid dampers under a
        `damper.Noise` on the primary. Draws are independent, and make the limits where there are
        several; else these are the observer's own.

    Returns
    -------
    pandas.DataFrame
        One row for each place along the axes and each mean: ``mean``, its name, ``value``,
        ``lower`` and ``upper`` in the cube's units, ``white``, its closed form under white
        noise, and ``in_band``, the same less the part of the power that is missing above the
        band; NaN where there is no closed form. ``holds``: whether the limits
        reach what lies between these two.

    Raises
    ------
    ValueError
        When the cube lacks a variable, a run stopped early, or the closed forms are of
        another damper.
    """
    require_variables(cube, "statistics", *MEANS)
    if "draw" not in cube.dims:
        require_variables(cube, "statistics", *(f"{name}_error" for name in MEANS))
    confidence = observers_of(cube)["statistics"].get("confidence", 0.95)
    rows = []
    for where in places(cube.mean_input, "draw"):
        place = cube.sel(where)
        one = place.isel(draw=0) if "draw" in place.dims else place
        damper, units = damper_at(one)
        rate = float(np.mean(place.impact_rate)) / damper.cycle
        missing = missing_part(damper, rate)  # infinite where bursts complete
        white, in_band = means(damper), means(damper, missing if missing < 1.0 else 0.0)
        for name, (_, unit, *_) in MEANS.items():
            size = units.size(unit)
            value, error = _mean(place, name, confidence)
            most, least = (found.get(name, math.nan) * size for found in (white, in_band))
            row = {"mean": name, "value": value, "lower": value - error, "upper": value + error}
            row |= {"white": most, "in_band": least}
            inside = value - error <= most and least <= value + error
            row["holds"] = None if math.isnan(most) else inside
            rows.append(where | row)
    return pd.DataFrame(rows)


def _mean(place: xr.Dataset, name: str, confidence: float) -> tuple[float, float]:
    array = place[name]
    if not array.ndim:
        return float(array), float(place[f"{name}_error"])
    require_known(place.mean_input)
    # A mean over impacts: of the impacts of all draws.
    impacts = place.impact_rate.values if name == "mean_approach_energy" else np.ones(array.size)
    return mean_within(np.where(impacts > 0.0, array.values, 0.0) * impacts, impacts, confidence)

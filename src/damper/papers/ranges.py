"""Ranges of the restitution in which bursts are chatter, straight from a cube's grid."""

from __future__ import annotations

from collections.abc import Mapping
from typing import NamedTuple

import numpy as np

from damper.analysis.runs import runs
from damper.parameters.lazy import xr

#: Runs of fewer grid points are chaotic edges, not ranges.
_LEAST = 3


class Range(NamedTuple):
    """Outermost values of an axis, NaN where there is none, its length without and with the gaps.

    Each value stands for one step of the axis in both lengths.
    """

    low: float
    high: float
    length: float
    span: float


def range_of(values: np.ndarray, holds: np.ndarray) -> Range:
    """Hull of all runs of at least three neighbouring values at which something holds.

    Its length counts all values at which the statement holds, neighbours or not: their number times
    the step of the axis.
    """
    step = float(np.abs(np.diff(values)).min()) if values.size > 1 else 0.0
    length = step * float(np.sum(holds))
    wide = [(a, b) for a, b in runs(holds) if b - a + 1 >= _LEAST]
    if not wide:
        return Range(np.nan, np.nan, length, 0.0)
    low, high = float(values[wide[0][0]]), float(values[wide[-1][1]])
    return Range(low, high, length, high - low + step)


def chatter_ranges(
    cube: xr.Dataset, least: int, threshold: float | None = None
) -> dict[tuple[float, float], Range]:
    """Range of chatter in the restitution: (mass_ratio, frequency_ratio) -> Range.

    With `least` 2 only complete chatter counts, with 1 incomplete as well; `threshold` is one of
    the compared visibility thresholds, the main one when not given.
    """
    chatter = cube.chatter
    if threshold is not None:
        chatter = cube.chatter_by_threshold.sel(threshold=threshold)
    chatter = chatter.sortby("restitution")
    return {
        (float(mass), float(frequency)): range_of(
            chatter.restitution.values,
            chatter.sel(mass_ratio=mass, frequency_ratio=frequency).values >= least,
        )
        for mass in cube.mass_ratio.values
        for frequency in cube.frequency_ratio.values
    }


def ends(ranges: Mapping[tuple[float, float], Range]) -> tuple[float, float]:
    """Return the outermost ends of all ranges; NaN where there is none."""
    found = [one for one in ranges.values() if not np.isnan(one.low)]
    if not found:
        return np.nan, np.nan
    return min(one.low for one in found), max(one.high for one in found)

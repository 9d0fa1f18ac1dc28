"""How well theory predicts the rest of complete bursts: errors of a cube, and their slopes.

The cube has the variables of the observer `accumulation`. Its resolved ends carry an uncertainty
of their own, so an error counts only where it is well above that.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass
from itertools import product
from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    import xarray as xr

#: Dimensions of the observer.
BURST, IMPACT = "complete_burst", "burst_impact"
QUANTITIES = ("time", "displacement")
ORDERS = ("first", "second")
#: An error counts where it is this many times the uncertainty of the resolved value.
SHARP = 100.0
#: Largest estimated relative error for which the asymptotic law is looked at.
SMALL = 1e-2
#: Ratio of the rebound speeds between which a slope is taken.
_SPAN = 4.0
#: Fewer points than these tell no slope.
_LEAST = 5


@dataclass(frozen=True)
class Errors:
    """Errors of one prediction: of a quantity, to an order, in arrays (bursts, impacts).

    `error` is predicted less resolved, NaN where either is missing; `left` the resolved value;
    `asymptotic` says where the law of the error can be seen: the formulas hold, and the error is
    well above the uncertainty of the resolved value; `sharp` where the resolved value itself is.
    """

    speed: np.ndarray
    left: np.ndarray
    error: np.ndarray
    asymptotic: np.ndarray
    sharp: np.ndarray

    def slope(self) -> tuple[float, int]:
        """Exponent of the rebound speed in the error, and the number of errors it rests on.

        The median of the slopes between each impact and the first later one of the same burst
        whose rebound speed is at most a quarter of it: bursts may differ in size, and where an
        error changes its sign single slopes are wild. NaN for fewer than five errors.
        """
        slopes: list[float] = []
        points = 0
        for speed, error, mask in zip(self.speed, self.error, self.asymptotic, strict=True):
            w, size = np.log(speed[mask]), np.log(np.abs(error[mask]))
            points += w.size
            for k in range(w.size):
                later = np.flatnonzero(w <= w[k] - math.log(_SPAN))
                later = later[later > k]
                if later.size:
                    m = later[0]
                    slopes.append(float((size[k] - size[m]) / (w[k] - w[m])))
        if points < _LEAST or not slopes:
            return math.nan, points
        return float(np.median(slopes)), points


@dataclass(frozen=True)
class FirstImpact:
    """Errors of predictions made at the first impact of each burst: NaN where there are none.

    In units of the quantity, and as parts of the burst's size: its duration, or the largest
    distance of the primary at one of its impacts from where it completes.
    """

    predicted: int
    median: float
    worst: float
    median_part: float
    worst_part: float


@dataclass(frozen=True)
class Within:
    """From which impact on predictions stay within a part of what they predict.

    Counted from 1; infinite where the impacts listed do not reach that far. `left` is the part of
    the burst's size that is left then (median over the bursts that get there).
    """

    median: float
    worst: float
    left: float


@dataclass(frozen=True)
class Agreement:
    """One prediction at one place along the axes."""

    where: dict[str, float]
    quantity: str
    order: str
    complete_bursts: int
    """In the record; -1 where the run stopped early."""
    bursts: int
    """Looked at."""
    impacts: int
    predicted: int
    slope: float
    slope_points: int
    first: FirstImpact
    within: Within


def errors_of(piece: xr.Dataset, quantity: str, order: str) -> Errors:
    """Collect the errors of one prediction from a cube, over all of its other dimensions.

    Parameters
    ----------
    piece : xarray.Dataset
        A cube, or the part of one that is to be looked at.
    quantity : {"time", "displacement"}
    order : {"first", "second"}

    Returns
    -------
    Errors
    """
    speed = _rows(piece.rebound_speed)
    left = _rows(piece[f"remaining_{quantity}"])
    error = _rows(piece[f"{order}_order_{quantity}"]) - left
    blur = _rows(piece[f"completion_{quantity}_uncertainty"])[:, None]
    with np.errstate(invalid="ignore"):
        clear = np.abs(error) > SHARP * blur
        small = (_rows(piece.prediction_error_estimate) < SMALL) & (speed > 0.0)
        sharp = np.abs(left) > SHARP * blur
    there = np.isfinite(left).any(axis=1)
    arrays = (speed, left, error, clear & small, sharp)
    return Errors(*(array[there] for array in arrays))


def agreements(cube: xr.Dataset, within: float) -> Iterator[Agreement]:
    """Compare every prediction at every place along the axes and branches of a cube.

    Parameters
    ----------
    cube : xarray.Dataset
        With the variables of the observer `accumulation`.
    within : float
        The part of what is predicted that counts as agreement, such as 0.01.

    Yields
    ------
    Agreement
        Four for each place: time and displacement, each to first and second order.
    """
    axes = {name: cube[name].values.tolist() for name in cube.complete_bursts.dims}
    for values in product(*axes.values()):
        where = dict(zip(axes, values, strict=True))
        here = cube.sel(where)
        for quantity in QUANTITIES:
            for order in ORDERS:
                found = errors_of(here, quantity, order)
                slope, points = found.slope()
                yield Agreement(
                    where,
                    quantity,
                    order,
                    int(here.complete_bursts),
                    len(found.error),
                    int(np.isfinite(found.left).sum()),
                    int(np.isfinite(found.error).sum()),
                    slope,
                    points,
                    _first_impact(found),
                    _within(found, within),
                )


def _rows(array: xr.DataArray) -> np.ndarray:
    """Values with one row for each burst, whatever other dimensions there are."""
    own = [dim for dim in (BURST, IMPACT) if dim in array.dims]
    values = array.transpose(..., *own).values
    return values.reshape(-1, *values.shape[values.ndim - len(own) + 1 :])


def _sizes(found: Errors) -> np.ndarray:
    """Largest value of what was left, of each burst."""
    return np.nanmax(np.abs(found.left), axis=1, initial=0.0)


def _first_impact(found: Errors) -> FirstImpact:
    error = np.abs(found.error[:, 0])
    made = np.isfinite(error)
    size = _sizes(found)
    part = error[made & (size > 0.0)] / size[made & (size > 0.0)]
    error = error[made]
    return FirstImpact(error.size, _median(error), _worst(error), _median(part), _worst(part))


def _within(found: Errors, within: float) -> Within:
    starts, parts = [], []
    for left, error, sharp, size in zip(
        found.left, found.error, found.sharp, _sizes(found), strict=True
    ):
        if not sharp.any():
            continue
        # Missing predictions are no agreement.
        far = sharp & ~(np.abs(error) <= within * np.abs(left))
        start = int(np.flatnonzero(far)[-1]) + 1 if far.any() else 0
        if start <= np.flatnonzero(sharp)[-1]:
            starts.append(start + 1.0)
            parts.append(abs(left[start]) / size)
        else:
            starts.append(math.inf)
    return Within(_median(np.array(starts)), _worst(np.array(starts)), _median(np.array(parts)))


def _median(values: np.ndarray) -> float:
    return float(np.median(values)) if values.size else math.nan


def _worst(values: np.ndarray) -> float:
    return float(values.max()) if values.size else math.nan

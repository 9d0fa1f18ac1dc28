"""How well theory predicts the rest of complete bursts: errors of a cube, and their slopes.

The cube has the variables of the observer `accumulation`. Its resolved ends carry an uncertainty
of their own, so an error counts only where it is well above that.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from damper.analysis.places import places, require_variables
from damper.parameters.lazy import pd, xr
from damper.parameters.quantity import in_range

#: Dimensions of the observer.
BURST, IMPACT = "complete_burst", "burst_impact"
PREDICTED = ("time", "displacement")
ORDERS = ("first", "second")
_OF_BURSTS = tuple(f"accumulation_{quantity}_uncertainty" for quantity in PREDICTED)
_OF_IMPACTS = (
    *("rebound_speed", "prediction_error_estimate"),
    *(
        f"{which}_{quantity}"
        for which in ("remaining", "first_order", "second_order")
        for quantity in PREDICTED
    ),
)
#: All of the observer that errors are made of.
VARIABLES = (*_OF_BURSTS, *_OF_IMPACTS)
#: An error counts where it is this many times the uncertainty of the resolved value.
SHARP = 100.0
#: Largest estimated relative error for which the asymptotic law is looked at.
SMALL = 1e-2
#: Ratio of the rebound speeds between which a slope is taken.
_SPAN = 4.0
#: Fewer points than these give no slope.
_LEAST = 5


def accumulation_errors(cube: xr.Dataset, within: float = 0.01) -> pd.DataFrame:
    """How well theory predicts when and where complete bursts end, at every place of a cube.

    After each impact of a complete burst, theory predicts its accumulation time and the
    displacement of the primary there, to first and to second order in the rebound speed.

    Parameters
    ----------
    cube : xarray.Dataset
        With the variables of the observer ``accumulation``.
    within : float, default 0.01
        The part of what is predicted that counts as agreement.

    Returns
    -------
    pandas.DataFrame
        Four rows for each place along the axes, directions and draws: ``quantity`` (time,
        displacement) and ``order`` (1, 2). Columns are these and

        - ``complete_bursts`` in the window, missing where the run stopped; of these ``bursts``
          looked at, with ``impacts`` and ``predicted_impacts``;
        - ``slope``: exponent of the rebound speed in the error, and the number of errors that it
          rests on, ``slope_points``;
        - ``first_impact_...``: number of predictions made at the first impact of a burst, their
          median and worst error in units of the quantity, and in per cent of the burst's size: its
          duration, or the largest distance of the primary at an impact from where it completes;
        - ``within_percent`` as given, and the impact, counted from 1, from which on all predictions
          are that good: ``within_from_median`` and ``_worst``, infinite where the impacts listed do
          not reach that far. ``within_left_percent``: part of the burst's size that is left then
          (median over the bursts that get there).

        NaN where there is nothing to compare.

    Raises
    ------
    ValueError
        When the cube was made without the observer.
    """
    in_range("within", within, minimum=0, above=True)
    require_variables(cube, "accumulation", "complete_bursts")
    require_variables(cube, "accumulation", *_OF_BURSTS, along=[BURST])
    require_variables(cube, "accumulation", *_OF_IMPACTS, along=[BURST, IMPACT])
    rows = []
    for where in places(cube.complete_bursts):
        here = cube.sel(where)
        for quantity in PREDICTED:
            for number, order in enumerate(ORDERS, start=1):
                found = errors_of(here, quantity, order)
                slope, points = found.slope()
                rows.append(
                    where
                    | {
                        "quantity": quantity,
                        "order": number,
                        "complete_bursts": math.nan
                        if np.isnan(here.complete_bursts)
                        else int(here.complete_bursts),
                        "bursts": len(found.error),
                        "impacts": int(np.isfinite(found.left).sum()),
                        "predicted_impacts": int(np.isfinite(found.error).sum()),
                        "slope": slope,
                        "slope_points": points,
                    }
                    | _first_impact(found)
                    | _within(found, within)
                )
    return pd.DataFrame(rows)


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

    def factor(self, exponent: float) -> float:
        """Factor of the law with a given exponent: the median over the errors that follow it."""
        speed, error = self.speed[self.asymptotic], self.error[self.asymptotic]
        if not speed.size:
            return math.nan
        return float(np.exp(np.median(np.log(np.abs(error)) - exponent * np.log(speed))))


def errors_of(piece: xr.Dataset, quantity: str, order: str) -> Errors:
    """Collect the errors of one prediction from a cube, over all of its other dimensions.

    The quantity is "time" or "displacement", the order "first" or "second".
    """
    speed = _rows(piece.rebound_speed)
    left = _rows(piece[f"remaining_{quantity}"])
    error = _rows(piece[f"{order}_order_{quantity}"]) - left
    roundoff = _rows(piece[f"accumulation_{quantity}_uncertainty"])[:, None]
    with np.errstate(invalid="ignore"):
        clear = np.abs(error) > SHARP * roundoff
        small = (_rows(piece.prediction_error_estimate) < SMALL) & (speed > 0.0)
        sharp = np.abs(left) > SHARP * roundoff
    there = np.isfinite(left).any(axis=1)
    arrays = (speed, left, error, clear & small, sharp)
    return Errors(*(array[there] for array in arrays))


def _rows(array: xr.DataArray) -> np.ndarray:
    """Values with one row for each burst, whatever other dimensions there are."""
    own = [dim for dim in (BURST, IMPACT) if dim in array.dims]
    values = array.transpose(..., *own).values
    return values.reshape(-1, *values.shape[values.ndim - len(own) + 1 :])


def _sizes(found: Errors) -> np.ndarray:
    """Largest value of what was left, of each burst."""
    return np.nanmax(np.abs(found.left), axis=1, initial=0.0)


def _first_impact(found: Errors) -> dict[str, float]:
    error = np.abs(found.error[:, 0])
    made = np.isfinite(error)
    size = _sizes(found)
    parts = 100.0 * (error[made & (size > 0.0)] / size[made & (size > 0.0)])
    error = error[made]
    return {
        "first_impact_predicted": error.size,
        "first_impact_median_error": _median(error),
        "first_impact_worst_error": _worst(error),
        "first_impact_median_percent": _median(parts),
        "first_impact_worst_percent": _worst(parts),
    }


def _within(found: Errors, within: float) -> dict[str, float]:
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
    return {
        "within_percent": 100.0 * within,
        "within_from_median": _median(np.array(starts)),
        "within_from_worst": _worst(np.array(starts)),
        "within_left_percent": 100.0 * _median(np.array(parts)),
    }


def _median(values: np.ndarray) -> float:
    return float(np.median(values)) if values.size else math.nan


def _worst(values: np.ndarray) -> float:
    return float(values.max()) if values.size else math.nan

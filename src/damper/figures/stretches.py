"""Stretches of a sampled trajectory: where bursts are chatter, and where the masses stick.

For figures of motion in time. Everything comes from what the observers `trajectory` and `bursts`
wrote; nothing is found anew here, so a figure shows what the tables count.
"""

from typing import NamedTuple

import numpy as np
import xarray as xr

from damper.study.runs import runs
from damper.variables import CHATTER_IMPACTS

#: What `chatter` needs: the observer `trajectory`, and `bursts` with records.
CHATTER_VARIABLES = (
    "trajectory_start",
    "burst_onset",
    "burst_duration",
    "burst_visible_impacts",
    "burst_complete",
)
_STICKING = 1


class Chatter(NamedTuple):
    """A burst with at least five visible impacts.

    Times count from the start of the sampled stretch, in the cube's units of time.
    """

    start: float
    """Of the first impact."""
    stop: float
    """Of sticking, or of the last impact where the burst does not complete."""
    complete: bool


def chatter(place: xr.Dataset) -> list[Chatter]:
    """Return the listed bursts of one run that are chatter, in order.

    A burst that was under way when the record began is not listed, nor is one that the record's
    end cuts: let the sampled stretch begin a period or two into the record, and end before it.

    Parameters
    ----------
    place : xarray.Dataset
        One run, with `CHATTER_VARIABLES` over the dimension ``burst``.
    """
    onsets = place.burst_onset.values - float(place.trajectory_start)
    stops = onsets + place.burst_duration.values
    complete = place.burst_complete.values == 1.0
    # NaN, in unused places of the list, is less than nothing.
    (found,) = np.nonzero(place.burst_visible_impacts.values >= CHATTER_IMPACTS)
    return [Chatter(float(onsets[k]), float(stops[k]), bool(complete[k])) for k in found]


def listed_until(place: xr.Dataset) -> float:
    """Return the time up to which all bursts are listed: infinite unless the list is full.

    Parameters
    ----------
    place : xarray.Dataset
        As for `chatter`.
    """
    onset = place.burst_onset.values[-1] - float(place.trajectory_start)
    return np.inf if np.isnan(onset) else float(onset + place.burst_duration.values[-1])


def sticking(time: np.ndarray, mode: np.ndarray) -> list[tuple[float, float]]:
    """Return start and end of every stretch in which the masses stick.

    Parameters
    ----------
    time : ndarray, shape (n,)
        Of the trajectory's rows, in any unit.
    mode : ndarray, shape (n,)
        `trajectory_mode` of these rows.

    Examples
    --------
    >>> sticking(np.array([0.0, 1.0, 2.0, 3.0]), np.array([0, 1, 1, 0]))
    [(1.0, 3.0)]
    """
    # The row after the last one that sticks is the release, or the last row of all.
    last_row = len(time) - 1
    return [
        (float(time[first]), float(time[min(last + 1, last_row)]))
        for first, last in runs(mode == _STICKING)
    ]


def forcing_frequency(place: xr.Dataset) -> str:
    """Name of the coordinate that gives the forcing period."""
    return "frequency_ratio" if "frequency_ratio" in place.coords else "forcing_frequency"


def half_gap(place: xr.Dataset) -> float:
    """Distance from the centre to each wall, in the cube's unit of length."""
    return float(place.clearance if "clearance" in place.coords else 0.5 * place.gap)


def rows_between(time: np.ndarray, start: float, stop: float | None) -> slice:
    """Rows from `start` to `stop`, and one beyond each, so that lines reach the panel's edges.

    Parameters
    ----------
    time : ndarray, shape (n,)
        In forcing periods, NaN in unused rows, which come last.
    start, stop : float
        In forcing periods; to the last row without `stop`.

    Raises
    ------
    ValueError
        When the rows end before `start`.
    """
    time = time[np.isfinite(time)]
    if not time.size or time[-1] <= start:
        end = f"{time[-1]:g}" if time.size else "0"
        raise ValueError(
            f"start = {start:g}: the trajectory ends {end} forcing periods after its start"
        )
    first = max(int(np.searchsorted(time, start, "right")) - 1, 0)
    last = time.size if stop is None else int(np.searchsorted(time, stop, "right")) + 1
    return slice(first, min(last, time.size))

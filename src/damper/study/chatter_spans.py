"""When a run chatters and when it sticks, from what the observers wrote; nothing is found anew."""

import math
from typing import NamedTuple

import numpy as np
import xarray as xr

from damper.study.runs import runs
from damper.variables import CHATTER_IMPACTS

#: Variables of the observer `bursts` that `listed_bursts` reads.
BURST_VARIABLES = (
    "burst_onset",
    "burst_wall",
    "burst_duration",
    "burst_visible_impacts",
    "burst_complete",
    "burst_sticking_time",
)
_STICKING = 1


class Burst(NamedTuple):
    """A run of impacts on one wall. Times count from the start of the record, in its unit."""

    onset: float
    """Of the first impact."""
    wall: int
    """-1 left, +1 right."""
    duration: float
    """From the first impact to sticking, or to the last impact of an incomplete burst."""
    visible: int
    """Visible impacts."""
    complete: bool
    sticking: float
    """From sticking to release; NaN where the burst is incomplete or the record ends first."""

    @property
    def end(self) -> float:
        """Time of sticking, or of the last impact."""
        return self.onset + self.duration

    @property
    def release(self) -> float:
        """Time of the release after it, or of the last impact where there is none."""
        return self.end if math.isnan(self.sticking) else self.end + self.sticking

    @property
    def chatter(self) -> bool:
        """Whether it has enough visible impacts to be chatter."""
        return self.visible >= CHATTER_IMPACTS


def listed_bursts(place: xr.Dataset) -> list[Burst]:
    """Return the listed bursts of one run, in order.

    A burst that was under way when the record began, or that its end cuts, is not listed.

    Parameters
    ----------
    place : xarray.Dataset
        One run, with `BURST_VARIABLES` over the dimension ``burst``.
    """
    columns = [place[name].values for name in BURST_VARIABLES]
    return [
        Burst(float(onset), int(wall), float(duration), int(visible), bool(complete), float(stuck))
        for onset, wall, duration, visible, complete, stuck in zip(*columns, strict=True)
        if np.isfinite(onset)
    ]


def list_is_full(place: xr.Dataset) -> bool:
    """Whether the list of bursts has no place left, so that more may have come after its last."""
    onsets = place.burst_onset.values
    return bool(np.isfinite(onsets).all())


def sticking_spans(time: np.ndarray, mode: np.ndarray) -> list[tuple[float, float]]:
    """Return start and end of every stretch in which the masses stick.

    Parameters
    ----------
    time : ndarray, shape (n,)
        Of the trajectory's rows, in any unit.
    mode : ndarray, shape (n,)
        `trajectory_mode` of these rows.

    Examples
    --------
    >>> sticking_spans(np.array([0.0, 1.0, 2.0, 3.0]), np.array([0, 1, 1, 0]))
    [(1.0, 3.0)]
    """
    # The row after the last one that sticks is the release, or the last row of all.
    last_row = len(time) - 1
    return [
        (float(time[first]), float(time[min(last + 1, last_row)]))
        for first, last in runs(mode == _STICKING)
    ]

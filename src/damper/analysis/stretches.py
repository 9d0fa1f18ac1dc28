"""Stretches of a run: its single bursts, when the masses stick, and parts of a sampled motion.

For figures of motion in time. Everything comes from what the observers `trajectory` and `bursts`
wrote; nothing is found anew here, so a figure shows what the tables count.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from damper.analysis.places import own_values
from damper.analysis.runs import runs
from damper.parameters.lazy import xr
from damper.parameters.quantity import real
from damper.parameters.variables import CHATTER_IMPACTS

#: Variables of the observer `trajectory` that every run has.
MOTION_VARIABLES = tuple(
    f"trajectory_{name}"
    for name in (
        *("time", "start", "displacement", "velocity", "free_displacement", "free_velocity"),
        *("event", "mode", "events_left_out"),
    )
)
#: Variables of the observer `bursts`, with records, that `listed_bursts` reads.
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
    """A run of impacts on one wall. Times count from the start of the window, in its unit."""

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
    """From sticking to release; NaN where the burst is incomplete or the window ends first."""

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

    A burst that was under way when the window began is not listed, nor is one that the window's end
    cuts: let a sampled stretch begin a cycle or two into the window, and end before it.
    """
    columns = [place[name].values for name in BURST_VARIABLES]
    return [
        Burst(float(onset), int(wall), float(duration), int(visible), bool(complete), float(stuck))
        for onset, wall, duration, visible, complete, stuck in zip(*columns, strict=True)
        if np.isfinite(onset)
    ]


def listed_until(place: xr.Dataset) -> float:
    """Return the time up to which all bursts are listed: infinite unless the list is full."""
    last = float(place.burst_onset.values[-1] + place.burst_duration.values[-1])
    return math.inf if math.isnan(last) else last


def sticking(time: np.ndarray, mode: np.ndarray) -> list[tuple[float, float]]:
    """Return start and end of every stretch in which the masses stick, from a trajectory's rows.

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
    """Name of the coordinate that gives the cycle."""
    return "frequency_ratio" if "frequency_ratio" in place.coords else "forcing_frequency"


def cycle(place: xr.Dataset) -> float:
    """Length of a cycle in the cube's unit of time."""
    name = forcing_frequency(place)
    return 2.0 * math.pi / float(own_values(place, name, place[name].values))


def half_gap(place: xr.Dataset) -> float:
    """Distance from the centre to each wall, in the cube's unit of length; of its `body`."""
    return float(half_gap_of(place, int(place.coords.get("body", 0))))


def half_gap_of(cube: xr.Dataset, body: int) -> xr.DataArray:
    """Distance from the centre to each wall of a free mass, along the axes of its clearance."""
    coords = cube.coords
    factor = coords.get(f"clearance_factor_{body}", coords.get("clearance_factor", 1.0))
    for name, part in (("clearance", 1.0), ("gap", 0.5)):
        for own in (f"{name}_{body}", name):
            if own in coords:
                return part * coords[own] * factor  # type: ignore[no-any-return]
    raise ValueError("the cube has lost how far the walls are apart")


def sides(place: xr.Dataset) -> tuple[float, ...]:
    """Sides with a wall: -1 left, 1 right."""
    one = float(place.coords.get("walls", 0.0))
    return (one,) if one else (-1.0, 1.0)


def rows_between(time: np.ndarray, start: float, stop: float | None) -> slice:
    """Rows from `start` to `stop`, and one beyond each, so that lines reach the panel's edges.

    Times are in cycles, NaN in unused rows, which come last; ValueError when the rows end
    before `start`, or `stop` is no later.
    """
    time = time[np.isfinite(time)]
    start = real("start", start)
    if stop is not None and not start < real("stop", stop):
        raise ValueError(f"start = {start:g}, stop = {stop:g}: start must be less than stop")
    if not time.size or time[-1] <= start:
        end = f"{time[-1]:g}" if time.size else "0"
        raise ValueError(f"start = {start:g}: the trajectory ends {end} cycles after its start")
    first = max(int(np.searchsorted(time, start, "right")) - 1, 0)
    last = time.size if stop is None else int(np.searchsorted(time, stop, "right")) + 1
    return slice(first, min(last, time.size))

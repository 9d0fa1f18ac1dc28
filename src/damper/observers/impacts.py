"""Impacts: how many can be seen per period, and how hard they are."""

from collections.abc import Mapping

import numpy as np

from damper.compiled import compiled
from damper.engine import CAUSE, IMPACT, MODE, SIDE, SPEED, STICKING, TAIL, Trajectory
from damper.observers.base import (
    Observer,
    Window,
    since,
    visibility,
    visible_in_tail,
)
from damper.variables import SPEED as SPEED_UNIT
from damper.variables import Variable

_COUNT, _SUM, _LARGEST, _FIRST, _WALL = range(5)


class Impacts(Observer):
    """Visible impacts per period, their mean and largest approach speed.

    A complete burst has infinitely many impacts, so only visible ones can be counted.

    Parameters
    ----------
    threshold : float or mapping, default 0.03
        An impact is visible when its approach speed is at least this fraction of the first one
        of its burst, or at least ``{"speed": ...}``.

    Raises
    ------
    ValueError
        When the threshold is out of range.
    """

    def __init__(self, threshold: float | Mapping[str, float] = 0.03) -> None:
        self.threshold = visibility(threshold)
        comment = describe(self.threshold)
        self.variables = (
            Variable(
                "impacts_per_period", "visible impacts per forcing period", "1", comment=comment
            ),
            Variable(
                "mean_approach_speed",
                "mean approach speed of visible resolved impacts",
                SPEED_UNIT,
                comment=comment,
            ),
            Variable("max_approach_speed", "largest approach speed", SPEED_UNIT),
        )

    def begin(self, lane: int, trajectory: Trajectory, window: Window) -> None:
        """Start on a lane."""
        self._lane = lane
        self._model = trajectory.model
        self._window = window
        self._totals = np.zeros(6)

    def observe(self, log: np.ndarray) -> None:
        """Read the next piece of the log."""
        _count(
            self._model, log, self._window.period, self._window.time, *self.threshold, self._totals
        )

    def finish(self, finished: bool) -> None:
        """Write the lane's averages."""
        if not finished:
            return
        count, total, resolved = self._totals[[_COUNT, _SUM, 5]]
        self.arrays["impacts_per_period"][self._lane] = count / self._window.length
        if resolved:
            self.arrays["mean_approach_speed"][self._lane] = total / resolved
            self.arrays["max_approach_speed"][self._lane] = self._totals[_LARGEST]


def describe(threshold: tuple[float, float]) -> str:
    """Say in words what counts as visible."""
    fraction, speed = threshold
    if speed:
        return f"visible: approach speed >= {speed:g}"
    return f"visible: approach speed >= {fraction:g} of the first one of the burst"


@compiled
def _count(model, log, periods, time, fraction, speed, totals):
    for index in range(len(log)):
        row = log[index]
        wall = float(row[SIDE])
        if row[MODE] == STICKING:
            totals[_WALL] = 0.0
        if row[CAUSE] != IMPACT:
            continue
        approach = float(row[SPEED])
        if wall != totals[_WALL]:
            totals[_WALL] = wall
            totals[_FIRST] = approach
        if since(row, model[4], periods, time) < 0.0:
            continue
        limit = max(fraction * totals[_FIRST], speed)
        if approach >= limit:
            totals[_COUNT] += 1.0
            totals[_SUM] += approach
            totals[5] += 1.0
        if row[MODE] == TAIL:
            totals[_COUNT] += visible_in_tail(row, model[2], limit)
        totals[_LARGEST] = max(totals[_LARGEST], approach)

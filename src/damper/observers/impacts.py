"""Impacts: how many can be seen per period, and how hard they are."""

from collections.abc import Mapping

import numpy as np

from damper.engine.compiled import compiled
from damper.engine.segment import CAUSE, FIRST, IMPACT, MODE, SPEED, TAIL
from damper.engine.trajectory import Trajectory
from damper.observers.base import (
    Observer,
    Window,
    describe,
    since,
    visibility,
    visible_in_tail,
)
from damper.parameters.variables import SPEED as SPEED_UNIT
from damper.parameters.variables import Variable

_IMPACTS, _VISIBLE, _TAILS, _SUM, _LARGEST = range(5)


class Impacts(Observer):
    """Visible impacts per period, their mean and largest approach speed.

    A complete burst has infinitely many impacts, so only visible ones can be counted.

    Parameters
    ----------
    threshold : float or mapping, default 0.03
        An impact is visible when its approach speed is at least this fraction of the first one
        of its burst, or at least ``{"speed": ...}``, in m/s for points in SI units.

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
        super().begin(lane, trajectory, window)
        self._totals = np.zeros(5)
        fraction, speed = self.threshold
        self._visible = (fraction, speed / trajectory.units.speed)

    def observe(self, log: np.ndarray) -> None:
        """Read the next piece of the log."""
        _count(
            self._model, log, self._window.period, self._window.time, *self._visible, self._totals
        )

    def finish(self, finished: bool) -> None:
        """Write the lane's averages."""
        if not finished:
            return
        impacts, visible, in_tails, total, largest = self._totals
        put = {"impacts_per_period": (visible + in_tails) / self._window.length}
        if visible:
            put["mean_approach_speed"] = total / visible
        if impacts:
            put["max_approach_speed"] = largest
        self._put(put)


@compiled
def _count(model, log, periods, time, fraction, speed, totals):
    for index in range(len(log)):
        row = log[index]
        if row[CAUSE] != IMPACT or since(row, model.period, periods, time) < 0.0:
            continue
        approach = float(row[SPEED])
        limit = max(fraction * float(row[FIRST]), speed)
        totals[_LARGEST] = max(totals[_LARGEST], approach)
        totals[_IMPACTS] += 1.0
        if approach >= limit:
            totals[_VISIBLE] += 1.0
            totals[_SUM] += approach
        if row[MODE] == TAIL:
            totals[_TAILS] += visible_in_tail(row, model.restitution, limit)

"""Impacts: how many can be seen per period, and how hard they are."""

import numpy as np

from damper.engine.compiled import compiled
from damper.engine.model import read_segment
from damper.engine.segment import IMPACT, TAIL
from damper.engine.trajectory import Trajectory
from damper.models.response import own_impulse, own_loss, prepare_tables
from damper.observers.common.base import (
    Observer,
    Window,
    describe,
    read_record,
    record_type,
    since,
    visible_in_tail,
)
from damper.observers.common.settings import BODIES, VISIBILITY, Setting
from damper.parameters.models import MODELS
from damper.parameters.variables import ENERGY, IMPULSE, Variable
from damper.parameters.variables import SPEED as SPEED_UNIT

#: Of a run: all impacts, visible ones, those in tails; sum and largest of the approach speeds.
_TOTALS = record_type("impacts", "visible", "in_tails", "speeds", "largest")
_MOST = record_type("impulse", "loss")


class Impacts(Observer):
    """Visible impacts per cycle, their mean and largest approach speed.

    A complete burst has infinitely many impacts, so only visible ones can be counted.
    """

    models = tuple(MODELS)
    bodies = BODIES
    threshold = VISIBILITY
    speeds = Setting(
        0, "Visible impacts of each run whose approach speeds are listed, the first ones.", ge=0
    )
    largest = Setting(
        False,
        "Write the largest impulse of an impact, and the largest energy that one takes, as well.",
        models=("rigid", "grounded", "time_varying", "sliding", "several"),
    )

    @property
    def variables(self) -> list[Variable]:
        """What it writes."""
        seen = describe(self.threshold)
        made = [
            Variable("impacts_per_period", "visible impacts per cycle", "1", comment=seen),
            Variable(
                "mean_approach_speed",
                "mean approach speed of visible resolved impacts",
                SPEED_UNIT,
                comment=seen,
            ),
            Variable("max_approach_speed", "largest approach speed", SPEED_UNIT),
        ]
        if self.largest:
            made += [
                Variable("max_impulse", "largest impulse of an impact", IMPULSE),
                Variable("max_impact_loss", "largest energy lost in an impact", ENERGY),
            ]
        if self.speeds:
            each = "approach speed of each visible resolved impact"
            made.append(Variable("approach_speed", each, SPEED_UNIT, ("impact",), comment=seen))
        return made

    def size(self, dim: str, window_length: int) -> int:
        """Number of impacts listed."""
        return self.speeds

    def begin(self, run: int, trajectory: Trajectory, window: Window) -> None:
        """Start on a run."""
        super().begin(run, trajectory, window)
        self._totals = np.zeros(1, _TOTALS)
        fraction, speed = self.threshold
        self._visible = (fraction, speed / trajectory.units.speed)
        self._listed = np.full(self.speeds, np.nan)
        if self.largest:
            prepare_tables(self._model)  # what an impact takes, of this model
            self._most = np.zeros(1, _MOST)

    def observe(self, log: np.ndarray) -> None:
        """Read the next piece of the log."""
        _count(self._model, log, self._window, *self._visible, self._totals, self._listed)
        if self.largest:
            _find_largest(self._model, log, self._window, self._most)

    def finish(self, finished: bool) -> None:
        """Write the run's averages; speeds listed before an early stop stay."""
        if self.speeds:
            self._put({"approach_speed": self._listed})
        if not finished:
            return
        total = read_record(self._totals)
        put = {"impacts_per_period": (total.visible + total.in_tails) / self._window.length}
        if total.visible:
            put["mean_approach_speed"] = total.speeds / total.visible
        if total.impacts:
            put["max_approach_speed"] = total.largest
        if total.impacts and self.largest:
            most = read_record(self._most)
            put |= {"max_impulse": most.impulse, "max_impact_loss": most.loss}
        self._put(put)


@compiled
def _count(model, log, window, fraction, speed, totals, listed):
    total = totals[0]
    for index in range(len(log)):
        s = read_segment(model, log[index])
        if s.cause != IMPACT or since(s, model.cycle, window.periods, window.time) < 0.0:
            continue
        limit = max(fraction * s.first_speed, speed)
        total.largest = max(total.largest, s.speed)
        total.impacts += 1.0
        if s.speed >= limit:
            if total.visible < len(listed):
                listed[int(total.visible)] = s.speed
            total.visible += 1.0
            total.speeds += s.speed
        if s.mode == TAIL:
            total.in_tails += visible_in_tail(model, s, limit)


@compiled
def _find_largest(model, log, window, most):
    """Note the largest impulse and loss of single impacts: not of the closed rest of a burst."""
    found = most[0]
    for index in range(len(log)):
        s = read_segment(model, log[index])
        if s.cause == IMPACT and since(s, model.cycle, window.periods, window.time) >= 0.0:
            found.impulse = max(found.impulse, own_impulse(model, s))
            found.loss = max(found.loss, own_loss(model, s))

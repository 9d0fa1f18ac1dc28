"""Stroboscopic section: the state once per cycle."""

import numpy as np

from damper.engine.compiled import compiled
from damper.engine.model import motion, read_segment
from damper.observers.common.base import Window, since
from damper.observers.common.sections import Section, write_sample
from damper.observers.common.settings import Setting
from damper.parameters.models import MODELS


class StroboscopicSection(Section):
    """The state once per cycle."""

    models = (*MODELS, "structure")
    shared = of_box = ("displacement", "velocity")
    when = Setting(0.0, "When in each cycle to look.", "cycles", ge=0, lt=1)
    last = Setting(
        0, "Of so many cycles only, the window's last ones; 0: of all.", ge=0, le=1_000_000
    )
    where = "once per cycle"

    def size(self, dim: str, window_length: int) -> int:
        """A sample for each cycle of the window, or for each of its last cycles."""
        return min(self.last or window_length, window_length)

    def observe(self, log: np.ndarray) -> None:
        """Read the next piece of the log."""
        periods, time, length = self._window
        skipped = max(length // 1.0 - self.last, 0.0) if self.last else 0.0
        at = Window(periods + skipped, time + self.when * self._model.cycle, 0.0)
        self._taken = _sample(self._model, log, at, self._samples, self._taken)


@compiled
def _sample(model, log, at, samples, taken):
    for index in range(len(log)):
        s = read_segment(model, log[index])
        while taken < len(samples):
            tau = -since(s, model.cycle, at.periods + taken, at.time)
            if tau > s.duration:
                break
            write_sample(samples[taken], model.clearance, s.side, motion(model, s, max(tau, 0.0)))
            taken += 1
    return taken

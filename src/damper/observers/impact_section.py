"""Impact section: the state just after each impact on one wall."""

import numpy as np

from damper.engine.compiled import compiled
from damper.engine.segment import CONTACT, IMPACT, SEPARATION, segment_at
from damper.observers.common.base import since
from damper.observers.common.sections import Section, write_sample
from damper.observers.common.settings import Setting


class ImpactSection(Section):
    """The state just after each impact on one wall."""

    wall = Setting("right", "The wall whose impacts are sampled.", choices=("left", "right"))
    samples = Setting(
        100, "Most impacts to keep of each run, the first ones of the window.", ge=1, le=100_000
    )

    @property
    def where(self) -> str:
        """Where the section lies, in words."""
        return f"just after an impact on the {self.wall} wall"

    def size(self, dim: str, window_length: int) -> int:
        """As many samples as were asked for."""
        return self.samples

    def observe(self, log: np.ndarray) -> None:
        """Read the next piece of the log."""
        side = 1.0 if self.wall == "right" else -1.0
        self._taken = _sample(self._model, log, self._window, side, self._samples, self._taken)


@compiled
def _sample(model, log, window, side, samples, taken):
    for index in range(len(log)):
        if taken == len(samples):
            break
        s = segment_at(log[index])
        # An impact on a compliant wall is over when its contact is.
        over = s.cause == SEPARATION or (s.cause == IMPACT and s.mode != CONTACT)
        if over and s.side == side and since(s, model.cycle, window.periods, window.time) >= 0.0:
            write_sample(samples[taken], model.clearance, side, (s.x, s.v, s.gap, s.gap_rate))
            taken += 1
    return taken

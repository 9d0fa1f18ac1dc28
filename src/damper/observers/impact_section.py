"""Impact section: the state just after each impact on one wall."""

import numpy as np

from damper.engine.compiled import compiled
from damper.engine.segment import CONTACT, IMPACT, SEPARATION, segment_at
from damper.observers.base import since
from damper.observers.sections import Section, write_sample


class ImpactSection(Section):
    """Primary's displacement and velocity just after the impacts on one wall.

    Parameters
    ----------
    wall : {"right", "left"}, default "right"
    samples : int, default 100
        Most impacts to keep of each run, the first ones of the window; NaN fills the rest.
    free_mass : bool, default False
        Record the free mass as well.

    Raises
    ------
    ValueError
        For another wall, or samples < 1.
    """

    def __init__(self, wall: str = "right", samples: int = 100, free_mass: bool = False) -> None:
        if wall not in ("right", "left"):
            raise ValueError(f"wall = {wall!r}: must be 'right' or 'left'")
        if samples < 1:
            raise ValueError(f"samples = {samples!r}: must be at least 1")
        super().__init__(f"just after an impact on the {wall} wall", free_mass)
        self.side = 1.0 if wall == "right" else -1.0
        self.samples = samples

    def size(self, dim: str, window_length: int) -> int:
        """As many samples as were asked for."""
        return self.samples

    def observe(self, log: np.ndarray) -> None:
        """Read the next piece of the log."""
        self._taken = _sample(self._model, log, self._window, self.side, self._samples, self._taken)


@compiled
def _sample(model, log, window, side, samples, taken):
    for index in range(len(log)):
        if taken == len(samples):
            break
        s = segment_at(log[index])
        # An impact on a compliant wall is over when its contact is.
        over = s.cause == SEPARATION or (s.cause == IMPACT and s.mode != CONTACT)
        if over and s.side == side and since(s, model.period, window.periods, window.time) >= 0.0:
            write_sample(samples[taken], model.clearance, side, (s.x, s.v, s.gap, s.rate))
            taken += 1
    return taken

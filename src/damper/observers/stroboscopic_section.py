"""Stroboscopic section: the state once per forcing period."""

import numpy as np

from damper.engine.compiled import compiled
from damper.engine.model import motion
from damper.engine.segment import segment_at
from damper.observers.base import Window, since
from damper.observers.sections import Section, write_sample


class StroboscopicSection(Section):
    """Primary's displacement and velocity once per forcing period.

    Parameters
    ----------
    at : float, default 0
        Fraction of the forcing period at which to look, 0 <= at < 1.
    free_mass : bool, default False
        Record the free mass as well.

    Raises
    ------
    ValueError
        When `at` is out of range.
    """

    def __init__(self, at: float = 0.0, free_mass: bool = False) -> None:
        if not 0.0 <= at < 1.0:
            raise ValueError(f"at = {at!r}: must be a fraction of the period with 0 <= at < 1")
        super().__init__("once per forcing period", free_mass)
        self.at = at

    def size(self, dim: str, window_length: int) -> int:
        """One sample per recorded period."""
        return window_length

    def observe(self, log: np.ndarray) -> None:
        """Read the next piece of the log."""
        at = Window(self._window.periods, self._window.time + self.at * self._model.period, 0.0)
        self._taken = _sample(self._model, log, at, self._samples, self._taken)


@compiled
def _sample(model, log, at, samples, taken):
    for index in range(len(log)):
        s = segment_at(log[index])
        while taken < len(samples):
            tau = -since(s, model.period, at.periods + taken, at.time)
            if tau > s.duration:
                break
            write_sample(samples[taken], model.clearance, s.side, motion(model, s, max(tau, 0.0)))
            taken += 1
    return taken

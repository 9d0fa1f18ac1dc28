"""Stroboscopic section: the state once per forcing period."""

import numpy as np

from damper.engine.compiled import compiled
from damper.engine.segment import DURATION, SIDE
from damper.models import motion
from damper.observers.base import since
from damper.observers.sections import Section, free_state


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
        self._taken = _sample(
            self._model,
            log,
            self._window.period,
            self._window.time + self.at * self._model.period,
            self._samples,
            self._taken,
        )


@compiled
def _sample(model, log, first_period, time, samples, taken):
    for index in range(len(log)):
        row = log[index]
        duration = float(row[DURATION])
        while taken < len(samples):
            tau = -since(row, model.period, first_period + taken, time)
            if tau > duration:
                break
            x, v, gap, rate = motion(model, row, max(tau, 0.0))
            samples[taken, 0] = x
            samples[taken, 1] = v
            if samples.shape[1] == 4:
                y, u = free_state(model.clearance, float(row[SIDE]), x, v, gap, rate)
                samples[taken, 2] = y
                samples[taken, 3] = u
            taken += 1
    return taken

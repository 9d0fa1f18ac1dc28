"""Stroboscopic section: the state once per forcing period."""

import numpy as np

from damper.compiled import compiled
from damper.engine import DURATION, SIDE, Trajectory, motion
from damper.observers.base import Observer, Window, since
from damper.observers.sections import free_state, section_variables


class StroboscopicSection(Observer):
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
        self.at = at
        self.columns = 4 if free_mass else 2
        self.variables = section_variables("once per forcing period", free_mass)

    def size(self, dim: str, window_length: int) -> int:
        """One sample per recorded period."""
        return window_length

    def begin(self, lane: int, trajectory: Trajectory, window: Window) -> None:
        """Start on a lane."""
        self._model = trajectory.model
        self._outputs = [array[lane] for array in self.arrays.values()]
        self._samples = np.empty((window.length, self.columns))
        self._window = window
        self._at = self.at * trajectory.period
        self._taken = 0

    def observe(self, log: np.ndarray) -> None:
        """Read the next piece of the log."""
        self._taken = _sample(
            self._model,
            log,
            self._window.period,
            self._window.time + self._at,
            self._samples,
            self._taken,
        )

    def finish(self, finished: bool) -> None:
        """Write the samples taken; those after an early stop stay NaN."""
        for column, output in enumerate(self._outputs):
            output[: self._taken] = self._samples[: self._taken, column]


@compiled
def _sample(model, log, first_period, time, samples, taken):
    for index in range(len(log)):
        row = log[index]
        duration = float(row[DURATION])
        while taken < len(samples):
            tau = -since(row, model[4], first_period + taken, time)
            if tau > duration:
                break
            x, v, gap, rate = motion(model, row, max(tau, 0.0))
            samples[taken, 0] = x
            samples[taken, 1] = v
            if samples.shape[1] == 4:
                y, u = free_state(model[1], float(row[SIDE]), x, v, gap, rate)
                samples[taken, 2] = y
                samples[taken, 3] = u
            taken += 1
    return taken

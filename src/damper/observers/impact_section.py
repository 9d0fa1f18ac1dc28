"""Impact section: the state just after each impact on one wall."""

import numpy as np

from damper.compiled import compiled
from damper.engine import CAUSE, GAP, IMPACT, RATE, SIDE, Trajectory, V, X
from damper.observers.base import Observer, Window, since
from damper.observers.sections import free_state, section_variables


class ImpactSection(Observer):
    """Primary's displacement and velocity just after the impacts on one wall.

    Parameters
    ----------
    wall : {"right", "left"}, default "right"
    samples : int, default 100
        Most impacts to keep of each lane, the first ones of the window; NaN fills the rest.
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
        self.side = 1.0 if wall == "right" else -1.0
        self.samples = samples
        self.columns = 4 if free_mass else 2
        self.variables = section_variables(f"just after an impact on the {wall} wall", free_mass)

    def size(self, dim: str, window_length: int) -> int:
        """As many samples as were asked for."""
        return self.samples

    def begin(self, lane: int, trajectory: Trajectory, window: Window) -> None:
        """Start on a lane."""
        self._model = trajectory.model
        self._outputs = [array[lane] for array in self.arrays.values()]
        self._samples = np.empty((self.samples, self.columns))
        self._window = window
        self._taken = 0

    def observe(self, log: np.ndarray) -> None:
        """Read the next piece of the log."""
        self._taken = _sample(
            self._model,
            log,
            self._window.period,
            self._window.time,
            self.side,
            self._samples,
            self._taken,
        )

    def finish(self, finished: bool) -> None:
        """Write the samples taken."""
        for column, output in enumerate(self._outputs):
            output[: self._taken] = self._samples[: self._taken, column]


@compiled
def _sample(model, log, periods, time, side, samples, taken):
    for index in range(len(log)):
        row = log[index]
        if taken == len(samples):
            break
        if row[CAUSE] != IMPACT or row[SIDE] != side or since(row, model[4], periods, time) < 0.0:
            continue
        samples[taken, 0] = row[X]
        samples[taken, 1] = row[V]
        if samples.shape[1] == 4:
            y, u = free_state(
                model[1], side, float(row[X]), float(row[V]), float(row[GAP]), float(row[RATE])
            )
            samples[taken, 2] = y
            samples[taken, 3] = u
        taken += 1
    return taken

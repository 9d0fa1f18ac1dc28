"""Impact section: the state just after each impact on one wall."""

import numpy as np

from damper.engine.compiled import compiled
from damper.engine.segment import CAUSE, CONTACT, GAP, IMPACT, MODE, RATE, SEPARATION, SIDE, V, X
from damper.observers.base import since
from damper.observers.sections import Section, free_state


class ImpactSection(Section):
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
        super().__init__(f"just after an impact on the {wall} wall", free_mass)
        self.side = 1.0 if wall == "right" else -1.0
        self.samples = samples

    def size(self, dim: str, window_length: int) -> int:
        """As many samples as were asked for."""
        return self.samples

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


@compiled
def _sample(model, log, periods, time, side, samples, taken):
    for index in range(len(log)):
        row = log[index]
        if taken == len(samples):
            break
        # Where walls give, an impact is over when its contact is.
        struck = row[CAUSE] == IMPACT and row[MODE] != CONTACT
        if (
            not (struck or row[CAUSE] == SEPARATION)
            or row[SIDE] != side
            or since(row, model.period, periods, time) < 0.0
        ):
            continue
        samples[taken, 0] = row[X]
        samples[taken, 1] = row[V]
        if samples.shape[1] == 4:
            y, u = free_state(
                model.clearance,
                side,
                float(row[X]),
                float(row[V]),
                float(row[GAP]),
                float(row[RATE]),
            )
            samples[taken, 2] = y
            samples[taken, 3] = u
        taken += 1
    return taken

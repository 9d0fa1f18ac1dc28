"""What the two kinds of section share."""

import numpy as np

from damper.engine.compiled import compiled
from damper.engine.trajectory import Trajectory
from damper.observers.common.base import Observer, Window
from damper.observers.common.settings import BODIES, FREE_MASS
from damper.parameters.models import ONE_BY_ONE
from damper.parameters.variables import LENGTH, SPEED, Variable


class Section(Observer):
    """Base of the sections: samples of the primary's, and perhaps the free mass's, motion.

    On a structure the primary is the box of the free mass.
    """

    models = ONE_BY_ONE
    bodies = BODIES
    free_mass = FREE_MASS

    @property
    def where(self) -> str:
        """Where the section lies, in words."""
        raise NotImplementedError

    @property
    def variables(self) -> list[Variable]:
        """What it writes."""
        bodies = {"": "primary", "free_": "free mass"} if self.free_mass else {"": "primary"}
        return [
            Variable(f"{prefix}{quantity}", f"{body} {quantity} {self.where}", units, ("sample",))
            for prefix, body in bodies.items()
            for quantity, units in (("displacement", LENGTH), ("velocity", SPEED))
        ]

    def begin(self, run: int, trajectory: Trajectory, window: Window) -> None:
        """Start on a run."""
        super().begin(run, trajectory, window)
        self._outputs = [array[run] for array in self.arrays.values()]
        # A row for each sample, for the compiled pass.
        self._samples = np.empty((len(self._outputs[0]), len(self._outputs)))
        self._taken = 0

    def finish(self, finished: bool) -> None:
        """Write the samples taken; those after an early stop stay NaN."""
        for column, output in enumerate(self._outputs):
            output[: self._taken] = self._samples[: self._taken, column]


@compiled
def free_state(
    clearance: float, side: float, x: float, v: float, gap: float, rate: float
) -> tuple[float, float]:
    """Displacement and velocity of the free mass from the primary's and the gap's."""
    return x + side * (clearance - gap), v - side * rate


@compiled
def write_sample(
    row: np.ndarray, clearance: float, side: float, state: tuple[float, float, float, float]
) -> None:
    """Write a state of the primary and the gap as a sample: of one mass or of both."""
    x, v, gap, rate = state
    row[0] = x
    row[1] = v
    if len(row) == 4:
        row[2], row[3] = free_state(clearance, side, x, v, gap, rate)

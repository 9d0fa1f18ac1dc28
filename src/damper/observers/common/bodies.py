"""An observer of one free mass, of each of several that its setting `bodies` lists."""

from collections.abc import Iterable, Mapping
from copy import copy
from dataclasses import replace
from typing import Any, ClassVar

import numpy as np

from damper.engine.model import count_masses, log_of_mass, view_of_mass
from damper.engine.trajectory import Trajectory
from damper.observers.common.base import Observer, Window
from damper.observers.common.settings import Setting
from damper.parameters.variables import Variable


def require_bodies(model: Any, name: str, bodies: tuple[int, ...]) -> None:
    """Raise ValueError for a free mass that there is not."""
    count = count_masses(model)
    if max(bodies) >= count:
        raise ValueError(
            f"{name}.bodies = {list(bodies)!r}: there is no mass {max(bodies)}: this damper has "
            f"{count}, from 0"
        )


class OfEachBody(Observer):
    """An observer for each of several free masses, along the dimension `body`.

    Variables of the primary are written once, unless the primary is the box of each mass.
    """

    settings: ClassVar[dict[str, Setting]] = {}

    def __init__(self, kind: type[Observer], given: Mapping[str, Any], boxes: bool = False) -> None:
        self._observers = [kind(**given) for _ in kind(**given).bodies]
        for observer in self._observers[1:]:
            observer.is_first = boxes
        self.bodies: tuple[int, ...] = self._observers[0].bodies
        self.throughout = self._observers[0].throughout
        of_box = self._observers[0].of_box if boxes else ()
        self._shared = tuple(n for n in self._observers[0].shared if n not in of_box)

    @property
    def name(self) -> str:
        """That of the observers."""
        return self._observers[0].name

    @property
    def place(self) -> Mapping[str, float]:
        """That of the observers."""
        return self._observers[0].place

    def refusals(self, models: Iterable[str], masses: int = 1) -> dict[str, tuple[str, str]]:
        """What the observers say."""
        return self._observers[0].refusals(models, masses)

    @property
    def variables(self) -> list[Variable]:
        """What they write, along `body`."""
        return [
            v if v.name in self._shared else replace(v, dims=("body", *v.dims))
            for v in self._observers[0].variables
        ]

    @property
    def arrays(self) -> dict[str, np.ndarray]:
        """Those of all; each observer writes into its part."""
        return self._arrays

    @arrays.setter
    def arrays(self, arrays: dict[str, np.ndarray]) -> None:
        self._arrays = arrays
        for k, observer in enumerate(self._observers):
            observer.arrays = {n: a if n in self._shared else a[:, k] for n, a in arrays.items()}

    def size(self, dim: str, window_length: int) -> int:
        """Number of masses, or what each observer says."""
        return len(self.bodies) if dim == "body" else self._observers[0].size(dim, window_length)

    def coordinates(self) -> dict[str, np.ndarray]:
        """Numbers of the masses, and what each observer has."""
        return {"body": np.array(self.bodies)} | self._observers[0].coordinates()

    def allocate(self, runs: int, window_length: int) -> None:
        """Make the arrays of all."""
        self._observers[0].allocate(runs, window_length)  # refuses what it does not fit
        super().allocate(runs, window_length)
        self.arrays = self._arrays

    def begin(self, run: int, trajectory: Trajectory, window: Window) -> None:
        """Start on a run."""
        require_bodies(trajectory.model, self.name, self.bodies)
        self._model = trajectory.model
        for body, observer in zip(self.bodies, self._observers, strict=True):
            seen = copy(trajectory)
            seen.model, seen.body = view_of_mass(trajectory.model, body), body
            observer.begin(run, seen, window)

    def observe(self, log: np.ndarray) -> None:
        """Read the next piece of the log, as each mass has it."""
        for body, observer in zip(self.bodies, self._observers, strict=True):
            observer.observe(log_of_mass(self._model, log, body))

    def finish(self, finished: bool) -> None:
        """Write the run's results."""
        for observer in self._observers:
            observer.finish(finished)

"""What all observers share: arrays, the window, the visibility threshold."""

import math
from collections.abc import Mapping, Sequence
from types import SimpleNamespace
from typing import Any, NamedTuple

import numpy as np

from damper.engine.compiled import compiled
from damper.engine.impact import restitution_at
from damper.engine.segment import Segment
from damper.engine.trajectory import Trajectory
from damper.parameters.variables import Variable


class Window(NamedTuple):
    """Record of a run: from `periods` whole periods plus `time` on, `length` periods long."""

    periods: float
    time: float
    length: float


class Observer:
    """Base of the observers: allocates one array per variable with the run as first axis."""

    variables: Sequence[Variable] = ()

    def allocate(self, runs: int, window_length: int) -> None:
        """Make `arrays`: NaN (real) or -1 (integer) until a finished run fills them."""
        self.arrays: dict[str, np.ndarray] = {}
        for variable in self.variables:
            shape = (runs, *(self.size(dim, window_length) for dim in variable.dims))
            missing = np.nan if variable.dtype.startswith("f") else -1
            self.arrays[variable.name] = np.full(shape, missing, dtype=variable.dtype)

    def size(self, dim: str, window_length: int) -> int:
        """Length of one of the observer's own dimensions."""
        raise NotImplementedError

    def coordinates(self) -> dict[str, np.ndarray]:
        """Coordinate values of the observer's own dimensions; none by default."""
        return {}

    def begin(self, run: int, trajectory: Trajectory, window: Window) -> None:
        """Start on a run, by its number; observers add what they need for it."""
        self._run = run
        self._model = trajectory.model
        # Compiled passes know one kind of window.
        self._window = Window(*map(float, window))

    def observe(self, log: np.ndarray) -> None:
        """Read the next piece of the log."""
        raise NotImplementedError

    def finish(self, finished: bool) -> None:
        """Write the run's results.

        Where the run stopped early, `finished` is False: averages and counts stay missing, while
        samples and records keep what came before the stop.
        """

    def _put(self, values: Mapping[str, Any]) -> None:
        """Write the run's values of some variables."""
        for name, value in values.items():
            self.arrays[name][self._run] = value


def visibility(threshold: float | Mapping[str, float]) -> tuple[float, float]:
    """Threshold as (fraction of the burst's first approach speed, absolute speed); one is zero.

    Raises
    ------
    ValueError
        When the fraction is not in (0, 1) or the speed not positive.
    """
    if isinstance(threshold, Mapping):
        if set(threshold) == {"speed"} and 0.0 < threshold["speed"] < math.inf:
            return 0.0, float(threshold["speed"])
        if set(threshold) == {"fraction"}:
            return visibility(threshold["fraction"])
    elif 0.0 < threshold < 1.0:
        return float(threshold), 0.0
    raise ValueError(
        f"threshold = {threshold!r}: must be a fraction in (0, 1) of the burst's first approach "
        "speed, or {'speed': an absolute one > 0}"
    )


def describe(threshold: tuple[float, float]) -> str:
    """Say in words what counts as visible."""
    fraction, speed = threshold
    if speed:
        return f"visible: approach speed >= {speed:g}"
    return f"visible: approach speed >= {fraction:g} of the first one of the burst"


def record_type(*fields: str) -> np.dtype:
    """Type of an array whose entries compiled code reads and writes by field name."""
    return np.dtype((np.record, [(field, "f8") for field in fields]))


def read_record(record: np.ndarray) -> SimpleNamespace:
    """The only entry of an array of `record_type`, for Python, where a record is slow to read."""
    return SimpleNamespace(**dict(zip(record.dtype.names, record[0].item(), strict=True)))


@compiled
def since(segment: Segment, period: float, periods: float, time: float) -> float:
    """Time from a moment (whole periods plus time) to a segment's start; negative if before."""
    return (segment.periods - periods) * period + (segment.time - time)


@compiled
def visible_in_tail(law: Any, tail: Segment, limit: float) -> int:
    """Impacts at or above the speed `limit` that a closed tail still holds.

    The tail's approach speeds fall geometrically from that of its first, resolved impact.
    """
    # The impact after the rebound speed has it as approach speed to first order.
    restitution = restitution_at(law, 0.0)
    if not (restitution > 0.0 and 0.0 < limit <= tail.rate):
        return 0
    return 1 + math.floor(math.log(limit / tail.rate) / math.log(restitution))

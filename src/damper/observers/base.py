"""What all observers share: arrays, the window, the visibility threshold."""

import math
from collections.abc import Mapping, Sequence
from typing import Any, NamedTuple

import numpy as np

from damper.engine.compiled import compiled
from damper.engine.segment import PERIOD, RATE, TIME
from damper.engine.trajectory import Trajectory
from damper.parameters.variables import Variable


class Window(NamedTuple):
    """Recorded stretch: from `period` whole periods plus `time` on, `length` periods long."""

    period: float
    time: float
    length: int


class Observer:
    """Base of the observers: allocates one array per variable with the lane as first axis."""

    variables: Sequence[Variable] = ()

    def allocate(self, lanes: int, window_length: int) -> None:
        """Make `arrays`: NaN (real) or -1 (integer) until a finished run fills them."""
        self.arrays: dict[str, np.ndarray] = {}
        for variable in self.variables:
            shape = (lanes, *(self.size(dim, window_length) for dim in variable.dims))
            missing = np.nan if variable.dtype.startswith("f") else -1
            self.arrays[variable.name] = np.full(shape, missing, dtype=variable.dtype)

    def size(self, dim: str, window_length: int) -> int:
        """Length of one of the observer's own dimensions."""
        raise NotImplementedError

    def coordinates(self) -> dict[str, np.ndarray]:
        """Coordinate values of the observer's own dimensions; none by default."""
        return {}

    def begin(self, lane: int, trajectory: Trajectory, window: Window) -> None:
        """Start on a lane; observers add what they need for it."""
        self._lane = lane
        self._model = trajectory.model
        self._window = window

    def observe(self, log: np.ndarray) -> None:
        """Read the next piece of the log."""
        raise NotImplementedError

    def finish(self, finished: bool) -> None:
        """Write the lane's results.

        Where the run stopped early, `finished` is False: averages and counts stay missing, while
        samples and records keep what came before the stop.
        """

    def _put(self, values: Mapping[str, Any]) -> None:
        """Write the lane's values of some variables."""
        for name, value in values.items():
            self.arrays[name][self._lane] = value


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


@compiled
def since(row: np.ndarray, period_length: float, periods: float, time: float) -> float:
    """Time from a moment (whole periods plus time) to a segment's start; negative if before."""
    return (float(row[PERIOD]) - periods) * period_length + (float(row[TIME]) - time)


@compiled
def visible_in_tail(row: np.ndarray, restitution: float, limit: float) -> int:
    """Impacts at or above the speed `limit` that a closed tail still holds.

    The tail's approach speeds fall geometrically from that of its first, resolved impact.
    """
    speed = float(row[RATE])
    if not (restitution > 0.0 and 0.0 < limit <= speed):
        return 0
    # The impact after the rebound speed `speed` has it as approach speed to first order.
    return 1 + math.floor(math.log(limit / speed) / math.log(restitution))

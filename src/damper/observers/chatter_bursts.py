"""How many bursts are chatter, how many of them complete, and how long these last."""

from collections.abc import Mapping, Sequence

import numpy as np

from damper.engine.compiled import compiled
from damper.engine.trajectory import Trajectory
from damper.observers.base import Window
from damper.observers.bursts import CHATTER_IMPACTS, EachBurst, column
from damper.parameters.variables import TIME, Variable

_ONSET, _VISIBLE, _COMPLETE, _DURATION = (
    column(name) for name in ("onset", "visible_impacts", "complete", "duration")
)


class ChatterBursts(EachBurst):
    """Counts and mean duration of chatter bursts, in the whole record and in later parts of it.

    A burst belongs to the parts in which it begins; one that the record's end cuts to none.

    Parameters
    ----------
    since : sequence of float, default (0,)
        Where each part begins, in forcing periods after the start of the record; each lasts to
        the record's end.
    threshold : float or mapping, default 0.03
        Visibility, as in `damper.observers.impacts.Impacts`.

    Raises
    ------
    ValueError
        When the threshold is out of range or a part begins before the record.
    """

    def __init__(
        self, since: Sequence[float] = (0.0,), threshold: float | Mapping[str, float] = 0.03
    ) -> None:
        super().__init__(threshold)
        self.since = np.array(since, dtype=float)
        if not (len(self.since) and (self.since >= 0.0).all()):
            raise ValueError(f"since = {since!r}: must be one or more numbers of periods >= 0")
        counted = "-1: the run stopped"
        self.variables = [
            Variable(name, text, units, ("since",), dtype, comment)
            for name, text, units, dtype, comment in (
                ("chatter_bursts", "bursts that are chatter", "1", "i4", counted),
                ("chatter_complete", "of these, those that complete", "1", "i4", counted),
                (
                    "sticking_bursts",
                    "bursts that end in sticking, of any count",
                    "1",
                    "i4",
                    counted,
                ),
                ("chatter_duration", "mean duration of complete chatter bursts", TIME, "f8", ""),
                (
                    "chatter_onset",
                    "start of the first complete chatter burst since the start of the record",
                    TIME,
                    "f8",
                    "",
                ),
            )
        ]

    def size(self, dim: str, window_length: int) -> int:
        """Number of parts."""
        return len(self.since)

    def coordinates(self) -> dict[str, np.ndarray]:
        """Starts of the parts."""
        return {"since": self.since}

    def begin(self, lane: int, trajectory: Trajectory, window: Window) -> None:
        """Start on a lane."""
        super().begin(lane, trajectory, window)
        self._starts = self.since * trajectory.period
        self._counts = np.zeros((3, len(self.since)), dtype=np.int64)
        self._times = np.zeros((2, len(self.since)))

    def read(self, bursts: np.ndarray) -> None:
        """Count the next bursts."""
        _count(bursts, self._starts, self._counts, self._times)

    def write(self) -> None:
        """Write the lane's counts and mean."""
        chatter, complete, sticking = self._counts
        total, first = np.where(complete > 0, self._times, np.nan)
        self._put(
            {
                "chatter_bursts": chatter,
                "chatter_complete": complete,
                "sticking_bursts": sticking,
                "chatter_duration": total / np.maximum(complete, 1),
                "chatter_onset": first,
            }
        )


@compiled
def _count(bursts, starts, counts, times):
    for index in range(len(bursts)):
        burst = bursts[index]
        chatter = burst[_VISIBLE] >= CHATTER_IMPACTS
        complete = burst[_COMPLETE] == 1.0
        for part in range(len(starts)):
            if burst[_ONSET] < starts[part]:
                continue
            if chatter:
                counts[0, part] += 1
            if complete:
                counts[2, part] += 1
            if chatter and complete:
                if counts[1, part] == 0:
                    times[1, part] = burst[_ONSET]
                counts[1, part] += 1
                times[0, part] += burst[_DURATION]

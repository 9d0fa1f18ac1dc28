"""How many bursts are chatter, how many of them complete, and how long these last."""

from collections.abc import Mapping, Sequence

import numpy as np

from damper.engine.compiled import compiled
from damper.engine.trajectory import Trajectory
from damper.observers.base import Window, record_type
from damper.observers.bursts import CHATTER_IMPACTS, EachBurst
from damper.parameters.variables import TIME, Variable

#: Of one part: counts, time of the complete chatter bursts together, onset of the first one.
_TOTALS = record_type("chatter", "complete", "sticking", "duration", "onset")


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

    def begin(self, run: int, trajectory: Trajectory, window: Window) -> None:
        """Start on a run."""
        super().begin(run, trajectory, window)
        self._starts = self.since * trajectory.period
        self._totals = np.zeros(len(self.since), _TOTALS)

    def read(self, bursts: np.ndarray) -> None:
        """Count the next bursts."""
        _count(bursts, self._starts, self._totals)

    def write(self) -> None:
        """Write the run's counts and mean."""
        total = self._totals
        some = total["complete"] > 0.0
        self._put(
            {
                "chatter_bursts": total["chatter"],
                "chatter_complete": total["complete"],
                "sticking_bursts": total["sticking"],
                "chatter_duration": np.where(some, total["duration"], np.nan)
                / np.maximum(total["complete"], 1.0),
                "chatter_onset": np.where(some, total["onset"], np.nan),
            }
        )


@compiled
def _count(bursts, starts, totals):
    for index in range(len(bursts)):
        burst = bursts[index]
        chatter = burst.visible_impacts >= CHATTER_IMPACTS
        for part in range(len(starts)):
            if burst.onset < starts[part]:
                continue
            total = totals[part]
            if chatter:
                total.chatter += 1.0
            if burst.complete == 1.0:
                total.sticking += 1.0
            if chatter and burst.complete == 1.0:
                if total.complete == 0.0:
                    total.onset = burst.onset
                total.complete += 1.0
                total.duration += burst.duration

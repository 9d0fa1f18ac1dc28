"""How many bursts are chatter, how many of them complete, and how long these last."""

import numpy as np

from damper.engine.compiled import compiled
from damper.engine.trajectory import Trajectory
from damper.observers.bursts import CHATTER_IMPACTS, EachBurst
from damper.observers.common.base import Window, record_type
from damper.observers.common.settings import Setting
from damper.parameters.variables import TIME, Variable

#: Of one part: counts, time of the complete chatter bursts together, onset of the first one.
_TOTALS = record_type("chatter", "complete", "sticking", "duration", "onset")


class ChatterBursts(EachBurst):
    """How many bursts are chatter, how many of them complete, and how long these last.

    In the whole window and in later parts of it. A burst belongs to the parts in which it begins; a
    burst that the window's end cuts belongs to no part.
    """

    since = Setting(
        (0.0,),
        "Starts of the parts of the window in which to count, each to its end, along the dimension "
        "`since`.",
        "cycles",
        ge=0,
        least=1,
    )

    @property
    def variables(self) -> list[Variable]:
        """What it writes."""
        counts = {
            "chatter_bursts": "bursts that are chatter",
            "chatter_complete": "of these, those that complete",
            "sticking_bursts": "bursts that end in sticking, of any count",
        }
        times = {
            "chatter_duration": "mean duration of complete chatter bursts",
            "chatter_onset": "start of the first complete chatter burst since the start of the "
            "window",
        }
        dims = ("since",)
        return [
            *(Variable(name, text, "1", dims, "i4") for name, text in counts.items()),
            *(Variable(name, text, TIME, dims) for name, text in times.items()),
        ]

    def allocate(self, runs: int, window_length: int) -> None:
        """Make the arrays; ValueError for a part that begins after the window."""
        last = max(self.since)
        if last >= window_length:
            raise ValueError(
                f"{self.name}.since = {last!r}: begins after the window of {window_length} cycles"
            )
        super().allocate(runs, window_length)

    def size(self, dim: str, window_length: int) -> int:
        """Number of parts."""
        return len(self.since)

    def coordinates(self) -> dict[str, np.ndarray]:
        """Starts of the parts."""
        return {"since": np.array(self.since)}

    def begin(self, run: int, trajectory: Trajectory, window: Window) -> None:
        """Start on a run."""
        super().begin(run, trajectory, window)
        self._starts = np.array(self.since) * trajectory.cycle
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

"""The burst at a time: of the bursts that are chatter, the one that begins nearest to it."""

from collections.abc import Mapping

import numpy as np

from damper.engine.compiled import compiled
from damper.engine.trajectory import Trajectory
from damper.observers.base import Window, read_record
from damper.observers.bursts import BURST, CHATTER_IMPACTS, EachBurst
from damper.parameters.variables import TIME, Variable


class BurstAt(EachBurst):
    """Onset, duration, sticking and impacts of the chatter burst nearest to a time.

    A burst is chatter from five visible impacts on. One that the record's end cuts is left out,
    because its end is not known. Of two equally near ones it is the earlier.

    Parameters
    ----------
    time : float, default 0
        Where to look, in units of sqrt(M/K) (s for points in SI units) since the start of the
        record.
    threshold : float or mapping, default 0.03
        Visibility, as in `damper.observers.impacts.Impacts`.

    Raises
    ------
    ValueError
        When the threshold is out of range or the time negative.
    """

    def __init__(self, time: float = 0.0, threshold: float | Mapping[str, float] = 0.03) -> None:
        super().__init__(threshold)
        if not time >= 0.0:
            raise ValueError(f"time = {time!r}: must be at least 0")
        self.time = float(time)
        self.variables = [
            Variable(
                "burst_at_onset",
                f"start of the chatter burst nearest to {time:g} since the start of the record",
                TIME,
            ),
            Variable(
                "burst_at_duration", "its time from first impact to sticking, or last impact", TIME
            ),
            Variable(
                "burst_at_sticking_time", "its time of sticking, if released in the record", TIME
            ),
            Variable(
                "burst_at_visible_impacts",
                "its visible impacts",
                "1",
                dtype="i4",
                comment="-1: the record has no chatter burst, or the run stopped",
            ),
            Variable(
                "burst_at_complete",
                "1 if it ends in sticking",
                "1",
                dtype="i1",
                comment="-1: the record has no chatter burst, or the run stopped",
            ),
        ]

    def begin(self, run: int, trajectory: Trajectory, window: Window) -> None:
        """Start on a run."""
        super().begin(run, trajectory, window)
        self._sought = self.time / trajectory.units.time
        self._found = np.full(1, np.nan, BURST)

    def read(self, bursts: np.ndarray) -> None:
        """Keep the nearest burst so far."""
        _keep_nearest(bursts, self._sought, self._found)

    def write(self) -> None:
        """Write what the nearest burst was like."""
        found = read_record(self._found)
        if not np.isnan(found.onset):
            self._put(
                {
                    "burst_at_onset": found.onset,
                    "burst_at_duration": found.duration,
                    "burst_at_sticking_time": found.sticking_time,
                    "burst_at_visible_impacts": found.visible_impacts,
                    "burst_at_complete": found.complete,
                }
            )


@compiled
def _keep_nearest(bursts, time, found):
    for index in range(len(bursts)):
        burst = bursts[index]
        # Nothing is nearer than NaN, nor is it the other way round.
        if burst.visible_impacts >= CHATTER_IMPACTS and not (
            abs(burst.onset - time) >= abs(found[0].onset - time)
        ):
            found[0] = burst

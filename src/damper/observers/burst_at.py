"""The burst at a time: of the bursts that are chatter, the one that begins nearest to it."""

import numpy as np

from damper.engine.compiled import compiled
from damper.engine.trajectory import Trajectory
from damper.observers.bursts import BURST, CHATTER_IMPACTS, EachBurst
from damper.observers.common.base import Window, read_record
from damper.observers.common.settings import TIME_UNITS, Setting
from damper.parameters.variables import TIME, Variable


class BurstAt(EachBurst):
    """The chatter burst that begins nearest to a time: onset, duration, sticking and impacts.

    A burst is chatter from five visible impacts on. A burst that the window's end cuts is left out,
    because its end is not known. Of two equally near bursts the earlier counts.
    """

    time = Setting(0.0, "Where to look, counted from the start of the window.", TIME_UNITS, ge=0)

    @property
    def variables(self) -> list[Variable]:
        """What it writes."""
        none = "missing where the window has no chatter burst"
        return [
            Variable(
                "burst_at_onset",
                "start of the chatter burst nearest to "
                f"{self.time:g} since the start of the window",
                TIME,
            ),
            Variable(
                "burst_at_duration", "its time from first impact to sticking, or last impact", TIME
            ),
            Variable(
                "burst_at_sticking_time", "its time of sticking, if released in the window", TIME
            ),
            Variable(
                "burst_at_visible_impacts", "its visible impacts", "1", dtype="i4", comment=none
            ),
            Variable(
                "burst_at_complete", "1 if it ends in sticking", "1", dtype="i1", comment=none
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
        if burst.visible_impacts >= CHATTER_IMPACTS:
            # Also where none is found yet: then that onset is NaN, of which `<` would be false.
            farther = abs(burst.onset - time) >= abs(found[0].onset - time)
            if not farther:
                found[0] = burst

"""Segments: the solution itself over the last cycles of the window, a row for each segment.

Between events the motion is known in closed form, so these rows hold it exactly and in less space
than samples would take.
"""

import numpy as np

from damper.engine import segment as columns
from damper.engine.trajectory import Trajectory
from damper.observers.common.base import Observer, Window
from damper.observers.common.settings import AT, BODIES, Setting
from damper.parameters.models import ONE_BY_ONE
from damper.parameters.variables import LENGTH, SPEED, Variable
from damper.parameters.variables import TIME as TIME_UNIT

#: Name -> column of the log, meaning, units.
_FIELDS: dict[str, tuple[int, str, str]] = {
    "time": (columns.TIME, "start of a segment since the start of the stretch", TIME_UNIT),
    "displacement": (columns.X, "primary displacement at its start", LENGTH),
    "velocity": (columns.V, "primary velocity at its start", SPEED),
    "gap": (columns.GAP, "gap to the segment's wall at its start", LENGTH),
    "gap_rate": (columns.GAP_RATE, "rate of the gap at its start", SPEED),
    "accumulation": (
        columns.ACCUMULATION,
        "time to the accumulation point; of contact, since touch",
        TIME_UNIT,
    ),
    "side": (columns.SIDE, "the segment's wall: -1 left, 1 right", "1"),
    "mode": (
        columns.MODE,
        "0 flight, 1 closed rest of a burst, 2 sticking, 3 compliant contact, 4 held by friction",
        "1",
    ),
    "cause": (columns.CAUSE, "what began it: code of damper.events, -1 none, -2 separation", "1"),
}


class Segments(Observer):
    """The solution itself: every segment of the last cycles of the window.

    The first segment is cut where the stretch begins, unless it is the closed rest of a burst.
    Where there are too many, the first ones are missing. Of several free masses each has a
    row for every event of any of them; the rows of all at one time hold the motion. On a structure
    the primary is the box of the free mass, whose motion the rows sample.
    """

    models = ONE_BY_ONE
    bodies = BODIES
    at = AT
    periods = Setting(5, "Length of the stretch, at most the window's.", "cycles", ge=1)
    rows = Setting(200, "Most segments to keep.", ge=1, le=1_000_000)

    @property
    def variables(self) -> list[Variable]:
        """What it writes."""
        return [
            Variable(f"segment_{name}", meaning, units, ("segment",))
            for name, (_, meaning, units) in _FIELDS.items()
        ]

    def size(self, dim: str, window_length: int) -> int:
        """Most segments."""
        return self.rows

    def begin(self, run: int, trajectory: Trajectory, window: Window) -> None:
        """Start on a run."""
        super().begin(run, trajectory, window)
        self._motion_in = trajectory.motion_in
        self._rows = np.empty((0, trajectory.columns))

    def observe(self, log: np.ndarray) -> None:
        """Keep what lies in the stretch."""
        within = self._times(log) + log[:, columns.DURATION] > 0.0
        self._rows = np.concatenate([self._rows, log[within]])[-self.rows :]

    def finish(self, finished: bool) -> None:
        """Write the rows."""
        rows = self._rows
        times = self._times(rows)
        if len(rows) and times[0] < 0.0 and rows[0, columns.MODE] != columns.TAIL:
            rows[0, columns.X : columns.GAP_RATE + 1] = self._motion_in(rows[0], -times[0])
            if rows[0, columns.MODE] == columns.CONTACT:
                rows[0, columns.ACCUMULATION] -= times[0]
            rows[0, columns.CAUSE], times[0] = columns.NOTHING, 0.0
        for name, (column, _, _) in _FIELDS.items():
            values = times if column == columns.TIME else rows[:, column]
            self.arrays[f"segment_{name}"][self._run, : len(rows)] = values

    def _times(self, rows: np.ndarray) -> np.ndarray:
        window = self._window
        first = window.periods + window.length - min(self.periods, window.length)
        return (rows[:, columns.PERIODS] - first) * self._model.cycle + (
            rows[:, columns.TIME] - window.time
        )

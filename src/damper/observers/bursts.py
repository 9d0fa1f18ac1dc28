"""Bursts: runs of consecutive impacts on one wall, and whether they end in sticking.

A burst ends at an impact on the other wall or at sticking. Bursts that begin in the window are
counted; one that the window's end cuts counts for `visible_impacts` and `chatter`, but neither as
complete nor as incomplete in the fraction, because its end is not known.
"""

from collections.abc import Mapping, Sequence

import numpy as np

from damper.engine.compiled import compiled
from damper.engine.segment import (
    CAUSE,
    DURATION,
    FIRST,
    IMPACT,
    MODE,
    PERIOD,
    RELEASE,
    SIDE,
    SPEED,
    STICK,
    STICKING,
    TAIL,
    TIME,
    X,
)
from damper.engine.trajectory import LOG_ROWS, Trajectory
from damper.observers.base import (
    Observer,
    Window,
    describe,
    since,
    visibility,
    visible_in_tail,
)
from damper.parameters.variables import CHATTER_IMPACTS, LENGTH, Variable
from damper.parameters.variables import SPEED as SPEED_UNIT
from damper.parameters.variables import TIME as TIME_UNIT

_TOTALS = 13
# The burst under way, and the lane's totals. A moment is held as its log row holds it, as whole
# periods and a local time, so that the differences of two are sharp however late they are.
(
    _WALL,
    _EARLIER_WALL,
    _FIRST_SPEED,
    _ONSET_PERIOD,
    _ONSET_TIME,
    _LAST_PERIOD,
    _LAST_TIME,
    _BURSTS,
    _COMPLETE,
    _STICKING,
    _LISTED,
    _OPEN_RECORD,
    _OPEN_STICKING,
) = range(_TOTALS)
# No burst under way; one that began before the window; nothing read yet.
_NONE, _EARLIER, _UNKNOWN = 0.0, 2.0, 3.0

#: What is known of one burst, in the order of the columns.
RECORDS = (
    Variable("burst_onset", "time of the first impact since the start of the record", TIME_UNIT),
    Variable("burst_onset_period", "whole forcing periods in the time of the first impact", "1"),
    Variable(
        "burst_onset_time_in_period",
        "rest of the time of the first impact, sharp in long records",
        TIME_UNIT,
    ),
    Variable("burst_wall", "wall of the burst: -1 left, +1 right", "1"),
    Variable("burst_first_speed", "approach speed of the first impact", SPEED_UNIT),
    Variable("burst_visible_impacts", "visible impacts of the burst", "1"),
    Variable("burst_complete", "1 if the burst ends in sticking", "1"),
    Variable(
        "burst_accumulation_time", "time of sticking since the start of the record", TIME_UNIT
    ),
    Variable("burst_accumulation_displacement", "primary displacement at sticking", LENGTH),
    Variable(
        "burst_duration", "time from the first impact to sticking, or to the last impact", TIME_UNIT
    ),
    Variable(
        "burst_sticking_time", "time from sticking to release, if within the record", TIME_UNIT
    ),
)
(
    _R_ONSET,
    _R_ONSET_PERIOD,
    _R_ONSET_TIME,
    _R_WALL,
    _R_FIRST,
    _R_VISIBLE,
    _R_COMPLETE,
    _R_TIME,
    _R_X,
    _R_DURATION,
    _R_STICKING,
) = range(len(RECORDS))


class Bursts(Observer):
    """Chatter: bursts, their visible impacts, completion and sticking.

    Parameters
    ----------
    threshold : float or mapping, default 0.03
        Visibility, as in `damper.observers.impacts.Impacts`.
    compare_thresholds : sequence of float, default ()
        More fractions for which `visible_impacts` and `chatter` are given along a `threshold`
        dimension.
    records : int, default 0
        Bursts of each lane to list one by one, the first ones of the window.

    Raises
    ------
    ValueError
        When a threshold is out of range or `records` is negative.
    """

    def __init__(
        self,
        threshold: float | Mapping[str, float] = 0.03,
        compare_thresholds: Sequence[float] = (),
        records: int = 0,
    ) -> None:
        if records < 0:
            raise ValueError(f"records = {records!r}: must be at least 0")
        pairs = [visibility(threshold), *(visibility(value) for value in compare_thresholds)]
        self.compared = np.array(compare_thresholds, dtype=float)
        self.records = records
        self._fractions, self._speeds = (np.array(values) for values in zip(*pairs, strict=True))
        seen = describe(pairs[0])
        chatter = (
            f"2 complete: a burst with at least {CHATTER_IMPACTS} visible impacts ends in "
            "sticking; 1 incomplete: such bursts occur, none completes; 0 none; -1 run stopped"
        )
        self.variables = [
            Variable(
                "visible_impacts",
                "most visible impacts in one burst",
                "1",
                dtype="i4",
                comment=f"{seen}; -1 run stopped",
            ),
            Variable(
                "chatter",
                "chatter: 0 none, 1 incomplete, 2 complete",
                "1",
                dtype="i1",
                comment=f"{chatter}; {seen}",
            ),
            Variable("bursts_per_period", "bursts per forcing period", "1"),
            Variable(
                "complete_fraction",
                "part of the bursts that ends in sticking",
                "1",
                comment="all bursts, visible count or not",
            ),
            Variable("sticking_fraction", "part of the time spent sticking", "1"),
        ]
        if len(self.compared):
            self.variables += [
                Variable(
                    "visible_impacts_by_threshold",
                    "most visible impacts in one burst",
                    "1",
                    ("threshold",),
                    "i4",
                ),
                Variable(
                    "chatter_by_threshold",
                    "chatter: 0 none, 1 incomplete, 2 complete",
                    "1",
                    ("threshold",),
                    "i1",
                    chatter,
                ),
            ]
        if records:
            self.variables += [Variable(v.name, v.long_name, v.units, ("burst",)) for v in RECORDS]

    def size(self, dim: str, window_length: int) -> int:
        """Number of thresholds compared, or of bursts listed."""
        return len(self.compared) if dim == "threshold" else self.records

    def coordinates(self) -> dict[str, np.ndarray]:
        """Fractions along the `threshold` dimension."""
        return {"threshold": self.compared} if len(self.compared) else {}

    def begin(self, lane: int, trajectory: Trajectory, window: Window) -> None:
        """Start on a lane."""
        super().begin(lane, trajectory, window)
        self._totals = np.zeros(_TOTALS)
        self._limits = self._speeds / trajectory.units.speed
        self._totals[_OPEN_RECORD] = -1.0
        self._totals[_WALL] = _UNKNOWN
        self._visible = np.zeros((2, len(self._fractions)), dtype=np.int64)
        self._chatter = np.zeros(len(self._fractions), dtype=np.int64)
        self._listed = np.full((self.records, len(RECORDS)), np.nan)

    def observe(self, log: np.ndarray) -> None:
        """Read the next piece of the log."""
        _follow(
            self._model,
            log,
            self._window.period,
            self._window.time,
            self._fractions,
            self._limits,
            self._totals,
            self._visible,
            self._chatter,
            self._listed,
        )

    def finish(self, finished: bool) -> None:
        """Write the lane's results."""
        if self.records:
            self._put({v.name: self._listed[:, k] for k, v in enumerate(RECORDS)})
        if not finished:
            return
        if self._totals[_WALL] not in (_NONE, _EARLIER, _UNKNOWN):
            _judge(self._visible, self._chatter, 1)
        put = {
            "visible_impacts": self._visible[1, 0],
            "chatter": self._chatter[0],
            "bursts_per_period": self._totals[_BURSTS] / self._window.length,
            "sticking_fraction": self._totals[_STICKING]
            / (self._window.length * self._model.period),
        }
        if self._totals[_BURSTS]:
            put["complete_fraction"] = self._totals[_COMPLETE] / self._totals[_BURSTS]
        if len(self.compared):
            put["visible_impacts_by_threshold"] = self._visible[1, 1:]
            put["chatter_by_threshold"] = self._chatter[1:]
        self._put(put)


class EachBurst(Bursts):
    """Base of observers that read the bursts of a record one by one, as `Bursts` lists them.

    Parameters
    ----------
    threshold : float or mapping, default 0.03
        Visibility, as in `Bursts`.
    """

    def __init__(self, threshold: float | Mapping[str, float] = 0.03) -> None:
        super().__init__(threshold)
        self._room = np.full((LOG_ROWS + 1, len(RECORDS)), np.nan)

    def read(self, bursts: np.ndarray) -> None:
        """Read the next bursts of the lane in order, a row each with the columns of `RECORDS`."""
        raise NotImplementedError

    def write(self) -> None:
        """Write the results of a lane that reached its end."""
        raise NotImplementedError

    def begin(self, lane: int, trajectory: Trajectory, window: Window) -> None:
        """Start on a lane."""
        super().begin(lane, trajectory, window)
        self._listed = self._room

    def observe(self, log: np.ndarray) -> None:
        """Read the next piece of the log."""
        # A row ends one burst at most, and one from the piece before may still be sticking.
        if len(log) >= len(self._room):
            self._room = np.full((len(log) + 1, len(RECORDS)), np.nan)
            self._room[:1] = self._listed[:1]
            self._listed = self._room
        super().observe(log)
        self._hand_over(int(self._totals[_OPEN_RECORD] >= 0.0))

    def finish(self, finished: bool) -> None:
        """Write the lane's results."""
        self._hand_over(0)
        if finished:
            self.write()

    def _hand_over(self, keep: int) -> None:
        """Hand over the bursts listed, all but the last one if it still sticks; free their rows."""
        count = int(self._totals[_LISTED])
        done = count - keep
        if done > 0:
            self.read(self._listed[:done])
            self._listed[:keep] = self._listed[done:count]
            self._listed[keep:count] = np.nan
            self._totals[_LISTED] = keep
            self._totals[_OPEN_RECORD] = keep - 1.0


def column(name: str) -> int:
    """Return the column of one of `RECORDS`, without ``burst_``, in the rows that are read."""
    return [variable.name for variable in RECORDS].index(f"burst_{name}")


@compiled
def _follow(model, log, periods, time, fractions, speeds, totals, visible, chatter, listed):
    if totals[_WALL] == _UNKNOWN and len(log) > 0:
        totals[_WALL] = _EARLIER if log[0][FIRST] > 0.0 else _NONE
        totals[_EARLIER_WALL] = log[0][SIDE]
    for index in range(len(log)):
        row = log[index]
        start = since(row, model.period, periods, time)
        wall = float(row[SIDE])
        cause = float(row[CAUSE])
        if totals[_WALL] == _EARLIER and (
            row[MODE] == STICKING or (cause == IMPACT and wall != totals[_EARLIER_WALL])
        ):
            totals[_WALL] = _NONE
        if row[MODE] == STICKING:
            inside = float(row[DURATION]) + min(start, 0.0)
            totals[_STICKING] += max(inside, 0.0)
            if cause == STICK and totals[_WALL] != _NONE:
                _close(model, row, periods, time, 2, totals, visible, chatter, listed)
            totals[_OPEN_STICKING] += inside
        elif cause == RELEASE:
            if totals[_OPEN_RECORD] >= 0.0:
                listed[int(totals[_OPEN_RECORD]), _R_STICKING] = totals[_OPEN_STICKING]
            totals[_OPEN_RECORD] = -1.0
        elif cause == IMPACT and start >= 0.0 and totals[_WALL] != _EARLIER:
            approach = float(row[SPEED])
            if wall != totals[_WALL]:
                if totals[_WALL] != _NONE:
                    _close(model, row, periods, time, 1, totals, visible, chatter, listed)
                totals[_WALL] = wall
                totals[_FIRST_SPEED] = approach
                totals[_ONSET_PERIOD] = row[PERIOD]
                totals[_ONSET_TIME] = row[TIME]
                for k in range(len(fractions)):
                    visible[0, k] = 0
            totals[_LAST_PERIOD] = row[PERIOD]
            totals[_LAST_TIME] = row[TIME]
            for k in range(len(fractions)):
                limit = max(fractions[k] * row[FIRST], speeds[k])
                if approach >= limit:
                    visible[0, k] += 1
                if row[MODE] == TAIL:
                    visible[0, k] += visible_in_tail(row, model.restitution, limit)


@compiled
def _close(model, row, periods, time, outcome, totals, visible, chatter, listed):
    """End the burst under way: outcome 2 complete, at the start of `row`; 1 incomplete."""
    totals[_BURSTS] += 1.0
    if outcome == 2:
        totals[_COMPLETE] += 1.0
    number = int(totals[_LISTED])
    if number < len(listed):
        entry = listed[number]
        onset_period = float(totals[_ONSET_PERIOD])
        onset_time = float(totals[_ONSET_TIME])
        whole, rest = _elapsed(model.period, onset_period - periods, onset_time - time)
        entry[_R_ONSET] = whole * model.period + rest
        entry[_R_ONSET_PERIOD] = whole
        entry[_R_ONSET_TIME] = rest
        entry[_R_WALL] = totals[_WALL]
        entry[_R_FIRST] = totals[_FIRST_SPEED]
        entry[_R_VISIBLE] = visible[0, 0]
        entry[_R_COMPLETE] = outcome - 1
        if outcome == 2:
            entry[_R_TIME] = since(row, model.period, periods, time)
            entry[_R_X] = row[X]
            entry[_R_DURATION] = since(row, model.period, onset_period, onset_time)
            totals[_OPEN_RECORD] = number
            totals[_OPEN_STICKING] = 0.0
        else:
            whole = float(totals[_LAST_PERIOD]) - onset_period
            entry[_R_DURATION] = whole * model.period + (float(totals[_LAST_TIME]) - onset_time)
        totals[_LISTED] += 1.0
    _judge(visible, chatter, outcome)
    totals[_WALL] = _NONE


@compiled
def _elapsed(period_length, whole, rest):
    """Carry a negative rest, so that 0 <= rest < period_length."""
    if rest < 0.0:
        rest += period_length
        whole -= 1.0
        if rest >= period_length:
            rest = 0.0
            whole += 1.0
    return whole, rest


@compiled
def _judge(visible, chatter, outcome):
    """Carry a burst's visible counts into the lane's largest count and its chatter."""
    for k in range(visible.shape[1]):
        visible[1, k] = max(visible[1, k], visible[0, k])
        if visible[0, k] >= CHATTER_IMPACTS:
            chatter[k] = max(chatter[k], outcome)

"""Bursts: runs of consecutive impacts on one wall, and whether they end in sticking.

A burst ends at an impact on the other wall or at sticking. It belongs to the window in which it
begins, so the rate of a periodic motion is exact over whole periods. A burst that the window's end
cuts has no known end: it is not listed, and the fraction of complete bursts leaves it out.
"""

from typing import Any

import numpy as np

from damper.engine.compiled import compiled
from damper.engine.model import read_segment
from damper.engine.segment import IMPACT, RELEASE, STICK, STICKING, TAIL
from damper.engine.trajectory import LOG_ROWS, Trajectory
from damper.observers.common.base import (
    Observer,
    Window,
    describe,
    fields_of,
    read_record,
    record_type,
    since,
    visible_in_tail,
)
from damper.observers.common.settings import BODIES, VISIBILITY, Setting
from damper.parameters.models import ONE_BY_ONE
from damper.parameters.variables import CHATTER_IMPACTS, LENGTH, Chatter, Variable
from damper.parameters.variables import SPEED as SPEED_UNIT
from damper.parameters.variables import TIME as TIME_UNIT

#: The burst under way, and the totals of a run. A moment is held as its segment holds it, as whole
#: periods and a local time, so that the differences of two are sharp however late they are.
_STATE = record_type(
    "wall",
    "earlier_wall",
    "first_speed",
    "onset_cycles",
    "onset_time",
    "last_periods",
    "last_time",
    "bursts",
    "complete",
    "sticking",
    "listed",
    # Row of the listed burst whose sticking goes on, or -1; how long it has stuck so far.
    "open",
    "open_sticking",
)
# Walls: no burst under way; one that began before the window; nothing read yet.
_NONE, _EARLIER, _UNKNOWN = 0.0, 2.0, 3.0
# How a burst ends, for compiled code.
INCOMPLETE, COMPLETE = int(Chatter.INCOMPLETE), int(Chatter.COMPLETE)

#: Columns of the list of bursts, in their order.
RECORDS = (
    Variable("burst_onset", "time of the first impact since the start of the window", TIME_UNIT),
    Variable("burst_onset_cycle", "whole cycles in the time of the first impact", "1"),
    Variable(
        "burst_onset_time_in_cycle",
        "rest of the time of the first impact, sharp in long records",
        TIME_UNIT,
    ),
    Variable("burst_wall", "wall of the burst: -1 left, +1 right", "1"),
    Variable("burst_first_speed", "approach speed of the first impact", SPEED_UNIT),
    Variable("burst_visible_impacts", "visible impacts of the burst", "1"),
    Variable("burst_complete", "1 if the burst ends in sticking", "1"),
    Variable(
        "burst_accumulation_time", "time of sticking since the start of the window", TIME_UNIT
    ),
    Variable("burst_accumulation_displacement", "primary displacement at sticking", LENGTH),
    Variable(
        "burst_duration", "time from the first impact to sticking, or to the last impact", TIME_UNIT
    ),
    Variable(
        "burst_sticking_time", "time from sticking to release, if within the window", TIME_UNIT
    ),
)
#: The same as a record; field names are without ``burst_``.
BURST = record_type(*(variable.name.removeprefix("burst_") for variable in RECORDS))


class Bursts(Observer):
    """Bursts: their number, visible impacts and accumulation."""

    models = ONE_BY_ONE
    bodies = BODIES
    threshold = VISIBILITY
    compare_thresholds = Setting(
        (), "More fractions at which to count, along the dimension `threshold`.", gt=0, lt=1
    )
    records = Setting(
        0, "Bursts of each run to list one by one, the first ones of the window.", ge=0
    )

    def __init__(self, **given: Any) -> None:
        super().__init__(**given)
        pairs = [self.threshold, *((fraction, 0.0) for fraction in self.compare_thresholds)]
        self._fractions, self._speeds = (np.array(values) for values in zip(*pairs, strict=True))

    @property
    def variables(self) -> list[Variable]:
        """What it writes."""
        seen = describe(self.threshold)
        kinds = "chatter: 0 none, 1 incomplete, 2 complete"
        chatter = (
            f"2 complete: a burst with at least {CHATTER_IMPACTS} visible impacts ends in "
            "sticking; 1 incomplete: such bursts occur, none completes; 0 none"
        )
        most = "most visible impacts in one burst"
        made = [
            Variable("visible_impacts", most, "1", dtype="i4", comment=seen),
            Variable("chatter", kinds, "1", dtype="i1", comment=f"{chatter}; {seen}"),
            Variable(
                "bursts_per_period",
                "bursts per cycle",
                "1",
                comment="those that begin in the window",
            ),
            Variable(
                "complete_fraction",
                "share of bursts that end in sticking",
                "1",
                comment="all bursts that begin and end in the window, visible count or not",
            ),
            Variable("sticking_fraction", "fraction of time sticking", "1"),
        ]
        if self.compare_thresholds:
            dims = ("threshold",)
            made += [
                Variable("visible_impacts_by_threshold", most, "1", dims, "i4"),
                Variable("chatter_by_threshold", kinds, "1", dims, "i1", chatter),
            ]
        if self.records:
            made += [Variable(v.name, v.long_name, v.units, ("burst",)) for v in RECORDS]
        return made

    def size(self, dim: str, window_length: int) -> int:
        """Number of thresholds compared, or of bursts listed."""
        return len(self.compare_thresholds) if dim == "threshold" else self.records

    def coordinates(self) -> dict[str, np.ndarray]:
        """Fractions along the `threshold` dimension."""
        compared = np.array(self.compare_thresholds)
        return {"threshold": compared} if len(compared) else {}

    def begin(self, run: int, trajectory: Trajectory, window: Window) -> None:
        """Start on a run."""
        super().begin(run, trajectory, window)
        self._state = np.zeros(1, _STATE)
        self._state["wall"] = _UNKNOWN
        self._state["open"] = -1.0
        self._limits = self._speeds / trajectory.units.speed
        self._visible = np.zeros((2, len(self._fractions)), dtype=np.int64)
        self._chatter = np.zeros(len(self._fractions), dtype=np.int64)
        self._listed = np.full(self.records, np.nan, BURST)

    def observe(self, log: np.ndarray) -> None:
        """Read the next piece of the log."""
        _follow(
            self._model,
            log,
            self._window,
            (self._fractions, self._limits),
            self._state,
            (self._visible, self._chatter),
            self._listed,
        )

    def finish(self, finished: bool) -> None:
        """Write the run's results."""
        if self.records:
            self._put({f"burst_{field}": self._listed[field] for field in fields_of(BURST)})
        if not finished:
            return
        state = read_record(self._state)
        counts = (self._visible, self._chatter)
        cut = state.wall not in (_NONE, _EARLIER, _UNKNOWN)
        if cut:
            _judge(counts, 1)
        put = {
            "visible_impacts": self._visible[1, 0],
            "chatter": self._chatter[0],
            "bursts_per_period": (state.bursts + cut) / self._window.length,
            "sticking_fraction": state.sticking / (self._window.length * self._model.cycle),
        }
        if state.bursts:
            put["complete_fraction"] = state.complete / state.bursts
        if self.compare_thresholds:
            put["visible_impacts_by_threshold"] = self._visible[1, 1:]
            put["chatter_by_threshold"] = self._chatter[1:]
        self._put(put)


class EachBurst(Bursts):
    """Base of observers that read the bursts of a window one by one, as `Bursts` lists them."""

    compare_thresholds = ()
    records = 0

    def __init__(self, **given: Any) -> None:
        super().__init__(**given)
        self._room = np.full(LOG_ROWS + 1, np.nan, BURST)

    def read(self, bursts: np.ndarray) -> None:
        """Read the next bursts of the run in order, an array of `BURST`."""
        raise NotImplementedError

    def write(self) -> None:
        """Write the results of a run that reached its end."""
        raise NotImplementedError

    def begin(self, run: int, trajectory: Trajectory, window: Window) -> None:
        """Start on a run."""
        super().begin(run, trajectory, window)
        self._listed = self._room

    def observe(self, log: np.ndarray) -> None:
        """Read the next piece of the log."""
        # A row ends one burst at most, and one from the piece before may still be sticking.
        if len(log) >= len(self._room):
            self._room = np.full(len(log) + 1, np.nan, BURST)
            self._room[:1] = self._listed[:1]
            self._listed = self._room
        super().observe(log)
        self._hand_over(int(self._state["open"][0] >= 0.0))

    def finish(self, finished: bool) -> None:
        """Write the run's results."""
        self._hand_over(0)
        if finished:
            self.write()

    def _hand_over(self, keep: int) -> None:
        """Hand over the bursts listed, all but the last one if it still sticks; free their rows."""
        count = int(self._state["listed"][0])
        done = count - keep
        if done > 0:
            self.read(self._listed[:done])
            self._listed[:keep] = self._listed[done:count]
            self._listed[keep:count] = np.nan
            self._state["listed"] = keep
            self._state["open"] = keep - 1.0


@compiled
def _follow(model, log, window, thresholds, states, counts, listed):
    state = states[0]
    if state.wall == _UNKNOWN and len(log) > 0:
        first = read_segment(model, log[0])
        state.wall = _EARLIER if first.first_speed > 0.0 else _NONE
        state.earlier_wall = first.side
    for index in range(len(log)):
        s = read_segment(model, log[index])
        start = since(s, model.cycle, window.periods, window.time)
        is_sticking = s.mode == STICKING
        if state.wall == _EARLIER and (
            is_sticking or (s.cause == IMPACT and s.side != state.earlier_wall)
        ):
            state.wall = _NONE
        if is_sticking:
            inside = s.duration + min(start, 0.0)
            state.sticking += max(inside, 0.0)
            if s.cause == STICK and state.wall != _NONE:
                _close(model, window, s, COMPLETE, state, counts, listed)
            state.open_sticking += inside
        elif s.cause == RELEASE:
            if state.open >= 0.0:
                listed[int(state.open)].sticking_time = state.open_sticking
            state.open = -1.0
        elif s.cause == IMPACT and start >= 0.0 and state.wall != _EARLIER:
            if state.wall != _NONE and state.wall != s.side:
                _close(model, window, s, INCOMPLETE, state, counts, listed)
            _strike(model, s, thresholds, state, counts)


@compiled
def _strike(model, s, thresholds, state, counts):
    """Count an impact, of a new burst where none is under way."""
    fractions, speeds = thresholds
    visible, _ = counts
    if state.wall == _NONE:
        state.wall = s.side
        state.first_speed = s.speed
        state.onset_cycles = s.periods
        state.onset_time = s.time
        for k in range(len(fractions)):
            visible[0, k] = 0
    state.last_periods = s.periods
    state.last_time = s.time
    for k in range(len(fractions)):
        limit = max(float(fractions[k]) * s.first_speed, float(speeds[k]))
        if s.speed >= limit:
            visible[0, k] += 1
        if s.mode == TAIL:
            visible[0, k] += visible_in_tail(model, s, limit)


@compiled
def _close(model, window, s, outcome, state, counts, listed):
    """End the burst under way: `COMPLETE` at the start of `s`, or `INCOMPLETE`."""
    state.bursts += 1.0
    if outcome == COMPLETE:
        state.complete += 1.0
    number = int(state.listed)
    if number < len(listed):
        burst = listed[number]
        whole = state.onset_cycles - window.periods
        whole, rest = _carried(model.cycle, whole, state.onset_time - window.time)
        burst.onset = whole * model.cycle + rest
        burst.onset_cycle = whole
        burst.onset_time_in_cycle = rest
        burst.wall = state.wall
        burst.first_speed = state.first_speed
        burst.visible_impacts = counts[0][0, 0]
        burst.complete = outcome - INCOMPLETE
        if outcome == COMPLETE:
            burst.accumulation_time = since(s, model.cycle, window.periods, window.time)
            burst.accumulation_displacement = s.x
            burst.duration = since(s, model.cycle, state.onset_cycles, state.onset_time)
            state.open = number
            state.open_sticking = 0.0
        else:
            whole = state.last_periods - state.onset_cycles
            burst.duration = whole * model.cycle + (state.last_time - state.onset_time)
        state.listed += 1.0
    _judge(counts, outcome)
    state.wall = _NONE


@compiled
def _carried(period, whole, rest):
    """Carry a negative rest, so that 0 <= rest < period."""
    if rest < 0.0:
        rest += period
        whole -= 1.0
        if rest >= period:
            rest = 0.0
            whole += 1.0
    return whole, rest


@compiled
def _judge(counts, outcome):
    """Carry a burst's visible counts into the run's largest count and its chatter."""
    visible, chatter = counts
    for k in range(visible.shape[1]):
        visible[1, k] = max(visible[1, k], visible[0, k])
        if visible[0, k] >= CHATTER_IMPACTS:
            chatter[k] = max(chatter[k], outcome)

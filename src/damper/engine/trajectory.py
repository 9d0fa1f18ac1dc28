"""One resumable run of the event loop."""

import math
from collections.abc import Iterator
from typing import Any

import numpy as np

from damper.engine.compiled import Compiled, compiled
from damper.engine.loop import FINISHED, LOG_FULL, run
from damper.engine.model import (
    begin_samples,
    columns_of,
    initial_segment,
    masses_in,
    motion,
    motion_sample,
    primary_in,
    read_segment,
    state_in,
    state_sample,
    write_row,
)
from damper.engine.segment import COLUMNS, PERIODS, TIME
from damper.parameters import NO_UNITS, State
from damper.parameters.run import DEFAULTS

LOG_ROWS = 1024
DEFAULT_ACCURACY: float = DEFAULTS["accuracy"]
DEFAULT_MAX_EVENTS: int = DEFAULTS["max_events"]

#: Segments of a piece that plain Python runs at a time.
_PIECE = 500

_REST = State(0.0, 0.0, 0.0, 0.0)
#: A buffer that keeps nothing.
NO_LOG = np.empty((0, COLUMNS))


class Trajectory:
    """One resumable run of the event loop.

    Parameters
    ----------
    model : NamedTuple
        From `damper.models.model_of`, which has checked parameters and accuracy.
    state : State, optional
        Where it starts; from rest with y = 0 when not given.
    max_events : int, default 1_000_000
        Budget after which the run stops and says so in `status`: events, or hundreds of evaluations
        in searches that take more than a hundred, or in segments without an event shorter than
        0.001 units of time (and one whole search, 100 000, besides).

    Attributes
    ----------
    status : int
        0 finished so far, 1 max_events used up, 2 a search ran out of steps.
    columns : int
        Of the log.
    events, evaluations : int
        Events so far, and evaluations of the flow that finding them took.
    """

    def __init__(
        self, model: Any, state: State | None = None, max_events: int = DEFAULT_MAX_EVENTS
    ) -> None:
        state = state or _REST
        self.model = model
        #: Number of the one of several free masses that an observer is to see; all of them.
        self.body: int | None = None
        self.cycle = model.cycle
        self.start = self.whole_periods(state.time)
        self.columns = columns_of(model)
        self._state = np.empty(self.columns)
        self._counts = np.zeros(3, dtype=np.int64)
        self.max_events = int(max_events)
        self.initial = state
        #: What it is a run of.
        self.parameters: Any = None
        #: SI sizes of the units, for observers with absolute settings.
        self.units = NO_UNITS
        self.status = FINISHED
        moving = *primary_in(model, state), *masses_in(model, state)
        self._moving = moving
        _write_initial(model, self._state, *self.start, *moving)

    @property
    def events(self) -> int:
        """Events so far."""
        return int(self._counts[0])

    @property
    def is_compiled(self) -> bool:
        """Whether the cache holds its compiled code; true where nothing is compiled."""
        given = self.model, self._state, 0.0, 0.0, self.max_events, NO_LOG, self._counts
        return not isinstance(run, Compiled) or run.is_kept(*given)

    @property
    def evaluations(self) -> int:
        """Evaluations of the flow so far."""
        return int(self._counts[1])

    def whole_periods(self, time: float) -> tuple[float, float]:
        """Split a time into whole cycles and the rest in [0, cycle)."""
        rest = math.fmod(time, self.cycle)
        periods = round((time - rest) / self.cycle)
        if rest < 0.0:
            rest += self.cycle
            periods -= 1
        if rest >= self.cycle:
            rest = 0.0
            periods += 1
        return float(periods), rest

    def skip(self, periods: float, time: float = 0.0) -> None:
        """Run to `periods` whole cycles plus `time` without keeping anything.

        The last segment before that time is computed again by what follows, so a run is
        bit-identical however it is split.
        """
        for _ in self.segments(periods, time, NO_LOG):
            pass

    def state_at(self, periods: float, time: float = 0.0) -> State:
        """State at a moment inside the present segment, such as the one it was run to.

        The time of the state is the local one, in [0, cycle): whole cycles are left out.
        """
        row = self._state
        elapsed = (periods - row[PERIODS]) * self.cycle + (time - row[TIME])
        x, v, y, u = self.state_in(row, max(elapsed, 0.0))
        return State(x, v, y, u, time)

    def motion_in(self, row: np.ndarray, tau: float) -> tuple[float, float, float, float]:
        """State of the primary, gap and gap rate a time `tau` after the start of a log's row."""
        return _motion(self.model, row, float(tau))

    def motions_in(
        self, rows: np.ndarray, times: np.ndarray, which: np.ndarray | None = None
    ) -> np.ndarray:
        """`motion_in` at many times, a row each; of one row of the log, or of these of several."""
        found = np.empty((len(times), 4))
        which = np.zeros(len(times), int) if which is None else which
        _motions(self.model, np.atleast_2d(rows), which, times, found)
        return found

    def state_in(self, row: np.ndarray, tau: float) -> tuple[float, float, Any, Any]:
        """State of the primary and of each free mass a time `tau` after the start of a row."""
        return _state(self.model, row, float(tau))

    def states_in(
        self, log: np.ndarray, times: np.ndarray, at: np.ndarray | None = None
    ) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
        """`state_in` at many times: arrays with a row each.

        `log` is a row, or rows of which `at` gives that of each time.
        """
        x, v, y, u = (np.empty((len(times), size)) for size in map(np.size, self._moving))
        at = np.zeros(len(times), int) if at is None else at
        _states(self.model, np.atleast_2d(log), at, times, x, v, y, u)
        return x, v, y, u

    def segments(
        self, periods: float, time: float = 0.0, buffer: np.ndarray | None = None
    ) -> Iterator[np.ndarray]:
        """Run on to a time and yield the log in pieces.

        Parameters
        ----------
        periods, time : float
            Where to stop: whole cycles plus a time in [0, cycle).
        buffer : ndarray (rows, columns), optional
            Where to write; each piece is a view of it, valid until the next one.

        Yields
        ------
        ndarray (n, columns)
            Segments in order, the fields of `damper.engine.segment.Segment` a row. The first may
            begin before the time reached so far; the last is cut where the run stops.
        """
        if buffer is None:
            buffer = np.empty((LOG_ROWS, self.columns))
        while True:
            full, rows = self._run(periods, time, buffer)
            yield buffer[:rows]
            if not full:
                return

    def _run(self, periods: float, time: float, log: np.ndarray) -> tuple[bool, int]:
        """Run on; whether there is more to come, and the rows written."""
        if self.status != FINISHED:
            return False, 0
        end = float(periods), float(time)  # an int would be compiled for itself
        given = self.model, self._state, *end, self.max_events
        call = run.ready(*given, log, self._counts) if isinstance(run, Compiled) else run
        if call is None:
            # Plain Python: go in short pieces, for the rest of a long run is compiled.
            log = (log if len(log) else np.empty((_PIECE, self.columns)))[:_PIECE]
        code, rows = (call or run)(*given, log, self._counts)
        if code == LOG_FULL:
            return True, rows
        self.status = code
        return False, rows


@compiled
def _write_initial(model, state, periods, time, x, v, y, u):
    write_row(model, state, initial_segment(model, periods, time, x, v, y, u), 0.0)


@compiled
def _motion(model, row, tau):
    return motion(model, read_segment(model, row), tau)


@compiled
def _motions(model, rows, which, times, found):
    segment = read_segment(model, rows[0])
    begun = begin_samples(model, segment)
    last = 0
    for k in range(len(times)):
        if which[k] != last:
            last = which[k]
            segment = read_segment(model, rows[last])
            begun = begin_samples(model, segment)
        found[k, 0], found[k, 1], found[k, 2], found[k, 3] = motion_sample(
            model, segment, begun, float(times[k])
        )


@compiled
def _state(model, row, tau):
    return state_in(model, read_segment(model, row), tau)


@compiled
def _states(model, log, at, times, x, v, y, u):
    k = 0
    while k < len(times):
        row = at[k]
        segment = read_segment(model, log[row])
        begun = begin_samples(model, segment)
        while k < len(times) and at[k] == row:
            x[k], v[k], y[k], u[k] = state_sample(model, segment, begun, float(times[k]))
            k += 1

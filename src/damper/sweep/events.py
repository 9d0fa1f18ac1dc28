"""`damper.events`: the exact event sequence of one run as a structured array."""

import math
from collections.abc import Iterator, Mapping, Sequence
from inspect import cleandoc
from typing import Any

import numpy as np

from damper.engine import segment
from damper.engine.loop import FINISHED
from damper.engine.trajectory import DEFAULT_ACCURACY, DEFAULT_MAX_EVENTS
from damper.models import check_state, start_run
from damper.parameters import NO_UNITS, Parameters, SIParameters, State
from damper.parameters.names import counted, unknown_name
from damper.parameters.quantity import real
from damper.parameters.run import EngineSettings, settings_text
from damper.parameters.structural import StructureParameters
from damper.sweep.estimate import MOST_PERIODS
from damper.sweep.points import one_run

EVENT = np.dtype(
    [
        ("time", "f8"),
        ("kind", "i1"),
        ("side", "i1"),
        ("approach_speed", "f8"),
        ("x", "f8"),
        ("v", "f8"),
        ("cycle", "i8"),
        ("time_in_cycle", "f8"),
        ("body", "i1"),
    ]
)
#: Names of the kinds, in the order of their numbers.
KINDS = tuple(kind.name.lower() for kind in segment.EventKind)
IMPACT, STICK, RELEASE, STOPPED, REST, SLIP, REVERSAL = segment.EventKind
#: Most events that are shown whole; of more, the first and last few.
_SHOWN, _FEW = 12, 5
#: Field -> the unit that it is in.
_SIZES = {
    "time": "time",
    "approach_speed": "speed",
    "x": "length",
    "v": "speed",
    "time_in_cycle": "time",
}


class EventTable(np.ndarray):
    """Events as a structured array that is shown as a table; its fields are plain arrays."""

    def __getitem__(self, key: Any) -> Any:
        if isinstance(key, str) and key not in (self.dtype.names or ()):
            raise ValueError(str(unknown_name("field", key, self.dtype.names or ())))
        part = super().__getitem__(key)
        other = isinstance(part, EventTable) and part.dtype != EVENT
        return part.view(np.ndarray) if other else part

    def __repr__(self) -> str:
        if self.ndim != 1 or self.dtype != EVENT:
            return repr(self.view(np.ndarray))
        count, rows = len(self), self.view(np.ndarray)
        several = bool((rows["body"] > 0).any())
        shown = range(count) if count <= _SHOWN else [*range(_FEW), *range(count - _FEW, count)]
        lines = [
            f"{rows['time'][k]:12.6g} {KINDS[rows['kind'][k]]:>8} {rows['side'][k]:+5d} "
            f"{rows['approach_speed'][k]:15.6g} {rows['x'][k]:12.6g} {rows['v'][k]:12.6g}"
            + (f" {rows['body'][k]:5d}" if several else "")
            for k in shown
        ]
        if count > _SHOWN:
            lines.insert(_FEW, f"{'...':>12}")
        head = f"{'time':>12} {'kind':>8} {'side':>5} {'approach_speed':>15} {'x':>12} {'v':>12}"
        head += f" {'body':>5}" if several else ""
        return "\n".join([f"<{counted(count, 'event')}>", head, *lines])

    __str__ = __repr__


class Started:
    """A run that has begun: what `events` and `damper.start` have in common.

    Parameters
    ----------
    parameters, state, accuracy, max_events, values
        As for `events`.
    """

    def __init__(
        self,
        parameters: Parameters | SIParameters | StructureParameters | None,
        state: State | None,
        accuracy: float,
        max_events: int,
        values: Mapping[str, Any],
    ) -> None:
        self.parameters, state = one_run(parameters, state, values, structures=True)
        self.units, scaled = self.parameters.units, self.parameters.dimensionless
        if state is not None:
            state = state.over(self.units)
            check_state(scaled, state, self.units)
        self.trajectory = start_run(scaled, state, accuracy, max_events)
        self.trajectory.units = self.units
        self.begun = 0.0 if state is None else state.time

    def pieces(self, until: float) -> Iterator[np.ndarray]:
        """Run on to a time, in s with SIParameters, and yield pieces of the log.

        Raises
        ------
        ValueError
            When the time is before the start, not finite, or a billion cycles after the start.
        TypeError
            When it is not a number.
        """
        end = real("until", until) / self.units.time
        if not (math.isfinite(end) and end >= self.begun):
            raise ValueError(
                f"until = {until!r}: must be a finite time >= {self.begun * self.units.time!r}, "
                "the start"
            )
        periods = (end - self.begun) / self.trajectory.cycle
        if periods > MOST_PERIODS:
            raise ValueError(
                f"until = {until!r}: ends after {periods:.3g} cycles; at most {MOST_PERIODS}"
            )
        yield from self.trajectory.segments(*self.trajectory.whole_periods(end))

    def events_in(self, log: np.ndarray) -> np.ndarray:
        """Rows of the events that begin segments of a piece of the log, in its units."""
        rows = log[log[:, segment.CAUSE] >= segment.IMPACT]
        piece = np.empty(len(rows), dtype=EVENT)
        piece["time"] = rows[:, segment.PERIODS] * self.trajectory.cycle + rows[:, segment.TIME]
        piece["kind"] = rows[:, segment.CAUSE]
        piece["side"] = np.where(rows[:, segment.CAUSE] < segment.REST, rows[:, segment.SIDE], 0.0)
        piece["approach_speed"] = rows[:, segment.SPEED]
        piece["x"] = rows[:, segment.X]
        piece["v"] = rows[:, segment.V]
        piece["cycle"] = rows[:, segment.PERIODS]
        piece["time_in_cycle"] = rows[:, segment.TIME]
        # Rows of one free mass are no wider.
        several = log.shape[1] > segment.COLUMNS
        piece["body"] = rows[:, segment.COLUMNS] if several else 0
        return piece

    def stopped(self, last: np.ndarray) -> list[np.ndarray]:
        """The row that says where a run stopped early, after its last row of the log; or none."""
        if self.trajectory.status == FINISHED:
            return []
        row = last[0]
        x, v, _, _ = self.trajectory.motion_in(row, row[segment.DURATION])
        whole, rest = self.trajectory.whole_periods(row[segment.TIME] + row[segment.DURATION])
        periods = row[segment.PERIODS] + whole
        time = periods * self.trajectory.cycle + rest
        found = (time, segment.STOPPED, 0, 0.0, x, v, periods, rest, -1)
        return [np.array([found], dtype=EVENT)]

    def table(self, pieces: Sequence[np.ndarray]) -> EventTable:
        """Join pieces into a table, in SI units with SIParameters."""
        found: EventTable = np.concatenate(pieces).view(EventTable)
        if self.units is not NO_UNITS:
            for name, size in _SIZES.items():
                found[name] *= getattr(self.units, size)
        return found


def events(
    parameters: Parameters | SIParameters | StructureParameters | None = None,
    state: State | None = None,
    *,
    until: float,
    accuracy: float = DEFAULT_ACCURACY,
    max_events: int = DEFAULT_MAX_EVENTS,
    **values: Any,
) -> EventTable:
    """Compute a run's events exactly: impacts, starts and ends of sticking, and stops by friction.

    Parameters
    ----------
    parameters : Parameters or SIParameters, optional
        With SIParameters, times are in s, lengths in m and speeds in m/s throughout.
    state : State, optional
        Where it starts; from rest with y = 0 at time 0 when not given.
    until : float
        Time (not a number of cycles) at which to end, in units of sqrt(M/K) (in s with
        SIParameters).

    Other Parameters
    ----------------
    {engine}
    **values
        Parameters and initial quantities by name, as `damper.simulate` takes them, in place of
        `parameters` and `state` or of single values of theirs.

    Returns
    -------
    EventTable, a structured ndarray that is shown as a table
        One row per event in order: `time`; `kind` 0 impact, 1 stick, 2 release, 3 stopped (only
        if the run ended before `until`, and then the last row); with dry friction, off the walls,
        4 rest, where the free mass comes to rest in the box, 5 slip, where it breaks away, and 6
        reversal, where it slides back at once (`damper.IMPACT`, `damper.STICK`, ... are these
        numbers); `side` -1 left wall, +1 right (0 where there is
        none); `approach_speed` just before an impact, else 0; `x` and `v`, the
        primary's displacement and velocity just after; `cycle` the number of whole cycles, of
        length P, from time 0 and `time_in_cycle` with 0 <= `time_in_cycle` < P. These two stay
        sharp after
        any number of cycles, while `time` is the rounded sum cycle * P + time_in_cycle. A
        completed burst is its individually resolved impacts and then one stick row at the
        accumulation time. `body` is the number of the free mass that it happens to, from 0 (-1 in a
        stopped row): what happens to several at one instant is as many rows of one `time`, and a
        mass that another one's impact kicks off its wall is a release. It is shown where there are
        several.

    Raises
    ------
    ValueError
        When the state is outside the box, `until` is before it, not finite or a billion
        cycles after it, or `accuracy` or `max_events` is out of range.
    TypeError
        For what is not a number, not of these classes, or an unknown or missing name.

    Examples
    --------
    >>> import damper
    >>> p = damper.Parameters(mass_ratio=0.1, damping_ratio=0.05, frequency_ratio=0.2,
    ...                       clearance=0.25, restitution=0.6)
    >>> first = damper.events(p, until=3.0)[0]
    >>> print(first["kind"] == damper.IMPACT, first["side"], round(float(first["time"]), 9))
    True -1 2.158603189
    >>> damper.events(p, until=10.0)
    <2 events>
            time     kind  side  approach_speed            x            v
          2.1586   impact    -1        0.285743         0.25      0.24418
         5.25461   impact    +1        0.347026      1.03678     0.119076
    """
    started = Started(parameters, state, accuracy, max_events, values)
    pieces, last = [], np.empty(0)
    for log in started.pieces(until):
        pieces.append(started.events_in(log))
        last = log[-1:].copy() if len(log) else last
    return started.table([*pieces, *started.stopped(last)])


events.__doc__ = cleandoc(events.__doc__ or "").replace("{engine}\n", settings_text(EngineSettings))

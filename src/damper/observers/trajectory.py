"""Sampled trajectory: the motion at equal time steps and, exactly, at every event.

Made for drawing time histories and phase portraits: with the rows just before and just after each
impact, corners stay sharp however coarse the samples are. Sampling only reads the log; it never
moves an event.
"""

import math

import numpy as np

from damper.engine.compiled import compiled
from damper.engine.segment import (
    CAUSE,
    CONTACT,
    DURATION,
    GAP,
    IMPACT,
    MODE,
    PERIOD,
    RATE,
    SIDE,
    SPEED,
    STICKING,
    TIME,
    V,
    X,
)
from damper.engine.trajectory import Trajectory
from damper.models import mass_ratio_at, motion
from damper.observers.base import Observer, Window, since
from damper.observers.sections import free_state
from damper.observers.stretch import SLACK, sample_steps
from damper.parameters.variables import LENGTH, Variable
from damper.parameters.variables import SPEED as SPEED_UNIT
from damper.parameters.variables import TIME as TIME_UNIT

#: What the pass has written so far.
_ROWS, _SAMPLES, _EVENTS, _LEFT_OUT = range(4)


class SampledTrajectory(Observer):
    """Both masses' motion at equal time steps and at every event, rows sorted by time.

    An impact gives two rows of one time, with the velocities just before and just after it; the
    start of sticking and the release give one row each. The impacts of a closed burst are not
    listed, as in `damper.events`; samples inside one follow its bounces. A sample that falls on an
    event to the last bit shows the same side of it as the stroboscopic section does.

    Parameters
    ----------
    samples_per_period : int, default 100
        Equal steps per forcing period.
    start : float, default 0
        Where to begin, in forcing periods after the start of the record.
    length : float, optional
        How long to go on, in forcing periods, rounded to whole steps; to the end of the record
        (its last whole step) when not given.
    events : int, default 1000
        Most events to write; `trajectory_events_left_out` counts those beyond.

    Raises
    ------
    ValueError
        When a setting is out of range; when the stretch leaves the record, as soon as its length
        is known.
    """

    def __init__(
        self,
        samples_per_period: int = 100,
        start: float = 0.0,
        length: float | None = None,
        events: int = 1000,
    ) -> None:
        if not (samples_per_period >= 1 and int(samples_per_period) == samples_per_period):
            raise ValueError(
                f"samples_per_period = {samples_per_period!r}: must be a whole number >= 1"
            )
        if not 0.0 <= start < math.inf:
            raise ValueError(f"start = {start!r}: must be a number of forcing periods >= 0")
        if length is not None and not 0.0 < length < math.inf:
            raise ValueError(f"length = {length!r}: must be a number of forcing periods > 0")
        if not (events >= 0 and int(events) == events):
            raise ValueError(f"events = {events!r}: must be a whole number >= 0")
        self.samples_per_period = int(samples_per_period)
        self.start = float(start)
        self.length = length
        self.events = int(events)
        instant = ("instant",)
        self.variables = (
            Variable(
                "trajectory_time",
                "time since the start of the sampled stretch",
                TIME_UNIT,
                instant,
                comment="missing in unused rows, which come last",
            ),
            Variable(
                "trajectory_start",
                "start of the sampled stretch since the start of the record",
                TIME_UNIT,
            ),
            Variable("trajectory_displacement", "primary displacement", LENGTH, instant),
            Variable("trajectory_velocity", "primary velocity", SPEED_UNIT, instant),
            Variable("trajectory_free_displacement", "free mass displacement", LENGTH, instant),
            Variable("trajectory_free_velocity", "free mass velocity", SPEED_UNIT, instant),
            Variable(
                "trajectory_event",
                "what the row shows",
                "1",
                instant,
                "i1",
                "-1 a sample (or an unused row); 0 impact, a row just before and one just after "
                "it; 1 start of sticking; 2 release",
            ),
            Variable(
                "trajectory_mode",
                "how the masses move from there on",
                "1",
                instant,
                "i1",
                "0 flight or the bounces of a closed burst; 1 sticking; -1 unused row",
            ),
            Variable(
                "trajectory_events_left_out",
                "events of the stretch that did not fit",
                "1",
                dtype="i4",
                comment="up to the stop where the run stopped early",
            ),
        )

    def size(self, dim: str, window_length: int) -> int:
        """Rows: all samples, and two for each event."""
        return self._steps(window_length) + 1 + 2 * self.events

    def begin(self, lane: int, trajectory: Trajectory, window: Window) -> None:
        """Start on a lane."""
        super().begin(lane, trajectory, window)
        self._samples = self._steps(window.length) + 1
        # Whole steps to the start keep the instants those of sections at simple fractions.
        self._first = round(self.start * self.samples_per_period)
        self._rest = self.start - self._first / self.samples_per_period
        if abs(self._rest) * self.samples_per_period < SLACK:
            self._rest = 0.0
        self._columns = tuple(self.arrays[v.name][lane] for v in self.variables if v.dims)
        self._counts = np.zeros(4, dtype=np.int64)
        # To whole steps, as the samples are.
        steps = self._first / self.samples_per_period + self._rest
        self._put({"trajectory_start": steps * trajectory.period})

    def observe(self, log: np.ndarray) -> None:
        """Read the next piece of the log."""
        _write(
            self._model,
            log,
            self._window.period,
            self._window.time,
            self._first,
            self._rest,
            self.samples_per_period,
            self._samples,
            self.events,
            self._counts,
            *self._columns,
        )

    def finish(self, finished: bool) -> None:
        """Write how many events did not fit; the rows are in place."""
        self._put({"trajectory_events_left_out": self._counts[_LEFT_OUT]})

    def _steps(self, window_length: int) -> int:
        """Sample steps of the stretch, once it is known to lie in the record."""
        return sample_steps(self.samples_per_period, self.start, self.length, window_length)


@compiled
def _write(
    model,
    log,
    first_period,
    time,
    first_step,
    rest,
    rate,
    samples,
    most_events,
    counts,
    times,
    xs,
    vs,
    ys,
    us,
    kinds,
    modes,
):
    clearance = model.clearance
    period = model.period
    start_period, start_time = _instant(first_period, time, first_step, rest, rate, period)
    last = first_step + samples - 1
    end_period, end_time = _instant(first_period, time, last, rest, rate, period)
    n = int(counts[_ROWS])
    taken = int(counts[_SAMPLES])
    for index in range(len(log)):
        row = log[index]
        duration = float(row[DURATION])
        side = float(row[SIDE])
        mode = 1 if row[MODE] == STICKING else 0
        # Times never go back, not even by rounding.
        now = since(row, period, start_period, start_time)
        inside = now >= 0.0 and since(row, period, end_period, end_time) <= 0.0
        if row[CAUSE] >= IMPACT and inside:
            if counts[_EVENTS] == most_events:
                counts[_LEFT_OUT] += 1
            else:
                counts[_EVENTS] += 1
                x = float(row[X])
                v = float(row[V])
                now = max(now, float(times[n - 1])) if n > 0 else now
                if row[CAUSE] == IMPACT:
                    mass_ratio = mass_ratio_at(model, float(row[PERIOD]), float(row[TIME]))
                    jump = mass_ratio * (1.0 + model.restitution) / (1.0 + mass_ratio)
                    approach = float(row[SPEED])
                    # Walls that give change the velocity in time: before and after are the same.
                    before = v if row[MODE] == CONTACT else v - side * jump * approach
                    y, u = free_state(clearance, side, x, before, 0.0, -approach)
                    times[n], xs[n], vs[n], ys[n], us[n] = now, x, before, y, u
                    kinds[n], modes[n] = 0, 0
                    n += 1
                y, u = free_state(clearance, side, x, v, float(row[GAP]), float(row[RATE]))
                times[n], xs[n], vs[n], ys[n], us[n] = now, x, v, y, u
                kinds[n], modes[n] = int(row[CAUSE]), mode
                n += 1
        while taken < samples:
            periods, local = _instant(first_period, time, first_step + taken, rest, rate, period)
            tau = -since(row, period, periods, local)
            if tau > duration:
                break
            x, v, gap, gap_rate = motion(model, row, max(tau, 0.0))
            y, u = free_state(clearance, side, x, v, gap, gap_rate)
            now = (periods - start_period) * period + (local - start_time)
            now = max(now, float(times[n - 1])) if n > 0 else now
            times[n], xs[n], vs[n], ys[n], us[n] = now, x, v, y, u
            modes[n] = mode
            n += 1
            taken += 1
    counts[_ROWS] = n
    counts[_SAMPLES] = taken


@compiled
def _instant(first_period, time, step, rest, rate, period):
    """Whole periods and local time of a sample, formed as the stroboscopic section forms them.

    `step` counts from the start of the record and `rate` is steps per period; `rest` is the part
    of a period by which the stretch begins after a whole step.
    """
    whole = step // rate
    return first_period + whole, time + ((step - whole * rate) / rate + rest) * period

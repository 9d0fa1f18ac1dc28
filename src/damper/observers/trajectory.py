"""Sampled trajectory: the motion at equal time steps and, exactly, at every event.

Made for drawing time histories and phase portraits: with the rows just before and just after each
impact, corners stay sharp however coarse the samples are. Sampling only reads the log; it never
moves an event.
"""

import math
from typing import NamedTuple

import numpy as np

from damper.engine.compiled import compiled
from damper.engine.forcing import derivative_of, phase_at
from damper.engine.model import AFTER, BEFORE, count_masses, masses_at, read_segment
from damper.engine.segment import COLUMNS, IMPACT, RESTING, STICKING
from damper.engine.trajectory import Trajectory
from damper.observers.common.base import (
    LEAVE_ALONE,
    Observer,
    Window,
    fields_of,
    primary_alone,
    read_record,
    record_type,
    since,
)
from damper.observers.common.bodies import require_bodies
from damper.observers.common.settings import AT, BODIES, Setting
from damper.observers.common.stretch import SLACK, sample_steps
from damper.parameters.models import MODELS, ONE_BY_ONE
from damper.parameters.variables import ACCELERATION, LENGTH, Variable
from damper.parameters.variables import SPEED as SPEED_UNIT
from damper.parameters.variables import TIME as TIME_UNIT

#: A row of the result; the fields are variables without ``trajectory_``.
_ROW = record_type("time", "displacement", "velocity", "event", "body")
#: Variables of each free mass, in the order of `masses_at`.
_OF_MASSES = ("free_displacement", "free_velocity", "mode")
#: Numbers of rows, samples and events so far.
_COUNTS = record_type("rows", "samples", "events", "left_out")


class SampledTrajectory(Observer):
    """The motion of both masses at equal time steps and at every event, rows sorted by time.

    An impact gives two rows of one time, with the velocities just before and just after it; the
    start of sticking and the release give one row each. The impacts of a closed burst are not
    listed, as in `damper.events`; samples inside one follow its bounces. A sample that falls on an
    event to the last bit shows the same side of it as the stroboscopic section does. On a structure
    the primary is the box of the first free mass.

    Raises
    ------
    ValueError
        When the stretch leaves the window, as soon as its length is known.
    """

    models = ONE_BY_ONE
    sees_all = True
    bodies = BODIES
    at = AT
    samples_per_period = Setting(100, "Equal time steps per cycle.", ge=1, le=1_000_000)
    start = Setting(
        0.0, "Where the stretch begins, counted from the start of the window.", "cycles", ge=0
    )
    length = Setting(
        None,
        "Length of the stretch, rounded to whole steps; without it, to the end of the window.",
        "cycles",
        gt=0,
    )
    to_end = Setting(
        False, "Whether to take shorter steps instead of rounding `length`, to end at its very end."
    )
    drive = Setting(
        False,
        "Write what drives the primary as well: the force over its mass. In the frame of a base "
        "that is minus the base's acceleration.",
        models=tuple(MODELS),
    )
    without_damper = Setting(
        False,
        "Write the displacement of the primary alone, from the same start, at each sample as well.",
        models=LEAVE_ALONE,
    )
    events = Setting(1000, "Most events to write; those beyond are counted.", ge=0, le=10_000_000)

    @property
    def variables(self) -> list[Variable]:
        """What it writes."""
        instant = ("instant",)
        of_masses = ("body", *instant) if self.bodies else instant
        body = Variable(
            "trajectory_body",
            "number of the free mass of the event, from 0",
            "1",
            instant,
            "i1",
            "missing: a sample, or an unused row",
        )
        alone = Variable("trajectory_alone", "primary displacement without damper", LENGTH, instant)
        drive = Variable("trajectory_drive", "force over the primary's mass", ACCELERATION, instant)
        return [
            *([drive] if self.drive else []),
            *([body] if self.bodies else []),
            *([alone] if self.without_damper else []),
            Variable(
                "trajectory_time",
                "time since the start of the sampled stretch",
                TIME_UNIT,
                instant,
                comment="missing in unused rows, which come last",
            ),
            Variable(
                "trajectory_start",
                "start of the sampled stretch since the start of the window",
                TIME_UNIT,
            ),
            Variable("trajectory_displacement", "primary displacement", LENGTH, instant),
            Variable("trajectory_velocity", "primary velocity", SPEED_UNIT, instant),
            Variable("trajectory_free_displacement", "free mass displacement", LENGTH, of_masses),
            Variable("trajectory_free_velocity", "free mass velocity", SPEED_UNIT, of_masses),
            Variable(
                "trajectory_event",
                "what the row shows",
                "1",
                instant,
                "i1",
                "0 impact, a row just before and one just after it; 1 start of sticking; "
                "2 release; with dry friction off the walls 4 rest, 5 slip, 6 reversal; missing: a "
                "sample, or an unused row",
            ),
            Variable(
                "trajectory_mode",
                "how the masses move from there on",
                "1",
                of_masses,
                "i1",
                "0 flight or the bounces of a closed burst; 1 sticking; 2 at rest in the box by "
                "friction; missing: unused row",
            ),
            Variable(
                "trajectory_events_left_out",
                "events of the stretch that did not fit",
                "1",
                dtype="i4",
                comment="up to the stop where the run stopped early",
            ),
        ]

    def size(self, dim: str, window_length: int) -> int:
        """Rows: all samples, and two for each event; or masses."""
        if dim == "body":
            return len(self.bodies)
        return self._steps(window_length) + 1 + 2 * self.events

    def coordinates(self) -> dict[str, np.ndarray]:
        """Numbers of the masses."""
        return {"body": np.array(self.bodies)} if self.bodies else {}

    def begin(self, run: int, trajectory: Trajectory, window: Window) -> None:
        """Start on a run."""
        if self.bodies:
            require_bodies(trajectory.model, self.name, self.bodies)
        super().begin(run, trajectory, window)
        rate = self._rate
        # Whole steps to the start keep the instants those of sections at simple fractions.
        first = round(self.start * rate)
        rest = self.start - first / rate
        if abs(rest) * rate < SLACK:
            rest = 0.0
        self._trajectory = trajectory
        samples = self._steps(window.length) + 1
        self._stretch = Stretch(
            self._window, float(first), rest, float(rate), float(samples), float(self.events)
        )
        self._rows = np.empty(samples + 2 * self.events, _ROW)
        self._masses = np.empty((len(self._rows), count_masses(self._model), len(_OF_MASSES)))
        self._counts = np.zeros(1, _COUNTS)
        # To whole steps, as the samples are.
        self._put({"trajectory_start": (first / rate + rest) * trajectory.cycle})

    def observe(self, log: np.ndarray) -> None:
        """Read the next piece of the log."""
        _write(self._model, log, self._stretch, self._rows, self._masses, self._counts)

    def finish(self, finished: bool) -> None:
        """Write the rows that there are, and how many events did not fit."""
        count = read_record(self._counts)
        rows = int(count.rows)
        for field in fields_of(_ROW):
            if field != "body" or self.bodies:
                self.arrays[f"trajectory_{field}"][self._run, :rows] = self._rows[field][:rows]
        for column, field in enumerate(_OF_MASSES):
            found = self._masses[:rows, list(self.bodies) or 0, column].T
            if field == "mode":
                found = np.select([found == STICKING, found == RESTING], [1.0, 2.0], 0.0)
            self.arrays[f"trajectory_{field}"][self._run, ..., :rows] = found
        self._put({"trajectory_events_left_out": count.left_out})
        if self.without_damper:
            sampled = self._rows["event"][:rows] == -1.0
            alone = self._alone()[: sampled.sum()]
            self.arrays["trajectory_alone"][self._run, :rows][sampled] = alone
        if self.drive:
            drive = np.empty(rows)
            free = self._model.free
            times = np.ascontiguousarray(self._rows["time"][:rows])
            _write_drive(free.forcing, self._stretch, self._model.cycle, times, drive)
            self.arrays["trajectory_drive"][self._run, :rows] = free.strength * drive

    def _alone(self) -> np.ndarray:
        """Displacement of the primary alone at each sample."""
        run, stretch = primary_alone(self._trajectory), self._stretch._replace(most_events=0.0)
        rows, counts = np.full(int(stretch.samples), np.nan, _ROW), np.zeros(1, _COUNTS)
        masses = np.empty((len(rows), count_masses(run.model), len(_OF_MASSES)))
        for log in run.segments(*self._window.end(run.cycle)):
            _write(run.model, log, stretch, rows, masses, counts)
        return rows["displacement"]

    @property
    def _rate(self) -> float:
        """Sample steps in a cycle."""
        length = self.length if self.to_end else None
        steps = self.samples_per_period * (length or 0.0)
        if not length or abs(steps - round(steps)) < SLACK:
            return self.samples_per_period
        return math.ceil(steps) / length

    def _steps(self, window_length: float) -> int:
        """Sample steps of the stretch, once it is known to lie in the window."""
        return sample_steps(self._rate, self.start, self.length, window_length)


class Stretch(NamedTuple):
    """What is sampled: steps of 1/rate cycle, `first` steps and `rest` cycles into the window."""

    window: Window
    first: float
    rest: float
    rate: float
    samples: float
    most_events: float


@compiled
def _write(model, log, stretch, rows, masses, counts):
    period = model.cycle
    count = counts[0]
    start_periods, start_time = _instant(stretch, 0.0, period)
    end_periods, end_time = _instant(stretch, stretch.samples - 1.0, period)
    for index in range(len(log)):
        s = read_segment(model, log[index])
        body = float(log[index, COLUMNS]) if log.shape[1] > COLUMNS else 0.0
        now = since(s, period, start_periods, start_time)
        if s.cause >= IMPACT and now >= 0.0 and since(s, period, end_periods, end_time) <= 0.0:
            if count.events == stretch.most_events:
                count.left_out += 1.0
            else:
                count.events += 1.0
                if s.cause == IMPACT:
                    _add_row(model, s, now, BEFORE, (IMPACT, body), rows, masses, count)
                _add_row(model, s, now, AFTER, (s.cause, body), rows, masses, count)
        while count.samples < stretch.samples:
            periods, time = _instant(stretch, count.samples, period)
            tau = -since(s, period, periods, time)
            if tau > s.duration:
                break
            now = (periods - start_periods) * period + (time - start_time)
            _add_row(model, s, now, max(tau, 0.0), (-1.0, -1.0), rows, masses, count)
            count.samples += 1.0


@compiled
def _add_row(model, s, now, tau, event, rows, masses, count):
    number = int(count.rows)
    row = rows[number]
    # Times never go back, not even by roundoff.
    row.time = max(now, rows[number - 1].time) if number > 0 else now
    row.displacement, row.velocity = masses_at(model, s, tau, masses[number])
    row.event, row.body = event
    count.rows += 1.0


@compiled
def _write_drive(forcing, stretch, period, times, drive):
    periods, time = _instant(stretch, 0.0, period)
    for k in range(len(times)):
        phase = phase_at(forcing, periods, time + times[k])
        drive[k] = derivative_of(forcing, phase, 0)


@compiled
def _instant(stretch, sample, period):
    """Whole cycles and local time of a sample, formed as the stroboscopic section forms them."""
    step = stretch.first + sample
    whole = math.floor(step / stretch.rate)
    part = (step - whole * stretch.rate) / stretch.rate + stretch.rest
    return stretch.window.periods + whole, stretch.window.time + part * period

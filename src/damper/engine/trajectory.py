"""The event loop of one trajectory. Its only product is the segment log.

Between events the motion is known in closed form, so a trajectory *is* the list of its segments;
observers are passes over that list. Time is held as whole forcing periods plus a local time in
[0, period), so nothing blurs in long runs.
"""

import math
from collections.abc import Iterator

import numpy as np

from damper.engine.compiled import compiled
from damper.engine.oscillator import acceleration, sine_cosine
from damper.engine.search import BRIEF, GAVE_UP, LONG_SEARCH, ROUNDING, impact, search_budget
from damper.engine.segment import (
    CAUSE,
    COLUMNS,
    DURATION,
    FINISHED,
    FIRST,
    FLIGHT,
    GAP,
    IMPACT,
    LOG_FULL,
    MODE,
    NOTHING,
    PERIOD,
    RATE,
    RELEASE,
    SEARCH_FAILED,
    SIDE,
    SPEED,
    STICK,
    STICKING,
    TAIL,
    TIME,
    TOO_MANY_EVENTS,
    V,
    X,
)
from damper.models import (
    Model,
    cut_flight,
    flight,
    loop_of,
    mass_ratio_at,
    model_of,
    motion,
    rests,
    settle,
    sticking,
    time_to_sticking,
)
from damper.parameters import NO_UNITS, Parameters, State, Units

LOG_ROWS = 1024
DEFAULT_ACCURACY = 1e-12
DEFAULT_MAX_EVENTS = 1_000_000


_REST = State(0.0, 0.0, 0.0, 0.0)


class Trajectory:
    """One resumable run of the event loop.

    Parameters
    ----------
    parameters : Parameters
    state : State, optional
        Where it starts; from rest with y = 0 when not given.
    accuracy : float, default 1e-12
        Largest error of an accumulation time, in units of sqrt(M/K) (of 1/omega where that is
        shorter). Everything else is exact to rounding.
    max_events : int, default 1_000_000
        Budget after which the run stops and says so in `status`: events, or hundreds of evaluations
        in searches that take more than a hundred, or in segments without an event shorter than
        0.001 units of time (and one whole search, 100 000, besides).

    Attributes
    ----------
    status : int
        0 finished so far, 1 max_events used up, 2 a search ran out of steps.
    events, evaluations : int
        Events so far, and evaluations of the flow that finding them took.

    Raises
    ------
    ValueError
        When the state lies outside the box, or accuracy or max_events is out of range.
    """

    def __init__(
        self,
        parameters: Parameters,
        state: State | None = None,
        accuracy: float = DEFAULT_ACCURACY,
        max_events: int = DEFAULT_MAX_EVENTS,
    ) -> None:
        check_engine_settings(accuracy, max_events)
        p = parameters
        state = state or _REST
        check_state(p, state)
        self.model = model_of(p, accuracy)
        self._loop, begin = loop_of(p.model, run, place)
        self.period = p.period
        self.start = self.whole_periods(state.time)
        self._state = np.empty(COLUMNS)
        self._counts = np.zeros(3, dtype=np.int64)
        self._max_events = int(max_events)
        #: SI sizes of the units, for observers with absolute settings.
        self.units = NO_UNITS
        self.status = FINISHED
        begin(self.model, self._state, *self.start, state.x, state.v, state.y, state.u)

    @property
    def events(self) -> int:
        """Events so far."""
        return int(self._counts[0])

    @property
    def evaluations(self) -> int:
        """Evaluations of the flow so far."""
        return int(self._counts[1])

    def whole_periods(self, time: float) -> tuple[float, float]:
        """Split a time into whole forcing periods and the rest in [0, period)."""
        rest = math.fmod(time, self.period)
        periods = round((time - rest) / self.period)
        if rest < 0.0:
            rest += self.period
            periods -= 1
        if rest >= self.period:
            rest = 0.0
            periods += 1
        return float(periods), rest

    def skip(self, periods: float, time: float = 0.0) -> None:
        """Run to `periods` whole forcing periods plus `time` without keeping anything.

        The last segment before that time is computed again by what follows, so a run is
        bit-identical however it is split.
        """
        self._run(periods, time, _NO_LOG)

    def state_at(self, periods: float, time: float = 0.0) -> State:
        """State at a moment inside the present segment, such as the one it was run to.

        The time of the state is the local one, in [0, period): whole periods are left out.
        """
        row = self._state
        elapsed = (periods - row[PERIOD]) * self.period + (time - row[TIME])
        x, v, gap, rate = motion(self.model, row, max(float(elapsed), 0.0))
        side = float(row[SIDE])
        clearance = self.model.clearance
        return State(x, v, x + side * (clearance - gap), v - side * rate, time)

    def segments(
        self, periods: float, time: float = 0.0, buffer: np.ndarray | None = None
    ) -> Iterator[np.ndarray]:
        """Run on to a time and yield the log in pieces.

        Parameters
        ----------
        periods, time : float
            Where to stop: whole forcing periods plus a time in [0, period).
        buffer : ndarray (rows, COLUMNS), optional
            Where to write; each piece is a view of it, valid until the next one.

        Yields
        ------
        ndarray (n, COLUMNS)
            Segments in order. The first may begin before the time reached so far; the last is cut
            where the run stops.
        """
        buffer = np.empty((LOG_ROWS, COLUMNS)) if buffer is None else buffer
        while True:
            full, rows = self._run(periods, time, buffer)
            yield buffer[:rows]
            if not full:
                return

    def _run(self, periods: float, time: float, log: np.ndarray) -> tuple[bool, int]:
        if self.status != FINISHED:
            return False, 0
        code, rows = self._loop(
            self.model, self._state, periods, time, self._max_events, log, self._counts
        )
        if code == LOG_FULL:
            return True, rows
        self.status = code
        return False, rows


_NO_LOG = np.empty((0, COLUMNS))


def check_state(parameters: Parameters, state: State, units: Units = NO_UNITS) -> None:
    """Raise ValueError unless the free mass is between the walls; SI `units` speak of the gap.

    Walls that give let it in deeper.
    """
    distance = abs(state.y - state.x)
    allowed = parameters.clearance + slack(parameters.clearance, state.x, state.y)
    if distance > allowed and parameters.model != "compliant":
        limit = "clearance" if units is NO_UNITS else "gap / 2"
        raise ValueError(
            f"state: |y - x| = {distance * units.length!r} is outside the box: "
            f"must be at most {limit} = {parameters.clearance * units.length!r}"
        )


def check_engine_settings(accuracy: float, max_events: int) -> None:
    """Raise ValueError with name, value and range unless both settings are sensible."""
    if not 1e-15 <= accuracy <= 1e-3:
        raise ValueError(f"accuracy = {accuracy!r}: must be a number from 1e-15 to 1e-3")
    if int(max_events) != max_events or max_events < 1:
        raise ValueError(f"max_events = {max_events!r}: must be a whole number >= 1")


@compiled
def slack(clearance: float, x: float, y: float) -> float:
    """Rounding of the gap of a given state: within it the free mass is at the wall."""
    return ROUNDING * (clearance + abs(x) + abs(y))


@compiled
def place(
    model: Model,
    state: np.ndarray,
    periods: float,
    time: float,
    x: float,
    v: float,
    y: float,
    u: float,
) -> None:
    """Write the first segment's start into `state` (section 1's rules for a start on a wall)."""
    clearance = model.clearance
    relative = y - x
    side = 1.0 if relative >= 0.0 else -1.0
    gap = clearance - side * relative
    rate = -side * (u - v)
    mode = FLIGHT
    cause = NOTHING
    if clearance == 0.0:
        # Stuck between both walls for good, with the common velocity that keeps the momentum.
        side = 0.0
        mass_ratio = mass_ratio_at(model, periods, time)
        v = (v + mass_ratio * u) / (1.0 + mass_ratio)
        gap = 0.0
        rate = 0.0
        mode = STICKING
    elif gap <= slack(clearance, x, y):
        gap = 0.0
        if rate == 0.0:
            angle = model.free[3] * time + model.phase
            sin = math.sin(angle)
            cos = math.cos(angle)
            a, j = acceleration(model.free, x, v, sin, cos)
            if rests(model, periods, time, side, x, v, a, j, sin, cos):
                mode = STICKING
                cause = STICK
    state[PERIOD] = periods
    state[TIME] = time
    state[X] = x
    state[V] = v
    state[GAP] = gap
    state[RATE] = rate
    state[SIDE] = side
    state[MODE] = mode
    state[CAUSE] = cause
    state[SPEED] = 0.0
    state[FIRST] = 0.0
    state[DURATION] = 0.0


@compiled
def run(
    model: Model,
    state: np.ndarray,
    until_periods: float,
    until_time: float,
    max_events: int,
    log: np.ndarray,
    counts: np.ndarray,
) -> tuple[int, int]:
    """Advance from event to event until a time, or until the log is full.

    Parameters
    ----------
    model : tuple
        From `prepare`.
    state : float64 array (COLUMNS,)
        Start of the present segment; updated in place. A segment that the end cuts stays the
        present one.
    until_periods, until_time : float
        Where to stop, whole periods plus local time; an event at exactly that time still counts.
    max_events : int
        Events after which to stop; `search_budget` bounds evaluations that find none.
    log : float64 array (rows, COLUMNS)
        One row per segment; with no rows nothing is kept.
    counts : int64 array (3,)
        Events, evaluations, and those in long searches and brief segments, added to.

    Returns
    -------
    code, rows : int
        FINISHED, TOO_MANY_EVENTS, SEARCH_FAILED or LOG_FULL, and the rows written.
    """
    free = model.free
    phase = model.phase
    period = model.period
    omega = free[3]
    keep = len(log) > 0
    # float(): plain Python would otherwise carry slow NumPy scalars through the loop.
    periods = float(state[PERIOD])
    time = float(state[TIME])
    x = float(state[X])
    v = float(state[V])
    gap = float(state[GAP])
    rate = float(state[RATE])
    side = float(state[SIDE])
    mode = float(state[MODE])
    cause = float(state[CAUSE])
    speed = float(state[SPEED])
    first = float(state[FIRST])
    events = int(counts[0])
    evaluations = int(counts[1])
    searched = int(counts[2])
    most_searched = search_budget(max_events)
    brief = BRIEF / max(1.0, omega)
    rows = 0
    code = FINISHED
    known = False  # whether phase and acceleration at the segment's start are at hand
    while True:
        if keep and rows == len(log):
            code = LOG_FULL
            break
        remaining = (until_periods - periods) * period + (until_time - time)
        if remaining < 0.0:
            break
        if not known:
            angle = omega * time + phase
            sin0, cos0, _ = sine_cosine(angle)
            a, j = acceleration(free, x, v, sin0, cos0)
        known = False

        # The segment's length, and the state at its end.
        hit = 0.0
        end_rate = rate
        if mode == FLIGHT:
            duration, hit, dx, end_v, end_rate, steps = flight(
                model, cause, side, x, v, gap, rate, a, j, sin0, cos0
            )
        elif mode == STICKING:
            duration, hit, dx, end_v, steps = sticking(model, periods, time, side, x, v, sin0, cos0)
        else:
            duration, _ = time_to_sticking(model, periods, time, side, x, v, rate, a, j, sin0, cos0)
            dx, end_v = settle(model, periods, time, side, x, v, rate, sin0, cos0, duration)
            steps = 1
        evaluations += steps

        over = duration > remaining
        if keep:
            row = log[rows]
            row[PERIOD] = periods
            row[TIME] = time
            row[X] = x
            row[V] = v
            row[GAP] = gap
            row[RATE] = rate
            row[SIDE] = side
            row[MODE] = mode
            row[CAUSE] = cause
            row[SPEED] = speed
            row[FIRST] = first
            row[DURATION] = remaining if over else duration
            rows += 1
        if over:
            break
        if hit == GAVE_UP:
            code = SEARCH_FAILED
            break
        is_event = mode == TAIL or hit != 0.0
        if steps >= LONG_SEARCH or (not is_event and duration < brief):
            searched += steps
        if (is_event and events >= max_events) or searched > most_searched:
            code = TOO_MANY_EVENTS
            break

        end_gap = gap
        if hit == 0.0 and mode == FLIGHT:
            dx, end_v, end_gap, end_rate = cut_flight(
                model, side, x, v, gap, rate, sin0, cos0, duration
            )
        # Step over the event into the next segment.
        x += dx
        left = period - time
        if duration < left:
            time += duration
        else:
            # In an order that loses no digit: a flight cut many times would lose the same one.
            rest = duration - left
            time = rest % period
            periods += 1.0 + math.floor((rest - time) / period + 0.5)
        cause = NOTHING
        speed = 0.0
        if mode == TAIL:
            mode = STICKING
            cause = STICK
            first = 0.0
            v = end_v
            rate = 0.0
        elif mode == STICKING:
            v = end_v
            if hit != 0.0:
                mode = FLIGHT
                cause = RELEASE
        elif hit == 0.0:
            gap = end_gap
            v = end_v
            rate = end_rate
        else:
            cause = IMPACT
            speed = abs(end_rate)
            if first == 0.0 or hit != side:
                first = speed
            side = hit
            gap = 0.0
            mass_ratio = mass_ratio_at(model, periods, time)
            v, rate = impact(mass_ratio, model.restitution, side, end_v, speed)
            angle = omega * time + phase
            sin0, cos0, _ = sine_cosine(angle)
            a, j = acceleration(free, x, v, sin0, cos0)
            known = True
            if rate == 0.0:
                stays = rests(model, periods, time, side, x, v, a, j, sin0, cos0)
                mode = TAIL if stays else FLIGHT
            else:
                _, error = time_to_sticking(
                    model, periods, time, side, x, v, rate, a, j, sin0, cos0
                )
                if error <= model.tolerance:
                    mode = TAIL
        if is_event:
            events += 1
    state[PERIOD] = periods
    state[TIME] = time
    state[X] = x
    state[V] = v
    state[GAP] = gap
    state[RATE] = rate
    state[SIDE] = side
    state[MODE] = mode
    state[CAUSE] = cause
    state[SPEED] = speed
    state[FIRST] = first
    counts[0] = events
    counts[1] = evaluations
    counts[2] = searched
    return code, rows

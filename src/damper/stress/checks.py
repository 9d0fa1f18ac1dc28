"""What must hold in every run, however extreme: checks that need one run of each lane.

A check is a pass over the segment log, as observers are. It reads the state at the end of each
segment from the closed form and compares it with the start of the next one, so the laws of impact
and continuity are tested on the log and not on what the event loop says of itself. Each law's
largest violation is kept relative to the sizes of its terms: a few units of rounding are as good
as it gets.
"""

import math
from collections.abc import Callable, Iterable, Mapping
from importlib import import_module
from typing import Any

import numpy as np

from damper.engine.compiled import by_model, compiled
from damper.engine.oscillator import acceleration, increments, sine_cosine
from damper.engine.segment import (
    CAUSE,
    COLUMNS,
    CONTACT,
    DURATION,
    FLIGHT,
    GAP,
    IMPACT,
    MODE,
    PERIOD,
    RATE,
    SIDE,
    STICKING,
    TIME,
    V,
    X,
)
from damper.engine.trajectory import (
    DEFAULT_ACCURACY,
    LOG_ROWS,
    Trajectory,
    check_engine_settings,
)
from damper.models import mass_ratio_at, motion, rigid
from damper.observers.base import Observer, Window
from damper.observers.response import (
    LOSS,
    MODULATION,
    PEAK,
    SPEED_SQUARE,
    STORED,
    SUPPORT,
    WORK,
    add_part,
    impact_loss,
    stored_energy,
)
from damper.stress.laws import LAWS, REFUSED, RUN
from damper.sweep.points import Point, read_point

#: Samples of a segment beside its end; of one in which little can turn, and of a long one.
_SAMPLES, _FEWEST_SAMPLES, _MOST_SAMPLES = 8, 3, 64
#: Product of a segment's length and the primary's fastest rate below which little can turn.
_SHORT = 0.5

#: Largest violation of each law in a lane, and what the energy balance needs.
(
    _PENETRATION,
    _TOUCH,
    _CONTINUITY,
    _MOMENTUM,
    _RESTITUTION,
    _PULL,
    _CLOCK,
    _BACKWARDS,
    _NOT_FINITE,
    _WORK_SIZE,
    _LARGEST,
    _ROWS,
) = range(12)


class Laws(Observer):
    """Largest violation of each law over a run, from its start.

    Violations are relative to the sizes of the terms whose difference they are, so that rounding is
    some 1e-16 to 1e-15 in each. What a lane does not have, such as impacts, leaves NaN.
    """

    variables = (*LAWS, *(variable for variable in RUN if variable.name == "segments"))

    def begin(self, lane: int, trajectory: Trajectory, window: Window) -> None:
        """Start on a lane."""
        super().begin(lane, trajectory, window)
        self._more: tuple = ()
        for name in _MODULES.get(type(self._model).__name__, ()):
            module = import_module(name)
            if hasattr(module, "prepare"):
                self._more = module.prepare(self._model)
        self._worst = np.zeros(12)
        self._worst[[_TOUCH, _MOMENTUM, _RESTITUTION, _PULL]] = np.nan
        self._totals = np.zeros(9)
        # The peak is of no interest: a search for it that has nothing to find.
        self._totals[PEAK] = np.inf
        self._last = np.zeros(COLUMNS)
        self._end = np.zeros(5)

    def observe(self, log: np.ndarray) -> None:
        """Read the next piece of the log."""
        _follow(self._model, self._more, log, self._worst, self._totals, self._last, self._end)

    def finish(self, finished: bool) -> None:
        """Write what was found, up to a stop too."""
        worst, totals, model = self._worst, self._totals, self._model
        put = {
            "penetration": worst[_PENETRATION],
            "touch": worst[_TOUCH],
            "continuity": worst[_CONTINUITY],
            "momentum": worst[_MOMENTUM],
            "restitution_law": worst[_RESTITUTION],
            "pull": worst[_PULL],
            "clock": worst[_CLOCK],
            "backwards": worst[_BACKWARDS],
            "not_finite": worst[_NOT_FINITE],
            "segments": worst[_ROWS],
        }
        if worst[_ROWS]:
            end = stored_energy(model, self._last, float(self._last[DURATION]))
            dashpot = 2.0 * model.free[0] * totals[SPEED_SQUARE] + totals[SUPPORT]
            lost = dashpot + totals[LOSS]
            left = totals[WORK] + totals[MODULATION] - lost - (end - totals[STORED])
            size = worst[_WORK_SIZE] + abs(totals[MODULATION]) + lost + worst[_LARGEST]
            put["energy"] = abs(left) / size if size > 0.0 else abs(left)
        self._put(put)


#: Model -> modules that implement its part of the checks and of the energy balance; the last one
#: may `prepare` what that needs.
_MODULES = {
    "Compliant": ("damper.stress.compliant_checks", "damper.models.compliant.response"),
    "Grounded": ("damper.stress.grounded_checks", "damper.models.grounded.response"),
    "TimeVarying": ("damper.models.time_varying.response",),
}


@by_model
def flight_start(model: tuple, row: np.ndarray) -> tuple[float, ...]:
    """What the motion in a flight takes that is the same all along it.

    Parameters
    ----------
    model : tuple
        Of `damper.models.model_of`.
    row : ndarray (COLUMNS,)
        Of the segment log.

    Returns
    -------
    a, j, sin, cos : float
        The primary's second and third derivative at the start, and the phase's sine and cosine.
    y, u, b, k : float
        The free mass's position and first three derivatives there, where it does not fly straight.
    """
    free = model.free
    x = float(row[X])
    v = float(row[V])
    sin, cos, _ = sine_cosine(free[3] * float(row[TIME]) + model.phase)
    a, j = rigid.flight_start(free, float(row[CAUSE]), x, v, sin, cos)
    return a, j, sin, cos, 0.0, 0.0, 0.0, 0.0


@by_model
def own_jerk(model: tuple, start: tuple, duration: float) -> float:
    """Bound on the free mass's third derivative in a flight."""
    return 0.0


@by_model
def flight_at(
    model: tuple, row: np.ndarray, start: tuple[float, ...], tau: float
) -> tuple[float, ...]:
    """Motion in flight, as it is: `damper.models.motion` never gives a gap less than zero.

    Parameters
    ----------
    model : tuple
        Of `damper.models.model_of`.
    row : ndarray (COLUMNS,)
        Of the segment log.
    start : tuple of float
        Of `flight_start`.
    tau : float
        Time after the segment's start.

    Returns
    -------
    x, v, gap, rate, size : float
        Of the primary; from the segment's wall; the sizes of the gap's terms.
    """
    x = float(row[X])
    v = float(row[V])
    gap = float(row[GAP])
    rate = float(row[RATE])
    side = float(row[SIDE])
    dx, dv, _, _ = increments(model.free, x, v, start[0], start[1], start[2], start[3], tau)
    return (
        x + (v * tau + dx),
        v + dv,
        gap + rate * tau + side * dx,
        rate + side * dv,
        gap + (abs(rate) + abs(v)) * tau,
    )


@by_model
def thrust(
    model: tuple, row: np.ndarray, tau: float, x: float, v: float, gap: float, rate: float
) -> tuple[float, ...]:
    """Force of the wall on the free mass in sticking, over its mass, and the size of its terms.

    The masses have the acceleration (sin - 2 zeta v - x) / (1 + mu). The state is that at `tau`.
    """
    free = model.free
    # What the velocity is made of: itself, and what spring and force add against the dashpot.
    drag = max(2.0 * free[0], 1.0)
    speed = abs(v) + abs(float(row[V])) + (1.0 + abs(float(row[X]))) * min(tau, 1.0 / drag)
    time = float(row[TIME]) + tau
    heavier = 1.0 + mass_ratio_at(model, float(row[PERIOD]), time)
    sin, _, _ = sine_cosine(free[3] * time + model.phase)
    a, _ = acceleration(free, x, v, sin, 0.0)
    size = 1.0 + 2.0 * free[0] * speed + abs(x) + abs(float(row[X]))
    return -float(row[SIDE]) * a / heavier, size / heavier


@compiled
def _follow(model, more, log, worst, totals, last, end):
    for index in range(len(log)):
        row = log[index]
        for column in range(COLUMNS):
            if not math.isfinite(row[column]):
                worst[_NOT_FINITE] += 1.0
                break
        if worst[_ROWS] == 0.0:
            totals[STORED] = stored_energy(model, row, 0.0)
            worst[_LARGEST] = _energy_size(model, row)
        else:
            _compare(model, last, end, row, worst)
        duration = float(row[DURATION])
        if row[MODE] == FLIGHT and row[GAP] >= 0.0:
            _sample_flight(model, row, duration, worst, end)
        else:
            _sample_contact(model, row, duration, worst, end)
        if row[CAUSE] == IMPACT:
            totals[LOSS] += impact_loss(model, row)
        before = float(totals[SPEED_SQUARE])
        add_part(model, more, row, 0.0, duration, totals)
        # The work is at most this, however its parts cancel.
        passed = max(float(totals[SPEED_SQUARE]) - before, 0.0)
        worst[_WORK_SIZE] += math.sqrt(duration * passed)
        worst[_LARGEST] = max(float(worst[_LARGEST]), _energy_size(model, row))
        worst[_ROWS] += 1.0
        last[:] = row


@compiled
def _more(old, new):
    """The larger of the two; the old one is NaN as long as there is none."""
    return old if old >= new else new


@compiled
def _compare(model, last, end, row, worst):
    """The end of one segment against the start of the next one."""
    duration = float(last[DURATION])
    period = model.period
    passed = (float(row[PERIOD]) - float(last[PERIOD])) * period + (
        float(row[TIME]) - float(last[TIME])
    )
    worst[_CLOCK] = _more(worst[_CLOCK], abs(passed - duration) / period)
    worst[_BACKWARDS] = _more(worst[_BACKWARDS], max(-passed, 0.0) / period)

    v0 = float(last[V])
    rate0 = float(last[RATE])
    x = float(end[0])
    v = float(end[1])
    gap = float(end[2])
    rate = float(end[3])
    size = float(end[4])
    if row[SIDE] != last[SIDE]:
        gap = 2.0 * model.clearance - gap
        rate = -rate
        size += 2.0 * model.clearance
    # A velocity's terms: those of the start and what spring, force and dashpot add.
    pushes = (1.0 + abs(float(last[X]))) * min(duration, 1.0)
    pushes += abs(v0) * min(2.0 * model.free[0] * duration, 1.0)
    pushes += support_speed(model, abs(x), abs(v0), duration)
    speeds = abs(v0) + abs(rate0) + abs(v) + abs(rate) + pushes
    size += 1.0 + abs(x)
    new_x = float(row[X])
    new_v = float(row[V])
    new_rate = float(row[RATE])
    jump = abs(new_x - x) / size
    hits = row[CAUSE] == IMPACT and row[MODE] != CONTACT
    if hits:
        worst[_TOUCH] = _more(worst[_TOUCH], abs(gap) / size)
        approach = -rate
        law = abs(new_rate - model.restitution * approach)
        sizes = abs(rate0) + abs(approach) + pushes
        worst[_RESTITUTION] = _more(worst[_RESTITUTION], law / sizes if law > 0.0 else 0.0)
        mass_ratio = mass_ratio_at(model, float(row[PERIOD]), float(row[TIME]))
        # u = v - side * rate, from the wall of the new segment on both sides.
        side = float(row[SIDE])
        change = (new_v - v) + mass_ratio * ((new_v - v) - side * (new_rate - rate))
        terms = speeds * (1.0 + mass_ratio)
        worst[_MOMENTUM] = _more(worst[_MOMENTUM], abs(change) / terms if change != 0.0 else 0.0)
    else:
        jump = _more(jump, abs(float(row[GAP]) - gap) / size)
        jump = _more(jump, abs(new_v - v) / speeds if new_v != v else 0.0)
        jump = _more(jump, abs(new_rate - rate) / speeds if new_rate != rate else 0.0)
    worst[_CONTINUITY] = _more(worst[_CONTINUITY], jump)


@compiled
def _sample_flight(model, row, duration, worst, end):
    """Look beyond both walls, at the ends of a flight and wherever a wall may be passed between.

    Writes the state at its end, and the sizes of the gap's terms, to `end`.
    """
    width = 2.0 * model.clearance
    start = flight_start(model, row)
    x, v, gap, rate, size = flight_at(model, row, start, duration)
    end[0] = x
    end[1] = v
    end[2] = gap
    end[3] = rate
    end[4] = size
    depth = _more(0.0, max(-gap, gap - width) / (1.0 + abs(x) + size))
    if not math.isfinite(gap + rate + x):
        worst[_NOT_FINITE] += 1.0
    elif not stays_between(model, row, start, duration):
        depth = _more(depth, _deepest(model, row, start, duration, worst))
    worst[_PENETRATION] = _more(worst[_PENETRATION], depth)


@compiled
def stays_between(model: tuple, row: np.ndarray, start: tuple[float, ...], duration: float) -> bool:
    """Whether a flight whose ends lie between the walls must do so all along.

    The gap's second derivative stays within J T of what it is at the start of a flight of length T.
    J bounds the third derivatives of both masses. That of the primary obeys its equation of motion
    with the forcing's second derivative, at most w^2, and sqrt(x''^2 + x'''^2) grows by at most
    that much in a unit of time. So the gap is monotone, concave or convex where that suffices, and
    then its extremes are at the ends, or no further from the start than its rate there takes it.
    """
    free = model.free
    a, j = start[0], start[1]
    gap = float(row[GAP])
    rate = float(row[RATE])
    width = 2.0 * model.clearance
    jerk = math.sqrt(a * a + j * j) + free[3] * free[3] * duration
    spread = (jerk + own_jerk(model, start, duration)) * duration
    bend = float(row[SIDE]) * (a - start[6])
    lowest = bend - spread
    highest = bend + spread
    if not gap <= width:
        return False
    if rate + min(lowest, 0.0) * duration >= 0.0 or rate + max(highest, 0.0) * duration <= 0.0:
        return True
    if highest <= 0.0:
        return gap + max(rate, 0.0) * duration <= width
    return lowest >= 0.0 and gap + min(rate, 0.0) * duration >= 0.0


@compiled
def _deepest(model, row, start, duration, worst):
    """Depth beyond either wall at samples of a flight, and where the gap turns between them."""
    width = 2.0 * model.clearance
    swings = duration * max(1.0, model.free[3])
    samples = _SAMPLES
    if model.free[10] * duration <= _SHORT:
        samples = _FEWEST_SAMPLES
    elif swings > _SAMPLES:
        samples = _MOST_SAMPLES if swings > _MOST_SAMPLES else int(swings)
    tau = 0.0
    rate = float(row[RATE])
    depth = 0.0
    for k in range(samples + 1):
        part = (k + 0.5) / samples
        # Denser towards both ends, where the walls are.
        new_tau = duration * (part * part * (3.0 - 2.0 * part)) if k < samples else duration
        x, _, gap, new_rate, size = flight_at(model, row, start, new_tau)
        depth = _more(depth, max(-gap, gap - width) / (1.0 + abs(x) + size))
        if not math.isfinite(gap + new_rate + x):
            worst[_NOT_FINITE] += 1.0
            break
        if rate * new_rate < 0.0:
            between = tau + (new_tau - tau) * (rate / (rate - new_rate))
            x, _, gap, _, size = flight_at(model, row, start, between)
            depth = _more(depth, max(-gap, gap - width) / (1.0 + abs(x) + size))
        tau = new_tau
        rate = new_rate
    return depth


@compiled
def _sample_contact(model, row, duration, worst, end):
    """Look whether everything is finite, and whether the wall pulls.

    Writes the state at the segment's end, and the sizes of the gap's terms, to `end`.
    """
    sticks = row[MODE] == STICKING and row[SIDE] != 0.0
    # Without a force to look at, one in the middle: what is not finite is not so at one time only.
    samples = 1
    if sticks:
        samples = _SAMPLES if model.free[10] * duration > _SHORT else _FEWEST_SAMPLES
    for k in range(samples, -1, -1):
        part = (k + 0.5) / samples
        tau = duration * (part * part * (3.0 - 2.0 * part)) if k < samples else duration
        x, v, gap, rate = motion(model, row, tau)
        if k == samples:
            end[0] = x
            end[1] = v
            end[2] = gap
            end[3] = rate
            end[4] = abs(gap) + (abs(float(row[V])) + abs(float(row[RATE]))) * duration
        if not math.isfinite(x + v + gap + rate):
            worst[_NOT_FINITE] += 1.0
            break
        if sticks:
            force, size = thrust(model, row, tau, x, v, gap, rate)
            worst[_PULL] = _more(worst[_PULL], max(-force, 0.0) / size)


@compiled
def _energy_size(model, row):
    """Sizes of the stored energy's terms; the free mass's speed is v less side times rate."""
    speed = abs(float(row[V])) + abs(float(row[RATE]))
    x = float(row[X])
    y = abs(x) + model.clearance
    mass_ratio = mass_ratio_at(model, float(row[PERIOD]), float(row[TIME]))
    own = 0.5 * (x * x + float(row[V]) * float(row[V]) + mass_ratio * speed * speed)
    return own + 0.5 * support_stiffness(model) * y * y


@by_model
def support_stiffness(model: tuple) -> float:
    """Stiffness that ties the free mass to ground, over that of the primary."""
    return 0.0


@by_model
def support_speed(model: tuple, x: float, v: float, duration: float) -> float:
    """Speed that the support gives or takes in a time; `x` and `v` are sizes of the primary's."""
    return 0.0


def run_checks(
    lanes: Iterable[Mapping[str, float]],
    periods: int,
    accuracy: float = DEFAULT_ACCURACY,
    max_events: int = 100_000,
    *,
    longest: float = math.inf,
    progress: Callable[[int], None] | None = None,
) -> dict[str, np.ndarray]:
    """Run every lane and check it.

    Parameters
    ----------
    lanes : iterable of mapping
        As `damper.stress.box` makes them.
    periods : int
        Forcing periods to run.
    accuracy : float
        As for `damper.events`.
    max_events : int
        Events after which a run stops: no lane can hang.
    longest : float
        Time, in units of sqrt(M/K), after which a run ends with the forcing period under way.
    progress : callable, optional
        Called with the number of lanes done after each one.

    Returns
    -------
    dict of str to ndarray (lanes,)
        The variables of `Laws`; ``status`` as the engine's, `REFUSED` where the parameters were
        refused with an error; ``events``, ``evaluations`` of the flow, and ``periods`` asked for.

    Raises
    ------
    ValueError
        For settings out of range.
    """
    check_engine_settings(accuracy, max_events)
    if periods < 1 or int(periods) != periods:
        raise ValueError(f"periods = {periods!r}: must be a whole number >= 1")
    points = [_read(lane) for lane in lanes]
    laws = Laws()
    laws.allocate(len(points), int(periods))
    count = len(points)
    arrays: dict[str, Any] = {
        "status": np.full(count, REFUSED, dtype="i1"),
        "events": np.zeros(count, dtype="i8"),
        "evaluations": np.zeros(count, dtype="i8"),
        "periods": np.zeros(count, dtype="i8"),
    }
    buffer = np.empty((LOG_ROWS, COLUMNS))
    for lane, point in enumerate(points):
        try:
            if point is None:
                continue
            trajectory = Trajectory(point.parameters, point.start(), accuracy, max_events)
        except ValueError:
            continue
        first, time = trajectory.start
        length = int(periods)
        if longest < length * trajectory.period:
            length = max(math.ceil(longest / trajectory.period), 1)
        laws.begin(lane, trajectory, Window(first, time, length))
        for log in trajectory.segments(first + length, time, buffer):
            laws.observe(log)
        laws.finish(trajectory.status == 0)
        arrays["status"][lane] = trajectory.status
        arrays["events"][lane] = trajectory.events
        arrays["evaluations"][lane] = trajectory.evaluations
        arrays["periods"][lane] = length
        if progress:
            progress(lane + 1)
    return arrays | laws.arrays


def _read(lane: Mapping[str, float]) -> Point | None:
    try:
        return read_point(lane)
    except ValueError:
        return None

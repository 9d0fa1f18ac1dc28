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

from damper.compiled import by_model, compiled
from damper.engine import (
    DEFAULT_ACCURACY,
    LOG_ROWS,
    Trajectory,
    check_engine_settings,
)
from damper.flow import acceleration, increments, sine_cosine
from damper.models import mass_ratio_at, motion
from damper.models.rigid import flight_start
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
from damper.points import Point, read_point
from damper.segment import (
    CAUSE,
    COLUMNS,
    CONTACT,
    DURATION,
    FLIGHT,
    GAP,
    IMPACT,
    MODE,
    NOTHING,
    PERIOD,
    RATE,
    SIDE,
    STICKING,
    TIME,
    V,
    X,
)
from damper.stress.laws import LAWS, REFUSED, RUN

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

    def observe(self, log: np.ndarray) -> None:
        """Read the next piece of the log."""
        _follow(self._model, self._more, log, self._worst, self._totals, self._last)

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
    "Compliant": ("damper.stress.compliant_checks", "damper.observers.compliant_response"),
    "Grounded": ("damper.stress.grounded_checks", "damper.observers.grounded_response"),
    "Modulated": ("damper.observers.modulated_response",),
}


@by_model
def has_rigid_walls(model: tuple) -> bool:
    """Whether x'' = 0 at a release, by definition: a wall that gives has its own end of contact."""
    return True


@by_model
def flight_gap(model: tuple, row: np.ndarray, tau: float) -> tuple[float, ...]:
    """Gap and its rate in flight, as they are: `damper.models.motion` never gives less than zero.

    Parameters
    ----------
    model : tuple
        Of `damper.models.model_of`.
    row : ndarray (COLUMNS,)
        Of the segment log.
    tau : float
        Time after the segment's start.

    Returns
    -------
    gap, rate, x, size : float
        From the segment's wall; the primary's displacement; the sizes of the gap's terms.
    """
    free = model.free
    x = float(row[X])
    v = float(row[V])
    gap = float(row[GAP])
    rate = float(row[RATE])
    side = float(row[SIDE])
    sin, cos, _ = sine_cosine(free[3] * float(row[TIME]) + model.phase)
    cause = float(row[CAUSE]) if has_rigid_walls(model) else NOTHING
    a, j = flight_start(free, cause, x, v, sin, cos)
    dx, dv, _, _ = increments(free, x, v, a, j, sin, cos, tau)
    return (
        gap + rate * tau + side * dx,
        rate + side * dv,
        x + (v * tau + dx),
        gap + abs(rate) * tau + abs(v) * tau,
    )


@by_model
def thrust(model: tuple, row: np.ndarray, tau: float) -> tuple[float, ...]:
    """Force of the wall on the free mass in sticking, over its mass, and the size of its terms.

    The masses have the acceleration (sin - 2 zeta v - x) / (1 + mu).
    """
    x, v, _, _ = motion(model, row, tau)
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
def _follow(model, more, log, worst, totals, last):
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
            _compare(model, last, row, worst)
        duration = float(row[DURATION])
        if row[MODE] == FLIGHT and row[GAP] >= 0.0:
            _sample_flight(model, row, duration, worst)
        else:
            _sample_contact(model, row, duration, worst)
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
def _compare(model, last, row, worst):
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
    if last[MODE] == FLIGHT and last[GAP] >= 0.0:
        gap, rate, x, size = flight_gap(model, last, duration)
        _, v, _, _ = motion(model, last, duration)
    else:
        x, v, gap, rate = motion(model, last, duration)
        size = abs(gap) + (abs(v0) + abs(rate0)) * duration
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
def _sample_flight(model, row, duration, worst):
    """Look beyond both walls, densely, and where the gap is smallest and largest in between."""
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
        gap, new_rate, x, size = flight_gap(model, row, new_tau)
        depth = _more(depth, max(-gap, gap - width) / (1.0 + abs(x) + size))
        if not math.isfinite(gap + new_rate + x):
            worst[_NOT_FINITE] += 1.0
            break
        if rate * new_rate < 0.0:
            between = tau + (new_tau - tau) * (rate / (rate - new_rate))
            gap, _, x, size = flight_gap(model, row, between)
            depth = _more(depth, max(-gap, gap - width) / (1.0 + abs(x) + size))
        tau = new_tau
        rate = new_rate
    worst[_PENETRATION] = _more(worst[_PENETRATION], depth)


@compiled
def _sample_contact(model, row, duration, worst):
    """Look whether everything is finite, and whether the wall pulls."""
    for k in range(_SAMPLES + 1):
        part = (k + 0.5) / _SAMPLES
        tau = duration * (part * part * (3.0 - 2.0 * part)) if k < _SAMPLES else duration
        x, v, gap, rate = motion(model, row, tau)
        if not math.isfinite(x + v + gap + rate):
            worst[_NOT_FINITE] += 1.0
            break
        if row[MODE] == STICKING and row[SIDE] != 0.0:
            force, size = thrust(model, row, tau)
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

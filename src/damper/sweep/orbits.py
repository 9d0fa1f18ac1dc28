"""`damper.periodic_orbit`: a periodic motion, stable or not, and its multipliers."""

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property, partial
from itertools import groupby
from typing import Any, NamedTuple

import numpy as np

from damper.engine.loop import FINISHED
from damper.engine.segment import DURATION, FLIGHT, IMPACT, MODE, SIDE, STICK
from damper.engine.trajectory import Trajectory
from damper.models import check_state, model_of, start_run
from damper.models.tangent import derivative
from damper.parameters import Parameters, State
from damper.parameters.quantity import whole
from damper.parameters.state import need_state
from damper.sweep.events import events

#: Largest change of the state over the period, over the size of the state.
TOLERANCE = 1e-11
#: Mass ratio from which on the free mass is a fixed stop: an impact changes its velocity by less
#: than `TOLERANCE`. Its place is given, and two multipliers that are 1 are left out.
FIXED_STOP = 1e12
#: Steps of Newton's method, and halvings of one of them.
_STEPS, _HALVINGS = 60, 12


@dataclass(frozen=True)
class PeriodicOrbit:
    """One motion that repeats after a number of forcing periods.

    Made by `periodic_orbit`.

    Attributes
    ----------
    parameters : Parameters
    period : int
        Forcing periods after which it repeats.
    state : State
        At time 0, the start of a forcing period: a run of `parameters` from here is on the orbit.
    derivative : ndarray (4, 4)
        Of (x, v, y, u) after the period by those at its start.
    change : float
        Largest change of the state over the period: how closely it is met.
    """

    parameters: Parameters
    period: int
    state: State
    derivative: np.ndarray
    change: float

    @property
    def start(self) -> np.ndarray:
        """The state as an array (x, v, y, u)."""
        return np.array([self.state.x, self.state.v, self.state.y, self.state.u])

    @cached_property
    def multipliers(self) -> np.ndarray:
        """Floquet multipliers, complex, the largest first; shape (4,).

        Where a chatter sequence completes, two of them are zero. Beside a fixed stop there are only
        those of the primary; shape (2,).
        """
        moves = moving(self.parameters)
        values = np.linalg.eigvals(self.derivative[np.ix_(moves, moves)]).astype(complex)
        return values[np.lexsort((-values.imag, -abs(values)))]

    @property
    def stable(self) -> bool:
        """Whether small deviations die out: all multipliers inside the unit circle."""
        return bool(abs(self.multipliers[0]) < 1.0)

    @cached_property
    def events(self) -> np.ndarray:
        """Its events, as `damper.events` gives them, over the period."""
        until = self.period * 2.0 * np.pi / self.parameters.frequency_ratio
        return events(self.parameters, self.state, until=until)

    @cached_property
    def bursts(self) -> "tuple[WallImpacts, ...]":
        """Its runs of impacts on one wall, the longest on the right wall first."""
        names = ("kind", "side", "approach_speed")
        return bursts_of(*(self.events[name] for name in names))

    @property
    def word(self) -> str:
        """Its events: "R3 L2 RS" for three impacts right, two left, complete chatter right."""
        return " ".join(f"{b.wall}{'S' if b.completes else b.impacts}" for b in self.bursts)

    @property
    def impacts(self) -> float:
        """Impacts in its period; infinitely many where a chatter sequence completes."""
        return sum(np.inf if burst.completes else burst.impacts for burst in self.bursts)

    @property
    def slowest_impact(self) -> float:
        """Smallest approach speed outside complete chatter; NaN without such an impact.

        The derivative grows by its inverse.
        """
        return min((burst.slowest for burst in self.bursts if not burst.completes), default=np.nan)


class WallImpacts(NamedTuple):
    """Impacts on one wall, one after the other."""

    wall: str
    """R or L."""
    impacts: int
    """How many; where they complete, so that masses join: how often the approach speed rises."""
    completes: bool
    slowest: float
    """Smallest approach speed."""


def bursts_of(kinds: np.ndarray, sides: np.ndarray, speeds: np.ndarray) -> tuple[WallImpacts, ...]:
    """Bursts of the events of a period, whichever event is its first."""
    found: list[WallImpacts] = []
    # A period may begin within a burst.
    first = next((k for k in range(len(kinds)) if kinds[k - 1] or sides[k - 1] != sides[k]), 0)
    kinds, sides, speeds = (np.roll(each, -first) for each in (kinds, sides, speeds))
    for (kind, side), group in groupby(range(len(kinds)), lambda k: (kinds[k], sides[k])):
        if kind == IMPACT:
            struck = speeds[list(group)]
            found.append(WallImpacts("R" if side > 0 else "L", len(struck), False, struck.min()))
        elif kind == STICK and found:
            rises = int((np.diff(struck) > 0.0).sum())
            found[-1] = found[-1]._replace(impacts=rises, completes=True)
    turns = [tuple(found[k:] + found[:k]) for k in range(len(found))]
    return max(turns, key=lambda turn: [burst[:3] for burst in turn], default=())


def periodic_orbit(
    parameters: Parameters, period: int = 1, guess: State | None = None, *, settle: int = 200
) -> PeriodicOrbit:
    """Find a motion that repeats after some forcing periods, stable or not, by Newton's method.

    The derivative of the state after the period is that of `damper.models.tangent`, through
    impacts, completed chatter and sticking. No impact of the orbit is skipped: it is a run of the
    engine.

    Parameters
    ----------
    parameters : Parameters
        Of rigid walls.
    period : int, default 1
        Forcing periods after which it repeats. A shorter motion repeats then, too.
    guess : State, optional
        Where to look. Its time may be any: the search begins at the next start of a period. When
        not given, a run from rest, after it has settled.
    settle : int, default 200
        Forcing periods of that run.

    Returns
    -------
    PeriodicOrbit

    Raises
    ------
    ValueError
        When none is found, with where the search stopped; for compliant contact; when the period
        is no multiple of that of a time-varying free mass.

    Examples
    --------
    >>> import damper
    >>> p = damper.Parameters(mass_ratio=0.1, damping_ratio=0.02, frequency_ratio=1.3,
    ...                       clearance=0.05, restitution=0.3)
    >>> orbit = damper.periodic_orbit(p)
    >>> orbit.stable, orbit.events.size
    (True, 20)
    """
    period, settle = whole("period", period, 1), whole("settle", settle, 0)
    check(parameters, period)
    best = nearest_orbit(parameters, period, _settled(parameters, guess, settle))
    if best.change > TOLERANCE * max(1.0, abs(best.start).max()):
        raise ValueError(
            f"no motion of period {period} found: the search stopped at {best.state}, "
            f"which the period changes by {best.change:.3g}; try another guess or period"
        )
    return best


def nearest_orbit(
    parameters: Parameters, period: int, start: np.ndarray, steps: int = _STEPS
) -> PeriodicOrbit:
    """What Newton's method finds from a state at time 0: the state that changes least."""

    def over(start: np.ndarray) -> Pass:
        return pass_over(parameters, start, 0.0, float(period))

    best = found = over(start)
    for _ in range(steps):
        if found.change <= TOLERANCE * max(1.0, abs(found.start).max()):
            break
        if found.side != found.start_side:
            # It ends in contact, or no more: the next period begins as this one ends.
            found = over(found.end)
        elif (stepped := _newton(found, over)) is None:
            break
        else:
            found = stepped
        best = min(best, found, key=lambda each: each.change)
    state = State(*map(float, best.start))
    return PeriodicOrbit(parameters, period, state, best.derivative, best.change)


@dataclass(frozen=True)
class Pass:
    """A run from one moment to another: states, derivative, log."""

    parameters: Parameters
    start: np.ndarray
    start_side: float
    """Wall at which the masses are in contact; 0 in flight."""
    end: np.ndarray
    side: float
    derivative: np.ndarray
    rows: np.ndarray
    trajectory: Trajectory

    @property
    def change(self) -> float:
        return float(abs(self.end - self.start).max())

    def state_after(self, tau: float) -> np.ndarray:
        """State a time after the start."""
        starts = np.cumsum(self.rows[:, DURATION]) - self.rows[:, DURATION]
        index = int(np.searchsorted(starts, tau, "right")) - 1
        x, v, gap, rate = self.trajectory.motion_in(self.rows[index], tau - starts[index])
        side = self.rows[index, SIDE]
        return np.array([x, v, x + side * (self.parameters.clearance - gap), v - side * rate])

    def smallest_gaps(self) -> list[float]:
        """Smallest gap to a wall in each flight, where it is not at the flight's ends."""
        p, found = self.parameters, []
        for row in self.rows[self.rows[:, MODE] == FLIGHT]:
            duration = float(row[DURATION])
            count = 8 + int(32.0 * duration / min(p.period, 2.0 * np.pi))
            times = np.linspace(0.0, duration, count)
            rates = [self.trajectory.motion_in(row, tau)[3] for tau in times]
            for k in range(count - 1):
                if rates[k] * rates[k + 1] < 0.0:
                    rate = partial(lambda row, tau: self.trajectory.motion_in(row, tau)[3], row)
                    tau = zero(rate, times[k], times[k + 1], rates[k], rates[k + 1])
                    gap = self.trajectory.motion_in(row, tau)[2]
                    found.append(gap if rates[k] < 0.0 else 2.0 * p.clearance - gap)
        return found


def pass_over(
    parameters: Parameters, start: np.ndarray, begin: float, end: float, model: Any = None
) -> Pass:
    """Run from one moment to another, both in forcing periods; `model` is that of the parameters.

    Raises
    ------
    ValueError
        Where the state lies outside the box, or the run does not come to its end.
    """
    period = parameters.period
    state = State(*map(float, (*start, begin * period)))
    check_state(parameters, state)
    trajectory = Trajectory(model or model_of(parameters), state)
    side = _side(trajectory, start)
    pieces: list[np.ndarray] = []
    until = float(np.floor(end)), (end - np.floor(end)) * period
    deviations = derivative(trajectory, *until, pieces)
    if trajectory.status != FINISHED:
        raise ValueError("the run used up max_events within a period")
    last = trajectory.state_at(*until)
    after = np.array([last.x, last.v, last.y, last.u])
    rows = np.concatenate(pieces)
    return Pass(
        parameters, start, side, after, _side(trajectory, after), deviations, rows, trajectory
    )


def moving(parameters: Parameters) -> np.ndarray:
    """Components of (x, v, y, u) that take part: not those of a free mass that is a fixed stop."""
    return np.arange(2 if parameters.mass_ratio >= FIXED_STOP else 4)


def _newton(found: Pass, over: Callable[[np.ndarray], Pass]) -> Pass | None:
    """As much of a Newton step as makes the change smaller; None where nothing does."""
    # In contact there are two directions, both masses together.
    basis = np.vstack([np.eye(2), np.eye(2)]) if found.side else np.eye(4)
    basis = basis[:, : len(moving(found.parameters))]
    rows = basis.shape[1]
    left = np.eye(rows) - (found.derivative @ basis)[:rows]
    lacking = (found.end - found.start)[:rows]
    step = basis @ np.linalg.lstsq(left, lacking, rcond=None)[0]
    for halving in range(_HALVINGS):
        start = found.start + 0.5**halving * step
        if abs(start[2] - start[0]) <= found.parameters.clearance * (1.0 + 1e-15):
            passed = over(start)
            if passed.change < found.change:
                return passed
    return None


def _side(trajectory: Trajectory, state: np.ndarray) -> float:
    """Wall of the contact that a state is in; 0 in flight."""
    x, v, y, u = state
    return float(np.sign(y - x)) if u == v and abs(y - x) >= trajectory.model.clearance else 0.0


def _settled(parameters: Parameters, guess: State | None, settle: int) -> np.ndarray:
    """State at the start of a forcing period: the first one after the guess, or of a long run."""
    need_state(guess)
    trajectory = start_run(parameters, guess)
    at = float(settle) if guess is None else trajectory.start[0] + (trajectory.start[1] > 0.0)
    trajectory.skip(at)
    state = trajectory.state_at(at)
    return np.array([state.x, state.v, state.y, state.u])


def zero(
    function: Callable[[float], float], low: float, high: float, f_low: float, f_high: float
) -> float:
    """Where a function changes its sign, by the Illinois method; NaN where it is not a number."""
    for _ in range(100):
        middle = (low * f_high - high * f_low) / (f_high - f_low)
        value = function(middle)
        if value == 0.0 or min(abs(middle - high), abs(middle - low)) < 1e-14 or value != value:
            return middle
        if value * f_high < 0.0:
            low, f_low = high, f_high
        else:
            f_low *= 0.5
        high, f_high = middle, value
    return middle


def check(parameters: Parameters, period: int) -> None:
    """Refuse what is not followed."""
    if not isinstance(parameters, Parameters):
        raise TypeError(f"parameters = {parameters!r}: must be damper.Parameters")
    if parameters.model == "compliant":
        raise ValueError("deviations are not followed through compliant contact")
    order = parameters.modulation_order if parameters.model == "time_varying" else 1
    if period % order:
        raise ValueError(f"period = {period}: must be a multiple of modulation_order = {order}")

"""Runs from one moment to another, with the derivative of the end by the start."""

from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from typing import Any

import numpy as np

from damper.engine.forcing import rate_of
from damper.engine.loop import FINISHED
from damper.engine.segment import DURATION, FLIGHT, GAP, GAP_RATE, MODE, SIDE, V, X
from damper.engine.trajectory import Trajectory
from damper.models import check_state, model_of
from damper.models.sensitivity import Stencil, follow_change
from damper.models.tangent import derivative
from damper.parameters import Parameters, State

#: Mass ratio from which on the free mass is a fixed stop: an impact changes its velocity by less
#: than `TOLERANCE`. Its place is given, and two multipliers that are 1 are left out.
FIXED_STOP = 1e12


@dataclass(frozen=True)
class Arc:
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

    @property
    def directions(self) -> np.ndarray:
        """Deviations of the start, a column each: in contact those of both masses together."""
        basis = np.vstack([np.eye(2), np.eye(2)]) if self.start_side else np.eye(4)
        return basis[:, : len(moving(self.parameters))]

    @property
    def fixed_point_matrix(self) -> np.ndarray:
        """One less the derivative, for these: singular where a multiplier is 1."""
        basis = self.directions
        rows = basis.shape[1]
        return np.eye(rows) - (self.derivative @ basis)[:rows]

    def change_by(self, stencil: Stencil, of_start: np.ndarray) -> np.ndarray:
        """Derivative of the end by a parameter, from that of the start."""
        change = of_start[:, None].copy()
        follow_change(self.trajectory.model, stencil, self.rows, change, False)
        return change[:, 0]

    def state_after(self, tau: float) -> np.ndarray:
        """State a time after the start."""
        starts = np.cumsum(self.rows[:, DURATION]) - self.rows[:, DURATION]
        index = int(np.searchsorted(starts, tau, "right")) - 1
        x, v, gap, rate = self.trajectory.motion_in(self.rows[index], tau - starts[index])
        side = self.rows[index, SIDE]
        return np.array([x, v, x + side * (self.parameters.clearance - gap), v - side * rate])

    def peak(self) -> tuple[float, float]:
        """Time of the primary's largest displacement, either way, and that displacement."""
        best, begin = (0.0, float(self.start[0])), 0.0
        steps = 32.0 * max(rate_of(self.trajectory.model.free.forcing), 1.0) / (2.0 * np.pi)
        for row in self.rows[self.rows[:, DURATION] > 0.0]:
            duration = float(row[DURATION])
            times = np.linspace(0.0, duration, 8 + int(steps * duration))
            speed = partial(lambda row, tau: self.trajectory.motion_in(row, tau)[1], row)
            v = self.trajectory.motions_in(row, times)[:, 1]
            turns = np.flatnonzero(v[:-1] * v[1:] < 0.0)
            at = [zero(speed, times[k], times[k + 1], v[k], v[k + 1]) for k in turns]
            for tau in (*at, duration):
                x = self.trajectory.motion_in(row, tau)[0]
                best = max(best, (begin + tau, x), key=lambda each: abs(each[1]))
            begin += duration
        return best

    def smallest_gaps(self) -> list[float]:
        """Smallest gap to a wall in each flight, where it is not at the flight's ends."""
        p, found = self.parameters, []
        fastest = max(rate_of(self.trajectory.model.free.forcing), 1.0)
        # A flight may begin below the surface of a compliant wall.
        flights = (self.rows[:, MODE] == FLIGHT) & (self.rows[:, GAP] >= 0.0)
        for row in self.rows[flights & (self.rows[:, DURATION] > 0.0)]:
            duration = float(row[DURATION])
            count = 8 + int(32.0 * duration / (2.0 * np.pi / fastest))
            # After a slow impact the gap turns soon: not before this part of the flight.
            soon = 0.1 * row[GAP_RATE] / (1.0 + abs(row[X]) + abs(row[V])) / duration
            soon = min(max(soon, 1e-9), 1.0)
            early = duration * np.geomspace(soon, 1.0, 2 - int(4.0 * np.log(soon)))
            times = np.union1d(np.linspace(0.0, duration, count), early)
            rates = self.trajectory.motions_in(row, times)[:, 3]
            for k in np.flatnonzero(rates[:-1] * rates[1:] < 0.0):
                rate = partial(lambda row, tau: self.trajectory.motion_in(row, tau)[3], row)
                tau = zero(rate, times[k], times[k + 1], rates[k], rates[k + 1])
                gap = self.trajectory.motion_in(row, tau)[2]
                found.append(gap if rates[k] < 0.0 else 2.0 * p.clearance - gap)
        return found


def run_arc(
    parameters: Parameters, start: np.ndarray, begin: float, end: float, model: Any = None
) -> Arc:
    """Run from one moment to another, both in forcing periods; `model` is that of the parameters.

    Raises
    ------
    ValueError
        Where the state lies outside the box, or the run does not come to its end.
    """
    period = parameters.cycle
    state = State(*map(float, (*start, begin * period)))
    check_state(parameters, state)
    trajectory = Trajectory(model or model_of(parameters), state)
    side = _side(parameters, start)
    pieces: list[np.ndarray] = []
    until = float(np.floor(end)), (end - np.floor(end)) * period
    deviations = derivative(trajectory, *until, pieces)
    if trajectory.status != FINISHED:
        raise ValueError("the run used up max_events within a period")
    last = trajectory.state_at(*until)
    after = vector(last)
    rows = np.concatenate(pieces)
    return Arc(
        parameters, start, side, after, _side(parameters, after), deviations, rows, trajectory
    )


def vector(state: State) -> np.ndarray:
    """(x, v, y, u) of a state."""
    return np.array([state.x, state.v, state.y, state.u])


def moving(parameters: Parameters) -> np.ndarray:
    """Components of (x, v, y, u) that take part: not those of a free mass that is a fixed stop."""
    return np.arange(2 if parameters.mass_ratio >= FIXED_STOP else 4)


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


def _side(parameters: Parameters, state: np.ndarray) -> float:
    """Wall at which a state's masses have joined; 0 where they have not."""
    x, v, y, u = state
    joined = u == v and abs(y - x) >= parameters.clearance and parameters.model != "compliant"
    return float(np.sign(y - x)) if joined else 0.0

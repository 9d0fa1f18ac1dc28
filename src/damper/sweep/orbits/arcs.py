"""Runs from one moment to another, with the derivative of the end by the start."""

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property, partial
from typing import Any

import numpy as np

from damper.engine.forcing import rate_of
from damper.engine.loop import FINISHED
from damper.engine.model import log_of_mass
from damper.engine.segment import (
    CAUSE,
    DURATION,
    FLIGHT,
    GAP,
    GAP_RATE,
    MODE,
    REST,
    REVERSAL,
    SIDE,
    V,
    X,
)
from damper.engine.trajectory import Trajectory
from damper.models import check_state, model_of
from damper.models.sensitivity import Stencil, follow_change
from damper.models.tangent import derivative, fastest_of, of_state, require_bounded, to_state
from damper.models.walls import TOUCHES, slack
from damper.parameters import Parameters, State

#: In place of a wall: dry friction holds the free mass off the walls.
RESTS = 2.0


@dataclass(frozen=True)
class Arc:
    """A run from one moment to another: states, derivative, log."""

    parameters: Parameters
    start: np.ndarray
    start_sides: np.ndarray
    """Wall at which each free mass is in contact; `RESTS` off the walls; 0 in flight."""
    end: np.ndarray
    sides: np.ndarray
    derivative: np.ndarray
    rows: np.ndarray
    trajectory: Trajectory

    @property
    def change(self) -> float:
        return float(abs(self.end - self.start).max())

    @property
    def directions(self) -> np.ndarray:
        """Deviations of the start, a column each: what moves together does so."""
        found = (self.leaders[:, None] == self.own).astype(float)
        if self.parameters.model == "structure":
            first, boxes = first_mass(self.parameters), boxes_of(self.parameters)
            for k in np.flatnonzero(self.start_sides):
                # Off the walls a mass keeps its place.
                for of_rate in (1,) if self.start_sides[k] == RESTS else (0, 1):
                    found[first + 2 * k + of_rate, of_rate:first:2] = boxes[k]
        return found

    @cached_property
    def leaders(self) -> np.ndarray:
        """As `leaders`; in contact a free mass moves with the primary, at rest at its velocity.

        On a structure it moves with its box, which is no single component: -1.
        """
        found, first = leaders(self.parameters, self.start), first_mass(self.parameters)
        on_structure = self.parameters.model == "structure"
        for k in np.flatnonzero(self.start_sides):
            found[first + 1 + 2 * k] = -1 if on_structure else 1
            if self.start_sides[k] != RESTS:
                found[first + 2 * k] = -1 if on_structure else 0
        return found

    @property
    def own(self) -> np.ndarray:
        """Components that these deviations move by themselves."""
        return np.unique(self.leaders[self.leaders >= 0])

    @property
    def fixed_point_matrix(self) -> np.ndarray:
        """One less the derivative, for these: singular where a multiplier is 1."""
        return np.eye(len(self.own)) - (self.derivative @ self.directions)[self.own]

    def change_by(self, stencil: Stencil, of_start: np.ndarray) -> np.ndarray:
        """Derivative of the end by a parameter, from that of the start.

        Raises
        ------
        ValueError
            As `derivative`; deviations of the start alone may have one where this has none.
        """
        model = self.trajectory.model
        change = of_state(model, of_start[:, None].copy())
        follow_change(model, stencil, self.rows, change, False)
        require_bounded(model, change)
        return to_state(model, change)[:, 0]

    def state_after(self, tau: float) -> np.ndarray:
        """State a time after the start."""
        starts = np.cumsum(self.rows[:, DURATION]) - self.rows[:, DURATION]
        index = int(np.searchsorted(starts, tau, "right")) - 1
        return components(*self.trajectory.state_in(self.rows[index], tau - starts[index]))

    def peak(self) -> tuple[float, float]:
        """Time of the primary's largest displacement, either way, and that displacement.

        Of a structure it is that of the box of the first free mass.
        """
        best, begin = (0.0, float(self.watched @ self.start)), 0.0
        steps = 32.0 * self.fastest / (2.0 * np.pi)
        rows = log_of_mass(self.trajectory.model, self.rows, 0)
        for row in rows[rows[:, DURATION] > 0.0]:
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

    @property
    def watched(self) -> np.ndarray:
        """Weights of the components of a state in the displacement of which `peak` speaks."""
        found = np.zeros(len(self.start))
        found[: first_mass(self.parameters) : 2] = boxes_of(self.parameters)[0]
        return found

    @property
    def fastest(self) -> float:
        """A rate of the motion between events, at least 1."""
        rate = max(rate_of(self.trajectory.model.free.forcing), 1.0)
        return max(rate, fastest_of(self.trajectory.model))

    def smallest_gaps(self, number: int) -> list[float]:
        """Smallest gap of a free mass in each flight, not at its ends but where friction stops it.

        The mass is given by its number.
        """
        rows = log_of_mass(self.trajectory.model, self.rows, number)
        clearance, found, fastest = self.parameters.each[number].clearance, [], self.fastest
        before, last = rows[0], rows[0]
        for row in rows[1:]:
            # Events of one instant begin a row each.
            before, last = (last if last[DURATION] > 0.0 else before), row
            if row[CAUSE] in (REST, REVERSAL):
                came, at = (each[SIDE] * (clearance - each[GAP]) for each in (before, row))
                found.append(clearance - at if at > came else clearance + at)
        # A flight may begin below the surface of a compliant wall.
        flights = (rows[:, MODE] == FLIGHT) & (rows[:, GAP] >= 0.0)
        for row in rows[flights & (rows[:, DURATION] > 0.0)]:
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
                found.append(gap if rates[k] < 0.0 else 2.0 * clearance - gap)
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
    state = state_of(start, begin * period, first_mass(parameters) // 2)
    check_state(parameters, state)
    trajectory = Trajectory(model or model_of(parameters), state)
    sides = _sides(parameters, start)
    pieces: list[np.ndarray] = []
    until = float(np.floor(end)), (end - np.floor(end)) * period
    deviations = derivative(trajectory, *until, pieces)
    if trajectory.status != FINISHED:
        raise ValueError("the run used up max_events within a period")
    after = vector(trajectory.state_at(*until))
    rows = np.concatenate(pieces)
    return Arc(
        parameters, start, sides, after, _sides(parameters, after), deviations, rows, trajectory
    )


def vector(state: State) -> np.ndarray:
    """(x, v, y, u) of a state; of several free masses (x, v, y0, u0, y1, u1, ...).

    Of a structure first each coordinate and its velocity, x0, v0, x1, v1, ...
    """
    return components(state.x, state.v, state.y, state.u)


def components(x: Any, v: Any, y: Any, u: Any) -> np.ndarray:
    """As `vector`."""
    found = np.empty(2 * (np.size(x) + np.size(y)))
    found[::2], found[1::2] = np.append(x, y), np.append(v, u)
    return found


def state_of(vector: np.ndarray, time: float = 0.0, coordinates: int = 1) -> State:
    """The state of which this is the vector."""
    places, rates = vector[::2].tolist(), vector[1::2].tolist()

    def part(values: list[float], of_structure: bool) -> Any:
        return values if len(values) > 1 or of_structure else values[0]

    n, on = coordinates, coordinates > 1
    x, v = part(places[:n], on), part(rates[:n], on)
    return State(x, v, part(places[n:], False), part(rates[n:], False), time)


def first_mass(parameters: Any) -> int:
    """Number of the state's component that is the displacement of the first free mass."""
    return 2 * len(parameters.structure.mass) if parameters.model == "structure" else 2


def boxes_of(parameters: Any) -> np.ndarray:
    """Displacement of each free mass's box in a unit displacement of each coordinate."""
    if parameters.model != "structure":
        return np.ones((len(parameters.each), 1))
    return np.array([parameters.structure.boxes[one.box] for one in parameters.each])


def base_shares_of(parameters: Any) -> list[float]:
    """Displacement of each free mass's box in a unit displacement of the base."""
    if parameters.model != "structure":
        return [1.0] * len(parameters.each)
    return [parameters.structure.base_shares[one.box] for one in parameters.each]


def leaders(parameters: Parameters, start: np.ndarray) -> np.ndarray:
    """For each component of a state the number of the one that it moves with.

    Its own but in masses in step, which stay so; -1 for those of a fixed stop and of a
    prescribed box: they are given.
    """
    found = np.arange(len(start))
    if "several" not in parameters.features:
        if parameters.hits_stop:
            found[2:] = -1
        if "prescribed" in parameters.features:
            found[:2] = -1
        return found
    first: dict[Any, int] = {}
    for k, one in enumerate(parameters.each):
        # A support moves a mass by its ratio to that; without mass there is no support.
        ratio = one.mass_ratio or 1.0
        supports = one.support_stiffness_ratio / ratio, one.support_damping_ratio / ratio
        walls = one.clearance, one.tables, one.yield_speed, one.yield_exponent
        of_mass = *walls, *supports, one.pull, one.friction
        alike = *of_mass, *start[2 + 2 * k : 4 + 2 * k]
        leader = first.setdefault(alike, k)
        found[2 + 2 * k : 4 + 2 * k] = 2 + 2 * leader, 3 + 2 * leader
    return found


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


def _sides(parameters: Parameters, state: np.ndarray) -> np.ndarray:
    """Wall at which each free mass has joined the primary; `RESTS` off them; 0 where it has not."""
    sides = np.zeros(len(parameters.each))
    if parameters.model == "compliant":
        return sides
    first, values, roundoff = first_mass(parameters), state.tolist(), 0.0
    x, v, *_ = values
    boxes = boxes_of(parameters) if parameters.model == "structure" else None
    for k, (one, y, u) in enumerate(
        zip(parameters.each, values[first::2], values[first + 1 :: 2], strict=True)
    ):
        if boxes is not None:
            x, v = boxes[k] @ state[:first:2], boxes[k] @ state[1:first:2]
            # The velocity of a box is a sum, which has roundoff.
            roundoff = TOUCHES * (abs(boxes[k]) @ abs(state[1:first:2]))
        if abs(u - v) <= roundoff:
            side = getattr(one, "walls", 0.0) or float(np.sign(y - x))
            if one.clearance - side * (y - x) <= slack(one.clearance, x, y):
                sides[k] = side
            elif one.friction:
                sides[k] = RESTS
    return sides

"""Exact motion of a run at any time, and its derivatives by unknown quantities.

Motion and derivatives come from the engine, the derivatives at Chebyshev points between the events
of a run. The polynomials through these points stand for them in between, to some 1e-10 of their
size; accelerations and their derivatives are slopes of polynomials of velocities.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Collection, Mapping, Sequence
from dataclasses import dataclass, field
from functools import cache, cached_property
from itertools import pairwise
from typing import Any, NamedTuple

import numpy as np
from numpy.polynomial import chebyshev

from damper.engine.forcing import rate_of
from damper.engine.loop import FINISHED
from damper.engine.segment import (
    CAUSE,
    COLUMNS,
    DURATION,
    IMPACT,
    PERIODS,
    SIDE,
    SPEED,
    TIME,
)
from damper.engine.trajectory import Trajectory
from damper.models import check_state
from damper.models.sensitivity import Stencil, follow_change, model_along, neighbours
from damper.models.tangent import follow, require_bounded
from damper.parameters import Parameters, SIParameters, State
from damper.parameters.named import rates_of, value_of
from damper.parameters.quantities import ALL, INITIAL_NAMES
from damper.parameters.units import LENGTH, SI_UNITS
from damper.parameters.units import SPEED as SPEED_UNIT
from damper.sweep.orbits.arcs import vector, zero

#: Longest piece between two polynomials, in units of the fastest rate of the motion.
_PIECE = 12.0
#: Points of a piece, the fewest, and how many more for each unit of its length: for 1e-9 of the
#: motion's size.
_FEWEST, _MORE = 8, 1.2
#: Part of a flight, or of the longest piece, between the velocities whose slope is an acceleration
#: without derivatives, their places, and the matrix from them to their polynomial's coefficients.
_LITTLE, _AROUND = 1e-3, np.arange(-2.0, 3.0)
_QUARTIC = np.linalg.inv(np.vander(_AROUND, increasing=True))
#: Events of a run at most: beyond these no record has an impact.
_MOST_EVENTS = 20_000


class Direction(NamedTuple):
    """Effect of a small change of an unknown: on the start, and along the run."""

    start: np.ndarray
    """Change of the dimensionless state at the start."""
    stencil: Stencil | None = None
    length: float = 0.0
    """Change of the unit of length over that unit, and below of speed and of the cycle."""
    speed: float = 0.0
    cycle: float = 0.0


def direction_of(parameters: Parameters | SIParameters, state: State, name: str) -> Direction:
    """Direction of a quantity of the damper, or of its start.

    Parameters
    ----------
    parameters : Parameters or SIParameters
    state : State
        Dimensionless start. In the units of the parameters it stays, and so does the free mass's
        place between the walls.
    name : str

    Raises
    ------
    ValueError
        Where the engine has no derivative by this quantity.
    """
    start, units, damper = vector(state), parameters.units, parameters.dimensionless
    if name in INITIAL_NAMES:
        change = np.zeros_like(start)
        moved = [one.clearance for one in damper.each]
        if name != "initial_position":
            moved = [1.0 / units.size(ALL[name].units)]
        # The primary moves all.
        change[INITIAL_NAMES.index(name) :: 2] = moved
        return Direction(change)
    rates = rates_of(parameters, name)
    scaled = {n: rate for n, rate in rates.items() if n not in SI_UNITS}
    length = rates.get(LENGTH, 0.0) / units.length
    speed = rates.get(SPEED_UNIT, 0.0) / units.speed
    cycle = 0.0
    if name in ("frequency_ratio", "forcing_frequency"):
        cycle = -1.0 / value_of(parameters, name)
        if state.time:
            raise ValueError(f"{name}: no derivative, as the run does not begin at time 0")
    stencil = neighbours(damper, scaled) if scaled else None
    places = (start[2::2] - start[0]) / [one.clearance for one in damper.each]
    change = np.empty_like(start)
    change[0], change[1] = -length * start[0], -speed * start[1]
    change[2::2] = change[0] + places * (stencil.clearance if stencil else 0.0)
    change[3::2] = -speed * start[3::2]
    return Direction(change, stencil, length, speed, cycle)


@dataclass(frozen=True)
class Piece:
    """A stretch without an event."""

    begin: float
    end: float
    count: int
    """Of Chebyshev points of time, at which polynomials through them are as good as the motion."""
    moving: Callable[[np.ndarray], np.ndarray]
    """Displacement and velocity, shape (n, 2), at n times."""
    changes: np.ndarray
    """Their derivatives by each direction at these points, shape (count, 2, directions)."""
    later: np.ndarray | None
    """Derivatives of its start, where an impact begins it."""

    def at(self, times: np.ndarray, order: int) -> tuple[np.ndarray, np.ndarray]:
        """As `ComputedMotion.at`, within it; without derivatives no acceleration."""
        if not self.changes.size:
            return self.moving(times)[:, order], np.empty((len(times), 0))
        which = min(order, 1)
        weights = _between((2.0 * times - self.begin - self.end) / self.length, self.count)
        if order == 2:
            weights = weights @ _slopes(self.count) * (2.0 / self.length)
        return weights @ self.motion[:, which], weights @ self.changes[:, which]

    @property
    def length(self) -> float:
        """Its duration."""
        return self.end - self.begin

    @cached_property
    def times(self) -> np.ndarray:
        """Its Chebyshev points."""
        return self.begin + self.length * (0.5 + 0.5 * _points(self.count))

    @cached_property
    def motion(self) -> np.ndarray:
        """Displacement and velocity at these."""
        return self.moving(self.times)

    @property
    def turns(self) -> list[float]:
        """Times within it at which the velocity vanishes."""
        v = self.motion[:, 1]
        found = np.flatnonzero(v[:-1] * v[1:] < 0.0)

        def rate(time: float) -> float:
            return float(self.moving(np.array([time]))[0, 1])

        return [zero(rate, *self.times[k : k + 2], *v[k : k + 2]) for k in found]


@dataclass
class ComputedMotion:
    """A run from its start to a time: pieces and impacts, in the units of its parameters."""

    pieces: list[Piece] = field(default_factory=list)
    impacts: list[tuple[float, float, float]] = field(default_factory=list)
    """Time, side and approach speed of each."""
    later: list[np.ndarray] = field(default_factory=list)
    """Derivatives of these times by each direction."""

    @property
    def count(self) -> int:
        """Of directions, where there are pieces."""
        return self.pieces[0].changes.shape[2] if self.pieces else 0

    def at(self, times: np.ndarray, order: int = 0) -> tuple[np.ndarray, np.ndarray]:
        """Displacement, velocity or acceleration (order 0, 1, 2), and their derivatives.

        The times increase.
        """
        values, changes = np.empty(len(times)), np.empty((len(times), self.count))
        ends = [piece.end for piece in self.pieces[:-1]]
        cuts = [0, *np.searchsorted(times, ends, "right").tolist(), len(times)]
        for piece, begin, end in zip(self.pieces, cuts, cuts[1:], strict=False):
            if begin < end:
                values[begin:end], changes[begin:end] = piece.at(times[begin:end], order)
        return values, changes

    def peaks(self) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Times of the extremes of the displacement, extremes, and their derivatives."""
        times, values, changes = [], [], []
        before = None
        for piece in self.pieces:
            v = piece.motion[0, 1]
            # At rest at the start, or turned round by an impact.
            struck = before is not None and before.motion[-1, 1] * v < 0.0
            if struck or (before is None and v == 0.0):
                times.append(piece.begin)
                values.append(piece.motion[0, 0])
                moved = 0.0 if piece.later is None else v * piece.later
                changes.append(piece.changes[0, 0] + moved)
            for time in piece.turns:
                (value,), (change,) = piece.at(np.array([time]), 0)
                times.append(time)
                values.append(value)
                changes.append(change)
            before = piece
        return np.array(times), np.array(values), np.reshape(changes, (len(times), self.count))


class _Plain(ComputedMotion):
    """A run without derivatives: its samples are the engine's, and pieces are for peaks alone."""

    count = 0

    def __init__(self, walk: _Walk, rows: np.ndarray) -> None:
        self.walk, self.log = walk, rows
        self.rows = rows[rows[:, DURATION] > 0.0]
        self.begins = self._begins(self.rows)

    def _begins(self, rows: np.ndarray) -> np.ndarray:
        """Times at which rows begin."""
        return rows[:, PERIODS] * self.walk.trajectory.cycle + rows[:, TIME]  # type: ignore[no-any-return]

    @cached_property
    def impacts(self) -> list[tuple[float, float, float]]:  # type: ignore[override]
        """Time, side and approach speed of each."""
        units, hits = self.walk.units, self.log[1:]
        hits = hits[hits[:, CAUSE] == IMPACT]
        found = units.time * self._begins(hits), hits[:, SIDE], units.speed * hits[:, SPEED]
        return list(zip(*(column.tolist() for column in found), strict=True))

    @cached_property
    def later(self) -> list[np.ndarray]:  # type: ignore[override]
        """No derivatives of them."""
        return [np.empty(0)] * len(self.impacts)

    @cached_property
    def pieces(self) -> list[Piece]:  # type: ignore[override]
        """Its stretches without an event."""
        for row in self.rows:
            self.walk.take(row, True)
        return self.walk.motion.pieces

    def at(self, times: np.ndarray, order: int = 0) -> tuple[np.ndarray, np.ndarray]:
        """As that of a run with derivatives."""
        unit, durations = self.walk.units.time, self.rows[:, DURATION]
        times = times / unit
        which = np.searchsorted(self.begins[1:], times, "left")
        taus = times - self.begins[which]
        if order < 2:
            found = self._velocities(which, taus)[:, order]
        else:
            # Slope of the polynomial of the fourth degree through five velocities around each time.
            little = _LITTLE * np.minimum(durations, _PIECE / self.walk.rate)[which]
            middles = np.clip(taus, 2.0 * little, durations[which] - 2.0 * little)
            around = (middles[:, None] + little[:, None] * _AROUND).ravel()
            velocities = self._velocities(np.repeat(which, 5), around)[:, 1].reshape(-1, 5)
            _, first, second, third, fourth = _QUARTIC @ velocities.T
            place = (taus - middles) / little
            slopes = first + place * (2.0 * second + place * (3.0 * third + 4.0 * place * fourth))
            found = slopes / (little * unit)
        return found, np.empty((len(times), 0))

    def _velocities(self, which: np.ndarray, taus: np.ndarray) -> np.ndarray:
        """Displacement and velocity at times after the start of rows."""
        units = self.walk.units
        found = self.walk.trajectory.motions_in(self.rows, taus, which)[:, :2]
        return found * [units.length, units.speed]


def run_motion(
    parameters: Parameters | SIParameters,
    state: State,
    until: float,
    directions: Mapping[str, Direction],
    sampled: bool = True,
    names: Collection[str] = (),
) -> ComputedMotion:
    """Run a damper with what small changes of unknowns do to its motion.

    Parameters
    ----------
    parameters : Parameters or SIParameters
    state : State
        Dimensionless start.
    until : float
        Time to which it runs, in the units of the parameters.
    directions : mapping of str to Direction
        By the names of the unknowns.
    sampled : bool, default True
        Whether the displacement is asked for, and not the impacts alone.
    names : collection of str, default ()
        Unknowns of the fit: its runs are all of one model, with or without directions.

    Raises
    ------
    ValueError
        For a start outside the box, too many events, or where there is no derivative.
    """
    damper = parameters.dimensionless
    check_state(damper, state)
    trajectory = Trajectory(model_along(damper, names or directions), state, _MOST_EVENTS)
    end = trajectory.whole_periods(until / parameters.units.time)
    rows = np.concatenate([piece.copy() for piece in trajectory.segments(*end)])
    if trajectory.status != FINISHED:
        raise ValueError(f"more than {_MOST_EVENTS} events until {until:g}")
    walk = _Walk(parameters, trajectory, tuple(directions.values()))
    if not directions:
        return _Plain(walk, rows)
    for row in rows:
        walk.take(row, sampled)
    require_bounded(trajectory.model, walk.changes)
    return walk.motion


class _Walk:
    """Goes along the log of a run, from event to event."""

    def __init__(
        self,
        parameters: Parameters | SIParameters,
        trajectory: Trajectory,
        directions: Sequence[Direction],
    ) -> None:
        self.units, self.model = parameters.units, trajectory.model
        self.trajectory, self.directions = trajectory, directions
        self.several = trajectory.columns > COLUMNS
        self.changes = np.column_stack([d.start for d in directions] or [np.empty((0, 0))])
        rate = max(1.0, float(rate_of(self.model.free.forcing)))
        self.rate = max(rate, 2.0 * parameters.dimensionless.damping_ratio)
        self.length = np.array([d.length for d in directions])
        self.speed = np.array([d.speed for d in directions])
        self.cycle = np.array([d.cycle for d in directions])
        self.begun, self.motion = False, ComputedMotion()

    def take(self, row: np.ndarray, sampled: bool) -> None:
        """Take changes over a row of the log, and note its motion."""
        time = (row[PERIODS] * self.trajectory.cycle + row[TIME]) * self.units.time
        later = None
        if self.begun and row[CAUSE] == IMPACT:
            later = self._later(row) + self.cycle * time if self.directions else np.empty(0)
            self.motion.impacts.append((time, row[SIDE], row[SPEED] * self.units.speed))
            self.motion.later.append(later)
        duration = float(row[DURATION])
        pieces = math.ceil(duration * self.rate / _PIECE) if sampled else 0
        ends = [duration * k / pieces for k in range(1, pieces + 1)]
        for low, high in pairwise([0.0, *ends]):
            self._note(time, row, low, high, later)
            later = None
        if self.directions:
            self.changes = self._over(row, np.array([duration]))[0]
        self.begun = True

    def _later(self, row: np.ndarray) -> np.ndarray:
        """Derivatives of the time of the impact that begins a row."""
        body = int(row[COLUMNS]) if self.several else 0
        y = self.changes[2 + 2 * body]
        moved = np.array(
            [
                np.atleast_1d(d.stencil.clearance)[body] if d.stencil else 0.0
                for d in self.directions
            ]
        )
        late = (row[SIDE] * (self.changes[0] - y) + moved) / row[SPEED]
        return self.units.time * late  # type: ignore[no-any-return]

    def _over(self, row: np.ndarray, taus: np.ndarray) -> np.ndarray:
        """Changes at times after the start of a row: shape (times, components, directions)."""
        found = np.tile(self.changes, (len(taus), 1, 1))
        part = row[None].copy()
        for j, direction in enumerate(self.directions):
            for change, tau in zip(found, taus.tolist(), strict=True):
                part[0, DURATION] = tau
                column = change[:, j : j + 1].copy()
                if direction.stencil is None:
                    follow(self.model, part, column, self.begun)
                else:
                    follow_change(self.model, direction.stencil, part, column, self.begun)
                change[:, j : j + 1] = column
        return found

    def _note(self, time: float, row: np.ndarray, low: float, high: float, later: Any) -> None:
        """Note displacement and velocity over a piece of a row, at times and not phases."""
        unit, sizes = self.units.time, np.array([self.units.length, self.units.speed])

        def moving(times: np.ndarray) -> np.ndarray:
            return sizes * self.trajectory.motions_in(row, (times - time) / unit)[:, :2]  # type: ignore[no-any-return]

        count = _FEWEST + int(_MORE * (high - low) * self.rate)
        changes = np.empty((count, 2, len(self.directions)))
        piece = Piece(time + unit * low, time + unit * high, count, moving, changes, later)
        self.motion.pieces.append(piece)
        if self.directions:
            relative = np.array([self.length, self.speed])
            changes[:] = self._over(row, (piece.times - time) / unit)[:, :2]
            changes[:] = sizes[:, None] * changes + piece.motion[:, :, None] * relative
        if self.cycle.any():
            # The same phase is at another time.
            rates = _slopes(count) @ piece.motion * (2.0 / piece.length)
            changes -= rates[:, :, None] * piece.times[:, None, None] * self.cycle


def _between(places: np.ndarray, count: int) -> np.ndarray:
    """Matrix from values at the points to values at places from -1 to 1."""
    angles = np.arccos(np.clip(places, -1.0, 1.0))
    return np.cos(angles[:, None] * np.arange(count)) @ _fitting(count)  # type: ignore[no-any-return]


@cache
def _points(count: int) -> np.ndarray:
    """Chebyshev points from -1 to 1."""
    return -np.cos(math.pi * np.arange(count) / (count - 1))


@cache
def _fitting(count: int) -> np.ndarray:
    """Matrix from values at the points to coefficients."""
    return np.linalg.inv(chebyshev.chebvander(_points(count), count - 1))


@cache
def _slopes(count: int) -> np.ndarray:
    """Matrix from values at the points to slopes there."""
    slopes = chebyshev.chebder(_fitting(count), axis=0)
    return chebyshev.chebvander(_points(count), count - 2) @ slopes

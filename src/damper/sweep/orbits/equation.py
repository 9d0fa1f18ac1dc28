"""The equation of a branch's orbits, and the corrector that solves it.

The unknowns are the states at some moments of the period, each in a flight, and the parameter.
Pseudo-arclength continuation follows the curve on which runs from moment to moment join (Keller,
Applications of Bifurcation Theory, 1977, 359-384): a step along the tangent, then Newton's method
at right angles to it. Derivatives by states and parameter come with the runs: docs/orbits.md.
"""

from collections.abc import Iterable
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

import numpy as np

from damper.engine.bodies import body_at
from damper.engine.forcing import phase_at
from damper.engine.model import log_of_mass
from damper.engine.oscillator import oscillator
from damper.engine.segment import (
    CAUSE,
    COLUMNS,
    DURATION,
    FLIGHT,
    IMPACT,
    MODE,
    NOTHING,
    SIDE,
    SPEED,
)
from damper.models.forces import drive_of
from damper.models.sensitivity import model_along, neighbours
from damper.parameters import Parameters, SIParameters
from damper.parameters.named import rates_of, value_of, with_values
from damper.parameters.units import SI_UNITS
from damper.sweep.orbits.arcs import Arc, base_shares_of, first_mass, leaders, run_arc
from damper.sweep.orbits.periodic import TOLERANCE, PeriodicOrbit, nearest_orbit
from damper.sweep.orbits.word import WallImpacts, bursts_of, stops_in

#: Newton steps at right angles to the tangent, and halvings of one.
_STEPS, _HALVINGS = 8, 3
#: Least residual that roundoff allows, over the size of the state.
_ROUNDOFF = 1e-15
#: Most moments of a period at which states are unknowns, and the smallest part of its flight that
#: lies before and after one.
_MOMENTS, MARGIN = 8, 0.1


@dataclass(frozen=True)
class OrbitEquation:
    """The equation of the branch: from one moment of the period to the next, runs must join.

    The unknowns are the components of the states at these moments that move, over their size, and
    the place on a line of parameters, from `low` to `low + span`.
    """

    base: Parameters | SIParameters
    names: tuple[str, ...]
    low: np.ndarray
    span: np.ndarray
    period: int
    state: np.ndarray
    """A state on the branch: its size, and the components that do not move."""
    moments: np.ndarray
    """In forcing periods."""
    idle: tuple[int, ...] = ()
    """Free masses whose places are no unknowns: with them no solution is the only one."""

    @cached_property
    def leaders(self) -> np.ndarray:
        """As `damper.sweep.orbits.arcs.leaders`, and -1 for what is `given`."""
        found = leaders(self.base.dimensionless, self.state)
        found[self.given] = -1
        return found

    @property
    def given(self) -> list[int]:
        """Places of idle masses, and their velocities without friction."""
        p = self.base.dimensionless
        each, first = p.each, first_mass(p)
        return [first + 2 * k + n for k in self.idle for n in range(1 if each[k].friction else 2)]

    @cached_property
    def moving(self) -> np.ndarray:
        """Components that are unknown."""
        return np.unique(self.leaders[self.leaders >= 0])

    def of_moving(self, matrix: np.ndarray) -> np.ndarray:
        """Return a derivative restricted to the unknowns, including the components that follow
        them."""
        return (matrix @ (self.leaders[:, None] == self.moving))[self.moving]

    @cached_property
    def size(self) -> float:
        largest = float(abs(self.state[self.moving]).max()) or 1.0
        return largest * len(self.moments) ** 0.5

    def at(self, states: np.ndarray, value: float) -> np.ndarray:
        """Unknowns of states at the moments and a place on the line."""
        return np.append(states[:, self.moving].ravel() / self.size, value)

    def over(self, at: np.ndarray) -> "PeriodMap | None":
        """Run from each moment to the next; None where there is no such run."""
        starts = np.tile(self.state, (len(self.moments), 1))
        unknowns = self.size * at[:-1].reshape(len(starts), -1)
        moves = self.leaders >= 0
        starts[:, moves] = unknowns[:, np.searchsorted(self.moving, self.leaders[moves])]
        moments = [*self.moments, self.moments[0] + self.period]
        try:
            values: list[Any] = (self.low + self.span * at[-1]).tolist()
            p = with_values(self.base, dict(zip(self.names, values, strict=True)))
            moved = {name for along in self.names for name in rates_of(p, along)}
            model = model_along(p.dimensionless, moved)
            starts[0] = self.without_drift(p.dimensionless, starts[0])
            arcs: list[Arc] = []
            for k, start in enumerate(starts):
                if arcs:
                    start[self.given] = arcs[-1].end[self.given]
                arcs.append(run_arc(p.dimensionless, start, moments[k], moments[k + 1], model))
            found = PeriodMap(self, p, arcs)
            # Asked here: a place without a derivative is no point of a branch.
            found.jacobian  # noqa: B018
            if found.hits_idle:
                return None
        except ValueError:
            # Outside the box or a parameter's range, or too many events.
            return None
        return found

    def without_drift(self, parameters: Parameters, start: np.ndarray) -> np.ndarray:
        """A start from which idle masses without friction come back after a cycle.

        In the frame of a base that moves, inertia drives them to and fro.
        """
        rates = [component for component in self.given if component % 2]
        drive, cycle = drive_of(parameters), parameters.cycle
        strength = drive.share * drive.amplitude
        if not rates or not strength:
            return start
        body = oscillator(0.0, 0.0, strength, drive.forcing)
        phase = phase_at(drive.forcing, 0.0, float(self.moments[0]) * cycle)
        start, drift = start.copy(), -body_at(body, 0.0, 0.0, phase, cycle)[0] / cycle
        shares = base_shares_of(parameters)
        for component in rates:
            start[component] = drift * shares[(component - first_mass(parameters)) // 2]
        return start

    def correct(self, guess: np.ndarray, normal: np.ndarray) -> "OrbitPoint | None":
        """Newton's method at right angles to a direction; None where it does not converge."""
        at, found = guess, self.over(guess)
        if found is None:
            return None
        for _ in range(_STEPS):
            left = abs(found.residual).max()
            if left <= _ROUNDOFF:
                break
            rows = np.vstack([found.jacobian, normal])
            try:
                change = np.linalg.solve(rows, [*-found.residual, normal @ (guess - at)])
            except np.linalg.LinAlgError:
                break
            for halving in range(1 if left <= TOLERANCE else _HALVINGS):
                nearer = at + 0.5**halving * change
                passed = self.over(nearer)
                if passed and abs(passed.residual).max() < left:
                    at, found = nearer, passed
                    break
            else:
                # Nothing is nearer: as near as roundoff allows, or nowhere.
                break
        kept = abs(found.residual).max() <= TOLERANCE and found.drift <= TOLERANCE
        return OrbitPoint(self, at, found) if kept else None


@dataclass(frozen=True)
class PeriodMap:
    """Runs from each moment of a period to the next."""

    equation: OrbitEquation
    parameters: Parameters | SIParameters
    arcs: list[Arc]

    @cached_property
    def residual(self) -> np.ndarray:
        """Difference between the state at each moment and the end of the run before it."""
        ends = np.array([each.end for each in self.arcs])
        starts = np.array([each.start for each in self.arcs])
        return (
            (ends - np.roll(starts, -1, 0))[:, self.equation.moving] / self.equation.size
        ).ravel()

    @property
    def hits_idle(self) -> bool:
        """Whether an idle mass meets a wall."""
        hits = self.events[self.events[:, CAUSE] == IMPACT]
        of_each = hits[:, COLUMNS] if hits.shape[1] > COLUMNS else np.zeros(len(hits))
        return bool(np.isin(of_each, self.equation.idle).any())

    @property
    def drift(self) -> float:
        """Largest change of idle masses over the period, as a residual."""
        equation = self.equation
        change = (self.arcs[-1].end - self.arcs[0].start)[equation.given] / equation.size
        return float(max(abs(change), default=0.0))

    @cached_property
    def jacobian(self) -> np.ndarray:
        """Derivative of the residual by all unknowns."""
        size, count = len(self.equation.moving), len(self.arcs)
        rows = np.zeros((size * count, size * count + 1))
        for k, each in enumerate(self.arcs):
            here = slice(size * k, size * (k + 1))
            later = size * ((k + 1) % count)
            rows[here, here] += self.equation.of_moving(each.derivative)
            rows[here, later : later + size] -= np.eye(size)
        rows[:, -1] = self.slope
        return rows

    @property
    def slope(self) -> np.ndarray:
        """Derivative of the residual by the place on the line."""
        equation = self.equation
        rates: dict[str, float] = {}
        for along, span in zip(equation.names, equation.span.tolist(), strict=True):
            for name, rate in rates_of(self.parameters, along).items():
                rates[name] = rates.get(name, 0.0) + span * rate
        scaled = {name: rate for name, rate in rates.items() if name not in SI_UNITS}
        stencil = neighbours(self.parameters.dimensionless, scaled)
        changes = np.array(
            [each.change_by(stencil, np.zeros_like(each.start)) for each in self.arcs]
        )
        return (changes[:, equation.moving] / equation.size).ravel()

    @cached_property
    def monodromy(self) -> np.ndarray:
        """Derivative of the state after the period by that at the first moment."""
        whole = self.equation.of_moving(self.arcs[0].derivative)
        for each in self.arcs[1:]:
            whole = self.equation.of_moving(each.derivative) @ whole
        return whole

    @cached_property
    def rows(self) -> np.ndarray:
        """The log."""
        return np.concatenate([each.rows for each in self.arcs])

    @cached_property
    def events(self) -> np.ndarray:
        """Rows of the log that an event begins."""
        return self.rows[self.rows[:, CAUSE] >= IMPACT]

    @cached_property
    def event_times(self) -> np.ndarray:
        """When they happen, since the first moment."""
        began = np.cumsum(self.rows[:, DURATION]) - self.rows[:, DURATION]
        return began[self.rows[:, CAUSE] >= IMPACT]

    @property
    def event_bodies(self) -> np.ndarray:
        """Number of the free mass of each."""
        rows = self.events
        return rows[:, COLUMNS] if rows.shape[1] > COLUMNS else np.zeros(len(rows))

    @cached_property
    def bursts(self) -> tuple[WallImpacts, ...]:
        """Its runs of impacts on one wall."""
        rows = self.events
        return bursts_of(rows[:, CAUSE], rows[:, SIDE], rows[:, SPEED], self.event_bodies)

    @cached_property
    def signature(self) -> tuple[Any, ...]:
        """Events of a period in order, mass by mass where there are several."""
        return *((b.wall, b.impacts, b.completes, b.body) for b in self.bursts), self.stops

    @cached_property
    def stops(self) -> tuple[int, ...]:
        """How often dry friction stops each free mass, but within bursts."""
        return stops_in(self.events[:, CAUSE], self.events[:, SIDE], self.event_bodies)

    @property
    def touches(self) -> int:
        """Impacts in a period, but for those that complete."""
        return sum(burst.impacts for burst in self.bursts)

    @property
    def completions(self) -> int:
        """Chatter sequences that complete in a period."""
        return sum(burst.completes for burst in self.bursts)

    @property
    def slowest(self) -> float:
        """Smallest approach speed, but for impacts that complete."""
        return min((burst.slowest for burst in self.bursts), default=np.inf)

    @cached_property
    def smallest_gap(self) -> float:
        """Smallest gap in a flight, other than at its ends; over the size of the state."""
        return self.smallest_gap_of(range(len(self.parameters.dimensionless.each)))

    def smallest_gap_of(self, masses: Iterable[int]) -> float:
        """As `smallest_gap`, of these masses."""
        gaps = [gap for each in self.arcs for k in masses for gap in each.smallest_gaps(k)]
        return min(gaps, default=np.inf) / self.equation.size

    def state(self, moment: float) -> np.ndarray:
        """State at a moment of the period, in forcing periods."""
        moments = self.equation.moments
        later = (moment - moments[0]) % self.equation.period
        begun = moments - moments[0]
        index = int(np.searchsorted(begun, later, "right")) - 1
        # Never below zero: it is the difference that was searched for.
        tau = (later - begun[index]) * self.arcs[index].parameters.cycle
        return self.arcs[index].state_after(tau)


@dataclass(frozen=True)
class OrbitPoint:
    """An orbit, as a point of the branch, with the branch's direction there."""

    equation: OrbitEquation
    at: np.ndarray
    found: PeriodMap
    toward: np.ndarray | None = None
    """A direction along the branch; without one, that of larger values."""

    @property
    def parameters(self) -> Parameters | SIParameters:
        return self.found.parameters

    @property
    def period(self) -> float:
        """The forcing period in dimensionless units, in which the log is."""
        return self.parameters.dimensionless.cycle

    @property
    def name(self) -> str:
        return self.equation.names[0]

    @property
    def value(self) -> float:
        return value_of(self.parameters, self.name)

    def turned(self, way: float) -> "OrbitPoint":
        """The point with the branch's direction the other way where `way` is negative."""
        return replace(self, toward=way * self.tangent)

    @cached_property
    def tangent(self) -> np.ndarray:
        tangent = np.linalg.svd(self.found.jacobian)[2][-1]
        along = tangent[-1] if self.toward is None else tangent @ self.toward
        return tangent if along >= 0.0 else -tangent

    @cached_property
    def tests(self) -> dict[str, float]:
        """Functions that vanish at special points, and are smooth along the branch."""
        monodromy = self.found.monodromy
        values = np.linalg.eigvals(monodromy)
        pairs = [a * b - 1.0 for i, a in enumerate(values) for b in values[:i]]
        return {
            "fold": float(self.tangent[-1]),
            "period doubling": float(np.linalg.det(monodromy + np.eye(len(monodromy)))),
            "torus": float(np.prod(pairs).real),
            "branch point": float(np.linalg.det(np.vstack([self.found.jacobian, self.tangent]))),
        }

    @cached_property
    def defect(self) -> np.ndarray:
        """Change of the state over half the period, mirrored for an odd number of forcing periods.

        Zero for a motion that is its own mirror image, or repeats already after half the period.
        """
        equation = self.equation
        way = 1.0 if equation.period % 2 == 0 else -1.0
        half = self.found.state(equation.moments[0] + 0.5 * equation.period)
        return (self.found.arcs[0].start - way * half)[equation.moving] / equation.size

    @property
    def repeats(self) -> bool:
        """Whether that is a motion of the same damper."""
        p, period = self.parameters.dimensionless, self.equation.period
        if period % 2:
            # Beside a fixed stop, between walls that differ, with one wall, under gravity, of a
            # mass of its own period, or under a force that is not its own opposite half a cycle
            # later, the mirror image is not.
            alike = all(len(set(one.restitutions)) == 1 and not one.pull for one in p.each)
            alike = alike and not p.walls
            odd = p.forcing.is_odd and p.model != "time_varying" and alike
            return odd and (bool(self.equation.idle) or bool(np.all(self.equation.leaders >= 0)))
        return p.model != "time_varying" or period % (2 * p.modulation_order) == 0

    @property
    def turns(self) -> bool:
        """Whether a pair of multipliers on the unit circle is complex."""
        values = np.linalg.eigvals(self.found.monodromy)
        return bool(abs(values[abs(abs(values) - 1.0).argmin()].imag) > 0.0)

    def advance(self, step: float) -> "OrbitPoint | None":
        """The point a step further, or the one at the end of the range if that is nearer."""
        guess, normal = self.at + step * self.tangent, self.tangent
        if not 0.0 <= guess[-1] <= 1.0:
            end = float(guess[-1] > 0.5)
            guess = self.at + (end - self.at[-1]) / self.tangent[-1] * self.tangent
            guess[-1], normal = end, np.eye(len(guess))[-1]
        found = self.equation.correct(guess, normal)
        if found is None or np.linalg.norm(found.at - guess) > abs(step):
            return None
        return replace(found, toward=self.tangent)

    @property
    def flights(self) -> np.ndarray:
        """Start and end of the flights between events, since the first moment; shape (n, 2).

        Of several masses all must fly.
        """
        rows, model = self.found.rows, self.found.arcs[0].trajectory.model
        # Also where a compliant contact ends, which is no event.
        began = rows[:, CAUSE] != NOTHING
        times = (np.cumsum(rows[:, DURATION]) - rows[:, DURATION])[began]
        length = self.equation.period * self.period
        ends = np.append(times[1:], times[:1] + length)
        each = range(len(self.found.arcs[0].sides))
        modes = [log_of_mass(model, rows[began], k)[:, MODE] for k in each]
        flying = np.all(np.equal(modes, FLIGHT), axis=0)
        return np.column_stack([times, ends])[flying & (ends > times)]

    @property
    def margin(self) -> float:
        """Smallest part of a flight that lies before or after a moment; 0 where one is in none."""
        start, end = self.flights.T[:, :, None]
        if not start.size:
            return 0.5
        period = self.period
        since = (self.equation.moments - self.equation.moments[0]) * period
        # A flight may end in the next period.
        since = since + np.where(since < start.min(), self.equation.period * period, 0.0)
        parts = np.minimum(since - start, end - since) / (end - start)
        return float(parts.max(0).min())

    def recentred(self, part: float = 0.5) -> "OrbitPoint":
        """The point with moments in the middle, or at another part, of the longest flights."""
        moved = self.moved(self.centres(part), 1e-6 * self.tangent)
        point = moved and moved.equation.correct(moved.at, np.eye(len(moved.at))[-1])
        return replace(point, toward=moved.toward) if moved and point else self

    def centres(self, part: float = 0.5, least: float = MARGIN) -> np.ndarray:
        """Moments in the middle, or at another part, of the longest flights."""
        equation, flights = self.equation, self.flights
        if not len(flights):
            return np.empty(0)
        lengths = flights[:, 1] - flights[:, 0]
        long = np.argsort(-lengths, kind="stable")[:_MOMENTS]
        long = long[lengths[long] > least * lengths.max()]
        middle = (flights[long, 0] + part * lengths[long]) / self.period
        return np.sort((equation.moments[0] + middle) % equation.period)

    def moved(self, moments: np.ndarray, toward: np.ndarray) -> "OrbitPoint | None":
        """The point with other moments, not corrected, and a small step in terms of these."""
        if not len(moments):
            return None
        state = self.found.state(float(moments[0]))
        there = replace(self.equation, moments=moments, state=state)
        ends = []
        for at in (self.at, self.at + toward):
            found = self.equation.over(at)
            if found is None:
                return None
            states = np.array([found.state(moment) for moment in moments])
            ends.append(there.at(states, at[-1]))
        runs = there.over(ends[0])
        return OrbitPoint(there, ends[0], runs, ends[1] - ends[0]) if runs else None

    def crossing(self) -> "OrbitPoint | None":
        """A point of the branch that crosses here, where symmetry breaks or the period doubles."""
        # Two directions solve Newton's equation; of both, the one along which no parameter changes.
        first, second = np.linalg.svd(self.found.jacobian)[2][-2:]
        across = first * second[-1] - second * first[-1]
        across /= np.linalg.norm(across)
        for step in (3e-3, 1e-3, 1e-2, 3e-4, 1e-4, 3e-5, 1e-5, 3e-6, 1e-6):
            guess = self.at + step * across
            found = self.equation.correct(guess, across)
            if found and np.linalg.norm(found.at - guess) < step:
                return found
        return None

    def orbit(self) -> PeriodicOrbit:
        """The orbit, from time 0 on."""
        start = self.found.state(0.0)
        scaled = self.parameters.dimensionless
        return nearest_orbit(scaled, self.equation.period, start, 3).of(self.parameters)

"""`damper.continue_orbit`: periodic motions along a parameter, stable or not.

The unknowns are the states at some moments of the period, each in a flight, and the parameter.
Pseudo-arclength continuation follows the curve on which runs from moment to moment join (Keller,
Applications of Bifurcation Theory, 1977, 359-384): a step along the tangent, then Newton's method
at right angles to it. The derivative by the state is exact; that by the parameter is a central
difference of the engine's map, which Newton's method only converges with: docs/orbits.md.
"""

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import cached_property
from typing import TYPE_CHECKING, Any

import numpy as np

from damper.engine.segment import CAUSE, DURATION, FLIGHT, IMPACT, MODE, SIDE, SPEED
from damper.models import model_of
from damper.parameters import Parameters
from damper.parameters.quantities import unknown_name
from damper.parameters.quantity import real, whole
from damper.sweep.orbits import (
    TOLERANCE,
    Pass,
    PeriodicOrbit,
    bursts_of,
    check,
    moving,
    nearest_orbit,
    pass_over,
    zero,
)

if TYPE_CHECKING:
    import xarray as xr

#: Parameters along which a motion can be followed.
FOLLOWED = tuple(q.name for q in Parameters.quantities if not q.whole and q.model != "compliant")
#: What a special point can be.
KINDS = (
    "fold",
    "period doubling",
    "torus",
    "branch point",
    "symmetry breaking",
    "grazing",
    "complete chatter",
)
#: Newton steps at right angles to the tangent, and halvings of one.
_STEPS, _HALVINGS = 8, 3
#: What cannot be less for roundoff, over the size of the state.
_ROUNDOFF = 1e-15
#: Smallest step along the branch, and the largest turn of its tangent in a step (as a cosine).
_LEAST, _TURN = 1e-6, 0.95
#: Step below which a corner of the branch is looked for, and how far ahead.
_CORNER, _AHEAD = 1e-2, 0.05
#: Growth of a deviation in a period from which on roundoff rules.
_GROWTH = 1e6
#: Step that is too small to part several changes of the events.
_CLOSE = 1e-4
#: What half a period may change of a symmetric motion.
_SYMMETRIC = 1e-8
#: Central differences by the parameter take this part of its range either way.
_DIFFERENCE = 1e-8
#: Most moments of a period at which states are unknowns, and the smallest part of its flight that
#: lies before and after one.
_MOMENTS, _MARGIN = 8, 0.1


@dataclass(frozen=True)
class SpecialPoint:
    """Where motions are born, die, or change their kind."""

    kind: str
    """One of `KINDS`."""
    value: float
    """Of the parameter, to 1e-10 of the range that is followed."""
    orbit: PeriodicOrbit


@dataclass(frozen=True)
class Branch:
    """Periodic motions along a parameter, in the order of the branch; made by `continue_orbit`."""

    parameter: str
    orbits: tuple[PeriodicOrbit, ...]
    special_points: tuple[SpecialPoint, ...]
    ends: tuple[str, str]
    """Why the branch ends where its first and its last orbit are."""

    @property
    def values(self) -> np.ndarray:
        """Values of the parameter, one for each orbit."""
        return np.array([getattr(orbit.parameters, self.parameter) for orbit in self.orbits])

    def switch(self, point: SpecialPoint) -> PeriodicOrbit:
        """Find a motion on the branch that crosses this one at a special point.

        Parameters
        ----------
        point : SpecialPoint
            A period doubling, symmetry breaking or branch point.

        Returns
        -------
        PeriodicOrbit
            Of twice the period after a period doubling. `continue_orbit` follows it.

        Raises
        ------
        ValueError
            For a point of another kind, and when no such motion is found.
        """
        if point.kind not in ("period doubling", "symmetry breaking", "branch point"):
            raise ValueError(f"no branch crosses at a point of the kind {point.kind!r}")
        doubled = point.kind == "period doubling"
        crossed = _through(point.orbit, self.parameter, self.values.min(), self.values.max())
        orbit = replace(point.orbit, period=2 * point.orbit.period) if doubled else point.orbit
        there = _through(orbit, self.parameter, self.values.min(), self.values.max())
        values, vectors = np.linalg.eig(crossed.found.map)
        vector = vectors[:, abs(values + (1.0 if doubled else -1.0)).argmin()].real
        found = there.crossing(vector)
        if found is None:
            raise ValueError(f"no branch found that crosses at the {point.kind} {point.value!r}")
        return found.orbit()

    def to_dataset(self) -> "xr.Dataset":
        """Return the branch as a Dataset: its orbits, and its special points."""
        import xarray as xr

        orbits, points = self.orbits, self.special_points
        quantity = next(q for q in Parameters.quantities if q.name == self.parameter)
        about = {"long_name": quantity.long_name, "units": quantity.units}
        multipliers = np.full((len(orbits), 4), np.nan, complex)
        for row, orbit in zip(multipliers, orbits, strict=True):
            row[: len(orbit.multipliers)] = orbit.multipliers
        variables: dict[str, Any] = {
            self.parameter: ("orbit", self.values, about),
            "multiplier_real": (("orbit", "multiplier"), multipliers.real),
            "multiplier_imaginary": (("orbit", "multiplier"), multipliers.imag),
            "stable": ("orbit", np.array([orbit.stable for orbit in orbits], "i1")),
            "impacts": ("orbit", np.array([orbit.impacts for orbit in orbits])),
            "slowest_impact": ("orbit", np.array([orbit.slowest_impact for orbit in orbits])),
            "word": ("orbit", np.array([orbit.word for orbit in orbits], dtype=object)),
            "kind": ("point", np.array([point.kind for point in points], dtype=object)),
            "value": ("point", np.array([point.value for point in points], float), about),
        }
        for name in ("x", "v", "y", "u"):
            states = np.array([getattr(orbit.state, name) for orbit in orbits])
            variables[name] = ("orbit", states)
            at = np.array([getattr(point.orbit.state, name) for point in points], float)
            variables[f"point_{name}"] = ("point", at)
        attributes = {
            "parameter": self.parameter,
            "period": orbits[0].period,
            "first_end": self.ends[0],
            "last_end": self.ends[1],
        }
        return xr.Dataset(variables, attrs=attributes)


def continue_orbit(
    orbit: PeriodicOrbit,
    parameter: str,
    start: float,
    stop: float,
    *,
    step: float = 0.02,
    max_orbits: int = 2000,
) -> Branch:
    """Follow a periodic motion along a parameter, both ways, also where it is unstable.

    Parameters
    ----------
    orbit : PeriodicOrbit
        Its own value of the parameter lies between `start` and `stop`.
    parameter : str
        Name of a parameter of `damper.Parameters`, such as "restitution".
    start, stop : float
        Range of the parameter to stay in.
    step : float, default 0.02
        Largest step along the branch: 1 is the whole range, or a change of the state by its size.
    max_orbits : int, default 2000
        Orbits after which to stop, either way.

    Returns
    -------
    Branch
        Its first end is the one that is met from `orbit` towards smaller values.

    Raises
    ------
    ValueError
        For a range without the orbit's own value or out of the parameter's own; when the motion
        does not satisfy Newton's method at its own value.
    TypeError
        For an unknown parameter.

    Examples
    --------
    >>> import damper
    >>> p = damper.Parameters(mass_ratio=0.1, damping_ratio=0.1, frequency_ratio=1.0,
    ...                       clearance=5.0, restitution=0.5)
    >>> branch = damper.continue_orbit(damper.periodic_orbit(p), "clearance", 4.5, 6.0)
    >>> [(point.kind, round(point.value, 9)) for point in branch.special_points]
    [('symmetry breaking', 4.616152418)]
    """
    if not isinstance(orbit, PeriodicOrbit):
        raise TypeError(f"orbit = {orbit!r}: must be a damper.PeriodicOrbit")
    most, step = whole("max_orbits", max_orbits, 1), real("step", step)
    if not 0.0 < step <= 1.0:
        raise ValueError(f"step = {step!r}: must be a number with 0 < step <= 1")
    first = _through(orbit, parameter, start, stop)
    down = _Walk(first.turned(-1.0), step, most)
    up = _Walk(first.turned(1.0), step, most) if not down.closed else down
    points = [*down.points[:0:-1], *up.points] if up is not down else down.points
    special = [*down.special[::-1], *up.special] if up is not down else down.special
    return Branch(
        parameter,
        tuple(point.orbit() for point in points),
        tuple(SpecialPoint(kind, point.value, point.orbit()) for kind, point in special),
        (down.end, up.end),
    )


@dataclass(frozen=True)
class _Curve:
    """The equation of the branch: from one moment of the period to the next, runs must join.

    The unknowns are the components of the states at these moments that move, over their size, and
    the parameter's place in its range.
    """

    base: Parameters
    name: str
    low: float
    span: float
    period: int
    state: np.ndarray
    """A state on the branch: its size, and the components that do not move."""
    moments: np.ndarray
    """In forcing periods."""

    @cached_property
    def moving(self) -> np.ndarray:
        return moving(self.base)

    @cached_property
    def size(self) -> float:
        largest = float(abs(self.state[self.moving]).max()) or 1.0
        return largest * len(self.moments) ** 0.5

    def at(self, states: np.ndarray, value: float) -> np.ndarray:
        """Unknowns of states at the moments and a value of the parameter's place."""
        return np.append(states[:, self.moving].ravel() / self.size, value)

    def over(self, at: np.ndarray) -> "_Round | None":
        """Run from each moment to the next; None where there is no such run."""
        starts = np.tile(self.state, (len(self.moments), 1))
        starts[:, self.moving] = self.size * at[:-1].reshape(len(starts), -1)
        moments = [*self.moments, self.moments[0] + self.period]
        try:
            value: dict[str, Any] = {self.name: self.low + self.span * float(at[-1])}
            p = replace(self.base, **value)
            model = model_of(p)
            passes = [
                pass_over(p, start, moments[k], moments[k + 1], model)
                for k, start in enumerate(starts)
            ]
        except ValueError:
            # Outside the box or a parameter's range, or too many events.
            return None
        return _Round(self, passes)

    def slope(self, at: np.ndarray, found: "_Round") -> np.ndarray:
        """Derivative of what is lacking by the parameter, a central difference."""
        ends = []
        for way in (-_DIFFERENCE, _DIFFERENCE):
            beside = at.copy()
            beside[-1] += way
            passed = self.over(beside)
            ends.append((beside[-1], passed) if passed else (at[-1], found))
        (below, first), (above, last) = ends
        return (last.lacking - first.lacking) / ((above - below) or 1.0)

    def correct(
        self, guess: np.ndarray, normal: np.ndarray, slope: np.ndarray | None = None
    ) -> "_Point | None":
        """Newton's method at right angles to a direction; None where it does not converge.

        A slope from nearby saves time. Just after a grazing all derivatives must be of one place.
        """
        at, found = guess, self.over(guess)
        if found is None:
            return None
        for _ in range(_STEPS):
            left = abs(found.lacking).max()
            if left <= _ROUNDOFF:
                break
            here = self.slope(at, found) if slope is None else slope
            rows = np.vstack([found.jacobian(here), normal])
            try:
                change = np.linalg.solve(rows, [*-found.lacking, normal @ (guess - at)])
            except np.linalg.LinAlgError:
                break
            for halving in range(1 if left <= TOLERANCE else _HALVINGS):
                nearer = at + 0.5**halving * change
                passed = self.over(nearer)
                if passed and abs(passed.lacking).max() < left:
                    at, found = nearer, passed
                    break
            else:
                # Nothing is nearer: as near as roundoff allows, or nowhere.
                break
        return _Point(self, at, found) if abs(found.lacking).max() <= TOLERANCE else None


@dataclass(frozen=True)
class _Round:
    """Runs from each moment of a period to the next."""

    curve: _Curve
    passes: list[Pass]

    @cached_property
    def lacking(self) -> np.ndarray:
        """What the state at each moment differs by from the end of the run before."""
        ends = np.array([each.end for each in self.passes])
        starts = np.array([each.start for each in self.passes])
        return ((ends - np.roll(starts, -1, 0))[:, self.curve.moving] / self.curve.size).ravel()

    def jacobian(self, slope: np.ndarray) -> np.ndarray:
        """Derivative of what is lacking by all unknowns."""
        moves = self.curve.moving
        size, count = len(moves), len(self.passes)
        rows = np.zeros((size * count, size * count + 1))
        for k, each in enumerate(self.passes):
            here = slice(size * k, size * (k + 1))
            later = size * ((k + 1) % count)
            rows[here, here] += each.derivative[np.ix_(moves, moves)]
            rows[here, later : later + size] -= np.eye(size)
        rows[:, -1] = slope
        return rows

    @cached_property
    def map(self) -> np.ndarray:
        """Derivative of the state after the period by that at the first moment."""
        moves = self.curve.moving
        whole = np.eye(4)
        for each in self.passes:
            whole = each.derivative @ whole
        return whole[np.ix_(moves, moves)]

    @cached_property
    def rows(self) -> np.ndarray:
        """The log."""
        return np.concatenate([each.rows for each in self.passes])

    @cached_property
    def events(self) -> tuple[np.ndarray, np.ndarray]:
        """Rows of the log that an event begins, and their times since the first moment."""
        times = np.cumsum(self.rows[:, DURATION]) - self.rows[:, DURATION]
        struck = self.rows[:, CAUSE] >= IMPACT
        return self.rows[struck], times[struck]

    @cached_property
    def signature(self) -> tuple[tuple[str, int, bool], ...]:
        """What it does in a period, event by event."""
        rows, _ = self.events
        bursts = bursts_of(rows[:, CAUSE], rows[:, SIDE], rows[:, SPEED])
        return tuple((burst.wall, burst.impacts, burst.completes) for burst in bursts)

    @property
    def touches(self) -> int:
        """Impacts in a period, but for those that complete."""
        return sum(impacts for _, impacts, _ in self.signature)

    @property
    def completions(self) -> int:
        """Chatter sequences that complete in a period."""
        return sum(completes for _, _, completes in self.signature)

    @property
    def slowest(self) -> float:
        """Smallest approach speed."""
        rows, _ = self.events
        return float(min(rows[rows[:, CAUSE] == IMPACT, SPEED], default=np.inf))

    @cached_property
    def smallest_gap(self) -> float:
        """Smallest gap in a flight, other than at its ends; over the size of the state."""
        gaps = [gap for each in self.passes for gap in each.smallest_gaps()]
        return min(gaps, default=np.inf) / self.curve.size

    def state(self, moment: float) -> np.ndarray:
        """State at a moment of the period, in forcing periods."""
        moments, period = self.curve.moments, self.curve.period
        later = (moment - moments[0]) % period
        index = int(np.searchsorted(moments - moments[0], later, "right")) - 1
        tau = (later - moments[index] + moments[0]) * self.passes[index].parameters.period
        return self.passes[index].state_after(tau)


@dataclass(frozen=True)
class _Point:
    """An orbit, as a point of the branch, with the branch's direction there."""

    curve: _Curve
    at: np.ndarray
    found: _Round
    toward: np.ndarray | None = None
    """A direction along the branch; without one, that of larger values."""

    @property
    def parameters(self) -> Parameters:
        return self.found.passes[0].parameters

    @property
    def value(self) -> float:
        return float(getattr(self.parameters, self.curve.name))

    def turned(self, way: float) -> "_Point":
        """The point with the branch's direction the other way where `way` is negative."""
        return replace(self, toward=way * self.tangent)

    @cached_property
    def slope(self) -> np.ndarray:
        return self.curve.slope(self.at, self.found)

    @cached_property
    def tangent(self) -> np.ndarray:
        tangent = np.linalg.svd(self.found.jacobian(self.slope))[2][-1]
        along = tangent[-1] if self.toward is None else tangent @ self.toward
        return tangent if along >= 0.0 else -tangent

    @cached_property
    def tests(self) -> dict[str, float]:
        """Functions that vanish at special points, and are smooth along the branch."""
        map_ = self.found.map
        values = np.linalg.eigvals(map_)
        pairs = [a * b - 1.0 for i, a in enumerate(values) for b in values[:i]]
        jacobian = self.found.jacobian(self.slope)
        return {
            "fold": float(self.tangent[-1]),
            "period doubling": float(np.linalg.det(map_ + np.eye(len(map_)))),
            "torus": float(np.prod(pairs).real),
            "branch point": float(np.linalg.det(np.vstack([jacobian, self.tangent]))),
        }

    @cached_property
    def defect(self) -> np.ndarray:
        """What half the period, mirrored for an odd number of forcing periods, does to the state.

        Zero for a motion that is its own mirror image, or repeats already after half the period.
        """
        curve = self.curve
        way = 1.0 if curve.period % 2 == 0 else -1.0
        half = self.found.state(curve.moments[0] + 0.5 * curve.period)
        return (self.found.passes[0].start - way * half)[curve.moving] / curve.size

    @property
    def turns(self) -> bool:
        """Whether a pair of multipliers on the unit circle is complex."""
        values = np.linalg.eigvals(self.found.map)
        return bool(abs(values[abs(abs(values) - 1.0).argmin()].imag) > 0.0)

    def advance(self, step: float) -> "_Point | None":
        """The point a step further, or the one at the end of the range if that is nearer."""
        guess, normal = self.at + step * self.tangent, self.tangent
        if not 0.0 <= guess[-1] <= 1.0:
            end = float(guess[-1] > 0.5)
            guess = self.at + (end - self.at[-1]) / self.tangent[-1] * self.tangent
            guess[-1], normal = end, np.eye(len(guess))[-1]
        found = self.curve.correct(guess, normal, self.slope)
        if found is None or np.linalg.norm(found.at - guess) > abs(step):
            return None
        return replace(found, toward=self.tangent)

    @property
    def flights(self) -> np.ndarray:
        """Start and end of the flights between events, since the first moment; shape (n, 2)."""
        rows, times = self.found.events
        length = self.curve.period * self.parameters.period
        ends = np.append(times[1:], times[:1] + length)
        return np.column_stack([times, ends])[rows[:, MODE] == FLIGHT]

    @property
    def margin(self) -> float:
        """Smallest part of a flight that lies before or after a moment; 0 where one is in none."""
        start, end = self.flights.T[:, :, None]
        if not start.size:
            return 0.5
        period = self.parameters.period
        since = (self.curve.moments - self.curve.moments[0]) * period
        # A flight may end in the next period.
        since = since + np.where(since < start.min(), self.curve.period * period, 0.0)
        parts = np.minimum(since - start, end - since) / (end - start)
        return float(parts.max(0).min())

    def recentred(self, part: float = 0.5) -> "_Point":
        """The point with moments in the middle, or at another part, of the longest flights."""
        curve, flights = self.curve, self.flights
        if not len(flights):
            return self
        lengths = flights[:, 1] - flights[:, 0]
        long = np.argsort(-lengths, kind="stable")[:_MOMENTS]
        long = long[lengths[long] > _MARGIN * lengths.max()]
        middle = (flights[long, 0] + part * lengths[long]) / self.parameters.period
        moments = np.sort((curve.moments[0] + middle) % curve.period)
        there = replace(curve, moments=moments, state=self.found.passes[0].start)
        ends = []
        for ahead in (0.0, 1e-6):
            found = curve.over(self.at + ahead * self.tangent)
            if found is None:
                return self
            states = np.array([found.state(moment) for moment in moments])
            ends.append(there.at(states, self.at[-1] + ahead * self.tangent[-1]))
        point = there.correct(ends[0], np.eye(len(ends[0]))[-1])
        return replace(point, toward=ends[1] - ends[0]) if point else self

    def crossing(self, vector: np.ndarray) -> "_Point | None":
        """A point of the branch that crosses here, along a deviation at the first moment."""
        deviation = np.zeros(len(self.found.passes[0].start))
        moves, deviations = self.curve.moving, []
        deviation[moves] = vector
        for each in self.found.passes:
            deviations.append(deviation)
            deviation = each.derivative @ deviation
        across = self.curve.at(np.array(deviations), 0.0)
        across /= np.linalg.norm(across)
        for step in (3e-3, 1e-3, 1e-2, 3e-4):
            guess = self.at + step * across
            found = self.curve.correct(guess, across)
            if found and np.linalg.norm(found.at - guess) < step:
                return found
        return None

    def orbit(self) -> PeriodicOrbit:
        """The orbit, from time 0 on."""
        start = self.found.state(0.0)
        return nearest_orbit(self.parameters, self.curve.period, start, 3)


def _through(orbit: PeriodicOrbit, name: str, start: float, stop: float) -> _Point:
    """Return the orbit as a point of its branch."""
    if name not in FOLLOWED:
        raise unknown_name("parameter", name, FOLLOWED)
    quantity = next(q for q in Parameters.quantities if q.name == name)
    low, high = sorted((quantity.check(start), quantity.check(stop)))
    p = orbit.parameters
    check(p, orbit.period)
    own = getattr(p, name)
    if not low <= own <= high or low == high:
        raise ValueError(
            f"{name} from {start!r} to {stop!r}: must be a range with the orbit's own {own!r}"
        )
    s = orbit.state
    state = np.array([s.x, s.v, s.y, s.u])
    curve = _Curve(p, name, low, high - low, orbit.period, state, np.zeros(1))
    at = curve.at(state[None, :], (own - low) / (high - low))
    found = curve.over(at)
    if found is None:
        raise ValueError(f"the orbit cannot be run: {orbit.state} of {p}")
    return _Point(curve, at, found, np.eye(len(at))[-1]).recentred()


class _Walk:
    """The branch from one point in one direction."""

    def __init__(self, first: _Point, step: float, most: int) -> None:
        self.points = [first]
        self.special: list[tuple[str, _Point]] = []
        self.closed = False
        self.end = ""
        size = 0.2 * step
        while not (self.end or self._ends(most)):
            point = self.points[-1]
            if point.margin < _MARGIN:
                point = self.points[-1] = point.recentred()
            if self._take(point, size):
                size = min(step, 1.4 * size)
            elif size < _CORNER and (
                # A moment at which the gap is smallest would count the touch twice.
                self._turn(point) or self._turn(point.recentred(0.3))
            ):
                continue
            elif size > _LEAST:
                size *= 0.4
            else:
                self.end = f"no orbit found beyond {point.curve.name} = {point.value!r}"

    def _ends(self, most: int) -> bool:
        point = self.points[-1]
        name, at = point.curve.name, point.at[-1]
        if (at <= 0.0 and point.tangent[-1] < 0.0) or (at >= 1.0 and point.tangent[-1] > 0.0):
            self.end = f"{name} = {point.value!r} is the end of the range"
        elif len(self.points) > 10 and self._returns():
            self.closed, self.end = True, f"closed at {name} = {point.value!r}"
        elif abs(point.found.map).max() > _GROWTH:
            self.end = (
                f"deviations grow without bound at {name} = {point.value!r}, "
                f"where the slowest impact has {point.found.slowest:.3g}"
            )
        elif len(self.points) > most:
            self.end = f"max_orbits = {most} are found"
        return bool(self.end)

    def _returns(self) -> bool:
        """Whether the first point lies between the last two."""
        first, a, b = (
            np.append(point.found.state(0.0) / point.curve.size, point.at[-1])
            for point in (self.points[0], *self.points[-2:])
        )
        # The state at time 0 jumps where an impact passes it; the parameter does not.
        between = min(a[-1], b[-1]) <= first[-1] <= max(a[-1], b[-1])
        return bool(between and np.linalg.norm(first - b) < np.linalg.norm(b - a))

    def _take(self, a: _Point, size: float) -> bool:
        """Go a step; False where it has to be smaller."""
        b = a.advance(size)
        if b is None or (b.margin < 0.1 * _MARGIN and a.margin >= _MARGIN):
            return False
        if a.found.signature == b.found.signature:
            found = self._smooth(a, b) if a.tangent @ b.tangent > _TURN else None
        else:
            found, b = _change(a, b, size)
        if found is None:
            return False
        self.special += found
        self.points.append(b)
        return True

    def _turn(self, a: _Point) -> bool:
        """Go on beyond a grazing ahead, where the tangent jumps; whether there is one."""
        graze = _graze(a, _AHEAD)
        corner = graze.at if graze else _vanishing(a)
        if corner is None:
            return False
        b = _struck(a, graze) if graze else _missed(a, corner)
        if b is None:
            return False
        if graze is None:
            graze = _graze(b.turned(-1.0), _AHEAD)
            # The corner was but extrapolated.
            off = np.linalg.norm(graze.at - corner) if graze else np.inf
            if graze is None or off > 0.2 * np.linalg.norm(corner - a.at):
                return False
        self.special.append(("grazing", graze))
        self.points.append(b)
        return True

    def _smooth(self, a: _Point, b: _Point) -> list[tuple[str, _Point]] | None:
        """Special points between two orbits of one kind; None where one is not located."""
        points = []
        for kind in KINDS[:4]:
            if a.tests[kind] * b.tests[kind] < 0.0:
                point = _root(a, b, lambda point, kind=kind: point.tests[kind])  # type: ignore[misc]
                if point is None:
                    return None
                points.append((kind, point))
        points = [(kind, point) for kind, point in points if kind != "torus" or point.turns]
        both = min(np.linalg.norm(a.defect), np.linalg.norm(b.defect)) > _SYMMETRIC
        if both and a.defect @ b.defect < 0.0:
            # The branch goes on as the same motions half a period later.
            point = _root(a, b, lambda point: float(point.defect @ a.defect))
            if point is None:
                return None
            if np.linalg.norm(point.defect) < _SYMMETRIC:
                which = "symmetric motions" if a.curve.period % 2 else "motions of half the period"
                self.end = f"meets {which} near {a.curve.name} = {point.value:.6g}"
                points = [(kind, each) for kind, each in points if kind == "torus"]
        points.sort(key=lambda each: float(a.tangent @ (each[1].at - a.at)))
        symmetric = np.linalg.norm(a.defect) < _SYMMETRIC
        named = {"branch point": "symmetry breaking"} if symmetric and a.curve.period % 2 else {}
        return [(named.get(kind, kind), point) for kind, point in points]


def _change(a: _Point, b: _Point, size: float) -> tuple[list[tuple[str, _Point]] | None, _Point]:
    """Where events come or go between two orbits, and the second one with its direction."""
    if a.found.completions != b.found.completions:
        point = _last(a, size)
        return [("complete chatter", point)], replace(b, toward=b.at - point.at)
    fewer = a if a.found.touches < b.found.touches else b.turned(-1.0)
    if abs(a.found.touches - b.found.touches) > 2 and size > _CLOSE:
        return None, b
    graze = _graze(fewer, size)
    if graze is None:
        # Small steps go on without a special point, such as where speeds only change their order.
        return ([] if size < _CLOSE else None), b
    return [("grazing", graze)], replace(b, toward=b.at - graze.at)


def _last(a: _Point, size: float) -> _Point:
    """The last point at which as many chatter sequences complete as at the given one."""
    # Not closer, where the two halves of a symmetric motion may differ by roundoff.
    while size > 2e-11:
        size *= 0.5
        b = a.advance(size)
        if b is not None and b.found.completions == a.found.completions:
            a = b
    return a


def _vanishing(a: _Point) -> np.ndarray | None:
    """Unknowns ahead at which the slowest impact has no speed left; None where it is not near."""
    back = a.advance(-0.1 * _CORNER)
    if back is None or back.found.signature != a.found.signature:
        return None
    slowing = (back.found.slowest - a.found.slowest) / (0.1 * _CORNER)
    if slowing <= 0.0 or a.found.slowest > _AHEAD * slowing:
        return None
    return a.at + a.found.slowest / slowing * a.tangent


def _missed(a: _Point, corner: np.ndarray) -> _Point | None:
    """A point beyond a corner at which the slowest impact is lost."""
    curve = a.curve
    # The gap changes most in this direction: the derivative grows by the inverse of the speed.
    across = np.linalg.svd(a.found.jacobian(a.slope))[2][0]
    for ahead in (1e-3, -1e-3, 1e-4, -1e-4, 1e-2, -1e-2):
        at = corner + ahead * across
        found = curve.over(at)
        if found is None or found.touches >= a.found.touches:
            continue
        tangent = np.linalg.svd(found.jacobian(curve.slope(at, found)))[2][-1]
        for step in (abs(ahead), -abs(ahead)):
            b = curve.correct(corner + step * tangent, tangent)
            if b and b.found.touches < a.found.touches:
                b = replace(b, toward=b.at - corner)
                if np.linalg.norm(b.at - corner) < 3.0 * abs(step):
                    return b
    return None


def _struck(a: _Point, graze: _Point) -> _Point | None:
    """A point beyond a grazing at which the touch has begun.

    With the speed w of the touch the motion gains w E, and the gap's change along C is w^2 / c. So
    beyond the grazing the branch goes on as w t, with J t + E = 0 and C t = 0.
    """
    before, curve = graze.found.jacobian(a.slope), a.curve
    for ahead in (1e-4, 1e-3, 1e-5, 1e-2):
        at = graze.at + ahead * a.tangent
        found = curve.over(at)
        if found is None or found.touches <= a.found.touches:
            continue
        speed = found.slowest
        more = found.jacobian(curve.slope(at, found)) - before
        across = more.T @ more @ a.tangent
        across /= np.linalg.norm(across)
        c = speed**2 / (ahead * across @ a.tangent)
        lost = curve.over(graze.at - ahead * across)
        if lost is None:
            continue
        gained = 2.0 * speed / c * more @ across
        rows = np.vstack([before, across])
        tangent = np.linalg.lstsq(rows, [*-gained, 0.0], rcond=None)[0]
        guess = graze.at + speed * tangent
        for _ in range(3):
            if beside := curve.over(guess):
                # The square of the touch's speed, on the other side of the grazing as well.
                struck = beside.touches > a.found.touches
                missed = -c * ahead * beside.smallest_gap / lost.smallest_gap
                square = beside.slowest**2 if struck else missed
                guess = guess + (speed**2 - square) / c * across
        b = curve.correct(guess, across)
        if b and b.found.touches > a.found.touches:
            return replace(b, toward=b.at - graze.at)
    return None


def _graze(a: _Point, size: float) -> _Point | None:
    """The point ahead at which a touch is about to appear: the smallest gap in a flight is zero."""
    point, gap, ahead = a, a.found.smallest_gap, a.tangent
    step = 0.25 * size
    for _ in range(60):
        # Slope and tangent of the first: a difference would soon reach beyond the root.
        b = a.curve.correct(point.at + step * ahead, a.tangent, a.slope)
        if b is None or b.found.signature != a.found.signature:
            step *= 0.25
            continue
        closing = (gap - b.found.smallest_gap) / step
        ahead = (b.at - point.at) / step
        point, gap = b, b.found.smallest_gap
        if gap < 1e-12:
            return replace(point, toward=a.tangent)
        if closing <= 0.0 or gap > 4.0 * size * closing:
            return None
        # Short of the root, so that the touch does not begin.
        step = 0.98 * gap / closing
    return None


def _root(a: _Point, b: _Point, test: Callable[[_Point], float]) -> _Point | None:
    """The point between two at which a function changes its sign."""
    points: dict[float, _Point] = {}

    def along(step: float) -> float:
        point = a.advance(step)
        if point is None:
            return float("nan")
        points[step] = point
        return test(point)

    step = float(a.tangent @ (b.at - a.at))
    return points.get(zero(along, 0.0, step, test(a), test(b)))

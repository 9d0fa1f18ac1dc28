"""`damper.continue_point`: a special point of a branch along two parameters.

The next point of the curve is looked for on a line of parameters at right angles to the curve. On
that line it is a special point of a branch along one parameter, so the search for special points
locates it, whatever its kind.
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from damper.parameters import Parameters, SIParameters
from damper.parameters.named import named_quantity, value_of
from damper.parameters.quantity import whole
from damper.sweep.orbits.branch import (
    SpecialPoint,
    require_point,
    require_range,
    require_step,
    watched,
)
from damper.sweep.orbits.equation import MARGIN, OrbitEquation, OrbitPoint
from damper.sweep.orbits.periodic import PeriodicOrbit
from damper.sweep.orbits.special import grazing, last_complete, root

#: Smallest step, and the largest turn of the curve in a step (as a cosine).
_LEAST, _TURN = 1e-5, 0.95
#: Smallest part of the longest flight that a flight with a moment lasts.
_LONG = 0.4
#: How closely the border of complete chatter is located.
_BEYOND = 1e-8


def continue_point(
    point: SpecialPoint,
    ranges: Mapping[str, tuple[float, float]],
    *,
    step: float = 0.04,
    max_points: int = 500,
) -> "PointCurve":
    """Follow a special point of a branch along two parameters, both ways.

    Parameters
    ----------
    point : SpecialPoint
        Of a branch from `continue_orbit`.
    ranges : mapping
        Two parameters, one of them that of the branch -> where to stay.
    step : float, default 0.04
        Largest step along the curve: 1 is the whole range of a parameter.
    max_points : int, default 500
        Points after which to stop, either way.

    Returns
    -------
    PointCurve
        Its first end is the one that is met towards smaller values of the second parameter.

    Raises
    ------
    ValueError
        For other than two parameters, and for a range without the point's own value.
    TypeError
        For an unknown parameter, and for what is no special point or no range.

    Examples
    --------
    >>> import damper
    >>> p = damper.Parameters(mass_ratio=0.1, damping_ratio=0.1, frequency_ratio=1.0,
    ...                       clearance=4.7, restitution=0.5)
    >>> branch = damper.continue_orbit(damper.periodic_orbit(p), "clearance", 4.5, 4.8)
    >>> curve = damper.continue_point(
    ...     branch.special_points[0], {"clearance": (4.5, 4.8), "restitution": (0.5, 0.52)},
    ...     step=0.2,
    ... )
    >>> curve.values("clearance").round(6).tolist()[::len(curve.orbits) - 1]
    [4.616152, 4.685418]
    """
    require_point(point)
    most, step = whole("max_points", max_points, 1), require_step(step)
    own = point.found.name
    if not isinstance(ranges, Mapping):
        raise TypeError(f"ranges = {ranges!r}: must be a mapping of two parameters to (low, high)")
    if len(ranges) != 2 or own not in ranges:
        raise ValueError(
            f"ranges of {', '.join(ranges) or 'nothing'}: must be of {own}, along which the point "
            "was found, and of one more parameter"
        )
    names = sorted(ranges, key=lambda name: name != own)
    for name in names:
        if not isinstance(ranges[name], Sequence | np.ndarray) or len(ranges[name]) != 2:
            raise TypeError(f"ranges: {name} = {ranges[name]!r}: must be (low, high)")
    ends = [require_range(point.orbit, name, *ranges[name]) for name in names]
    plane = _Plane(tuple(names), np.array([e[0] for e in ends]), np.array([e[1] for e in ends]))
    first = plane.on(point.found)
    with watched(f"following a {point.kind}", float(plane.place(first.parameters)[1])) as watch:
        down = up = _CurveWalk(plane, point.kind, first, -1.0, step, most, watch)
        if not down.closed:
            up = _CurveWalk(plane, point.kind, first, 1.0, step, most, watch)
    points = [*down.points[:0:-1], *up.points] if up is not down else down.points
    orbits = tuple(each.orbit() for each in points)
    return PointCurve(point.kind, plane.names, orbits, (down.end, up.end))


@dataclass(frozen=True, eq=False)
class PointCurve:
    """Special points of one kind along two parameters; made by `continue_point`."""

    kind: str
    parameters: tuple[str, ...]
    orbits: tuple[PeriodicOrbit, ...] = field(repr=False)
    ends: tuple[str, str]
    """Why the curve ends where its first and its last orbit are."""

    def values(self, parameter: str) -> np.ndarray:
        """Values of a parameter, one for each orbit; TypeError for an unknown one."""
        named_quantity(self.orbits[0].parameters, parameter)
        return np.array([value_of(orbit.parameters, parameter) for orbit in self.orbits])


@dataclass(frozen=True)
class _Plane:
    """Two parameters, each as its place in its range."""

    names: tuple[str, ...]
    low: np.ndarray
    high: np.ndarray

    def place(self, parameters: Parameters | SIParameters) -> np.ndarray:
        values = np.array([value_of(parameters, name) for name in self.names])
        return (values - self.low) / (self.high - self.low)

    def line(self, equation: OrbitEquation, place: np.ndarray, across: np.ndarray) -> OrbitEquation:
        """The equation on a line whose middle is a place of the plane."""
        span = (self.high - self.low) * across
        low = self.low + (self.high - self.low) * place - 0.5 * span
        return replace(equation, names=self.names, low=low, span=span)

    def on(self, point: OrbitPoint) -> OrbitPoint:
        """The point of a branch along the first parameter, on a line of the plane."""
        across = np.array([1.0, 0.0])
        there = self.line(point.equation, self.place(point.parameters), across)
        toward = _unit(point.tangent if point.toward is None else point.toward)
        toward[-1] *= float(point.equation.span[0] / there.span[0])
        return replace(point, equation=there, at=np.append(point.at[:-1], 0.5), toward=toward)


class _CurveWalk:
    """The curve from one point in one direction of the second parameter."""

    def __init__(
        self,
        plane: _Plane,
        kind: str,
        first: OrbitPoint,
        way: float,
        step: float,
        most: int,
        watch: Callable[[float], None],
    ) -> None:
        self.plane, self.kind, self.points = plane, kind, [first]
        self.closed, self.end = False, ""
        size, along = 0.2 * step, np.array([0.0, way])
        while not self.end:
            here = self._place(-1)
            watch(float(here[1]))
            if len(self.points) > 1:
                along = _unit(here - self._place(-2))
            if self._ends(here, along, most, size):
                break
            if self._take(here, along, size):
                size = min(step, 1.4 * size)
            elif size > _LEAST:
                size *= 0.4
            elif len(self.points) == 1 and along[1]:
                # The curve may go along the first parameter.
                size, along = 0.2 * step, np.array([way, 0.0])
            else:
                self.end = f"no {kind} found beyond {self._where()}"

    def _place(self, index: int) -> np.ndarray:
        return self.plane.place(self.points[index].parameters)

    def _where(self) -> str:
        p = self.points[-1].parameters
        return ", ".join(f"{name} = {value_of(p, name)!r}" for name in self.plane.names)

    def _ends(self, here: np.ndarray, along: np.ndarray, most: int, size: float) -> bool:
        edge = np.where(along < 0.0, here, 1.0 - here)[along != 0.0]
        if edge.min() <= 1e-12:
            self.end = f"{self._where()} is the end of the range"
        elif len(self.points) > 10 and np.linalg.norm(here - self._place(0)) < size:
            self.closed, self.end = True, f"closed at {self._where()}"
        elif len(self.points) > most:
            self.end = f"max_points = {most} are found"
        return bool(self.end)

    def _take(self, here: np.ndarray, along: np.ndarray, size: float) -> bool:
        """Go a step; False where it has to be smaller."""
        last = self.points[-1]
        if last.margin < MARGIN or len(self.points) == 1:
            last = self.points[-1] = _recentred(last)
        equation = last.equation
        across = np.array([along[1], -along[0]])
        before = equation.span / (self.plane.high - self.plane.low)
        across *= 1.0 if across @ before >= 0.0 else -1.0
        place = here + size * along
        outside = (place < 0.0) | (place > 1.0)
        if outside.any():
            # On the edge of the plane, where the step first meets it.
            beyond = np.zeros(2)
            beyond[outside] = abs(place.clip(0.0, 1.0) - place)[outside] / abs(along)[outside]
            edge = int(beyond.argmax())
            place = here + (size - beyond[edge]) * along
            place[edge] = round(place[edge])
            across = np.where(np.arange(2) == edge, 0.0, np.copysign(1.0, across))
        there = self.plane.line(equation, place, across)
        guess, middle = self._predict(equation, float(np.linalg.norm(place - here)))
        guess[-1] = 0.5 + (middle - place) @ across if len(self.points) > 1 else 0.5
        found = _located(self.kind, last, there, guess, size)
        if found is None:
            return False
        went = self.plane.place(found.parameters) - here
        if len(self.points) > 1 and _unit(went) @ along < _TURN and not outside.any():
            return False
        self.points.append(found)
        return bool(np.linalg.norm(went) < 3.0 * size)

    def _predict(self, equation: OrbitEquation, ahead: float) -> tuple[np.ndarray, np.ndarray]:
        """Unknowns and place a step ahead: of the parabola through the last three points."""
        points = self.points[-3:]
        places = np.array([self.plane.place(point.parameters) for point in points])
        moments = equation.moments
        states = [np.array([each.found.state(m) for m in moments]) for each in points]
        at = np.array([equation.at(each, 0.5) for each in states])
        lengths = np.linalg.norm(np.diff(places, axis=0), axis=1)
        behind = -np.append(np.cumsum(lengths[::-1])[::-1], 0.0)
        # Lagrange's weights.
        away = behind[:, None] - behind + np.eye(len(points))
        parts = (ahead - behind) / away
        np.fill_diagonal(parts, 1.0)
        weights = parts.prod(axis=1)
        return weights @ at, weights @ places


def _recentred(point: OrbitPoint) -> OrbitPoint:
    """The point with moments in the middle of flights that no prediction leaves."""
    if point.toward is None:
        return point
    # Backwards, for a touch may begin ahead.
    moved = point.moved(point.centres(least=_LONG), -1e-6 * point.toward)
    if moved is None or moved.toward is None:
        return point
    return replace(moved, toward=-_unit(moved.toward))


def _located(
    kind: str, last: OrbitPoint, there: OrbitEquation, guess: np.ndarray, size: float
) -> OrbitPoint | None:
    """The special point on a line of parameters, beside a guess."""
    toward = last.toward
    if toward is None:
        return None
    for part in (0.05, 0.2, 0.8, 3.2):
        way = part * size
        a = there.correct(guess - way * toward, toward)
        if a is None or np.linalg.norm(a.at - guess) > 3.0 * way + size:
            continue
        a = replace(a, toward=toward)
        if kind == "grazing":
            same = a.found.touches == last.found.touches
            found = grazing(a, 2.0 * way) if same else None
        elif kind == "complete chatter":
            found = _border(a, last, 2.0 * way)
        else:
            found = _between(kind, a, a.advance(2.0 * way))
        if found:
            return replace(found, toward=a.tangent)
    return None


def _border(a: OrbitPoint, last: OrbitPoint, size: float) -> OrbitPoint | None:
    """The last point of a line at which as many chatter sequences complete as before."""
    if a.found.completions != last.found.completions:
        return None
    for _ in range(4):
        b = a.advance(size)
        if b and b.found.completions == a.found.completions:
            a, size = b, 2.0 * size
            continue
        a = last_complete(a, size, _BEYOND)
        # A step without an orbit need not end beyond the border: what lies beyond must be seen.
        beyond = a.advance(2.0 * _BEYOND)
        if beyond and beyond.found.completions < a.found.completions:
            return a
    return None


def _between(kind: str, a: OrbitPoint, b: OrbitPoint | None) -> OrbitPoint | None:
    """The special point between two orbits of a line; None where there is none."""
    test = "branch point" if kind == "symmetry breaking" else kind
    if b is None or a.found.signature != b.found.signature or a.tests[test] * b.tests[test] >= 0.0:
        return None
    found = root(a, b, lambda point: point.tests[test])
    return found if found and (kind != "torus" or found.turns) else None


def _unit(vector: np.ndarray) -> np.ndarray:
    return np.array(vector / np.linalg.norm(vector))

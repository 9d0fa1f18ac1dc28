"""Pseudo-arclength: the branch from one orbit in one direction, step by step."""

from dataclasses import replace

import numpy as np

from damper.sweep.orbits import KINDS
from damper.sweep.orbits.corners import AHEAD, CORNER, missed, struck, vanishing
from damper.sweep.orbits.equation import MARGIN, OrbitPoint
from damper.sweep.orbits.special import grazing, last_complete, root

#: Smallest step along the branch, and the largest turn of its tangent in a step (as a cosine).
_LEAST, _TURN = 1e-6, 0.95
#: Growth of a deviation in a period from which on roundoff rules.
_GROWTH = 1e6
#: Step that is too small to part several changes of the events.
_CLOSE = 1e-4
#: What half a period may change of a symmetric motion.
_SYMMETRIC = 1e-8


class Walk:
    """The branch from one point in one direction."""

    def __init__(self, first: OrbitPoint, step: float, most: int) -> None:
        self.points = [first]
        self.special: list[tuple[str, OrbitPoint]] = []
        self.closed = False
        self.end = ""
        size = 0.2 * step
        while not (self.end or self._ends(most)):
            point = self.points[-1]
            if point.margin < MARGIN:
                point = self.points[-1] = point.recentred()
            if self._take(point, size):
                size = min(step, 1.4 * size)
            elif size < CORNER and (
                # A moment at which the gap is smallest would count the touch twice.
                self._turn(point) or self._turn(point.recentred(0.3))
            ):
                continue
            elif size > _LEAST:
                size *= 0.4
            else:
                self.end = f"no orbit found beyond {point.name} = {point.value!r}"

    def _ends(self, most: int) -> bool:
        point = self.points[-1]
        name, at = point.name, point.at[-1]
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
            np.append(point.found.state(0.0) / point.equation.size, point.at[-1])
            for point in (self.points[0], *self.points[-2:])
        )
        # The state at time 0 jumps where an impact passes it; the parameter does not.
        between = min(a[-1], b[-1]) <= first[-1] <= max(a[-1], b[-1])
        return bool(between and np.linalg.norm(first - b) < np.linalg.norm(b - a))

    def _take(self, a: OrbitPoint, size: float) -> bool:
        """Go a step; False where it has to be smaller."""
        b = a.advance(size)
        if b is None or (b.margin < 0.1 * MARGIN and a.margin >= MARGIN):
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

    def _turn(self, a: OrbitPoint) -> bool:
        """Go on beyond a grazing ahead, where the tangent jumps; whether there is one."""
        graze = grazing(a, AHEAD)
        corner = graze.at if graze else vanishing(a)
        if corner is None:
            return False
        b = struck(a, graze) if graze else missed(a, corner)
        if b is None:
            return False
        if graze is None:
            graze = grazing(b.turned(-1.0), AHEAD)
            # The corner was but extrapolated.
            off = np.linalg.norm(graze.at - corner) if graze else np.inf
            if graze is None or off > 0.2 * np.linalg.norm(corner - a.at):
                return False
        self.special.append(("grazing", graze))
        self.points.append(b)
        return True

    def _smooth(self, a: OrbitPoint, b: OrbitPoint) -> list[tuple[str, OrbitPoint]] | None:
        """Special points between two orbits of one kind; None where one is not located."""
        points = []
        for kind in KINDS[:4]:
            if a.tests[kind] * b.tests[kind] < 0.0:
                point = root(a, b, lambda point, kind=kind: point.tests[kind])  # type: ignore[misc]
                if point is None:
                    return None
                points.append((kind, point))
        points = [(kind, point) for kind, point in points if kind != "torus" or point.turns]
        both = min(np.linalg.norm(a.defect), np.linalg.norm(b.defect)) > _SYMMETRIC
        if both and a.defect @ b.defect < 0.0:
            # The branch goes on as the same motions half a period later.
            point = root(a, b, lambda point: float(point.defect @ a.defect))
            if point is None:
                return None
            if np.linalg.norm(point.defect) < _SYMMETRIC:
                which = (
                    "symmetric motions" if a.equation.period % 2 else "motions of half the period"
                )
                self.end = f"meets {which} near {a.name} = {point.value:.6g}"
                points = [(kind, each) for kind, each in points if kind == "torus"]
        points.sort(key=lambda each: float(a.tangent @ (each[1].at - a.at)))
        symmetric = np.linalg.norm(a.defect) < _SYMMETRIC
        named = {"branch point": "symmetry breaking"} if symmetric and a.equation.period % 2 else {}
        return [(named.get(kind, kind), point) for kind, point in points]


def _change(
    a: OrbitPoint, b: OrbitPoint, size: float
) -> tuple[list[tuple[str, OrbitPoint]] | None, OrbitPoint]:
    """Where events come or go between two orbits, and the second one with its direction."""
    if a.found.completions != b.found.completions:
        point = last_complete(a, size)
        return [("complete chatter", point)], replace(b, toward=b.at - point.at)
    fewer = a if a.found.touches < b.found.touches else b.turned(-1.0)
    if abs(a.found.touches - b.found.touches) > 2 and size > _CLOSE:
        return None, b
    graze = grazing(fewer, size)
    if graze is None:
        # Small steps go on without a special point, such as where speeds only change their order.
        return ([] if size < _CLOSE else None), b
    return [("grazing", graze)], replace(b, toward=b.at - graze.at)

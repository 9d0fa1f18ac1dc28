"""Pseudo-arclength: the branch from one orbit in one direction, step by step."""

from collections.abc import Callable, Sequence
from dataclasses import replace

import numpy as np

from damper.engine.segment import CAUSE, COLUMNS, IMPACT
from damper.sweep.orbits import KINDS, corners
from damper.sweep.orbits.arcs import first_mass
from damper.sweep.orbits.equation import MARGIN, OrbitPoint
from damper.sweep.orbits.special import grazing, last_complete, root

#: Smallest step along the branch.
_LEAST = 1e-9
#: Growth of a deviation in a period from which on roundoff rules.
_GROWTH = 1e6
#: Step that is too small to part several changes of the events.
_CLOSE = 1e-4
#: Time between impacts of two masses that are as good as together.
_TOGETHER = 1e-6
#: Gap of an idle mass, over the size of the state, that is as good as none.
_TOUCHED = 1e-6
#: Places of one orbit, found twice.
_SAME = 1e-7
#: How far beyond a border of complete chatter its other side must be seen.
_BEYOND = 1e-8
#: Largest change of a symmetric motion over half a period.
_SYMMETRIC = 1e-8
#: Values of a function of special points that are roundoff: it is zero all along the branch, as the
#: torus's is where nothing damps a free mass that meets no wall.
_NOISE = 1e-12
#: Bound for a symmetric motion at which another branch ends.
_NEARLY = 1e-5


class Walk:
    """The branch from one point in one direction, up to special points that are known."""

    def __init__(
        self,
        first: OrbitPoint,
        step: float,
        most: int,
        known: Sequence[tuple[str, OrbitPoint]] = (),
        until_change: bool = False,
        watch: Callable[[float], None] | None = None,
    ) -> None:
        self.points, self.known, self._until_change = [first], known, until_change
        self.special: list[tuple[str, OrbitPoint]] = []
        self.closed = False
        self.end = ""
        size = 0.2 * step
        tried: OrbitPoint | None = None
        while not (self.end or self._ends(most)):
            point = self.points[-1]
            if watch:
                watch(float(point.at[-1]))
            if point.margin < MARGIN:
                point = self.points[-1] = point.recentred()
            if self._take(point, size):
                size = min(step, 1.4 * size)
            elif size < corners.CORNER and point is not tried:
                tried = point
                # A moment at which the gap is smallest would count the touch twice.
                if not (self._turn(point) or self._turn(point.recentred(0.3))):
                    size *= 0.4
            elif size > _LEAST:
                size *= 0.4
            else:
                self.end = self._stopped()

    def _ends(self, most: int) -> bool:
        point = self.points[-1]
        name, at = point.name, point.at[-1]
        if (at <= 0.0 and point.tangent[-1] < 0.0) or (at >= 1.0 and point.tangent[-1] > 0.0):
            self.end = f"{name} = {point.value!r} is the end of the range"
        elif self._until_change and (changes := [s for s in self.special if s[0] != "grazing"]):
            kind, changed = changes[0]
            self.end = f"changes its kind at the {kind} {name} = {changed.value!r}"
        elif len(self.points) > 10 and self._returns():
            self.closed, self.end = True, f"closed at {name} = {point.value!r}"
        elif self._grows():
            self.end = (
                f"deviations grow without bound at {name} = {point.value!r}, "
                f"where the slowest impact has {point.found.slowest:.3g}"
            )
        elif len(self.points) > most:
            self.end = f"max_orbits = {most} are found"
        return bool(self.end)

    def _grows(self) -> bool:
        """Whether deviations grow beyond bounds, and more so than before."""
        last = [abs(point.found.monodromy).max() for point in self.points[-2:]]
        corner = self.points[-1].found.signature != self.points[-2:][0].found.signature
        return bool(last[-1] > _GROWTH and last[-1] >= last[0] and not corner)

    def _stopped(self) -> str:
        """Why no step is found from the last point."""
        last, slowest = self.points[-1], self.points[-1].found.slowest
        if last.repeats and abs(last.defect).max() < _NEARLY < abs(self.points[0].defect).max():
            return f"{_meets(last)}, where an impact grazes"
        where = f", where the slowest impact has {slowest:.3g}" if slowest < np.inf else ""
        where = _touched(last) or _hit_together(last) or where
        return f"no orbit found beyond {last.name} = {last.value!r}{where}"

    def _returns(self) -> bool:
        """Whether the first point lies between the last two."""
        first, a, b = self.points[0], *self.points[-2:]
        ahead = [point.at[-1] - first.at[-1] for point in (a, b)]
        if ahead[0] * ahead[1] > 0.0 or len({p.found.signature for p in (first, a, b)}) > 1:
            return False
        point = root(a, b, lambda point: float(point.at[-1] - first.at[-1]))
        return point is not None and _same(first, point)

    def _take(self, a: OrbitPoint, size: float) -> bool:
        """Go a step; False where it has to be smaller."""
        b = a.advance(size)
        if b is None or (b.margin < 0.1 * MARGIN and a.margin >= MARGIN):
            if b and size < _CLOSE:
                # A touch begins at a moment: put it elsewhere.
                self.points[-1] = a.recentred(0.3)
            return False
        meets = self._meets(a, b, size < _CLOSE)
        if meets is None:
            return False
        if meets:
            self.end = _meets(a)
            return True
        if a.found.signature == b.found.signature:
            found = self._smooth(a, b) if a.tangent @ b.tangent > corners.STRAIGHT else None
        else:
            found, b = _change(a, b, size)
        if found is None:
            return False
        self._add(found, b)
        return True

    def _add(self, found: list[tuple[str, OrbitPoint]], b: OrbitPoint) -> None:
        """Add special points and the orbit beyond them, or end where one is known."""
        for kind, point in found:
            if any(kind == k and _same(point, other) for k, other in (*self.known, *self.special)):
                self.end = f"comes back to the {kind} {point.name} = {point.value!r}"
                return
        self.special += found
        self.points.append(b)

    def _turn(self, a: OrbitPoint) -> bool:
        """Go on beyond a grazing ahead, where the tangent jumps; whether there is one."""
        graze = grazing(a, corners.AHEAD)
        corner = graze.at if graze else corners.vanishing(a)
        if corner is None or (graze and not corners.adjacent(graze, a)):
            return False
        b = corners.touched(a, graze) if graze else corners.past_grazing_out(a, corner)
        if b is None:
            return False
        if graze is None:
            graze = grazing(b.turned(-1.0), corners.AHEAD)
            # The corner was but extrapolated.
            off = float(np.linalg.norm(graze.at - corner)) if graze else np.inf
            if graze is None or off > max(0.2 * float(np.linalg.norm(corner - a.at)), _CLOSE):
                return False
        meets = self._meets(a, b, True)
        if meets:
            self.end = f"{_meets(graze)}, where an impact grazes"
        elif meets is not None:
            self._add([("grazing", graze)], b)
        return meets is not None

    def _meets(self, a: OrbitPoint, b: OrbitPoint, close: bool) -> bool | None:
        """Whether a step reaches motions of more symmetry; None where it has to be smaller."""
        if not (a.repeats and b.repeats):
            return False
        if np.linalg.norm(self.points[0].defect) < _SYMMETRIC:
            # A step that leaves these was not along the branch.
            return None if np.linalg.norm(b.defect) > _NEARLY else False
        sizes = np.linalg.norm(a.defect), np.linalg.norm(b.defect)
        # Beyond, the branch would go on as the same motions half a period later.
        beyond = a.defect @ b.defect < -corners.STRAIGHT * sizes[0] * sizes[1]
        if not (beyond or sizes[1] < _SYMMETRIC):
            return False
        # Without a meeting the defect jumps, where half a period later is an impact.
        return bool(min(sizes) < corners.CORNER) if close else None

    def _smooth(self, a: OrbitPoint, b: OrbitPoint) -> list[tuple[str, OrbitPoint]] | None:
        """Special points between two orbits of one kind; None where one is not located."""
        points = []
        # In a small step a function jumps over zero, as where a compliant wall is touched.
        far = np.linalg.norm(b.at - a.at) > _CLOSE
        for kind in KINDS[:4]:
            ends = a.tests[kind], b.tests[kind]
            if ends[0] * ends[1] < 0.0 and max(map(abs, ends)) > _NOISE:
                point = root(a, b, lambda point, kind=kind: point.tests[kind])  # type: ignore[misc]
                if point:
                    points.append((kind, point))
                elif far:
                    return None
        points = [(kind, point) for kind, point in points if kind != "torus" or point.turns]
        points.sort(key=lambda each: float(a.tangent @ (each[1].at - a.at)))
        symmetric = a.repeats and b.repeats and np.linalg.norm(a.defect) < _SYMMETRIC
        named = {"branch point": "symmetry breaking"} if symmetric and a.equation.period % 2 else {}
        return [(named.get(kind, kind), point) for kind, point in points]


def _touched(point: OrbitPoint) -> str:
    """Name an idle mass that is about to be touched."""
    for k in point.equation.idle:
        if point.found.smallest_gap_of([k]) < _TOUCHED:
            return f", where the idle mass {k} is touched"
    return ""


def _hit_together(point: OrbitPoint) -> str:
    """Name two masses whose impacts exchange their order at a point, where the motion jumps."""
    found = point.found
    hits = found.events[:, CAUSE] == IMPACT
    times, bodies = found.event_times[hits], found.events[hits, COLUMNS:].astype(int)
    if not bodies.size:
        return ""
    first, second = bodies[:-1, 0], bodies[1:, 0]
    moves = point.equation.leaders[first_mass(point.parameters.dimensionless) :: 2]
    near = (np.diff(times) < _TOGETHER) & (moves[first] != moves[second])
    for k in np.flatnonzero(near):
        return f", where the masses {first[k]} and {second[k]} hit at one instant"
    return ""


def _same(a: OrbitPoint, b: OrbitPoint) -> bool:
    """Whether two points are of one orbit."""
    off = abs(a.found.state(0.0) - b.found.state(0.0)).max()
    return bool(abs(a.at[-1] - b.at[-1]) < _SAME and off < _NEARLY * a.equation.size)


def _meets(point: OrbitPoint) -> str:
    """Message on a branch that ends at a branch of motions with more symmetry."""
    which = "symmetric motions" if point.equation.period % 2 else "motions of half the period"
    return f"meets {which} near {point.name} = {point.value:.6g}"


def _parts(graze: OrbitPoint, fewer: OrbitPoint, a: OrbitPoint, b: OrbitPoint) -> bool:
    """Whether the touch that begins at a grazing is the one by which two points differ."""
    begun = corners.touched(fewer, graze)
    more = a if a.found.touches > b.found.touches else b
    return begun is not None and begun.found.signature == more.found.signature


def _change(
    a: OrbitPoint, b: OrbitPoint, size: float
) -> tuple[list[tuple[str, OrbitPoint]] | None, OrbitPoint]:
    """Where events come or go between two orbits, and the second one with its direction."""
    if a.found.completions != b.found.completions:
        point = last_complete(a, size)
        beyond = point.advance(_BEYOND)
        if beyond is None or beyond.found.completions != b.found.completions:
            # The step left the branch.
            return None, b
        return [("complete chatter", point)], replace(b, toward=b.at - point.at)
    fewer = a if a.found.touches < b.found.touches else b.turned(-1.0)
    if abs(a.found.touches - b.found.touches) > 2 and size > _CLOSE:
        return None, b
    graze = grazing(fewer, size)
    if graze is None and fewer is not a:
        # Beyond a corner the branch goes on in any direction.
        fewer, graze = b, grazing(b, size)
    if graze is None:
        # Small steps go on without a special point, such as where speeds only change their order.
        return ([] if size < _CLOSE else None), b
    back = a.tangent @ (graze.at - a.at) < 0.0
    if back or (size > _CLOSE and not (corners.adjacent(graze, b) and _parts(graze, fewer, a, b))):
        # The step went back to what was left there, beyond where the branch turns again, or to
        # another branch.
        return None, b
    return [("grazing", graze)], replace(b, toward=b.at - graze.at)

"""Where special points of a branch lie, to roundoff."""

from collections.abc import Callable
from dataclasses import replace

import numpy as np

from damper.sweep.orbits.arcs import zero
from damper.sweep.orbits.equation import OrbitPoint

#: Tolerance of a function's value at its root.
_ZERO = 1e-3


def root(a: OrbitPoint, b: OrbitPoint, test: Callable[[OrbitPoint], float]) -> OrbitPoint | None:
    """The point between two at which a function is zero; None where it jumps over zero."""
    points: dict[float, OrbitPoint] = {}

    def along(step: float) -> float:
        point = a.advance(step)
        if point is None:
            return float("nan")
        points[step] = point
        return test(point)

    step = float(a.tangent @ (b.at - a.at))
    ends = test(a), test(b)
    point = points.get(zero(along, 0.0, step, *ends))
    return point if point and abs(test(point)) < _ZERO * max(map(abs, ends)) else None


def grazing(a: OrbitPoint, size: float) -> OrbitPoint | None:
    """The point ahead at which a touch is about to appear: the smallest gap in a flight is zero."""
    point, gap, ahead = a, a.found.smallest_gap, a.tangent
    step = 0.25 * size
    for _ in range(60):
        b = a.equation.correct(point.at + step * ahead, a.tangent)
        if b is None or b.found.signature != a.found.signature:
            step *= 0.25
            continue
        closing = (gap - b.found.smallest_gap) / step
        ahead = (b.at - point.at) / step
        point, gap = b, b.found.smallest_gap
        if gap < 1e-12:
            return replace(point, toward=a.tangent)
        if not 0.0 < closing < np.inf or gap > 4.0 * size * closing:
            return None
        # Short of the root, so that the touch does not begin.
        step = 0.98 * gap / closing
    return None


def last_complete(a: OrbitPoint, size: float, tolerance: float = 2e-11) -> OrbitPoint:
    """The last point at which as many chatter sequences complete as at the given one."""
    last = a
    # Not closer, where the two halves of a symmetric motion may differ by roundoff.
    while size > tolerance:
        size *= 0.5
        guess = last.at + size * a.tangent
        b = a.equation.correct(guess, a.tangent)
        near = b is not None and np.linalg.norm(b.at - guess) < size
        if b and near and b.found.completions == a.found.completions:
            last = b
    return replace(last, toward=a.tangent)

"""Corners of a branch: how it goes on where a touch of no speed begins or ends."""

from dataclasses import replace

import numpy as np

from damper.sweep.orbits.equation import OrbitPoint

#: Step below which a corner of the branch is looked for, and how far ahead.
CORNER, AHEAD = 1e-2, 0.05
#: Largest turn of a branch in a step, as a cosine.
STRAIGHT = 0.95
#: How far beyond a corner of compliant walls a run is taken.
_AHEAD = (1e-4, 1e-3, 1e-5)


def adjacent(corner: OrbitPoint, b: OrbitPoint) -> bool:
    """Whether a point lies straight ahead of a corner, and not beyond a fold of the new branch."""
    chord = b.at - corner.at
    along = b.tangent @ chord
    folds = along * b.tangent[-1] * chord[-1] < 0.0
    return bool(abs(along) > STRAIGHT * np.linalg.norm(chord) and not folds)


def vanishing(a: OrbitPoint) -> np.ndarray | None:
    """Unknowns ahead at which the slowest impact has no speed left; None where it is not near."""
    back = a.advance(-0.1 * CORNER)
    if back is None or back.found.signature != a.found.signature or a.found.slowest == np.inf:
        return None
    slowing = (back.found.slowest - a.found.slowest) / (0.1 * CORNER)
    if slowing <= 0.0 or a.found.slowest > AHEAD * slowing:
        return None
    return a.at + a.found.slowest / slowing * a.tangent


def past_grazing_out(a: OrbitPoint, corner: np.ndarray) -> OrbitPoint | None:
    """A point beyond a corner at which the slowest impact is lost."""
    if _is_soft(a):
        return past_soft_corner(a, corner, -1, [ahead * a.tangent for ahead in _AHEAD])
    # The gap changes most in this direction: the derivative grows by the inverse of the speed.
    across = np.linalg.svd(a.found.jacobian)[2][0]
    return past_soft_corner(
        a, corner, -1, [k * across for k in (1e-3, -1e-3, 1e-4, -1e-4, 1e-2, -1e-2)]
    )


def touched(a: OrbitPoint, graze: OrbitPoint) -> OrbitPoint | None:
    """A point beyond a grazing at which the touch has begun."""
    if _is_soft(a):
        return past_soft_corner(a, graze.at, 1, [ahead * a.tangent for ahead in _AHEAD])
    return past_grazing_in(a, graze)


def _is_soft(a: OrbitPoint) -> bool:
    """Whether the derivatives on both sides of a corner have bounds."""
    return a.parameters.dimensionless.model == "compliant"


def past_soft_corner(
    a: OrbitPoint, corner: np.ndarray, more: int, offsets: list[np.ndarray]
) -> OrbitPoint | None:
    """A point near a corner on a branch of other touches, its direction that of a run there."""
    equation = a.equation
    for offset in offsets:
        found = equation.over(corner + offset)
        if found is None or more * (found.touches - a.found.touches) <= 0:
            continue
        tangent, size = np.linalg.svd(found.jacobian)[2][-1], float(np.linalg.norm(offset))
        for step in (size, -size):
            b = equation.correct(corner + step * tangent, tangent)
            near = b is not None and np.linalg.norm(b.at - corner) < 3.0 * size
            if b and near and more * (b.found.touches - a.found.touches) > 0:
                return replace(b, toward=b.at - corner)
    return None


def past_grazing_in(a: OrbitPoint, graze: OrbitPoint) -> OrbitPoint | None:
    """A point beyond a grazing at which the touch has begun.

    With the speed w of the touch the motion gains w E, and the gap's change along C is w^2 / c. So
    beyond the grazing the branch goes on as w t, with J t + E = 0 and C t = 0.
    """
    before, equation = graze.found.jacobian, a.equation
    for ahead in (1e-4, 1e-5, 1e-6, 1e-3, 1e-2):
        at = graze.at + ahead * a.tangent
        found = equation.over(at)
        if found is None or found.touches <= a.found.touches:
            continue
        speed = found.slowest
        more = found.jacobian - before
        across = more.T @ more @ a.tangent
        across /= np.linalg.norm(across)
        c = speed**2 / (ahead * across @ a.tangent)
        lost = equation.over(graze.at - ahead * across)
        if lost is None:
            continue
        gained = 2.0 * speed / c * more @ across
        rows = np.vstack([before, across])
        tangent = np.linalg.lstsq(rows, [*-gained, 0.0], rcond=None)[0]
        guess = graze.at + speed * tangent
        for _ in range(3):
            if beside := equation.over(guess):
                # The square of the touch's speed, on the other side of the grazing as well.
                begun = beside.touches > a.found.touches
                short = -c * ahead * beside.smallest_gap / lost.smallest_gap
                square = beside.slowest**2 if begun else short
                guess = guess + (speed**2 - square) / c * across
        b = equation.correct(guess, across)
        if b and b.found.touches > a.found.touches and adjacent(graze, b):
            return replace(b, toward=b.at - graze.at)
    return None

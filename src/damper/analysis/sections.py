"""How many distinct points a section has, and where along an axis that number changes."""

from collections.abc import Sequence

import numpy as np

#: Part of the largest coordinate within which two points of a section are one.
SAME = 1e-6


def section_period(points: np.ndarray, same: float = SAME) -> int:
    """Number of distinct points through which a section runs again and again.

    Parameters
    ----------
    points : ndarray, shape (n, m)
        Points in the order in which they were taken.
    same : float, default 1e-6
        Part of the largest coordinate within which two points are one; more than what is left of
        the transient.

    Returns
    -------
    int
        The least period, up to half the number of points; 0 if there is none (quasi-periodic,
        chaotic, or longer), or if a point is missing.

    Examples
    --------
    >>> section_period(np.array([[1.0, 0.0], [2.0, 0.0]] * 4))
    2
    >>> section_period(np.array([[1.0], [2.0], [3.0], [4.0]]))
    0
    """
    if not np.isfinite(points).all():
        return 0
    near = same * np.abs(points).max(initial=0.0)
    for period in range(1, len(points) // 2 + 1):
        if (np.abs(points[period:] - points[:-period]) <= near).all():
            return period
    return 0


def first_lasting_change(periods: Sequence[int], least: int = 10) -> int | None:
    """Index of the first point after a change of the number of section points that lasts.

    Before it lie `least` grid points of one and the same number, after it as many of which none
    has that number. Without this, the narrow windows in which a diagram falls back and forth would
    each count as a bifurcation.

    Parameters
    ----------
    periods : sequence of int
        `section_period` at every grid point; 0 is a number like the others, after the change.
    least : int, default 10
        Grid points on either side.

    Returns
    -------
    int or None
        None if there is no such change.

    Examples
    --------
    >>> first_lasting_change([1, 1, 1, 2, 1, 1, 1, 2, 0, 2], least=3)
    7
    """
    for index in range(least, len(periods) - least + 1):
        before = set(periods[index - least : index])
        if len(before) == 1 and 0 not in before and before.isdisjoint(periods[index:][:least]):
            return index
    return None

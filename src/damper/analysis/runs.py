"""Runs of neighbouring grid points at which something holds: for tables and for figures."""

from collections.abc import Sequence

import numpy as np


def runs(mask: Sequence[bool] | np.ndarray) -> list[tuple[int, int]]:
    """First and last index of every run of True.

    Examples
    --------
    >>> runs([True, False, True, True])
    [(0, 0), (2, 3)]
    """
    steps = np.flatnonzero(np.diff(np.concatenate([[0], np.asarray(mask, dtype=int), [0]])))
    return [(int(a), int(b) - 1) for a, b in steps.reshape(-1, 2)]

"""Derivatives of runs by central differences."""

from collections.abc import Callable
from typing import Any

import numpy as np


def difference(
    end: Callable[[float], tuple[np.ndarray, np.ndarray]],
    step: float,
    word: Callable[[np.ndarray], list[Any]],
) -> tuple[np.ndarray, float] | None:
    """Derivative by central differences, and what these change by when the step is halved.

    Of the step or ten times that, whichever changes less: one is too long beside a grazing impact,
    the other too short where roundoff grows. None where the events of the logs, their `word`,
    differ.
    """
    events = word(end(0.0)[1])
    found = []
    for largest in (step, 10.0 * step):
        slopes = []
        for width in (largest, 0.5 * largest):
            (above, log), (below, other) = end(width), end(-width)
            if word(log) == word(other) == events:
                slopes.append((above - below) / (2.0 * width))
        if len(slopes) == 2:
            change = float(abs(slopes[1] - slopes[0]).max())
            found.append(((4.0 * slopes[1] - slopes[0]) / 3.0, change))
    return min(found, key=lambda one: one[1], default=None)


def differences(
    end: Callable[[np.ndarray], tuple[np.ndarray, np.ndarray]],
    start: np.ndarray,
    word: Callable[[np.ndarray], list[Any]],
) -> np.ndarray | None:
    """Derivative by the start; None where the events differ, or a halved step changes it."""
    columns = [
        difference(lambda step, way=way: end(start + step * way), 1e-6, word)  # type: ignore[misc]
        for way in np.eye(len(start))
    ]
    found = [column for column in columns if column is not None]
    if len(found) < len(start):
        return None
    slopes = np.stack([slope for slope, _ in found], axis=1)
    # Beside a grazing impact differences are no derivative.
    return slopes if max(change for _, change in found) < 1e-4 * abs(slopes).max() else None

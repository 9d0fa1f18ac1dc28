"""Confidence limits of means: Student's t."""

import math
from functools import lru_cache

import numpy as np


def mean_within(
    over: np.ndarray, under: np.ndarray, confidence: float, *, in_turn: bool = False
) -> tuple[float, float]:
    """Quotient of two sums over batches, and half the width of its confidence limits.

    To first order in the batches' deviations (Cochran, Sampling Techniques, 1977, chapter 6); NaN
    where there is none. Batches that follow each other (`in_turn`, at least 5) count as fewer where
    neighbours are alike.
    """
    total, count = float(under.sum()), len(over)
    if not 0.0 < total < math.inf:
        return math.nan, math.nan
    mean = float(over.sum()) / total
    rest = over - mean * under if mean < math.inf else np.full(count, math.nan)
    alone = _independent(rest) if in_turn else float(count)
    error = math.sqrt(float(rest @ rest) / (alone * (count - 1))) * count / total
    return mean, student_t(confidence, max(int(alone) - 1, 1)) * error


def _independent(rest: np.ndarray) -> float:
    """How many independent ones batches in turn are worth, by the correlation c of neighbours.

    n (1 - c)/(1 + c), exact for means whose correlation falls as powers of c. The estimate of c is
    freed of its error of first order, which is -(1 + 4 c)/n (Kendall, Biometrika 41, 1954).
    """
    count, square = len(rest), float(rest @ rest)
    if not square > 0.0:
        return float(count)
    found = (count * float(rest[1:] @ rest[:-1]) / square + 1.0) / (count - 4)
    alike = min(max(found, 0.0), 1.0 - 2.0 / count)
    return count * (1.0 - alike) / (1.0 + alike)


@lru_cache(maxsize=16)
def student_t(confidence: float, freedom: int) -> float:
    """Quantile of Student's t: within it lies a part `confidence` of a distribution about zero.

    Its angle atan(t / sqrt(freedom)) is bisected in the finite sums of Abramowitz and Stegun,
    26.7.3 and 26.7.4.

    Examples
    --------
    >>> round(student_t(0.95, 19), 9)
    2.093024054
    """
    low, high = 0.0, 0.5 * math.pi
    while low < (angle := 0.5 * (low + high)) < high:
        if _within(angle, freedom) < confidence:
            low = angle
        else:
            high = angle
    return math.sqrt(freedom) * math.tan(angle)


def _within(angle: float, freedom: int) -> float:
    """Part of the distribution within sqrt(freedom) tan(angle)."""
    sin, cos = math.sin(angle), math.cos(angle)
    odd = freedom % 2
    term, total = (cos if odd else 1.0), 0.0
    for k in range(2 + odd, freedom + 1, 2):
        total += term
        term *= cos * cos * (k - 1) / k
    return 2.0 / math.pi * (angle + sin * total) if odd else sin * total

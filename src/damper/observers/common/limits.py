"""Confidence limits of means: Student's t."""

import math
from functools import lru_cache

import numpy as np


def mean_within(over: np.ndarray, under: np.ndarray, confidence: float) -> tuple[float, float]:
    """Quotient of two sums over batches, and half the width of its confidence limits.

    To first order in the batches' deviations (Cochran, Sampling Techniques, 1977, chapter 6); NaN
    where there is none.
    """
    total, count = float(under.sum()), len(over)
    if not 0.0 < total < math.inf:
        return math.nan, math.nan
    mean = float(over.sum()) / total
    rest = over - mean * under if mean < math.inf else np.full(count, math.nan)
    error = math.sqrt(float(rest @ rest) / (count * (count - 1))) * count / total
    return mean, student_t(confidence, count - 1) * error


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

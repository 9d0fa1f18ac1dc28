"""Noise in a band: a sum of sines of random phases, the same numbers on all platforms.

Only what IEEE 754 rounds correctly is used: sums, products, quotients, square roots. Sines are made
of these, and rounded to whole parts of 2**-16. The sum of many products of two such is then a sum
of whole numbers below 2**53, which is exact in whatever order a library takes it, with fused steps
or without; the random numbers are bits of a generator whose stream numpy keeps.
"""

import math
from functools import lru_cache
from typing import Any

#: Parts of 1 in which sines are rounded, and lines summed at a time: a matter of memory.
_PARTS = 2.0**16
_LINES = 1024


# A damper in SI units makes it anew for each of its points.
@lru_cache(maxsize=4)
def noise(seed: int, count: int, first: int, last: int) -> Any:
    """Sum of the lines `first` to `last` at `count` steps of a period of 1, rms 1, ends included.

    Line k is sin(2 pi (k t + p_k)), with p_k a random multiple of 2**-32.
    """
    import numpy as np

    drawn = np.random.PCG64(seed).random_raw(last - first + 1)
    phases = (drawn >> np.uint64(32)) / 2.0**32
    # With samples n = coarse + fine, few sines serve all samples.
    width = math.isqrt(count) + 1
    coarse, fine = np.arange(0, count, width, dtype="i8"), np.arange(width, dtype="i8")
    total = np.zeros((coarse.size, width))
    for start in range(first, last + 1, _LINES):
        lines = np.arange(start, min(start + _LINES, last + 1), dtype="i8")
        turned = phases[lines - first]
        sin, cos = _rounded_sines((coarse[:, None] * lines) % count / count + turned)
        fine_sin, fine_cos = _rounded_sines((fine[:, None] * lines) % count / count)
        total += sin @ fine_cos.T + cos @ fine_sin.T
    values = total.ravel()[:count] * (math.sqrt(2.0 / (last - first + 1)) / _PARTS**2)
    values = np.append(values, values[0])
    values.setflags(write=False)
    return values


def _rounded_sines(turns: Any) -> tuple[Any, Any]:
    """Sine and cosine of angles in turns, 0 to 2, in whole parts."""
    import numpy as np

    # To the nearest quarter: the difference is exact, and at most an eighth of a turn.
    quarters = np.rint(4.0 * turns)
    angle = (turns - 0.25 * quarters) * (2.0 * math.pi)
    square = angle * angle
    sin = angle * _series(square, 1)
    cos = _series(square, 0)
    quarter = quarters.astype(int) % 4
    odd = quarter % 2 == 1
    sign_sin = np.where(quarter >= 2, -_PARTS, _PARTS)
    sign_cos = np.where((quarter == 1) | (quarter == 2), -_PARTS, _PARTS)
    return np.rint(sign_sin * np.where(odd, cos, sin)), np.rint(sign_cos * np.where(odd, sin, cos))


def _series(square: Any, first: int) -> Any:
    """Taylor series of the cosine (`first` 0), or of sine over angle (1), up to an eighth turn."""
    total = 1.0
    for n in range(10, 0, -1):
        total = 1.0 - square * total / ((2 * n + first) * (2 * n - 1 + first))
    return total

"""Which value of an axis is the best one: one rule for tables and for figures."""

import numpy as np

#: What differs by less than the rest of a transient counts as equal.
_EQUAL = 1e-6


def least(values: np.ndarray) -> int:
    """Index of the first of the least values; NaN is never the least, unless all are.

    Values that differ by a transient's rest are equal, so that where the masses never touch the
    choice is not left to rounding.

    Examples
    --------
    >>> least(np.array([np.nan, 3.0, 2.0000001, 2.0]))
    2
    """
    values = np.where(np.isnan(values), np.inf, values)
    lowest = values.min()
    return int(np.argmax(values <= lowest + _EQUAL * abs(lowest)))

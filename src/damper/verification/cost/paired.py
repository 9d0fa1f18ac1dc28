"""Paired, interleaved measurement: a change of the machine's pace meets all that is compared.

Every repeat runs each case once, one after the other, and each second repeat goes backwards, so
that a steady drift cancels. What is compared are ratios and differences within a repeat; their
median and quartiles are what a table shows.
"""

import time
from collections.abc import Callable, Sequence
from typing import Any, NamedTuple

import numpy as np


class Spread(NamedTuple):
    """Median and quartiles."""

    low: float
    median: float
    high: float

    def __str__(self) -> str:
        return f"{self.median:.3f} [{self.low:.3f}, {self.high:.3f}]"


def take_turns(
    cases: Sequence[Callable[[], Any]],
    repeats: int,
    clock: Callable[[], float] = time.perf_counter,
) -> np.ndarray:
    """Time every case once a repeat.

    Parameters
    ----------
    cases : sequence of callable
        What is timed, already warmed up.
    repeats : int
    clock : callable
        Seconds of a clock that never goes back.

    Returns
    -------
    ndarray (repeats, cases)
        Seconds.
    """
    seconds = np.empty((repeats, len(cases)))
    for repeat in range(repeats):
        order = range(len(cases)) if repeat % 2 == 0 else reversed(range(len(cases)))
        for column in order:
            started = clock()
            cases[column]()
            seconds[repeat, column] = clock() - started
    return seconds


def spread(values: np.ndarray) -> Spread:
    """Median and quartiles of values, NaN left out.

    Examples
    --------
    >>> spread(np.array([4.0, 1.0, 3.0, 2.0, 5.0]))
    Spread(low=2.0, median=3.0, high=4.0)
    """
    return Spread(*(float(value) for value in np.nanquantile(values, [0.25, 0.5, 0.75])))

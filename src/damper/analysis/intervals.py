"""Tables of chatter intervals: where along one axis a study chatters, edges bisected.

An interval is a run of neighbouring grid values at which a predicate holds. Each of its edges is
bisected between the two differing neighbours, every run from rest, until both are closer than the
resolution; the edge given is the last value at which the predicate was seen to hold. Chaotic edges
are not unique, so intervals narrower than two grid steps are flagged.
"""

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from damper.analysis.runs import runs
from damper.sweep.runs import run_points

#: Name -> what `chatter` must be.
PREDICATES: dict[str, Callable[[int], bool]] = {
    "complete": lambda chatter: chatter == 2,
    "any": lambda chatter: chatter >= 1,
}


@dataclass(frozen=True)
class Interval:
    """One interval of a predicate along the axis of a table.

    `narrow`: narrower than two grid steps. `cut`: it reaches the end of the axis.
    """

    where: dict[str, float]
    threshold: str
    chatter: str
    lower: float
    upper: float
    narrow: bool
    cut: bool


class ChatterAt:
    """Chatter of single lanes for every threshold at once, each value simulated once.

    Parameters
    ----------
    along : str
        Name of the parameter that varies.
    fixed : mapping
        All other parameters.
    thresholds : sequence
        Visibility thresholds as the bursts observer takes them.
    settings : mapping
        transient, periods, accuracy and max_events.
    """

    def __init__(
        self,
        along: str,
        fixed: Mapping[str, float],
        thresholds: Sequence[Any],
        settings: Mapping[str, Any],
    ) -> None:
        self._along = along
        self._fixed = dict(fixed)
        self._observer = {
            "bursts": {"threshold": thresholds[0], "compare_thresholds": thresholds[1:]}
        }
        self._settings = settings
        self._known: dict[float, np.ndarray] = {}

    def __call__(self, value: float) -> np.ndarray:
        """Chatter at a value of the parameter, one number per threshold."""
        if value not in self._known:
            arrays, _ = run_points(
                [self._fixed | {self._along: value}], self._observer, **self._settings
            )
            more = arrays.get("chatter_by_threshold", np.empty((1, 0)))
            self._known[value] = np.concatenate([arrays["chatter"], more[0]])
        return self._known[value]


def intervals(
    values: Sequence[float],
    chatter: Sequence[int],
    holds: Callable[[int], bool],
    chatter_at: Callable[[float], int],
    resolution: float,
) -> Iterator[tuple[float, float, bool, bool]]:
    """Find the intervals of a predicate on a grid and bisect their edges.

    Parameters
    ----------
    values : sequence of float
        The grid, in increasing order.
    chatter : sequence of int
        Chatter on the grid.
    holds : callable
        The predicate on chatter.
    chatter_at : callable
        Chatter at any value between grid values.
    resolution : float
        Largest distance from an edge to a value at which the predicate was seen to fail.

    Yields
    ------
    lower, upper : float
        Outermost values at which the predicate was seen to hold.
    narrow, cut : bool
        Narrower than two grid steps; reaching the end of the grid.
    """
    inside = [holds(int(value)) for value in chatter]
    for first, last in runs(inside):
        lower, upper = values[first], values[last]
        if first > 0:
            lower = _edge(lower, values[first - 1], holds, chatter_at, resolution)
        if last + 1 < len(inside):
            upper = _edge(upper, values[last + 1], holds, chatter_at, resolution)
        before, after = max(first - 1, 0), min(last + 1, len(inside) - 1)
        step = (values[after] - values[before]) / max(after - before, 1)
        yield lower, upper, upper - lower < 2.0 * step, first == 0 or last + 1 == len(inside)


def _edge(
    inside: float,
    outside: float,
    holds: Callable[[int], bool],
    chatter_at: Callable[[float], int],
    resolution: float,
) -> float:
    while abs(outside - inside) > resolution * (1.0 + 1e-9):
        middle = 0.5 * (inside + outside)
        if middle in (inside, outside):
            break
        if holds(int(chatter_at(middle))):
            inside = middle
        else:
            outside = middle
    return inside

"""Chatter intervals: where along one axis a cube chatters, edges bisected by more runs.

An interval is a run of neighbouring grid values at which a predicate holds. Each of its edges is
bisected between the two differing neighbours, every run from rest, until both are closer than the
resolution; the edge given is the last value at which the predicate was seen to hold. In chaotic
motion the runs on both sides of an edge are chance: each edge says whether it survives shifts far
below the resolution, and intervals narrower than two grid steps are flagged.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Mapping, Sequence
from typing import Any, NamedTuple

import numpy as np

from damper.analysis.places import (
    fixed_values,
    own_values,
    places,
    require_axes,
    require_known,
    require_variables,
    within,
)
from damper.analysis.runs import runs
from damper.parameters.lazy import pd, xr
from damper.parameters.quantity import in_range, real
from damper.parameters.units import own_number
from damper.parameters.variables import Chatter
from damper.sweep.record import recorded

#: Name -> least `chatter` at which it holds.
PREDICATES = {"complete": 2, "any": 1}

SHIFTS = tuple(1e-13 * k for k in range(1, 11))
"""Parts of a value by which it is shifted to see whether an edge survives."""


class Interval(NamedTuple):
    """Outermost values at which something was seen to hold, and the next at which it was not."""

    lower: float
    upper: float
    narrow: bool
    """Whether it is narrower than two grid steps."""
    cut: bool
    """Whether it reaches the end of the grid."""
    below: float | None
    """None at the end of the grid."""
    above: float | None


def chatter_intervals(cube: xr.Dataset, along: str, resolution: float = 1e-3) -> pd.DataFrame:
    """All intervals of complete and of any chatter along one axis of a cube.

    Parameters
    ----------
    cube : xarray.Dataset
        With the variables of the observer ``bursts``; from rest or the steady response, one run at
        each point. Each visibility threshold of the observer is looked at.
    along : str
        Axis of a parameter.
    resolution : float, default 1e-3
        Edges are bisected to this distance, in units of the axis.

    Returns
    -------
    pandas.DataFrame
        One row for each interval, ordered by the other axes, threshold, predicate, place. Columns
        are the other axes and

        - ``threshold``: of visibility, the main one first;
        - ``chatter``: ``complete`` or ``any``;
        - ``<along>_lower``, ``<along>_upper``: outermost values with chatter;
        - ``narrow``: narrower than two grid steps;
        - ``cut``: reaches the end of the axis;
        - ``lower_survives``, ``upper_survives``: whether the runs on both sides of the edge show
          the same when the value is shifted by parts of 1e-13 to 1e-12. An edge that does not
          survive is chance. True at an end of the axis, where there is no edge.

    Raises
    ------
    ValueError
        When the cube lacks the axis, was made without bursts, or more of it cannot be run.

    Examples
    --------
    >>> import damper
    >>> cube = damper.simulate(mass_ratio=0.1, damping_ratio=0.02, frequency_ratio=1.3,
    ...                        clearance=0.05, restitution=[0.2, 0.4, 0.6, 0.8], transient=20,
    ...                        periods=5, observers=["bursts"])
    >>> found = chatter_intervals(cube, along="restitution", resolution=0.05)
    >>> found[["chatter", "restitution_lower", "restitution_upper"]].round(3)
        chatter  restitution_lower  restitution_upper
    0  complete               0.45               0.75
    1       any               0.45               0.80
    """
    require_axes(cube, along)
    require_variables(cube, "bursts", "chatter")
    in_range("resolution", resolution, minimum=0, above=True)
    require_known(cube.chatter)
    visible = thresholds(cube)
    run = recorded(cube, "bursts")
    fixed = fixed_values(cube)
    order = np.argsort(cube[along].values)
    values = cube[along].values[order].tolist()
    found = []
    for where in places(cube.chatter, along):
        place = cube.sel(where).isel({along: order})
        here = {name: own_values(cube, name, value) for name, value in where.items()}
        bodies = [here.pop("body")] if "body" in here else []
        units = cube[along].attrs.get("units")
        chatter_at = ChatterAt(along, fixed | here, list(visible.values()), run, units, bodies)
        for k, (name, threshold) in enumerate(visible.items()):
            grid = place.chatter
            if k:
                grid = place.chatter_by_threshold.sel(threshold=threshold)
            for predicate, least in PREDICATES.items():

                def holds_at(
                    value: float, at: ChatterAt = chatter_at, k: int = k, least: int = least
                ) -> bool:
                    return bool(at(value)[k] >= least)

                for one in intervals(values, grid.values >= least, holds_at, resolution):
                    lasting = (
                        _survives(one.lower, one.below, holds_at),
                        _survives(one.upper, one.above, holds_at),
                    )
                    found.append((*where.values(), name, predicate, *one[:4], *lasting))
    others = [dim for dim in cube.chatter.dims if dim != along]
    columns = [*others, "threshold", "chatter", f"{along}_lower", f"{along}_upper"]
    flags = ["narrow", "cut", "lower_survives", "upper_survives"]
    return pd.DataFrame(found, columns=[*columns, *flags]).astype(dict.fromkeys(flags, bool))


def chatter_in_range(cube: xr.Dataset, along: str, low: float, high: float) -> dict[str, float]:
    """Where along an axis a cube chatters, and at how many points in a range and outside it.

    Parameters
    ----------
    cube : xarray.Dataset
        With the variables of the observer ``bursts``. A value of the axis chatters if any run there
        does.
    along : str
        Axis of a parameter.
    low, high : float
        Ends of the range, which belong to it.

    Returns
    -------
    dict of str to float
        ``lowest`` and ``highest``: least and greatest value with chatter, NaN without chatter.
        ``in_range``, ``outside``: number of values there; ``chatter_in_range``,
        ``chatter_outside``: number of these with chatter. ``unknown``: number of values where a run
        stopped early and no run chatters.
    """
    require_axes(cube, along)
    require_variables(cube, "bursts", "chatter")
    if not real("low", low) <= real("high", high):
        raise ValueError(f"low = {low!r}, high = {high!r}: low must be at most high")
    grid = cube[along].values
    others = [dim for dim in cube.chatter.dims if dim != along]
    chatter = (cube.chatter > Chatter.NONE).any(others).values
    known = chatter | cube.chatter.notnull().all(others).values
    inside = within(grid, low, high)
    ends = (grid[chatter].min(), grid[chatter].max()) if chatter.any() else (np.nan, np.nan)
    return {
        "lowest": float(ends[0]),
        "highest": float(ends[1]),
        "in_range": int((known & inside).sum()),
        "chatter_in_range": int((chatter & inside).sum()),
        "outside": int((known & ~inside).sum()),
        "chatter_outside": int((chatter & ~inside).sum()),
        "unknown": int((~known).sum()),
    }


def thresholds(cube: xr.Dataset) -> dict[str, Any]:
    """Visibility thresholds of a cube, the main one first, as the bursts observer takes them.

    Their names are `3 %` of the first approach speed of a burst, or `speed 0.01`.
    """
    from damper.observers.bursts import Bursts

    made = Bursts(**recorded(cube, "bursts")["observers"]["bursts"])
    fraction, speed = made.threshold
    main = {f"speed {speed:g}": {"speed": speed}} if speed else {_percent(fraction): fraction}
    return main | {_percent(value): value for value in made.compare_thresholds if value != fraction}


def _percent(fraction: float) -> str:
    return f"{100.0 * fraction:g} %"


def hulls(found: pd.DataFrame, along: str) -> pd.DataFrame:
    """Lowest and highest value with chatter of `chatter_intervals`, narrow intervals left out.

    A row for each place, threshold and predicate with chatter; the columns of `chatter_intervals`
    without ``narrow`` and ``cut``.
    """
    lower, upper = f"{along}_lower", f"{along}_upper"
    wide = found[~found["narrow"]]
    keys = list(found.columns[: found.columns.get_loc(lower)])
    groups = wide.groupby(keys, sort=False)
    first = wide.loc[groups[lower].idxmin(), [*keys, lower, "lower_survives"]]
    last = wide.loc[groups[upper].idxmax(), [upper, "upper_survives"]]
    return first.reset_index(drop=True).join(last.reset_index(drop=True))


def edge_moves(found: pd.DataFrame, along: str, low: str, high: str) -> pd.DataFrame:
    """How far the hulls of `chatter_intervals` move from one visibility threshold to another.

    A row for each place and predicate with chatter at the threshold `low`: the place, ``chatter``,
    and the moves ``lower`` and ``upper`` of the edges in units of the axis, NaN where no run
    chatters at `high`.
    """
    spans = hulls(found, along)
    spans = spans.drop(columns=["lower_survives", "upper_survives"])
    before, after = (
        spans[spans["threshold"] == name].drop(columns="threshold") for name in (low, high)
    )
    keys = [name for name in before.columns if not name.startswith(f"{along}_")]
    both = before.merge(after, on=keys, how="left", suffixes=("", "_after"))
    moves = {
        end: both[f"{along}_{end}_after"] - both[f"{along}_{end}"] for end in ("lower", "upper")
    }
    return both[keys].assign(**moves)


class ChatterAt:
    """Chatter of single runs for every threshold at once, each value of `along` simulated once.

    All other parameters are `fixed`. Thresholds are as the bursts observer takes them; after the
    first one, fractions. `run` has the other arguments of `damper.sweep.runs.run_points`. Of
    several free masses `bodies` has the number of the one.
    """

    def __init__(
        self,
        along: str,
        fixed: Mapping[str, float],
        thresholds: Sequence[Any],
        run: Mapping[str, Any],
        units: str | None = None,
        bodies: Sequence[int] = (),
    ) -> None:
        self._along, self._units = along, units
        self._fixed = dict(fixed)
        observer: dict[str, Any] = {"threshold": thresholds[0], "bodies": bodies}
        observer["compare_thresholds"] = thresholds[1:]
        self._run = {**run, "observers": {"bursts": observer}}
        self._known: dict[float, np.ndarray] = {}

    def __call__(self, value: float) -> np.ndarray:
        """Chatter at a value of the parameter, one number per threshold."""
        if value not in self._known:
            # Loads the engine, which figures that show intervals do not need.
            from damper.sweep.runs import run_points

            point = self._fixed | {self._along: own_number(value, self._units)}
            arrays, _ = run_points([point], **self._run)
            if arrays["status"][0]:
                raise ValueError(f"chatter is not known: the run at {point} stopped early")
            more = arrays.get("chatter_by_threshold", np.empty(0))
            self._known[value] = np.concatenate([arrays["chatter"].ravel(), more.ravel()])
        return self._known[value]


def intervals(
    values: Sequence[float],
    inside: Sequence[bool] | np.ndarray,
    holds_at: Callable[[float], bool],
    resolution: float,
) -> Iterator[Interval]:
    """Find the intervals in which something holds over a rising grid, and bisect their edges.

    `inside` says where it holds on the grid, `holds_at` whether it does in between; `resolution` is
    the largest distance from an edge to a value at which it was seen to fail.
    """
    for first, last in runs(inside):
        lower, upper = values[first], values[last]
        below = above = None
        if first > 0:
            lower, below = bisected(lower, values[first - 1], holds_at, resolution)
        if last + 1 < len(inside):
            upper, above = bisected(upper, values[last + 1], holds_at, resolution)
        before, after = max(first - 1, 0), min(last + 1, len(inside) - 1)
        step = (values[after] - values[before]) / max(after - before, 1)
        cut = first == 0 or last + 1 == len(inside)
        yield Interval(lower, upper, upper - lower < 2.0 * step, cut, below, above)


def _survives(inside: float, outside: float | None, holds_at: Callable[[float], bool]) -> bool:
    """Whether an edge is still there after every one of the `SHIFTS` of the values on its sides."""
    if outside is None:
        return True
    # The interval only shrinks, so both ends stay in the parameter's range.
    towards = math.copysign(1.0, outside - inside)
    within, beyond = towards * abs(inside), towards * abs(outside)
    return all(
        holds_at(inside + shift * within) and not holds_at(outside - shift * beyond)
        for shift in SHIFTS
    )


def bisected(
    inside: float, outside: float, holds_at: Callable[[float], bool], resolution: float
) -> tuple[float, float]:
    """Bisect between a value that chatters and a value that does not, down to a resolution."""
    while abs(outside - inside) > resolution * (1.0 + 1e-9):
        middle = 0.5 * (inside + outside)
        if middle in (inside, outside):
            break
        if holds_at(middle):
            inside = middle
        else:
            outside = middle
    return inside, outside

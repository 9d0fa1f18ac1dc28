"""Several runs at each point of a grid: directions of a continuation, random initial states."""

import random
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from itertools import pairwise
from itertools import product as combinations
from typing import Any

from damper.parameters.quantities import INITIAL_NAMES

#: What an axis may be followed in; both directions make two branches.
DIRECTIONS = {"up": ("up",), "down": ("down",), "both": ("up", "down")}


@dataclass(frozen=True)
class Branches:
    """Points of all runs, and how the runs lie: the grid, then `dimensions`, last one fastest."""

    points: list[dict[str, float]]
    dimensions: dict[str, list[Any]] = field(default_factory=dict)
    labels: dict[str, list[float]] = field(default_factory=dict)
    after: list[int] | None = None
    primary: str = "rest"


def branches(
    grid: list[dict[str, float]],
    axes: Mapping[str, Sequence[float]],
    initial: Mapping[str, Any],
    follow: Mapping[str, str],
) -> Branches:
    """Expand the points of a grid into runs.

    Parameters
    ----------
    grid : list of mapping
        The product of `axes`, the last one fastest.
    axes : mapping of str to values
    initial : mapping
        ``primary``, ``draws``, ``seed`` and the range [low, high] of each random quantity. The
        draws are the same at every point.
    follow : mapping of str to str
        At most one axis -> "up", "down" or "both". Up is towards larger values, in whatever order
        the axis lists them.

    Returns
    -------
    Branches
    """
    dimensions: dict[str, list[Any]] = {}
    for way in follow.values():
        dimensions["direction"] = list(DIRECTIONS[way])
    labels: dict[str, list[float]] = {}
    if "draws" in initial:
        dimensions["draw"] = list(range(initial["draws"]))
        labels = draws(initial)
    count = len(list(combinations(*dimensions.values())))
    drawn = [
        {name: values[number] for name, values in labels.items()}
        for number in dimensions.get("draw", ())
    ] or [{}]
    directions = dimensions.get("direction", [None])
    points = [
        point | values if values else point
        for point in grid
        for _ in directions
        for values in drawn
    ]
    after = None
    for name in follow:
        after = _predecessors(axes, name, directions, len(drawn), count)
    return Branches(points, dimensions, labels, after, initial.get("primary", "rest"))


def draws(initial: Mapping[str, Any]) -> dict[str, list[float]]:
    """Draw the random initial quantities, uniformly.

    By Python's own generator, whose numbers for a seed are the same on every platform and version.

    Examples
    --------
    >>> draws({"draws": 2, "seed": 1, "initial_position": [-1, 1]})
    {'initial_position': [-0.7312715117751976, 0.6948674738744653]}
    """
    generator = random.Random(initial["seed"])
    ranges = {name: initial[name] for name in INITIAL_NAMES if initial.get(name)}
    drawn: dict[str, list[float]] = {name: [] for name in ranges}
    for _ in range(initial["draws"]):
        for name, (low, high) in ranges.items():
            part = generator.random()
            drawn[name].append(low * (1.0 - part) + high * part)
    return drawn


def _predecessors(
    axes: Mapping[str, Sequence[float]],
    name: str,
    directions: Sequence[str],
    drawn: int,
    branch_count: int,
) -> list[int]:
    """For each run the one whose end it starts from: its neighbour along the axis, or -1."""
    values = axes[name]
    upwards = sorted(range(len(values)), key=values.__getitem__)
    before_up = {b: a for a, b in pairwise(upwards)}
    before_down = {a: b for b, a in before_up.items()}
    sizes = [len(points) for points in axes.values()]
    place = list(axes).index(name)
    stride = branch_count
    for size in sizes[place + 1 :]:
        stride *= size
    after: list[int] = []
    for at in combinations(*map(range, sizes)):
        for direction in directions:
            neighbour = (before_up if direction == "up" else before_down).get(at[place], -1)
            for _ in range(drawn):
                number = len(after)
                after.append(-1 if neighbour < 0 else number + (neighbour - at[place]) * stride)
    return after

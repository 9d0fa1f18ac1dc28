"""Several runs at each point of a grid: directions of a continuation, random draws."""

import random
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from itertools import pairwise
from itertools import product as combinations
from typing import Any

from damper.parameters.quantities import quantities_in

#: What an axis may be followed in; both directions make two branches.
DIRECTIONS = {"up": ("up",), "down": ("down",), "both": ("up", "down")}


@dataclass(frozen=True)
class Branches:
    """Points of all runs, and how the runs lie: the grid, then `dimensions`, last one fastest."""

    points: list[dict[str, float]]
    dimensions: dict[str, list[Any]] = field(default_factory=dict)
    labels: dict[str, list[float]] = field(default_factory=dict)
    predecessor: list[int] | None = None


def branches(
    grid: list[dict[str, float]],
    axes: Mapping[str, Sequence[float]],
    draws: Mapping[str, Any],
    follow: Mapping[str, str],
) -> Branches:
    """Expand the points of a grid into runs.

    Parameters
    ----------
    grid : list of mapping
        The product of `axes`, the last one fastest.
    axes : mapping of str to values
    draws : mapping
        As for `draw`, or empty. The draws are the same at every point.
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
    if draws:
        dimensions["draw"] = list(range(*draws.get("only", (0, draws["count"]))))
        labels = draw(draws)
    count = len(list(combinations(*dimensions.values())))
    drawn = [
        {name: values[number] for name, values in labels.items()}
        for number in range(len(dimensions.get("draw", ())))
    ] or [{}]
    directions = dimensions.get("direction", [None])
    points = [
        point | values if values else point
        for point in grid
        for _ in directions
        for values in drawn
    ]
    predecessor = None
    for name in follow:
        predecessor = _predecessors(axes, name, directions, len(drawn), count)
    return Branches(points, dimensions, labels, predecessor)


def draw(draws: Mapping[str, Any]) -> dict[str, list[float]]:
    """Draw random quantities: name -> a value for each draw.

    By Python's own generator, whose numbers for a seed are the same on every platform and version.

    Parameters
    ----------
    draws : mapping
        ``count``, ``seed``; ``only``, the first and one past the last of those that are wanted, if
        not all are; and for each quantity a mapping: ``range`` [low, high], uniform or by
        ``spacing`` "log" uniform in its logarithm; ``values``, of which it takes one; or both, the
        values then in a ``share`` of the draws.

    Examples
    --------
    >>> draw({"count": 2, "seed": 1, "initial_position": {"range": [-1, 1]}})
    {'initial_position': [-0.7312715117751976, 0.6948674738744653]}
    """
    generator = random.Random(draws["seed"])
    rules = {name: draws[name] for name in quantities_in(draws)}
    drawn: dict[str, list[float]] = {name: [] for name in rules}
    for _ in range(draws["count"]):
        for name, rule in rules.items():
            drawn[name].append(_draw_one(generator, rule))
    return {name: values[_only(draws)] for name, values in drawn.items()}


def noise_seeds(draws: Mapping[str, Any]) -> list[int]:
    """Seeds of noise, one for each draw; with a stream of their own, whatever else is drawn.

    Examples
    --------
    >>> noise_seeds({"count": 2, "seed": 1})
    [894258943, 1895454466]
    """
    generator = random.Random(f"noise {draws['seed']}")
    return [generator.getrandbits(32) for _ in range(draws["count"])][_only(draws)]


def _only(draws: Mapping[str, Any]) -> slice:
    return slice(*draws.get("only", (None,)))


def _draw_one(generator: random.Random, rule: Mapping[str, Any]) -> float:
    """Draw one value; as many random numbers for each rule, whatever comes out."""
    values = rule.get("values", ())
    listed = bool(values)
    if values and "range" in rule:
        listed = generator.random() < rule["share"]
    part = generator.random()
    if listed:
        return float(values[int(part * len(values))])
    low, high = rule["range"]
    if rule.get("spacing") != "log":
        return float(low * (1.0 - part) + high * part)
    # The last digits of a power are not the same on every machine.
    value = float(f"{low ** (1.0 - part) * high**part:.12g}")
    return float(min(max(value, low), high))


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
    found: list[int] = []
    for at in combinations(*map(range, sizes)):
        for direction in directions:
            neighbour = (before_up if direction == "up" else before_down).get(at[place], -1)
            for _ in range(drawn):
                number = len(found)
                found.append(-1 if neighbour < 0 else number + (neighbour - at[place]) * stride)
    return found

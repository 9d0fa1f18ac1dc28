"""The box of parameters that the stress study covers: its corners, edges and random inside.

A point is a mapping of names to values for `damper.sweep.points.read_point`: parameters of one
model, and initial quantities where they are not zero.
"""

import math
from collections.abc import Iterable, Mapping, Sequence
from itertools import product
from random import Random
from typing import Any

import numpy as np

from damper.parameters.quantities import ALL, INITIAL_NAMES, PARAMETER_NAMES

#: Quantities of a run; those that it does not give have their defaults.
POINT_NAMES = (*PARAMETER_NAMES, *INITIAL_NAMES)
#: Distance from the wall of a free mass that is about to graze it; small, so that the primary's
#: acceleration is nearly constant on the way.
_GRAZING_GAP = 1e-8

#: How points may start.
STARTS = ("centre", "wall", "approaching", "grazing")


def start_of(name: str, clearance: float) -> dict[str, float]:
    """Initial quantities of one of the `STARTS` that are not zero.

    - ``centre``: at rest, in the middle.
    - ``wall``: at rest on the right wall. With phase 0 the primary has no acceleration then, and
      the wall draws away with the third derivative only.
    - ``approaching``: on the right wall, and into it at relative speed 1.
    - ``grazing``: near the right wall, which draws away from it at the acceleration 1 (primary at
      -1, phase 0), and just as fast as to reach it with no relative velocity, s^2 = 2 gap.
    """
    if name == "centre":
        return {}
    if name == "wall":
        return {"initial_position": 1.0}
    if name == "approaching":
        return {"initial_position": 1.0, "initial_relative_velocity": 1.0}
    gap = min(_GRAZING_GAP, 0.5 * clearance)
    return {
        "initial_displacement": -1.0,
        "initial_position": 1.0 - gap / clearance if clearance > 0.0 else 1.0,
        "initial_relative_velocity": math.sqrt(2.0 * gap),
    }


def corners(
    values: Mapping[str, Sequence[float]], starts: Iterable[str] = STARTS
) -> list[dict[str, float]]:
    """Every combination of values and starts, the last parameter fastest, after the starts."""
    names = tuple(starts)
    points = (dict(zip(values, corner, strict=True)) for corner in product(*values.values()))
    return [point | start_of(name, point["clearance"]) for point in points for name in names]


def random_points(
    count: int, seed: int, box: Mapping[str, Any], first: int = 0, which: tuple[int, int] = (0, 1)
) -> list[dict[str, float]]:
    """Points at random, the same for a seed on every machine, each independent of the others.

    ``box["parameters"]`` gives for each parameter or initial quantity what it may be: ``range``
    [low, high], log-uniform where low > 0 and uniform else, ``values``, or both; a pair alone is a
    range. ``models``, optional, gives names of other models of the damper, each with the ``share``
    of points that it gets and the ``parameters`` it adds. Where a quantity has both range and
    values, ``share`` is the part of points that have one of the values. Points from `first` on are
    those that a longer list has from there on; of the parts that `part` makes only points of
    `which` are drawn.
    """
    numbers = part(range(first, first + count), *which)
    return [_draw(Random(f"{seed} {number}"), box) for number in numbers]


def points_of(points: Sequence[Mapping[str, float]]) -> dict[str, np.ndarray]:
    """Quantities of points as arrays (points,); defaults where a point gives none."""
    return {
        name: np.array([point.get(name, ALL[name].default) for point in points], dtype=float)
        for name in POINT_NAMES
    }


def _draw(random: Random, box: Mapping[str, Any]) -> dict[str, float]:
    share = box.get("share", 0.0)
    point = {name: _value(random, rule, share) for name, rule in box["parameters"].items()}
    which = random.random()
    for model in box.get("models", {}).values():
        which -= model["share"]
        if which < 0.0:
            more = {n: _value(random, rule, share) for n, rule in model["parameters"].items()}
            return point | more
    return point


def _value(random: Random, rule: Mapping[str, Any] | Sequence[float], share: float) -> float:
    """Draw one value; as many random numbers for each rule, whatever comes out."""
    if not isinstance(rule, Mapping):
        rule = {"range": rule}
    edge, place = random.random() < share, random.random()
    values = rule.get("values", ())
    if values and (edge or "range" not in rule):
        return float(values[int(place * len(values))])
    low, high = rule["range"]
    value = low * (high / low) ** place if low > 0.0 else low + (high - low) * place
    # Six digits: fit to be printed, and the same whatever the last digit of a power is.
    return float(f"{value:.6g}")


def part(points: Sequence[Any], number: int, parts: int) -> Sequence[Any]:
    """Return one of several parts of equal weight: every `parts`-th point, from `number` on.

    Neighbours cost alike, so parts of neighbours would not.

    Examples
    --------
    >>> part(list(range(5)), 1, 2)
    [1, 3]
    """
    return points[number::parts]

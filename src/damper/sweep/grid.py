"""Points of a grid. No engine here: a table of a cube that runs nothing loads none."""

from collections.abc import Iterable, Mapping


def product(axes: Mapping[str, Iterable[float]], fixed: Mapping[str, float]) -> list[dict]:
    """Points of a grid: the product of the axes, the last one fastest.

    Examples
    --------
    >>> [p["restitution"] for p in product({"restitution": (0.2, 0.4)}, {"clearance": 1.0})]
    [0.2, 0.4]
    """
    sets: list[dict] = [dict(fixed)]
    for name, values in axes.items():
        sets = [{**given, name: value} for given in sets for value in values]
    return sets

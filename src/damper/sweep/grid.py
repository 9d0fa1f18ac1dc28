"""Points of a grid. No engine here: a table of a cube that runs nothing loads none."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from typing import TYPE_CHECKING, Any

from damper.parameters.quantities import check_quantity
from damper.parameters.warned import warn

if TYPE_CHECKING:
    import numpy as np

#: Difference to a value, as a part of it, that is rounding.
ROUNDING = 1e-9


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


def lies_at(point: Mapping[str, Any], place: Mapping[str, float]) -> bool:
    """Whether a point has the values of a place; every point has those of an empty place."""
    return all(point[name] == value for name, value in place.items())


def nearest_value(name: str, along: Sequence[float] | np.ndarray, value: float) -> float:
    """Return the value of an axis nearest to a value at most half a step away from it.

    A warning names the value taken, where the difference is more than rounding.

    Raises
    ------
    ValueError, TypeError
        For a value farther away, with the range of the axis and its nearest value.

    Examples
    --------
    >>> nearest_value("clearance", [1.0, 2.0, 3.0], 2)
    2.0
    """
    import numpy as np

    values, value = np.sort(along), check_quantity(name, value)
    grid, at = values, value
    if geometric(values):
        with np.errstate(divide="ignore", invalid="ignore"):
            grid, at = np.log(values), np.log(value)
    half = 0.5 * np.diff(grid) if grid.size > 1 else np.zeros(1)
    slack = ROUNDING * abs(grid).max()
    nearest = float(values[np.argmin(abs(grid - at))])
    if not grid[0] - half[0] - slack <= at <= grid[-1] + half[-1] + slack:
        raise ValueError(
            f"{name} = {value!r}: outside the cube, which has {values[0]:g} to {values[-1]:g}; "
            f"the nearest value is {nearest!r}"
        )
    if abs(nearest - value) > ROUNDING * abs(values).max():
        words = f"{name} = {value!r} is no value of the cube: the nearest, {nearest!r}, is taken"
        warn(words)
    return nearest


def geometric(values: np.ndarray) -> bool:
    """Whether at least three values keep one ratio, so that a logarithmic axis suits them."""
    import numpy as np

    if len(values) < 3 or values.min() <= 0.0:
        return False
    ratios = values[1:] / values[:-1]
    return bool(np.allclose(ratios, ratios[0], rtol=1e-6))

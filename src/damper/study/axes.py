"""The values of an axis, formed in decimal, and the names that carry them.

A value is part of a file name, so 0.3 must be 0.3 and never 0.30000000000000004: every value is
computed with `decimal` from the numbers as written and becomes a float once, at the end.
"""

from __future__ import annotations

import math
import sys
from collections.abc import Sequence
from decimal import Context, Decimal, localcontext
from functools import lru_cache
from itertools import pairwise

MOST_VALUES = 1_000_000
"""An axis longer than this is a slip of the pen."""


def coordinate_name(name: str, value: float) -> str:
    """Return the part of a file name that carries one coordinate, such as ``mass_ratio~0.1``.

    The value is written in its shortest decimal form (1.0 as 1, 1e-08 as 1e-08).
    """
    return f"{name}~{short(value)}"


# A study is looked at several times over while it is checked, and a long axis takes a while.
@lru_cache(maxsize=16)
def grid(
    start: float, stop: float, num: int | None, step: float | None, spacing: str
) -> tuple[float, ...]:
    """Return the values from start to stop, `num` of them or a step apart: distinct and finite.

    Geometric ones are rounded to 12 significant digits. ValueError, meant for the reader of the
    study file, if the parts do not make an axis.
    """
    first, last = _decimal(start), _decimal(stop)
    if first >= last:
        raise ValueError(f"start ({short(start)}) must be less than stop ({short(stop)})")
    with localcontext(Context(prec=50)):
        if spacing == "log":
            values = _geometric(first, last, num)
        elif step is not None:
            values = _stepped(first, last, _decimal(step))
        else:
            assert num is not None
            values = [first + (last - first) * i / (num - 1) for i in range(num)]
    grid = tuple(float(v) + 0.0 for v in values)
    if len(set(grid)) < len(grid):
        raise ValueError(
            f"from {short(start)} to {short(stop)} there are no {len(grid)} distinct values: "
            "they lie too close together"
        )
    return grid


def _stepped(first: Decimal, last: Decimal, step: Decimal) -> list[Decimal]:
    span = last - first
    steps = span / step
    if steps > MOST_VALUES - 1:
        raise ValueError(f"step {short(step)} makes more than {MOST_VALUES} values")
    count = int(steps.to_integral_value())
    if count < 1 or abs(count * step - span) > Decimal("1e-9") * span:
        below = first + int(steps) * step
        hint = f"stop: {short(below)} or " if int(steps) else ""
        raise ValueError(
            f"step {short(step)} does not divide the range from {short(first)} to "
            f"{short(last)} ({float(steps):.6g} steps): use {hint}num: {max(count, 1) + 1}"
        )
    return [first + i * step for i in range(count)] + [last]


def _geometric(first: Decimal, last: Decimal, num: int | None) -> list[Decimal]:
    if num is None:
        raise ValueError("spacing log goes with num, not with step")
    if first <= 0:
        raise ValueError(f"spacing log needs start > 0 (value: {short(first)})")
    # A root and many products, in 50 digits: libm's pow depends on the machine.
    factor = (last / first) ** (Decimal(1) / (num - 1))
    values, value = [first], first
    rounded = Context(prec=12)
    for _ in range(num - 2):
        value *= factor
        values.append(rounded.plus(value))
    return [*values, last]


def clean(values: Sequence[float]) -> list[float]:
    """Return values that differ from decimals of 12 digits by roundoff alone as these decimals.

    Roundoff in equal steps is that of the largest value.

    Examples
    --------
    >>> clean([0.1, 0.1 + 0.1 + 0.1, 0.5]), clean([-0.1, 1.4e-17, 0.1]), clean([1e-17, 1 / 3])
    ([0.1, 0.3, 0.5], [-0.1, 0.0, 0.1], [1e-17, 0.3333333333333333])
    """
    steps = [b - a for a, b in pairwise(values)]
    size = max(map(abs, values))
    even = len(steps) > 1 and max(steps) - min(steps) <= 1e-9 * size
    return [_clean(value, size if even else abs(value)) for value in values]


def _clean(value: float, size: float) -> float:
    if not (size and math.isfinite(size)):
        return value
    near = round(value, 11 - math.floor(math.log10(size))) + 0.0
    return near if abs(near - value) <= 4.0 * sys.float_info.epsilon * size else value


def _decimal(number: float) -> Decimal:
    return Decimal(repr(number))


def short(number: float | Decimal) -> str:
    """Return a number in its shortest decimal form: 1.0 as 1, 1e-08 as 1e-08."""
    return repr(float(number) + 0.0).removesuffix(".0")

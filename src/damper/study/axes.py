"""The values of an axis, formed in decimal, and the names that carry them.

A value is part of a file name, so 0.3 must be 0.3 and never 0.30000000000000004: every value is
computed with `decimal` from the numbers as written and becomes a float once, at the end.
"""

from __future__ import annotations

from decimal import Context, Decimal, localcontext
from functools import lru_cache
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from damper.study.settings import Axis

MOST_VALUES = 1_000_000
"""An axis longer than this is a slip of the pen."""

WAYS = "values; or start and stop with num or step (spacing: log goes with num)"
"""The ways of giving an axis, in words."""


def axis_values(spec: Axis) -> tuple[float, ...]:
    """Return the values of an axis in order: distinct and finite.

    Geometric ones are rounded to 12 significant digits. ValueError, meant for the reader of the
    study file, if the parts do not make an axis.
    """
    if spec.values is not None:
        others = [n for n in ("start", "stop", "num", "step") if getattr(spec, n) is not None]
        if spec.spacing != "linear":
            others.append("spacing")
        if others:
            raise ValueError(f"values stands alone, but {', '.join(others)} is given as well")
        return tuple(spec.values)
    missing = [n for n in ("start", "stop") if getattr(spec, n) is None]
    if len(missing) == 2 and spec.num is None and spec.step is None:
        raise ValueError("does not say which values it has")
    if missing:
        raise ValueError(f"{' and '.join(missing)} is missing")
    if spec.num is not None and spec.step is not None:
        raise ValueError(f"num ({spec.num}) and step ({_short(spec.step)}) are both given")
    if spec.num is None and spec.step is None:
        raise ValueError("start and stop are given, but neither num nor step")
    return _grid(spec.start, spec.stop, spec.num, spec.step, spec.spacing)


def coordinate_name(name: str, value: float) -> str:
    """Return the part of a file name that carries one coordinate, such as ``mass_ratio~0.1``.

    The value is written in its shortest decimal form (1.0 as 1, 1e-08 as 1e-08).
    """
    return f"{name}~{_short(value)}"


# A study is looked at several times over while it is checked, and a long axis takes a while.
@lru_cache(maxsize=16)
def _grid(
    start: float, stop: float, num: int | None, step: float | None, spacing: str
) -> tuple[float, ...]:
    first, last = _decimal(start), _decimal(stop)
    if first >= last:
        raise ValueError(f"start ({_short(start)}) must be less than stop ({_short(stop)})")
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
            f"from {_short(start)} to {_short(stop)} there are no {len(grid)} distinct values: "
            "they lie too close together"
        )
    return grid


def _stepped(first: Decimal, last: Decimal, step: Decimal) -> list[Decimal]:
    span = last - first
    steps = span / step
    if steps > MOST_VALUES - 1:
        raise ValueError(f"step {_short(step)} makes more than {MOST_VALUES} values")
    count = int(steps.to_integral_value())
    if count < 1 or abs(count * step - span) > Decimal("1e-9") * span:
        below = first + int(steps) * step
        hint = f"stop: {_short(below)} or " if int(steps) else ""
        raise ValueError(
            f"step {_short(step)} does not divide the range from {_short(first)} to "
            f"{_short(last)} ({float(steps):.6g} steps): use {hint}num: {max(count, 1) + 1}"
        )
    return [first + i * step for i in range(count)] + [last]


def _geometric(first: Decimal, last: Decimal, num: int | None) -> list[Decimal]:
    if num is None:
        raise ValueError("spacing log goes with num, not with step")
    if first <= 0:
        raise ValueError(f"spacing log needs start > 0 (value: {_short(first)})")
    # One root and many products, in 50 digits: the same on every machine, unlike libm's pow.
    factor = (last / first) ** (Decimal(1) / (num - 1))
    values, value = [first], first
    rounded = Context(prec=12)
    for _ in range(num - 2):
        value *= factor
        values.append(rounded.plus(value))
    return [*values, last]


def _decimal(number: float) -> Decimal:
    return Decimal(repr(number))


def _short(number: float | Decimal) -> str:
    return repr(float(number) + 0.0).removesuffix(".0")

"""Contact laws of the walls of many free masses, each its own, of one class for compiled code.

Constants of a mass have the restitution of its walls at low speeds, `left` and `right`; the speed
`yields` up to which both are constant and the `exponent` with which they fall above it; and the
number of a wall's table, `left_table` and `right_table`, or -1.
"""

import math
from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np

from damper.engine.compiled import compiled, plain
from damper.engine.dispatch import by_class
from damper.engine.impact import (
    TabledRestitution,
    YieldingRestitution,
    rebound_slope,
    restitution_at,
    restitution_change,
)


class WallTables(NamedTuple):
    """Tables of the restitution of walls, those with fewer rows with the last one repeated."""

    tables: np.ndarray


class WallRestitution(NamedTuple):
    """Contact law of a wall where some walls have a table: this one's table, or else a power."""

    has_table: bool
    table: TabledRestitution
    power: YieldingRestitution


@restitution_at.of(WallRestitution)
def _restitution_at(law, approach_speed):
    if law.has_table:
        return restitution_at(law.table, approach_speed)
    return restitution_at(law.power, approach_speed)


@rebound_slope.of(WallRestitution)
def _rebound_slope(law, approach_speed):
    if law.has_table:
        return rebound_slope(law.table, approach_speed)
    return rebound_slope(law.power, approach_speed)


@restitution_change.of(WallRestitution)
def _restitution_change(law, approach_speed):
    if law.has_table:
        return restitution_change(law.table, approach_speed)
    return restitution_change(law.power, approach_speed)


@plain
def wall_laws(each: Sequence[Any]) -> tuple[Any, np.ndarray]:
    """What the contact laws of all walls are made of, and the walls of each mass in a row.

    A row has `left`, `right`, `yields`, `exponent`, `left_table` and `right_table`.
    """
    rows, tables = np.full((len(each), 6), -1.0), []
    for k, q in enumerate(each):
        own = q.tables if q.law == "tabled" else ()
        # Up to the least speed of its tables a restitution is constant, too.
        constant = min(table[0][0] for table in own) if own else q.yield_speed
        rows[k, :4] = *q.restitutions, constant, q.yield_exponent
        for wall, table in enumerate(own):
            if table not in tables:
                tables.append(table)
            rows[k, 4 + wall] = tables.index(table)
    if not tables:
        return YieldingRestitution(1.0, math.inf, 0.0), rows
    longest = max(map(len, tables))
    filled = [[*table, *[table[-1]] * (longest - len(table))] for table in tables]
    return WallTables(np.array(filled)), rows


@by_class
def law_in(walls: Any, m: Any, side: float) -> Any:
    """Contact law of a wall, from what the laws of all are made of."""


@law_in.of(YieldingRestitution)
def _power_law(walls, m, side):
    return YieldingRestitution(restitution_of(m, side), m.yields, m.exponent)


@law_in.of(WallTables)
def _law_with_tables(walls, m, side):
    number = int(m.left_table if side < 0.0 else m.right_table)
    table = TabledRestitution(walls.tables[number])
    power = YieldingRestitution(restitution_of(m, side), m.yields, m.exponent)
    return WallRestitution(number >= 0, table, power)


@compiled
def law_of(model: Any, m: Any, side: float) -> Any:
    """Contact law of a mass at one of its walls; `model` has in `law` what all are made of."""
    return law_in(model.law, m, side)


@compiled
def have_one_law(one: Any, other: Any, side: float) -> bool:
    """Whether two masses have the same contact law at one of their walls."""
    left = side < 0.0
    number, others = (
        (one.left_table, other.left_table) if left else (one.right_table, other.right_table)
    )
    if number >= 0.0 or others >= 0.0:
        return number == others
    same = restitution_of(one, side) == restitution_of(other, side)
    return same and one.yields == other.yields and one.exponent == other.exponent


@compiled
def restitution_of(m: Any, side: float) -> float:
    """Coefficient of restitution of a mass at one of its walls, at low speeds."""
    return m.left if side < 0.0 else m.right

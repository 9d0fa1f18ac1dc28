"""Tables of the restitution by the approach speed, of each wall."""

import math
import os
from collections.abc import Mapping
from itertools import pairwise
from typing import Any

from damper.parameters.names import split
from damper.parameters.quantity import is_listed, real
from damper.parameters.record_file import RecordFile

#: Coefficient of restitution of a wall -> the table that may be given in its place.
TABLE_OF = {
    "restitution": "restitution_table",
    "restitution_left": "restitution_table_left",
}
WALL_TABLES = tuple(TABLE_OF.values())
#: By what the speeds of all tables are multiplied: a number of a damper without a name of its own,
#: which changes with the unit of speed.
TABLE_SPEED = "table_speed"

Table = tuple[tuple[float, float], ...]


def read_table(name: str, given: Any, unit: str = "1") -> Table:
    """Check a table: rows (approach speed, coefficient of restitution) at rising speeds.

    A path is that of a CSV file with these two columns. `unit` is that of the speed: a unit in the
    head of its column must be this one, or a multiple. Between two rows the coefficient is linear
    in the logarithm of the speed, before the first and beyond the last it is constant.

    Raises
    ------
    ValueError
        Where a row is out of range, speeds do not rise, or a harder hit comes back slower: the
        rebound speed r(v) v falls between two rows where r + dr/d(log v) < 0.
    TypeError
        When it is no sequence of pairs of numbers.
    OSError
        Where a file cannot be read.

    Examples
    --------
    >>> read_table("restitution_table", [(0.1, 0.9), (1, 0.8)])
    ((0.1, 0.9), (1.0, 0.8))
    >>> read_table("restitution_table", [(0.1, 0.9), (0.2, 0.3)])
    Traceback (most recent call last):
    ...
    ValueError: restitution_table, rows 0 and 1: from (0.1, 0.9) to (0.2, 0.3) the rebound speed \
falls while the approach speed rises; the coefficient must fall by at most 0.3684 here
    """
    wanted = (
        f"{name}: must be rows (approach speed, restitution), such as [(0.1, 0.9), (1, 0.8)], or "
        "the path of a CSV file"
    )
    if isinstance(given, str | os.PathLike):
        import numpy as np

        file = RecordFile(given, (unit, "1"), words="approach speed and restitution")
        given = np.transpose(file.samples).tolist()
    if not is_listed(given):
        raise TypeError(f"{wanted}, not {given!r}")
    rows = []
    for k, row in enumerate(given):
        if not is_listed(row):
            raise TypeError(f"{wanted}; row {k} is {row!r}")
        pair = [real(f"{name}, row {k}", value) for value in row]
        if len(pair) != 2:
            raise TypeError(f"{wanted}; row {k} is {row!r}")
        rows.append((pair[0], pair[1]))
    if not rows:
        raise ValueError(f"{wanted}; it is empty")
    for k, (speed, r) in enumerate(rows):
        if not 0.0 < speed < math.inf:
            raise ValueError(f"{name}, row {k}: speed = {speed!r}: must be a finite number > 0")
        if not 0.0 <= r <= 1.0:
            raise ValueError(f"{name}, row {k}: restitution = {r!r}: must be from 0 to 1")
    for k, ((low, before), (high, r)) in enumerate(pairwise(rows)):
        which = f"{name}, rows {k} and {k + 1}"
        if not low < high:
            raise ValueError(f"{which}: speeds = {low!r}, {high!r}: must rise from row to row")
        # r is least, and its slope the same, at one of both ends.
        decades = math.log(high / low)
        if r + (r - before) / decades < 0.0:
            raise ValueError(
                f"{which}: from {rows[k]} to {rows[k + 1]} the rebound speed falls while the "
                f"approach speed rises; the coefficient must fall by at most "
                f"{before * decades / (1.0 + decades):.4g} here"
            )
    return tuple(rows)


def tables_over(values: Mapping[str, Any], speed: float) -> dict[str, Any]:
    """Tables of a damper and its masses, or of a mass, in another unit of speed; none not given."""
    found: dict[str, Any] = {
        name: tuple((v / speed, r) for v, r in values[name])
        for name in WALL_TABLES
        if values.get(name) is not None
    }
    if any(name in dict(mass) for mass in values.get("masses") or () for name in WALL_TABLES):
        found["masses"] = [dict(m) | tables_over(dict(m), speed) for m in values["masses"]]
    return found


def listed_tables(parameters: Mapping[str, Any]) -> dict[str, Table]:
    """Tables of a damper, and of its masses under names such as `restitution_table_1`."""
    found = {name: parameters[name] for name in WALL_TABLES if parameters.get(name) is not None}
    for k, mass in enumerate(parameters.get("masses") or ()):
        own = dict(mass)
        found |= {f"{name}_{k}": own[name] for name in WALL_TABLES if own.get(name) is not None}
    return found


def put_own(values: dict[str, Any], own: Mapping[str, Any]) -> None:
    """Put a mass's own restitution in place of a table of all masses, and the reverse."""
    for wall, table in TABLE_OF.items():
        if table in own:
            values |= {wall: own.get(wall, math.inf), table: own[table]}
        elif wall in own:
            values[table] = None


def refuse_beside_tables(values: Mapping[str, Any], where: str = "") -> None:
    """Raise ValueError for a wall that has a table and a coefficient; `where` names its mass."""
    for wall, table in TABLE_OF.items():
        if values.get(table) and values[wall] not in (None, math.inf):
            raise ValueError(
                f"{where}{wall} = {values[wall]!r} and {table}: the table says it; leave one of "
                "them out"
            )


def beside_numbers(masses: int = 0, tables: Mapping[str, Table] | None = None) -> dict[str, Any]:
    """Return the masses of every damper of a study, and its tables as `listed_tables`.

    Examples
    --------
    >>> beside_numbers(2, {"restitution_table_1": ((1.0, 0.5),)})
    {'masses': [{}, {'restitution_table': ((1.0, 0.5),)}]}
    """
    tables = dict(tables or {})
    made: dict[str, Any] = {name: tables.pop(name) for name in WALL_TABLES if name in tables}
    if masses:
        own: list[dict[str, Any]] = [{} for _ in range(masses)]
        for name, rows in tables.items():
            [(common, k)] = filter(None, [split(name, WALL_TABLES)])
            own[k][common] = rows
        made["masses"] = own
    return made

"""Compiled functions that read, write and change NamedTuples of many fields.

Compiled code knows neither `_replace` nor a call with a sequence, so the functions are written out
field by field from the names of the fields.
"""

from collections.abc import Callable
from typing import Any, TypeVar

from damper.engine.compiled import compiled

T = TypeVar("T")


def changed(kind: type[T], *names: str) -> Callable[..., T]:
    """Make a function of a tuple and new values of some of its fields, which returns a new tuple.

    The old tuple may be of another class that has the other fields.

    Examples
    --------
    >>> from damper.engine.bodies import Ballistic
    >>> heavier = changed(Ballistic, "acceleration")
    >>> heavier(Ballistic(0.5), -1.0)
    Ballistic(acceleration=-1.0, damping=0.0, stiffness=0.0, strength=0.0)
    """
    _require(kind, names)
    values = [name if name in names else f"old.{name}" for name in _fields(kind)]
    return _written(kind, f"old, {', '.join(names)}", f"return kind({', '.join(values)})")


def made_of(kind: type[T], *names: str) -> Callable[..., T]:
    """Make a function of values of some fields, which returns a tuple whose other fields are 0."""
    _require(kind, names)
    values = [name if name in names else "0.0" for name in _fields(kind)]
    return _written(kind, ", ".join(names), f"return kind({', '.join(values)})")


def reader(kind: type[T], of_row: bool = False) -> Callable[..., T]:
    """Make a function that reads a tuple of floats from a table's row `k`, or from the row itself.

    Without float() plain Python would carry slow NumPy scalars through the loop.
    """
    at = "" if of_row else "k, "
    values = ", ".join(f"float(table[{at}{i}])" for i in range(len(_fields(kind))))
    return _written(kind, "table" if of_row else "table, k", f"return kind({values})")


def writer(kind: type, of_row: bool = False) -> Callable[..., None]:
    """Make a function that writes a tuple of floats into a table's row `k`, or the row itself."""
    at = "" if of_row else "k, "
    lines = [f"table[{at}{i}] = new.{name}" for i, name in enumerate(_fields(kind))]
    return _written(kind, "table, new" if of_row else "table, k, new", "; ".join(lines))


def _fields(kind: type) -> tuple[str, ...]:
    return kind._fields  # type: ignore[attr-defined, no-any-return]


def _require(kind: type, names: tuple[str, ...]) -> None:
    unknown = set(names) - set(_fields(kind))
    if unknown:
        raise TypeError(f"{kind.__name__} has no field {', '.join(sorted(unknown))}")


def _written(kind: type, arguments: str, body: str) -> Callable[..., Any]:
    """Compile a function of these arguments; all of its text comes from names of fields."""
    space: dict[str, Any] = {"kind": kind}
    exec(f"def written({arguments}): {body}", space)
    return compiled(space["written"])

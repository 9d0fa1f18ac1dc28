"""What is wrong with a study, in words: pydantic's errors and what our own rules find."""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator
from contextlib import contextmanager
from typing import Any

from pydantic import BaseModel, TypeAdapter, ValidationError
from pydantic_core import PydanticCustomError

from damper.parameters.quantities import ALL, SI_ONLY, nearest
from damper.study.schema import COORDINATE, Generator, Schema, choices_of, words_of
from damper.study.yaml_file import NUMBER, Loc, as_part, show, words

Told = dict[str, Any]
"""What a message says: ``message``, what is ``allowed``, and the name that is ``near``."""

IN_RANGE = {
    name: f"number in {q.units}, {q.allowed}"
    if name in SI_ONLY and q.units not in ("1", "rad")
    else f"number, {q.allowed}"
    for name, q in ALL.items()
}
"""What a value of each quantity may be, in words."""


class Nothing:
    """Stands for an empty value where pydantic would take None for a setting left out."""


NOTHING = Nothing()


class Faults:
    """Collects faults on their way through pydantic, so that one does not hide the next."""

    def __init__(self) -> None:
        self.lines: list[Any] = []

    def add(self, loc: Loc, message: str, allowed: str = "", near: str = "") -> None:
        """Note one fault."""
        self.lines.append({"type": fault(message, allowed, near), "loc": loc, "input": None})

    def unknown(
        self, loc: Loc, what: str, name: object, names: Iterable[str], value: object = None
    ) -> None:
        """Note a name that is none of `names`, and its value where it is short."""
        self.add(loc, **_unknown(what, name, names, value))

    @contextmanager
    def of(self, *loc: str | int, **where: Any) -> Iterator[None]:
        """Note the faults that the body raises, at `loc` and below; `where` is for `faults_of`."""
        try:
            yield
        except PydanticCustomError as error:
            self.lines.append({"type": error, "loc": loc, "input": None})
        except ValidationError as error:
            for below, told in faults_of(error, **where):
                self.add((*loc, *below), **told)

    def settle(self) -> None:
        """Raise what was noted, if anything."""
        if self.lines:
            raise ValidationError.from_exception_data("study", self.lines)


def fault(message: str, allowed: str = "", near: str = "") -> PydanticCustomError:
    """Return the error of a rule of ours: what is wrong, what is allowed, the nearest name."""
    context = {"message": message, "allowed": allowed, "near": near}
    return PydanticCustomError("fault", "{message}", context)


def wrong(what: str, value: object, allowed: str, hint: str = "") -> PydanticCustomError:
    """Return the fault that shows a value."""
    return fault(f"{what} (value: {show(value)}{hint})", allowed)


def as_mapping(value: Any, allowed: str) -> dict[Any, Any]:
    """Return `value` if it is a mapping."""
    if not isinstance(value, dict):
        raise wrong("not a mapping", value, allowed)
    return value


def faults_of(
    error: ValidationError,
    cls: type[BaseModel] | None = None,
    adapter: TypeAdapter[Any] | None = None,
    name: str | None = None,
) -> list[tuple[Loc, Told]]:
    """Return the faults in pydantic's error: where, and what to tell of each.

    Parameters
    ----------
    error : ValidationError
    cls, adapter : type of model, or TypeAdapter, optional
        What was validated; not needed where a model in it has told all.
    name : str, optional
        The name under which it stands: of a quantity, it decides what is allowed.
    """
    found = []
    lines = error.errors(include_url=False)
    items = {line["loc"][:-1] for line in lines if line["loc"]}
    for line in lines:
        loc, value = line["loc"], line["input"]
        if line["type"] == "too_short" and loc in items:
            continue  # what is wrong in a list does not count
        if line["type"] == "fault":
            found.append((loc, line["ctx"]))
        elif line["type"] in ("extra_forbidden", "invalid_key"):
            assert cls is not None
            key = value if line["type"] == "invalid_key" else loc[-1]
            value = None if line["type"] == "invalid_key" else value
            found.append(((as_part(key),), _unknown("key", key, cls.model_fields, value)))
        elif cls is not None and not loc:
            sort = "a mapping" if line["type"] == "model_type" else "text in UTF-8"
            found.append((loc, _wrong(sort, value, words(cls.model_fields))))
        else:
            if line["type"] == "missing" and isinstance(loc[-1], int):
                loc = loc[:-1]  # one of a pair
            found.append((loc, _told(line, _schema_at(cls, adapter, loc), name)))
    return found


def _schema_at(cls: type[BaseModel] | None, adapter: TypeAdapter[Any] | None, loc: Loc) -> Schema:
    """Return the JSON schema of what may stand at a place."""
    if cls is not None:
        adapter = TypeAdapter(cls.model_fields[str(loc[0])].rebuild_annotation())
        loc = loc[1:]
    assert adapter is not None
    schema: Any = adapter.json_schema(schema_generator=Generator)
    if "$ref" in schema:
        schema = schema["$defs"][schema["$ref"].rpartition("/")[2]]
    for part in loc:  # of a list or a pair
        schema = schema["items"] if "items" in schema else schema["prefixItems"][part]
    return dict(schema)


def _told(line: Any, schema: Schema, name: str | None) -> Told:
    """Return what one of pydantic's errors says of a value, whose schema tells what is allowed."""
    kind, value = line["type"], line["input"]
    value = None if value is NOTHING else value
    allowed = words_of(schema)
    if name in IN_RANGE:
        allowed = allowed.replace(f"number {COORDINATE}", IN_RANGE[name])
    if kind == "missing" and "prefixItems" not in schema:
        return _tell(f"'{line['loc'][-1]}' is missing", allowed)
    if kind == "rising":
        return _tell(line["msg"], allowed)
    if kind == "literal_error":
        near = nearest(value, choices_of(schema)) if isinstance(value, str) else ""
        return _tell(f"not one of the choices (value: {show(value)})", allowed, near)
    if kind == "string_pattern_mismatch":
        return _tell("the text is empty", allowed)
    if kind == "string_unicode":
        return _wrong("text in UTF-8", value, allowed)
    if kind in ("greater_than", "greater_than_equal", "less_than", "less_than_equal"):
        return _tell(f"out of range (value: {show(value)})", allowed)
    if kind in ("too_short", "too_long") and "items" in schema:
        count = line["ctx"]["actual_length"]
        if kind == "too_long":
            return _tell(f"{count} values are too many", f"at most {line['ctx']['max_length']}")
        return _tell(f"too few values ({count})" if count else "the list is empty", allowed)
    sort = _SORTS[schema["type"]] if isinstance(schema.get("type"), str) else "a mapping"
    if "prefixItems" in schema:
        return _wrong("two numbers", value, allowed)
    if sort in ("a number", "an integer") and isinstance(value, float) and not math.isfinite(value):
        return _wrong("finite", value, allowed)
    return _wrong(sort, value, allowed, _hint(sort, value))


_SORTS = {
    "string": "text",
    "boolean": "true or false",
    "array": "a list",
    "object": "a mapping",
    "number": "a number",
    "integer": "an integer",
}


def _hint(sort: str, value: Any) -> str:
    if sort in ("a number", "an integer") and isinstance(value, str) and NUMBER.fullmatch(value):
        return ", which is text: take off the quotes"
    if sort == "an integer" and isinstance(value, float) and value.is_integer():
        return f", write {int(value)}" if abs(value) < 1e15 else ""
    short = value is not None and not isinstance(value, dict | list)
    return ", put it in quotes" if sort == "text" and short else ""


def _wrong(sort: str, value: Any, allowed: str, hint: str = "") -> Told:
    value = None if value is NOTHING else value
    return _tell(f"not {sort} (value: {show(value)}{hint})", allowed)


def _unknown(what: str, name: object, names: Iterable[str], value: object) -> Told:
    if not isinstance(name, str):
        return _tell(f"a key must be text (it is {show(name)})", words(names))
    shown = "" if value is None or isinstance(value, dict | list) else f" (value: {show(value)})"
    return _tell(f"unknown {what} {show(name)}{shown}", words(names), nearest(name, names))


def _tell(message: str, allowed: str = "", near: str = "") -> Told:
    return {"message": message, "allowed": allowed, "near": near}

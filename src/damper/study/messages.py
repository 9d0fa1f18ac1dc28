"""Mistakes of a study in words, from pydantic's errors and from our own rules."""

from __future__ import annotations

from collections.abc import Collection, Iterable, Iterator
from contextlib import contextmanager
from typing import Any

from pydantic import BaseModel, TypeAdapter, ValidationError
from pydantic_core import PydanticCustomError

from damper.parameters.names import REPLACED, nearest
from damper.parameters.quantities import ALL, SI_ONLY, OfQuantities, Quantity
from damper.study.schema import COORDINATE, Generator, Schema, choices_of, words_of
from damper.study.yaml_file import NUMBER, Loc, as_part, display, join_names, key_path

Report = dict[str, Any]
"""What a message says: ``message``, what is ``allowed``, and the name that is ``near``."""


def _in_range(quantity: Quantity) -> str:
    own = quantity.name in SI_ONLY and quantity.units not in ("1", "rad")
    units = f" in {quantity.units}" if own else ""
    units += ", or with its unit, as 12 Hz" if quantity.units == "rad/s" else ""
    return f"number{units}, {quantity.allowed}"


IN_RANGE = OfQuantities(ALL, _in_range)
"""Allowed values of each quantity, in words."""


class Nothing:
    """Stands for an empty value where pydantic would take None for a setting left out."""


NOTHING = Nothing()


class Mistakes:
    """Collects mistakes on their way through pydantic, so that one does not hide the next."""

    def __init__(self) -> None:
        self.lines: list[Any] = []

    def __bool__(self) -> bool:
        return bool(self.lines)

    def add(self, loc: Loc, message: str, allowed: str = "", near: str = "") -> None:
        """Note a mistake: message, allowed values, the nearest name."""
        error = PydanticCustomError("mistake", "{message}", _report(message, allowed, near))
        self.lines.append({"type": error, "loc": loc, "input": None})

    def unknown(
        self, loc: Loc, what: str, name: object, names: Iterable[str], value: object = None
    ) -> None:
        """Note a name that is none of `names`, and its value where it is short."""
        self.add(loc, **_unknown(what, name, names, value))

    @contextmanager
    def at(self, *loc: str | int, **where: Any) -> Iterator[None]:
        """Put what the body notes or raises at `loc` and below; `where` is for `mistakes_of`."""
        before, self.lines = self.lines, []
        try:
            yield
        except ValidationError as error:
            for below, report in mistakes_of(error, **where):
                self.add(below, **report)
        self.lines = before + [line | {"loc": (*loc, *line["loc"])} for line in self.lines]

    def keep_first(self, keys: Collection[Loc]) -> None:
        """Drop the mistakes at each of these keys but the first one."""
        seen: set[Loc] = set()
        kept = []
        for line in self.lines:
            key = line["loc"][:1]
            if key not in seen or key not in keys:
                kept.append(line)
            seen.add(key)
        self.lines = kept

    def raise_any(self) -> None:
        """Raise what was noted, if anything."""
        if self.lines:
            raise ValidationError.from_exception_data("study", self.lines)


@contextmanager
def in_plain_words(name: str = "") -> Iterator[None]:
    """Raise pydantic's error in the body as a ValueError with a line for each mistake.

    `name` is the argument that holds what is wrong.
    """
    try:
        yield
    except ValidationError as error:
        lines = [
            f"{key_path((name, *loc) if name else loc)}: {report['message']}"
            + (f" (did you mean {report['near']!r}?)" if report["near"] else "")
            + (f": must be {report['allowed']}" if report["allowed"] else "")
            for loc, report in mistakes_of(error)
        ]
        raise ValueError("\n".join(lines)) from None


def mistakes_of(
    error: ValidationError,
    of: type[BaseModel] | TypeAdapter[Any] | None = None,
    name: str | None = None,
) -> list[tuple[Loc, Report]]:
    """Return the mistakes in pydantic's error: where, and what to report of each.

    `of` is what was validated, not needed where a model in it has reported all; `name` that under
    which it stands: of a quantity, it decides what is allowed.
    """
    lines = error.errors(include_url=False)
    # Where an item of a list is wrong, pydantic counts only the others.
    lists = {line["loc"][:k] for line in lines for k in range(len(line["loc"]))}
    found = []
    for line in lines:
        kind, loc = line["type"], line["loc"]
        value = None if line["input"] is NOTHING else line["input"]
        if kind == "too_short" and loc in lists:
            continue
        if kind == "missing" and isinstance(loc[-1], int):
            if loc[-1] == 0:
                continue  # so is the other one of the pair
            kind, loc = "missing_item", loc[:-1]
        if kind == "mistake":
            report = line["ctx"]
        elif isinstance(of, type) and kind in ("extra_forbidden", "invalid_key"):
            key, value = (value, None) if kind == "invalid_key" else (loc[-1], value)
            loc, report = (as_part(key),), _unknown("key", key, of.model_fields, value)
        elif isinstance(of, type) and not loc:
            kind = "string_unicode" if kind == "string_unicode" else "dict_type"
            report = _report(_in_plain_words(kind, "", value), join_names(of.model_fields))
        else:
            schema = _schema_at(of, loc)
            allowed = words_of(schema)
            if name is not None and name in IN_RANGE:
                allowed = allowed.replace(f"number {COORDINATE}", IN_RANGE[name])
            near = ""
            if kind == "literal_error" and isinstance(value, str):
                near = nearest(value, choices_of(schema))
            message = _in_plain_words(kind, line["msg"], value)
            if kind == "missing":
                message = f"'{loc[-1]}' is missing"
            report = _report(message, allowed, near)
        found.append((loc, report))
    return found


def _schema_at(of: type[BaseModel] | TypeAdapter[Any] | None, loc: Loc) -> Schema:
    """Return the JSON schema of what may stand at a place."""
    if isinstance(of, type):
        of, loc = TypeAdapter(of.model_fields[str(loc[0])].rebuild_annotation()), loc[1:]
    assert of is not None
    schema: Any = of.json_schema(schema_generator=Generator)
    if "$ref" in schema:
        schema = schema["$defs"][schema["$ref"].rpartition("/")[2]]
    for part in loc:
        schema = schema.get("anyOf", [schema])[0]
        if isinstance(part, str):
            schema = schema["additionalProperties"]
        else:
            schema = schema["items"] if "items" in schema else schema["prefixItems"][part]
    return dict(schema)


#: Errors of pydantic whose own words are not plain -> ours.
_MESSAGES = {
    "bool_type": "must be true or false",
    "dict_type": "must be a mapping",
    "float_type": "not a number",
    # What is allowed gives the bounds.
    "greater_than": "out of range",
    "greater_than_equal": "out of range",
    "int_type": "not an integer",
    "less_than": "out of range",
    "less_than_equal": "out of range",
    "missing_item": "must be two numbers",
    "literal_error": "not one of the choices",
    "string_pattern_mismatch": "the text is empty",
    "string_type": "must be text",
    "string_unicode": "not text in UTF-8",
    "tuple_type": "must be a list",
    "wrong_kind": "not allowed",
}
_WORDS = {"Input should": "must", "Tuple should": "the list must", " after validation": ""}


def _in_plain_words(kind: str, message: str, value: Any) -> str:
    """Return what one of pydantic's errors says of a value."""
    for word, plain in _WORDS.items():
        message = message.replace(word, plain)
    return f"{_MESSAGES.get(kind, message)} (value: {display(value)}{_hint(kind, value)})"


def _hint(kind: str, value: Any) -> str:
    if kind in ("float_type", "int_type") and isinstance(value, str) and NUMBER.fullmatch(value):
        return ", which is text: take off the quotes"
    if kind == "int_type" and isinstance(value, float) and value.is_integer():
        return f", write {int(value)}" if abs(value) < 1e15 else ""
    short = value is not None and not isinstance(value, dict | list)
    return ", put it in quotes" if kind == "string_type" and short else ""


def _unknown(what: str, name: object, names: Iterable[str], value: object) -> Report:
    if not isinstance(name, str):
        return _report(f"a key must be text (it is {display(name)})", join_names(names))
    shown = "" if value is None or isinstance(value, dict | list) else f" (value: {display(value)})"
    message = f"unknown {what} {display(name)}{shown}"
    if name in REPLACED:
        return _report(message, REPLACED[name])
    return _report(message, join_names(names), nearest(name, names))


def _report(message: str, allowed: str = "", near: str = "") -> Report:
    return {"message": message, "allowed": allowed, "near": near}

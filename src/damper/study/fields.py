"""What a setting may be, and how it is told that it is not.

Settings are checked by the kinds below (`Number`, `Choice`, ...) rather than by pydantic's own
types: a kind can say in words what it allows, and every message does. For editors it says the same
as a JSON schema (`schema`), and for the reference in the words of a table (`sort`, `limits`).
"""

from __future__ import annotations

import math
import operator
import re
from collections.abc import Callable, Iterable, Iterator, Mapping
from contextlib import contextmanager
from typing import Any, ClassVar, Self

from pydantic import (
    BaseModel,
    ConfigDict,
    GetJsonSchemaHandler,
    ValidationError,
    ValidationInfo,
    model_serializer,
    model_validator,
)
from pydantic.fields import FieldInfo
from pydantic_core import CoreSchema, PydanticCustomError, core_schema

from damper.parameters.quantities import ALL, SI_ONLY, check_quantity, nearest
from damper.study.axes import MOST_VALUES
from damper.study.schema import NULL_DROPS, Schema, nested, once, or_null, quantity_schema
from damper.study.yaml_file import NUMBER, Loc, Quoted, as_part, key_path, show, words

STEM = re.compile(r"[A-Za-z0-9_-]+")
STEM_WORDS = "letters, digits, _ and -"


class Strict(BaseModel):
    """A mapping of settings: unknown, missing and misspelt keys are told in plain words."""

    model_config = ConfigDict(frozen=True, extra="forbid")
    shorthand: ClassVar[str] = ""
    """The setting that may be written alone, in place of the mapping."""
    rules: ClassVar[Schema] = {}
    """What a JSON schema can say of the rules in `relate`."""

    @classmethod
    def entry(cls, name: str, data: Any) -> Self:
        """Return the checked entry `name` of a `Section`."""
        return cls.model_validate(data, context=name)

    @classmethod
    def checked(cls, name: str, data: Any) -> Self:
        """Return what a caller in Python gives for `name`, or raise ValueError in plain words."""
        try:
            return cls.model_validate(data)
        except ValidationError as error:
            told = [
                f"{key_path((name, *loc))}: {fault['message']}"
                + (f": must be {fault['allowed']}" if fault["allowed"] else "")
                for loc, fault in faults_of(error)
            ]
            raise ValueError("; ".join(told)) from None

    @classmethod
    def relate(cls, data: dict[str, Any], model: Any, faults: Faults) -> None:
        """Check what no setting can check alone; `model` is None after any other fault."""

    @classmethod
    def __get_pydantic_json_schema__(
        cls, core: CoreSchema, handler: GetJsonSchemaHandler
    ) -> Schema:
        reference = handler(core)
        made = handler.resolve_ref_schema(reference)
        made["description"] = first_line(cls)
        for key, part in made.get("properties", {}).items():
            units = getattr(kind_of(cls.model_fields[key]), "units", "")
            if units not in ("", "1", Coordinate.units):
                part["description"] = f"{part['description']} [{units}]"
        if cls.rules:
            made["allOf"] = [cls.rules]
        if cls.shorthand:
            whole = dict(made)
            alone = {
                key: value
                for key, value in made["properties"][cls.shorthand].items()
                if key not in ("description", "default")
            }
            made.clear()
            made["anyOf"] = [alone, whole]
        return reference

    # In place of pydantic's own method of this name, which is deprecated and not used.
    @classmethod
    def schema(  # type: ignore[override]
        cls, handler: GetJsonSchemaHandler, name: str | None = None
    ) -> Schema:
        """Return the JSON schema of what may be written for `name`."""
        # Pydantic leaves out the name of what has only one place, and would write it out again.
        label = {"ref": f"{cls.__module__}.{cls.__qualname__}:{id(cls)}"}
        made = nested(handler, {**cls.__pydantic_core_schema__, **label})
        kinds = {key: kind_of(field) for key, field in cls.model_fields.items()}
        own = {
            key: kind.schema(handler, name)
            for key, kind in kinds.items()
            if name in ALL and isinstance(kind, Kind) and kind.of_name
        }
        if not own:
            return made
        if not cls.shorthand:
            return made | {"properties": own}
        return made | {"anyOf": [own[cls.shorthand], {"type": "object", "properties": own}]}

    @model_validator(mode="wrap")
    @classmethod
    def _in_plain_words(cls, data: Any, handler: Callable[[Any], Any]) -> Any:
        if isinstance(data, cls):
            return data
        alone = bool(cls.shorthand) and not isinstance(data, dict)
        if alone:
            data = {cls.shorthand: data}
        as_mapping(data, words(cls.model_fields))
        faults, model = Faults(), None
        for key, value in data.items():
            if key not in cls.model_fields:
                faults.unknown((as_part(key),), "key", key, cls.model_fields, value)
        for key, field in cls.model_fields.items():
            if field.is_required() and key not in data:
                allowed = next((k.words for k in field.metadata if isinstance(k, Kind)), "")
                faults.add((key,), f"'{key}' is missing", allowed)
        with faults.of():
            model = handler({key: data[key] for key in cls.model_fields if key in data})
        if alone:
            faults.lines = [line | {"loc": ()} for line in faults.lines]
        cls.relate(data, None if faults.lines else model, faults)
        faults.settle()
        return model

    @model_serializer(mode="wrap")
    def _short(self, handler: Callable[[Any], dict[str, Any]]) -> Any:
        given = {key for key, value in self if value is not None}
        return getattr(self, self.shorthand) if given == {self.shorthand} else handler(self)


class Kind:
    """What a setting may be; stands in the annotation of a field."""

    words: str
    sort: str = ""
    """The type, for the reference."""
    limits: str = ""
    """What is allowed beyond the type, for the reference."""
    units: str = ""
    of_name: bool = False
    """Whether the name under which the setting stands decides what is allowed."""

    def check(self, value: Any, context: Any) -> Any:
        """Return the value to keep, or raise a `fault`."""
        raise NotImplementedError

    def schema(self, handler: GetJsonSchemaHandler, name: str | None) -> Schema:
        """Return the JSON schema of what `check` lets pass, or of more than that.

        With the `name` of a quantity, only what that adds has to be said.
        """
        return {}

    def __get_pydantic_json_schema__(
        self, core: CoreSchema, handler: GetJsonSchemaHandler
    ) -> Schema:
        return self.schema(handler, None)

    def __get_pydantic_core_schema__(self, source: Any, handler: Any) -> CoreSchema:
        def check(value: Any, info: ValidationInfo) -> Any:
            return self.check(value, info.context)

        return core_schema.with_info_plain_validator_function(check)


_SIGNS = {"gt": ">", "ge": ">=", "lt": "<", "le": "<="}
_BOUNDS = {
    "gt": "exclusiveMinimum",
    "ge": "minimum",
    "lt": "exclusiveMaximum",
    "le": "maximum",
}


class Number(Kind):
    """A finite number within bounds (gt, ge, lt, le): never a boolean, nor one in quotes."""

    def __init__(
        self, *, whole: bool = False, note: str = "", units: str = "", **bounds: float
    ) -> None:
        self.whole, self.units = whole, units
        self.bounds = [(getattr(operator, name), bound) for name, bound in bounds.items()]
        self.sort = "integer" if whole else "number"
        self.limits = " and ".join(f"{_SIGNS[name]} {bound}" for name, bound in bounds.items())
        self.words = " ".join(w for w in (self.sort, self.limits, note) if w)
        self._schema = {"type": self.sort} | {_BOUNDS[name]: end for name, end in bounds.items()}

    def check(self, value: Any, context: Any) -> float:
        number = _finite(value, self.words, self.whole)
        if not all(holds(number, bound) for holds, bound in self.bounds):
            shown = value if isinstance(value, str) else show(value)
            raise fault(f"out of range (value: {shown})", self.words)
        return number

    def schema(self, handler: GetJsonSchemaHandler, name: str | None) -> Schema:
        return dict(self._schema)


_IN_RANGE = {None: "number"} | {
    name: f"number in {q.units}, {q.allowed}"
    if name in SI_ONLY and q.units not in ("1", "rad")
    else f"number, {q.allowed}"
    for name, q in ALL.items()
}


class Coordinate(Kind):
    """A value of the parameter that the context names."""

    words = "number in the range of the parameter"
    sort = "number"
    limits = "the parameter's range"
    units = "the parameter's"
    of_name = True

    def check(self, value: Any, context: Any) -> float:
        allowed = _IN_RANGE[context]
        number = _finite(value, allowed)
        try:
            return number if context is None else check_quantity(context, number)
        except ValueError:
            raise wrong("out of range", value, allowed) from None

    def schema(self, handler: GetJsonSchemaHandler, name: str | None) -> Schema:
        return {"type": "number"} if name is None else quantity_schema(handler, ALL[name])


class Range(Kind):
    """Lowest and highest value: of a quantity, or of any number."""

    sort = "[low, high]"
    words = "[low, high], low < high"
    limits = "low < high"

    def __init__(self, name: str | None = None) -> None:
        self.name = name
        if name is not None:
            self.words = f"[low, high], {ALL[name].allowed}"
            self.units, self.limits = ALL[name].units, f"low < high; each {ALL[name].limits}"

    def check(self, value: Any, context: Any) -> tuple[float, float]:
        if not isinstance(value, list | tuple) or len(value) != 2:
            raise wrong("not two numbers", value, self.words)
        faults = Faults()
        ends = []
        for i, end in enumerate(value):
            with faults.of(i):
                ends.append(Coordinate().check(end, self.name))
        faults.settle()
        low, high = ends
        if not low < high:
            raise wrong("low must be less than high", value, self.words)
        return low, high

    def schema(self, handler: GetJsonSchemaHandler, name: str | None) -> Schema:
        items = Coordinate().schema(handler, self.name or name)
        pair = {"minItems": 2, "maxItems": 2, "uniqueItems": True}
        return {"type": "array", "items": items} | (pair if name is None else {})


def _finite(value: Any, allowed: str, whole: bool = False) -> float:
    sort = "not an integer" if whole else "not a number"
    if isinstance(value, str):
        # Snakemake's YAML reader takes 1e-12 for text; only what a file has in quotes is text.
        looks = NUMBER.fullmatch(value) is not None
        if not looks or isinstance(value, Quoted):
            raise wrong(sort, value, allowed, ", which is text: take off the quotes" * looks)
        value = int(value) if re.fullmatch(r"[-+]?[0-9]{1,400}", value) else float(value)
    if isinstance(value, bool) or not isinstance(value, int | float):
        raise wrong(sort, value, allowed)
    try:
        number = float(value) + 0.0  # and -0.0 is 0.0, also in names
    except OverflowError:
        number = math.inf
    if not math.isfinite(number):
        raise wrong("not finite", value, allowed)
    if whole and isinstance(value, float):
        round_ = value.is_integer() and abs(value) < 1e15
        raise wrong(sort, value, allowed, f", write {int(value)}" if round_ else "")
    return value if whole else number


class Text(Kind):
    """Text that is not blank."""

    words = "text"
    sort = "text"

    def check(self, value: Any, context: Any) -> str:
        if not isinstance(value, str):
            hint = "" if value is None or isinstance(value, dict | list) else ", put it in quotes"
            raise wrong("not text", value, self.words, hint)
        if not value.strip():
            raise fault("the text is empty", self.words)
        try:
            value.encode()
        except UnicodeEncodeError:
            raise wrong("not text in UTF-8", value, self.words) from None
        return str(value)

    def schema(self, handler: GetJsonSchemaHandler, name: str | None) -> Schema:
        return {"type": "string", "pattern": r"\S"}


class Choice(Kind):
    """One of a few words."""

    sort = "one of"

    def __init__(self, *names: str) -> None:
        self.names = names
        self.words = words(names)
        self.limits = ", ".join(f"`{name}`" for name in names)

    def check(self, value: Any, context: Any) -> str:
        if not isinstance(value, str) or value not in self.names:
            near = nearest(value, self.names) if isinstance(value, str) else ""
            raise fault(f"not one of the choices (value: {show(value)})", self.words, near)
        return str(value)

    def schema(self, handler: GetJsonSchemaHandler, name: str | None) -> Schema:
        return {"enum": list(self.names)}


class Flag(Kind):
    """True or false."""

    words = "true, false"
    sort = "flag"
    limits = "`true`, `false`"

    def check(self, value: Any, context: Any) -> bool:
        if not isinstance(value, bool):
            raise wrong("not true or false", value, self.words)
        return value

    def schema(self, handler: GetJsonSchemaHandler, name: str | None) -> Schema:
        return {"type": "boolean"}


class ListOf(Kind):
    """A list of distinct values of one kind."""

    def __init__(self, kind: Kind, least: int = 0) -> None:
        self.kind, self.least = kind, least
        self.words = f"list of {kind.words}"
        self.sort = f"list of {kind.sort}"
        count = f"at least {least}, " * bool(least)
        self.limits = f"{count}distinct" + f"; each {kind.limits}" * bool(kind.limits)
        self.units, self.of_name = kind.units, kind.of_name

    def check(self, value: Any, context: Any) -> tuple[Any, ...]:
        if not isinstance(value, list | tuple):
            raise wrong("not a list", value, self.words)
        if len(value) < self.least:
            raise fault("the list is empty", f"{self.words}, at least {self.least}")
        if len(value) > MOST_VALUES:
            raise fault(f"{len(value)} values are too many", f"at most {MOST_VALUES}")
        faults = Faults()
        kept: dict[Any, int] = {}
        for i, item in enumerate(value):
            with faults.of(i):
                checked = self.kind.check(item, context)
                if checked in kept:
                    raise fault(f"{show(item)} is given twice (first as [{kept[checked]}])")
                kept[checked] = i
        faults.settle()
        return tuple(kept)

    def schema(self, handler: GetJsonSchemaHandler, name: str | None) -> Schema:
        items = {"type": "array", "items": self.kind.schema(handler, name)}
        if self.of_name and name is not None:
            return items
        least = {"minItems": self.least} if self.least else {}
        return items | least | {"maxItems": MOST_VALUES, "uniqueItems": True}


class Section(Kind):
    """A mapping from names to entries; nothing at all is an empty one.

    Parameters
    ----------
    entry : callable
        Checks the entry of a name.
    what : str
        What the names are names of.
    names : iterable of str, optional
        All names there are; by default whatever can be the name of a file.
    of : type of Strict, or mapping of str to one
        The class of all entries; of each name; or, where `names` is open, of each ``kind``.
    bare : bool
        Whether an entry may be nothing at all.
    dropped : bool
        Whether an override may leave out an entry, by null in its place.
    """

    sort = "mapping"

    def __init__(
        self,
        entry: Callable[[str, Any], Any],
        what: str,
        names: Iterable[str] | None = None,
        *,
        of: type[Strict] | Kind | Mapping[str, type[Strict]],
        bare: bool = False,
        dropped: bool = False,
    ) -> None:
        self.entry, self.what, self.names = entry, what, names
        self.of, self.bare, self.dropped = of, bare, dropped
        self.words = f"mapping from {what} to its settings"

    def check(self, value: Any, context: Any) -> dict[str, Any]:
        faults = Faults()
        kept: dict[str, Any] = {}
        seen: dict[str, str] = {}
        for name, data in as_mapping({} if value is None else value, self.words).items():
            here = as_part(name)
            if self.names is not None and name not in self.names:
                faults.unknown((here,), self.what, name, self.names, data)
                continue
            if not isinstance(name, str):
                faults.add((here,), f"a key must be text: put {show(name)} in quotes", STEM_WORDS)
                continue
            twin = seen.setdefault(name.casefold(), name)
            if twin != name:
                faults.add((here,), f"the same file as '{twin}' where case does not count")
            with faults.of(here):
                kept[name] = self.entry(name, data)
        faults.settle()
        return kept

    def schema(self, handler: GetJsonSchemaHandler, name: str | None) -> Schema:
        made: Schema = {"type": ["object", "null"], "additionalProperties": False}
        if self.names is None:
            made["propertyNames"] = {"pattern": f"^{STEM.pattern}$"}
            made["additionalProperties"] = self._entry_schema(handler, None)
        else:
            made["properties"] = {key: self._entry_schema(handler, key) for key in self.names}
        if self.dropped:
            made["$comment"] = NULL_DROPS
        if self.names is None or isinstance(self.of, Mapping | Kind):
            return made
        return once(handler, f"{self.what}_{self.of.__name__}:{'-'.join(self.names)}", made)

    def _entry_schema(self, handler: GetJsonSchemaHandler, name: str | None) -> Schema | bool:
        if not isinstance(self.of, Mapping):
            made = self.of.schema(handler, None) | self.of.schema(handler, name)
        elif name is not None:
            made = self.of[name].schema(handler, name)
        else:
            made = {"anyOf": [of_kind(k, c.schema(handler)) for k, c in self.of.items()]}
        return or_null(made) if self.bare else made


def of_kind(kind: str, made: Schema) -> Schema:
    """Return a schema with a title and with ``kind`` fixed to one word."""
    return {"title": kind, "properties": {"kind": {"const": kind}}, **made}


def kind_of(field: FieldInfo) -> Kind | type[Strict]:
    """Return what says what a field may be: a kind, or the class of a mapping."""
    found: Any = next((kind for kind in field.metadata if isinstance(kind, Kind)), field.annotation)
    assert isinstance(found, Kind) or issubclass(found, Strict)
    return found


def default_of(field: FieldInfo) -> Any:
    """Return the default of a field as a file would give it; None if there is none."""
    if field.is_required() or field.default is None:
        return None
    if isinstance(field.default, BaseModel):
        return field.default.model_dump(mode="json", exclude_none=True)
    return list(field.default) if isinstance(field.default, tuple) else field.default


def first_line(cls: object) -> str:
    """Return the first line of a docstring."""
    return (cls.__doc__ or "").strip().split("\n")[0]


class Faults:
    """Collects faults on their way through pydantic, so that one does not hide the next."""

    def __init__(self) -> None:
        self.lines: list[Any] = []

    def add(self, loc: Loc, message: str, allowed: str = "", near: str = "") -> None:
        """Note one fault."""
        self._note(loc, fault(message, allowed, near))

    def unknown(
        self, loc: Loc, what: str, name: object, names: Iterable[str], value: object = None
    ) -> None:
        """Note a name that is none of `names`, and its value where it is short."""
        if not isinstance(name, str):
            self.add(loc, f"a key must be text (it is {show(name)})", words(names))
            return
        long = value is None or isinstance(value, dict | list)
        shown = "" if long else f" (value: {show(value)})"
        self.add(loc, f"unknown {what} {show(name)}{shown}", words(names), nearest(name, names))

    @contextmanager
    def of(self, *loc: str | int) -> Iterator[None]:
        """Note the faults that the body raises, at `loc` and below."""
        try:
            yield
        except PydanticCustomError as error:
            self._note(loc, error)
        except ValidationError as error:
            for below, context in faults_of(error):
                self.add((*loc, *below), **context)

    def settle(self) -> None:
        """Raise what was noted, if anything."""
        if self.lines:
            raise ValidationError.from_exception_data("study", self.lines)

    def _note(self, loc: Loc, error: PydanticCustomError) -> None:
        self.lines.append({"type": error, "loc": loc, "input": None})


def fault(message: str, allowed: str = "", near: str = "") -> PydanticCustomError:
    """Return the error that a kind raises: what is wrong, what is allowed, the nearest name."""
    context = {"message": message, "allowed": allowed, "near": near}
    return PydanticCustomError("fault", "{message}", context)


def wrong(what: str, value: object, allowed: str, hint: str = "") -> PydanticCustomError:
    """Return the fault that shows a value."""
    return fault(f"{what} (value: {show(value)}{hint})", allowed)


def faults_of(error: ValidationError) -> list[tuple[Loc, dict[str, Any]]]:
    """Return the faults in pydantic's error: where, and what `fault` was told."""
    lines = error.errors(include_url=False, include_input=False)
    # A missing key is told by `Strict`, in better words.
    return [(line["loc"], line["ctx"]) for line in lines if line["type"] != "missing"]


def as_mapping(value: Any, allowed: str) -> dict[Any, Any]:
    """Return `value` if it is a mapping."""
    if not isinstance(value, dict):
        raise wrong("not a mapping", value, allowed)
    return value

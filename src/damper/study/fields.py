"""Types of a study's settings, beside pydantic's own.

A setting is annotated with a type of Python and pydantic's `Field`, such as
``Annotated[int, Field(ge=1, description="How many.")]``; pydantic checks it strictly and makes its
JSON schema. Here is what a study needs beside: text that is not blank, lists without repetition,
pairs, values in the range of a quantity, and mappings of names. `damper.study.messages` says in
words what is wrong.
"""

from __future__ import annotations

import math
import re
from collections.abc import Callable, Iterable, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass
from functools import cache, partial
from pathlib import Path, PurePosixPath
from typing import Annotated, Any, ClassVar, Self, TypeVar, get_args, get_origin
from zlib import crc32

from pydantic import (
    AfterValidator,
    BaseModel,
    ConfigDict,
    Field,
    GetJsonSchemaHandler,
    GetPydanticSchema,
    TypeAdapter,
    ValidationError,
    ValidationInfo,
    ValidatorFunctionWrapHandler,
    WrapValidator,
    model_serializer,
    model_validator,
)
from pydantic_core import CoreSchema, PydanticCustomError, PydanticKnownError, core_schema

from damper.parameters.masses import equal_masses
from damper.parameters.names import MOST_MASSES, OF_ANY_MASS, split
from damper.parameters.quantities import ALL
from damper.parameters.unit_text import SIZES, each_number, number_in
from damper.study.axes import MOST_VALUES
from damper.study.messages import NOTHING, Mistakes, in_plain_words, mistakes_of
from damper.study.schema import COORDINATE, THE_PARAMETERS, Schema, nested, once, quantity_schema
from damper.study.yaml_file import (
    NUMBER,
    ConfigError,
    Loc,
    Problem,
    Quoted,
    YamlFile,
    as_part,
    display,
)

# A file's name has at most 255 bytes, with what is added to it, such as a coordinate and a suffix.
STEM = re.compile(r"[A-Za-z0-9_-]{1,100}")
STEM_WORDS = "up to 100 letters, digits, _ and -"

_FOLDER = re.compile(r"[A-Za-z0-9_][A-Za-z0-9_.-]*")
_PROJECT = ("benchmarks", "config", "docs", "logs", "profiles", "src", "tests", "workflow")

T = TypeVar("T")


class StrictModel(BaseModel):
    """A mapping of settings: unknown, missing and misspelt keys are reported in plain words."""

    model_config = ConfigDict(
        frozen=True, extra="forbid", strict=True, allow_inf_nan=False, defer_build=True
    )
    shorthand: ClassVar[str] = ""
    """The setting that may be written alone, in place of the mapping."""

    @classmethod
    def checked(cls, name: str, data: Any) -> Self:
        """Return what a caller in Python gives for `name`, or raise ValueError in plain words.

        Without a name, what is given is a mapping of arguments.
        """
        with in_plain_words(name):
            return cls.model_validate(data)

    @classmethod
    def checked_in(cls, file: YamlFile, data: Any) -> Self:
        """Return the settings of a file, which `data` are; ConfigError lists all mistakes.

        Mistakes are in the order of their lines.
        """
        problems = list(file.problems)
        try:
            made = cls.model_validate(data)
        except ValidationError as error:
            found = ((loc, file.find(loc), report) for loc, report in mistakes_of(error))
            problems += [Problem(at.place, loc, line=at.line, **more) for loc, at, more in found]
        if problems:
            raise ConfigError.of(sorted(problems, key=lambda problem: problem.line))
        return made

    @classmethod
    def without_units(
        cls, given: Mapping[str, Any], name: str | None, mistakes: Mistakes
    ) -> dict[str, Any]:
        """Return settings with numbers in place of texts with a unit, such as 20 mm.

        `name` is the key under which the settings stand.
        """
        read = dict(given)
        for key, unit in _units(cls).items():
            if key in read:
                with refused((key,), mistakes):
                    read[key] = each_number(read[key], partial(number_in, "", units=[unit]))
        return read

    @classmethod
    def check_keys(cls, given: Mapping[str, Any], mistakes: Mistakes) -> None:
        """Note keys that are missing or too many, whatever their values are."""

    def check_together(self, mistakes: Mistakes) -> None:
        """Note what no setting can check alone; each by itself is right."""

    @model_validator(mode="wrap")
    @classmethod
    def _in_plain_words(cls, data: Any, handler: Callable[[Any], Any], info: ValidationInfo) -> Any:
        if isinstance(data, cls):
            return data
        alone = bool(cls.shorthand) and not isinstance(data, dict)
        if alone:
            data = {cls.shorthand: data}
        mistakes = Mistakes()
        refused_units: set[Loc] = set()
        with mistakes.at(of=cls, name=info.context):
            if isinstance(data, dict):
                data = cls.without_units(data, info.context, mistakes)
                refused_units = {line["loc"][:1] for line in mistakes.lines}
            if () not in refused_units:
                if isinstance(data, dict):
                    cls.check_keys(data, mistakes)
                model = handler(_as_read(cls, data))
                model.check_together(mistakes)
        mistakes.keep_first(refused_units)
        if alone:
            mistakes.lines = [line | {"loc": line["loc"][1:]} for line in mistakes.lines]
        mistakes.raise_any()
        return model

    @model_serializer(mode="wrap")
    def _short(self, handler: Callable[[Any], dict[str, Any]]) -> Any:
        given = {key for key, value in self if value is not None}
        return getattr(self, self.shorthand) if given == {self.shorthand} else handler(self)


def _as_read(cls: type[StrictModel], data: Any) -> Any:
    """Return settings as pydantic is to see them.

    Text that looks like a number is one where a number is asked for, nothing at all is an empty
    mapping, and no other setting can be nothing.
    """
    if not isinstance(data, dict):
        return data
    read = dict(data)
    for key in data.keys() & cls.model_fields.keys():
        if data[key] is None:
            mapping = get_origin(cls.model_fields[key].annotation) is dict
            read[key] = {} if mapping else NOTHING
        elif key in _numeric(cls):
            read[key] = as_numbers(data[key])
    return read


@cache
def _numeric(cls: type[StrictModel]) -> frozenset[str]:
    """Return the settings that have numbers in them."""

    def has_numbers(annotation: Any) -> bool:
        return annotation in (int, float) or any(map(has_numbers, get_args(annotation)))

    return frozenset(k for k, field in cls.model_fields.items() if has_numbers(field.annotation))


@cache
def _units(cls: type[StrictModel]) -> dict[str, str]:
    """Return the SI units of the settings with numbers; 1 of those without a unit."""
    notes = ((k, n) for k, field in cls.model_fields.items() for n in field.metadata)
    found = {k: n.text for k, n in notes if getattr(n, "keyword", "") in ("unit", "si_unit")}
    units = {key: found.get(key, "1") for key in _numeric(cls)}
    return {key: unit for key, unit in units.items() if unit in SIZES}


@contextmanager
def refused(loc: Loc, mistakes: Mistakes) -> Iterator[None]:
    """Note a ValueError in the body, such as one of `number_in`, without the name of `loc`."""
    try:
        yield
    except ValueError as error:
        message, _, allowed = str(error).partition(": must be ")
        mistakes.add(loc, message.removeprefix(f"{loc[-1]}: ").removeprefix(" = "), allowed)


def as_numbers(value: Any, deep: int = 2) -> Any:
    """Return numbers as they are kept, also in a list or a mapping, and all else as it is."""
    if isinstance(value, list | tuple) and deep:
        return [as_numbers(item, deep - 1) for item in value]
    if isinstance(value, dict) and deep:
        return {key: as_numbers(item, deep - 1) for key, item in value.items()}
    # Snakemake's YAML reader takes 1e-12 for text; only what a file has in quotes is text.
    if value == "inf" and not isinstance(value, Quoted):
        return math.inf
    if isinstance(value, str) and not isinstance(value, Quoted) and NUMBER.fullmatch(value):
        value = int(value) if re.fullmatch(r"[-+]?[0-9]{1,400}", value) else float(value)
    if isinstance(value, float):
        return value + 0.0  # -0.0 is 0.0, also in names
    if isinstance(value, int) and abs(value) > 1e308:
        return math.inf
    return value


@dataclass(frozen=True)
class SchemaNote:
    """Says in a JSON schema what is not pydantic's to say; see `Unit` and `Rule`."""

    keyword: str
    text: Any

    def __get_pydantic_json_schema__(
        self, core: CoreSchema, handler: GetJsonSchemaHandler
    ) -> Schema:
        return handler(core) | {self.keyword: self.text}


Unit = partial(SchemaNote, "unit")
"""The unit of a number, for the reference and for editors."""
SIUnit = partial(SchemaNote, "si_unit")
"""The unit that a number may have in a study in SI units; in others it has none."""
Rule = partial(SchemaNote, "$comment")
"""Allowed values in words, beside the bounds."""


class OrWord:
    """Marks a number: a word may stand in its place."""

    def __init__(self, word: str) -> None:
        self.word = word

    def __get_pydantic_core_schema__(self, source: Any, handler: Any) -> CoreSchema:
        return core_schema.no_info_wrap_validator_function(
            lambda value, inner: value if value == self.word else inner(value),
            handler(source),
            serialization=core_schema.simple_ser_schema("any"),
        )

    def __get_pydantic_json_schema__(
        self, core: CoreSchema, handler: GetJsonSchemaHandler
    ) -> Schema:
        return {"anyOf": [handler(core["schema"]), {"const": self.word}]}  # type: ignore[typeddict-item]


class EqualMasses(StrictModel):
    """Equal shares of one free mass, as `damper.equal_masses` makes them."""

    count: Annotated[int, Field(ge=1, le=MOST_MASSES, description="Number of masses.")]
    clearance_spread: Annotated[
        float,
        Field(
            ge=0.0,
            lt=1.0,
            description="Their clearances go in even steps from 1 - spread to 1 + spread times "
            "the clearance.",
        ),
    ] = 0.0


class OrEqualMasses:
    """Marks a list of masses: a mapping for `EqualMasses` may stand in its place."""

    def __get_pydantic_core_schema__(self, source: Any, handler: Any) -> CoreSchema:
        def check(value: Any, inner: Any) -> Any:
            if not isinstance(value, dict):
                return inner(value)
            mistakes = Mistakes()
            with mistakes.at(of=EqualMasses):
                value = equal_masses(**EqualMasses.model_validate(value).model_dump())
            mistakes.raise_any()
            return inner(value)

        return core_schema.no_info_wrap_validator_function(check, handler(source))

    def __get_pydantic_json_schema__(
        self, core: CoreSchema, handler: GetJsonSchemaHandler
    ) -> Schema:
        equal = nested(handler, TypeAdapter(EqualMasses).core_schema)
        return {"anyOf": [handler(core["schema"]), equal]}  # type: ignore[typeddict-item]


class Distinct:
    """Marks a list: YAML's for Python's tuple, not too long, and no value in it twice."""

    def __get_pydantic_core_schema__(self, source: Any, handler: Any) -> CoreSchema:
        made = handler(source) | {"strict": False, "max_length": MOST_VALUES}
        return core_schema.no_info_after_validator_function(_distinct, made)

    def __get_pydantic_json_schema__(
        self, core: CoreSchema, handler: GetJsonSchemaHandler
    ) -> Schema:
        made = handler(core) | {"uniqueItems": True}
        del made["maxItems"]
        return made


def _distinct(values: tuple[Any, ...]) -> tuple[Any, ...]:
    mistakes, first = Mistakes(), dict[Any, int]()
    for i, value in enumerate(values):
        if first.setdefault(value, i) < i:
            mistakes.add((i,), f"{display(value)} is given twice (first as [{first[value]}])")
    mistakes.raise_any()
    return values


def _rising(pair: tuple[Any, Any]) -> tuple[Any, Any]:
    if not pair[0] < pair[1]:
        raise PydanticCustomError("not_rising", "low must be less than high")
    return pair


def _in_range(number: float, info: ValidationInfo) -> float:
    """Check a value of the quantity that the context names."""
    limits = ALL[info.context].limit_cases if info.context is not None else ()
    if not (math.isfinite(number) or number in limits):
        raise PydanticKnownError("finite_number")
    if info.context is not None and not ALL[info.context].holds(number):
        raise PydanticCustomError("out_of_range", "out of range")
    return number


def _finite(number: float) -> float:
    if not math.isfinite(number):
        raise PydanticKnownError("finite_number")
    return number


def _plain(text: str) -> str:
    """Check for characters that figures, tables and pages cannot show."""
    if re.search(r"[\x00-\x08\x0b-\x1f\x7f-\x9f]", text):
        raise PydanticCustomError("control_character", "there is a control character in it")
    return text


def _on_one_line(text: str) -> str:
    text = text.rstrip("\n")  # of a folded block
    if re.search(r"[\n\u2028\u2029]", text):
        raise PydanticCustomError("several_lines", "the text has more than one line")
    return text


def _folder(text: str) -> str:
    """Check the name of a folder for results, which Snakemake takes as it is."""
    path, mistakes = PurePosixPath(text), Mistakes()
    if len(text) > 200 or not path.parts or not all(map(_FOLDER.fullmatch, path.parts)):
        mistakes.add((), f"cannot be the folder of results (value: {display(text)})", FOLDER_WORDS)
    elif path.parts[0].casefold() in _PROJECT:
        mistakes.add((), f"'{path.parts[0]}' is a folder of the project", FOLDER_WORDS)
    else:
        for one in (path, *path.parents):
            if Path(one).exists() and not Path(one).is_dir():
                mistakes.add((), f"{display(one.as_posix())} is a file", FOLDER_WORDS)
    mistakes.raise_any()
    return path.as_posix()


Text = Annotated[str, Field(pattern=r"\S"), AfterValidator(_plain)]
"""Text that is not blank."""


def _in_one(value: Any, kinds: ValidatorFunctionWrapHandler) -> Any:
    """Replace the mistakes of a union of types, one for each type, by a single mistake."""
    try:
        return kinds(value)
    except ValidationError:
        raise PydanticCustomError("wrong_kind", "not allowed") from None


ONE_MISTAKE = WrapValidator(_in_one)
"""Marks a union of types: a value that is of none of them is one mistake."""
NumberOrText = Annotated[float | Text, ONE_MISTAKE]
Line = Annotated[Text, AfterValidator(_on_one_line), Rule("on one line")]
FOLDER_WORDS = "a path below the project's folder, of up to 200 letters, digits, _, -, . and /"
Folder = Annotated[Text, AfterValidator(_folder), Rule(f"that is {FOLDER_WORDS}")]
"""A path that Snakemake, and every platform, takes as it is."""
DistinctList = Annotated[tuple[T, ...], Field(min_length=1), Distinct()]
"""A list of at least one, without repetition."""
Pair = Annotated[tuple[T, T], Field(strict=False), AfterValidator(_rising), Rule("low < high")]
Coordinate = Annotated[
    float,
    Field(allow_inf_nan=True),
    AfterValidator(_in_range),
    Rule(COORDINATE),
    Unit(THE_PARAMETERS),
]
"""A value of the quantity under whose name it stands."""
Bound = Annotated[Coordinate, AfterValidator(_finite)]
"""An end of a range of such values."""


def one_of(names: Iterable[str]) -> GetPydanticSchema:
    """Mark text that must be among `names`, where a Literal does not list them."""
    return GetPydanticSchema(lambda source, handler: core_schema.literal_schema(list(names)))


class NamedMapping:
    """Marks a dict: a mapping from names to entries, each checked with its name as context.

    `what` the names are names of; all `names` there are, with the type of each where it is not that
    of the annotation, by default whatever can be the name of a file; `to` what stands under them;
    whether an entry may be nothing at all (`bare`), which is an empty one; whether null in an
    override leaves it out (`dropped`), by default where any name will do. `masses` says that
    quantities of single masses, such as `clearance_1`, may stand where those of all do.
    """

    def __init__(
        self,
        what: str,
        names: Iterable[str] | None = None,
        *,
        to: str = "its settings",
        bare: bool = False,
        dropped: bool | None = None,
        masses: bool = False,
    ) -> None:
        self.what, self.names, self.bare, self.masses = what, names, bare, masses
        self.says = f"from {what} to {to}"
        self._adapters: dict[int, TypeAdapter[Any]] = {}
        self.dropped = names is None if dropped is None else dropped

    def __get_pydantic_core_schema__(self, source: Any, handler: Any) -> CoreSchema:
        self._usual = get_args(source)[1]
        return core_schema.no_info_plain_validator_function(self._check)

    def _adapter(self, name: str) -> TypeAdapter[Any]:
        """Return what checks one entry."""
        common, _ = split(name) or (name, 0)
        of = self.names[common] if isinstance(self.names, Mapping) else self._usual
        if id(of) not in self._adapters:
            bare = get_args(of)[0] if get_origin(of) is Annotated else of
            own = isinstance(bare, type) and issubclass(bare, BaseModel)
            self._adapters[id(of)] = TypeAdapter(
                of, config=None if own else StrictModel.model_config
            )
        return self._adapters[id(of)]

    def _check(self, value: Any) -> dict[str, Any]:
        if not isinstance(value, dict):
            raise PydanticKnownError("dict_type")
        mistakes = Mistakes()
        kept: dict[str, Any] = {}
        seen: dict[str, str] = {}
        for name, data in value.items():
            here = as_part(name)
            of_one = split(name)
            if of_one and self.names is not None and not self.masses and of_one[0] in self.names:
                message = f"'{name}' is of mass {of_one[1]} alone"
                mistakes.add((here,), message, f"'{of_one[0]}' in its entry under masses")
                continue
            known = of_one[0] if of_one and self.masses else name
            if self.names is not None and known not in self.names:
                mistakes.unknown((here,), self.what, name, self.names, data)
                continue
            if not isinstance(name, str):
                message = f"a key must be text: put {display(name)} in quotes"
                mistakes.add((here,), message, STEM_WORDS)
                continue
            if self.names is None and not STEM.fullmatch(name):
                message = f"{display(name)} cannot be the name of a {self.what}"
                mistakes.add((here,), message, STEM_WORDS)
            twin = seen.setdefault(name.casefold(), name)
            if twin != name:
                mistakes.add((here,), f"the same file as '{twin}' where case does not count")
            entry = self._adapter(name)
            with mistakes.at(here, of=entry, name=name):
                data = {} if self.bare and data is None else data
                kept[name] = entry.validate_python(data, context=name)
        mistakes.raise_any()
        return kept

    def __get_pydantic_json_schema__(
        self, core: CoreSchema, handler: GetJsonSchemaHandler
    ) -> Schema:
        null = [{"type": "null"}] if self.bare or self.dropped else []
        made: Schema = {"type": ["object", "null"], "$comment": self.says}

        def entry(name: str) -> Schema:
            one = nested(handler, self._adapter(name).core_schema)
            return {"anyOf": [*one.get("anyOf", [one]), *null]} if null else one

        if self.names is None:
            keys = {"pattern": f"^{STEM.pattern}$"}
            return made | {"propertyNames": keys, "additionalProperties": entry("")}
        if isinstance(self.names, Mapping):
            properties = {name: entry(name) for name in self.names}
        else:
            one = entry("")
            one = one if "$ref" in one else once(handler, f"{self.what}_entry:{id(self)}", one)
            properties = dict.fromkeys(self.names, one)
        for name in properties.keys() & ALL.keys():
            quantity = quantity_schema(handler, ALL[name])
            one = properties[name]
            properties[name] = {"allOf": [quantity, one]} if "$ref" in one else quantity
        made |= {"properties": properties, "additionalProperties": False}
        if self.masses:
            there = (name for name in OF_ANY_MASS if name in properties)
            of_one = {f"^{name}_[0-9]+$": properties[name] for name in there}
            made |= {"patternProperties": of_one}
        return once(handler, f"{self.what}:{crc32(str(made).encode())}", made)

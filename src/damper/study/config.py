"""The study language: what a study file and the workflow's configuration may say.

A study file is one `Study`; `load_config` turns the mapping that Snakemake hands over into the
studies it names, or raises one `ConfigError` that lists every mistake in every file. To add an
observer, a figure or a table, write its class of settings and enter it in its registry.

Settings are checked by the kinds below (`Number`, `Choice`, ...) rather than by pydantic's own
types: a kind can say in words what it allows, and every message does.
"""

from __future__ import annotations

import difflib
import math
import re
from collections.abc import Callable, Iterable, Iterator, Mapping
from contextlib import contextmanager
from itertools import product
from pathlib import Path
from typing import Annotated, Any

from pydantic import (
    BaseModel,
    ConfigDict,
    PrivateAttr,
    ValidationError,
    ValidationInfo,
    model_serializer,
    model_validator,
)
from pydantic_core import CoreSchema, PydanticCustomError, core_schema

from damper.parameters import PARAMETER_NAMES, QUANTITIES, check_parameter
from damper.study.axes import MOST_VALUES, WAYS, axis_values, coordinate_name
from damper.study.yaml_file import (
    NUMBER,
    ConfigError,
    Loc,
    Problem,
    YamlFile,
    dump_yaml,
    read_yaml,
    show,
    words,
)

__all__ = ["Config", "ConfigError", "Study", "load_config", "load_study"]

MOST_SLICES = 1000
"""One slice is one job; beyond this the workflow spends its time on bookkeeping."""


def load_config(mapping: dict[str, Any], directory: Path) -> Config:
    """Check the workflow's configuration and load the studies it names.

    Parameters
    ----------
    mapping : dict
        The content of config/config.yaml as Snakemake read it. Its YAML reader makes text of
        1e-12, so text that looks like a number counts as one here, `overrides` included.
    directory : Path
        The folder that holds ``config/``.

    Returns
    -------
    Config
        The studies, in the order in which they are named, and the engine's settings.

    Raises
    ------
    ConfigError
        Everything that is wrong, in the configuration and in all files.
    """
    mapping = _from_snakemake(mapping)
    problems: list[Problem] = []
    settings = None
    try:
        settings = _Settings.model_validate(mapping)
    except ValidationError as error:
        problems = [Problem("config", *fault) for fault in _faults_of(error, mapping)]
    studies = _load_studies(mapping if isinstance(mapping, dict) else {}, Path(directory), problems)
    if problems or settings is None:
        raise ConfigError.of(problems)
    return Config(studies=studies, engine=settings.engine, results=settings.results)


def load_study(path: Path, override: dict[str, Any] | None = None) -> Study:
    """Load one study file.

    Parameters
    ----------
    path : Path
        The file; its stem is the study's name.
    override : dict, optional
        A partial study that is merged over the file. What it says about the values of an axis
        replaces the way in which the file gives them. As in `load_config`, text that looks like
        a number counts as one in it.

    Returns
    -------
    Study
        The study, merged and checked.

    Raises
    ------
    ConfigError
        Everything that is wrong with the file and the override.
    """
    problems: list[Problem] = []
    study = _load_study(Path(path), str(path), _from_snakemake(override), problems)
    if study is None:
        raise ConfigError.of(problems)
    return study


# Faults: what is wrong, on its way through pydantic, which puts the place together.


def fault(message: str, allowed: str = "", near: str = "") -> PydanticCustomError:
    """Return the error that a kind raises: what is wrong, what is allowed, the nearest name."""
    context = {"message": message, "allowed": allowed, "near": near}
    return PydanticCustomError("fault", "{message}", context)


class Faults:
    """Collects faults, so that one does not hide the next."""

    def __init__(self) -> None:
        self.lines: list[Any] = []

    def add(self, loc: Loc, message: str, allowed: str = "", near: str = "") -> None:
        """Note one fault."""
        self.lines.append({"type": fault(message, allowed, near), "loc": loc, "input": None})

    def unknown(
        self, loc: Loc, what: str, name: object, names: Iterable[str], value: object = None
    ) -> None:
        """Note a name that is none of `names`, and its value where it is short."""
        if not isinstance(name, str):
            self.add(loc, f"a key must be text (it is {show(name)})", words(names))
            return
        shown = (
            "" if value is None or isinstance(value, dict | list) else f" (value: {show(value)})"
        )
        self.add(loc, f"unknown {what} {show(name)}{shown}", words(names), nearest(name, names))

    @contextmanager
    def of(self, *loc: str | int) -> Iterator[None]:
        """Note the faults that the body raises, at `loc` and below."""
        try:
            yield
        except PydanticCustomError as error:
            self.lines.append({"type": error, "loc": loc, "input": None})
        except ValidationError as error:
            for line in error.errors(include_url=False, include_input=False):
                if line["type"] == "fault":
                    self.add((*loc, *line["loc"]), **line["ctx"])
                elif line["type"] != "missing":  # which `_Strict` tells better
                    self.add((*loc, *line["loc"]), f"not valid: {line['msg']}")

    def settle(self) -> None:
        """Raise what was noted, if anything."""
        if self.lines:
            raise ValidationError.from_exception_data("study", self.lines)


def nearest(name: str, names: Iterable[str]) -> str:
    """Return the one of `names` that `name` was probably meant to be, or nothing."""
    folded = {right.casefold(): right for right in names}
    close = difflib.get_close_matches(name[:100].casefold(), folded, n=1)
    return folded[close[0]] if close else ""


# Kinds: one for each sort of value.


class Kind:
    """What a setting may be; stands in the annotation of a field."""

    words: str

    def check(self, value: Any, context: Any) -> Any:
        """Return the value to keep, or raise a `fault`."""
        raise NotImplementedError

    def __get_pydantic_core_schema__(self, source: Any, handler: Any) -> CoreSchema:
        def check(value: Any, info: ValidationInfo) -> Any:
            return self.check(value, info.context)

        return core_schema.with_info_plain_validator_function(check)


class Number(Kind):
    """A finite number within bounds: never a boolean, nor a number in quotes."""

    def __init__(
        self,
        *,
        gt: float = -math.inf,
        ge: float = -math.inf,
        lt: float = math.inf,
        le: float = math.inf,
        whole: bool = False,
        note: str = "",
    ) -> None:
        self.gt, self.ge, self.lt, self.le, self.whole = gt, ge, lt, le, whole
        bounds = [(">", gt), (">=", ge), ("<", lt), ("<=", le)]
        limits = " and ".join(f"{sign} {b}" for sign, b in bounds if math.isfinite(b))
        self.words = " ".join(w for w in ("integer" if whole else "number", limits, note) if w)

    def check(self, value: Any, context: Any) -> float:
        number = self.plain(value)
        if not (number > self.gt and number >= self.ge and number < self.lt and number <= self.le):
            shown = value if isinstance(value, str) else show(value)
            raise fault(f"out of range (value: {shown})", self.words)
        return number

    def plain(self, value: Any) -> float:
        """Return a number of whatever size."""
        sort = "an integer" if self.whole else "a number"
        if isinstance(value, str):
            looks = NUMBER.fullmatch(value) is not None
            if not looks or not isinstance(value, _SnakemakeText):
                hint = ", which is text: take off the quotes" if looks else ""
                raise fault(f"not {sort} (value: {show(value)}{hint})", self.words)
            value = int(value) if re.fullmatch(r"[-+]?[0-9]{1,400}", value) else float(value)
        if isinstance(value, bool) or not isinstance(value, int | float):
            raise fault(f"not {sort} (value: {show(value)})", self.words)
        try:
            number = float(value) + 0.0  # and -0.0 is 0.0, also in names
        except OverflowError:
            number = math.inf
        if not math.isfinite(number):
            raise fault(f"not finite (value: {show(value)})", self.words)
        if not self.whole:
            return number
        if isinstance(value, float):
            hint = f", write {int(value)}" if value.is_integer() and abs(value) < 1e15 else ""
            raise fault(f"not an integer (value: {show(value)}{hint})", self.words)
        return value


class Coordinate(Kind):
    """A value of the parameter that the context names."""

    words = "number in the range of the parameter"

    def check(self, value: Any, context: Any) -> float:
        allowed = "number"
        if context is not None:
            allowed = next(f"number, {q.allowed}" for q in QUANTITIES if q.name == context)
        number = Number()
        number.words = allowed
        checked = number.check(value, None)
        try:
            return checked if context is None else check_parameter(context, checked)
        except ValueError:
            raise fault(f"out of range (value: {show(value)})", allowed) from None


class Text(Kind):
    """Text that is not blank."""

    words = "text"

    def check(self, value: Any, context: Any) -> str:
        if not isinstance(value, str):
            hint = "" if value is None or isinstance(value, dict | list) else ", put it in quotes"
            raise fault(f"not text (value: {show(value)}{hint})", self.words)
        if not value.strip():
            raise fault("the text is empty", self.words)
        try:
            value.encode()
        except UnicodeEncodeError:
            raise fault(f"not text in UTF-8 (value: {show(value)})", self.words) from None
        return str(value)


class Choice(Kind):
    """One of a few words."""

    def __init__(self, *names: str) -> None:
        self.names = names
        self.words = words(names)

    def check(self, value: Any, context: Any) -> str:
        if not isinstance(value, str) or value not in self.names:
            near = nearest(value, self.names) if isinstance(value, str) else ""
            raise fault(f"not one of the choices (value: {show(value)})", self.words, near)
        return str(value)


class Flag(Kind):
    """True or false."""

    words = "true, false"

    def check(self, value: Any, context: Any) -> bool:
        if not isinstance(value, bool):
            raise fault(f"not true or false (value: {show(value)})", self.words)
        return value


class ListOf(Kind):
    """A list of distinct values of one kind."""

    def __init__(self, kind: Kind, least: int = 0, most: int = MOST_VALUES) -> None:
        self.kind, self.least, self.most = kind, least, most
        self.words = f"list of {kind.words}"

    def check(self, value: Any, context: Any) -> tuple[Any, ...]:
        if not isinstance(value, list | tuple):
            raise fault(f"not a list (value: {show(value)})", f"list of {self.kind.words}")
        if len(value) < self.least:
            raise fault("the list is empty", f"list of {self.kind.words}, at least {self.least}")
        if len(value) > self.most:
            raise fault(f"{len(value)} values are too many", f"at most {self.most}")
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


class Section(Kind):
    """A mapping from names to entries; nothing at all is an empty one."""

    def __init__(
        self, entry: Callable[[str, Any], Any], what: str, names: Iterable[str] | None = None
    ) -> None:
        self.entry, self.what, self.names = entry, what, names
        self.words = f"mapping from {what} to its settings"

    def check(self, value: Any, context: Any) -> dict[str, Any]:
        if value is not None and not isinstance(value, dict):
            raise fault(f"not a mapping (value: {show(value)})", self.words)
        faults = Faults()
        kept: dict[str, Any] = {}
        seen: dict[str, str] = {}
        for name, data in (value or {}).items():
            here = _part(name)
            if self.names is not None and name not in self.names:
                faults.unknown((here,), self.what, name, self.names, data)
                continue
            if not isinstance(name, str):
                faults.add((here,), f"a key must be text: put {show(name)} in quotes", _STEM_WORDS)
                continue
            if name.casefold() in seen:
                twin = seen[name.casefold()]
                faults.add((here,), f"the same file as '{twin}' where case does not count")
            seen[name.casefold()] = name
            with faults.of(here):
                kept[name] = self.entry(name, data)
        faults.settle()
        return kept


class Strict(BaseModel):
    """A mapping of settings: unknown, missing and misspelt keys are told in plain words."""

    model_config = ConfigDict(frozen=True, extra="forbid", strict=True)

    @classmethod
    def written_out(cls, data: Any) -> Any:
        """Return the mapping that a shorthand stands for."""
        return data

    @classmethod
    def relate(cls, data: dict[str, Any], model: Any, faults: Faults) -> None:
        """Check what no setting can check alone; `model` is None if some setting is wrong."""

    @model_validator(mode="wrap")
    @classmethod
    def _in_plain_words(cls, data: Any, handler: Callable[[Any], Any]) -> Any:
        if isinstance(data, cls):
            return data
        data = cls.written_out(data)
        if not isinstance(data, dict):
            raise fault(f"not a mapping (value: {show(data)})", words(cls.model_fields))
        faults, model = Faults(), None
        for key, value in data.items():
            if key not in cls.model_fields:
                faults.unknown((_part(key),), "key", key, cls.model_fields, value)
        for key, field in cls.model_fields.items():
            if field.is_required() and key not in data:
                allowed = next((k.words for k in field.metadata if isinstance(k, Kind)), "")
                faults.add((key,), f"'{key}' is missing", allowed)
        with faults.of():
            model = handler({key: data[key] for key in cls.model_fields if key in data})
        cls.relate(data, model, faults)
        faults.settle()
        return model


# Parameters and axes.


class Fixed(Strict):
    """A parameter that is the same throughout the study."""

    value: Annotated[float, Coordinate()]
    assumed: Annotated[str | None, Text()] = None

    @classmethod
    def written_out(cls, data: Any) -> Any:
        return data if isinstance(data, dict) else {"value": data}

    @model_serializer
    def _short(self) -> Any:
        if self.assumed is None:
            return self.value
        return {"value": self.value, "assumed": self.assumed}


class Axis(Strict):
    """A parameter that runs through values; `axis_values` forms them."""

    values: Annotated[tuple[float, ...] | None, ListOf(Coordinate(), least=1)] = None
    start: Annotated[float | None, Coordinate()] = None
    stop: Annotated[float | None, Coordinate()] = None
    num: Annotated[int | None, Number(ge=2, le=MOST_VALUES, whole=True)] = None
    step: Annotated[float | None, Number(gt=0)] = None
    spacing: Annotated[str, Choice("linear", "log")] = "linear"
    fan: Annotated[bool, Flag()] = False
    assumed: Annotated[str | None, Text()] = None

    @classmethod
    def relate(cls, data: dict[str, Any], model: Any, faults: Faults) -> None:
        if model is None or not data.keys() <= cls.model_fields.keys():
            return  # a misspelt key would make a second error of the first
        try:
            axis_values(model)
        except ValueError as error:
            faults.add((), str(error), WAYS)


def _fixed(name: str, data: Any) -> Fixed:
    return Fixed.model_validate(data, context=name)


def _axis(name: str, data: Any) -> Axis:
    return Axis.model_validate(data, context=name)


# Observers.

_FRACTION = Number(gt=0, lt=1)


class Threshold(Strict):
    """The approach speed from which an impact is visible: `fraction` of the first, or `speed`."""

    fraction: Annotated[
        float | None, Number(gt=0, lt=1, note="(of the first approach speed), or {speed: > 0}")
    ] = None
    speed: Annotated[float | None, Number(gt=0)] = None

    @classmethod
    def written_out(cls, data: Any) -> Any:
        return data if isinstance(data, dict) else {"fraction": data}

    @classmethod
    def relate(cls, data: dict[str, Any], model: Any, faults: Faults) -> None:
        if model is None or not data.keys() <= cls.model_fields.keys():
            return
        if (model.fraction is None) == (model.speed is None):
            faults.add((), "exactly one of fraction and speed must be given", "fraction, speed")

    @model_serializer
    def _short(self) -> Any:
        return {"speed": self.speed} if self.fraction is None else self.fraction


class StroboscopicSection(Strict):
    """The state once per forcing period."""

    at: Annotated[float, Number(ge=0, lt=1)] = 0.0
    free_mass: Annotated[bool, Flag()] = False


class ImpactSection(Strict):
    """The state just after each impact on one wall."""

    wall: Annotated[str, Choice("left", "right")] = "right"
    samples: Annotated[int, Number(ge=1, le=100_000, whole=True)] = 100
    free_mass: Annotated[bool, Flag()] = False


class Impacts(Strict):
    """Counts of visible impacts."""

    threshold: Threshold = Threshold(fraction=0.03)


class Bursts(Strict):
    """Bursts: their number, visible impacts and completion."""

    threshold: Threshold = Threshold(fraction=0.03)
    compare_thresholds: Annotated[tuple[float, ...], ListOf(_FRACTION)] = ()
    records: Annotated[int, Number(ge=0, whole=True)] = 0


OBSERVERS: dict[str, type[Strict]] = {
    "stroboscopic_section": StroboscopicSection,
    "impact_section": ImpactSection,
    "impacts": Impacts,
    "bursts": Bursts,
}
SECTIONS = ("stroboscopic_section", "impact_section")


def _observer(name: str, data: Any) -> Strict:
    return OBSERVERS[name].model_validate({} if data is None else data)


# Figures and tables.


class Product(Strict):
    """A figure or a table: its kind, and what it needs of the study."""

    kind: Annotated[str, Text()]

    @classmethod
    def fit(
        cls,
        settings: dict[str, Any],
        axes: Mapping[str, tuple[float, ...] | None],
        observers: Iterable[str],
    ) -> None:
        """Raise what `settings` ask of the study in vain; an axis in error has no values."""
        raise NotImplementedError

    def files(self, stem: str, axes: Mapping[str, tuple[float, ...]]) -> dict[str, dict[str, Any]]:
        """Return the file stems with the coordinates at which each is made."""
        return {stem: {}}


class Bifurcation(Product):
    """The section over one axis, with a row of panels for each value of a second one."""

    along: Annotated[str, Text()]
    each: Annotated[str | None, Text()] = None
    rows: Annotated[str | None, Text()] = None
    caption: Annotated[str | None, Text()] = None

    @classmethod
    def fit(
        cls,
        settings: dict[str, Any],
        axes: Mapping[str, tuple[float, ...] | None],
        observers: Iterable[str],
    ) -> None:
        faults = Faults()
        used: dict[str, str] = {}
        if not any(section in observers for section in SECTIONS):
            faults.add((), "needs a section among the observers", " or ".join(SECTIONS))
        for role in ("along", "each", "rows"):
            name = settings.get(role)
            if not isinstance(name, str):
                continue
            _know_axis(role, name, axes, faults)
            if name in used:
                faults.add((role,), f"'{name}' is {used[name]} already", "three distinct axes")
            used[name] = role
        # Where a role is missing or misspelt, this would make a second error of the first.
        if not faults.lines and "along" in settings and cls.model_fields.keys() >= settings.keys():
            for name, values in axes.items():
                if name not in used and values is not None and len(values) > 1:
                    message = f"axis '{name}' has {len(values)} values but no place in the figure"
                    free = [role for role in ("each", "rows") if role not in settings]
                    faults.add((), message, f"name it as {' or '.join(free)}" if free else "")
        faults.settle()

    def files(self, stem: str, axes: Mapping[str, tuple[float, ...]]) -> dict[str, dict[str, Any]]:
        if self.each is None:
            return {stem: {}}
        values = axes[self.each]
        return {f"{stem}_{coordinate_name(self.each, v)}": {self.each: v} for v in values}


class Intervals(Product):
    """The intervals of one axis in which bursts are chatter."""

    along: Annotated[str, Text()]
    resolution: Annotated[float, Number(gt=0)] = 1e-3

    @classmethod
    def fit(
        cls,
        settings: dict[str, Any],
        axes: Mapping[str, tuple[float, ...] | None],
        observers: Iterable[str],
    ) -> None:
        faults = Faults()
        if "bursts" not in observers:
            faults.add((), "needs bursts among the observers", "bursts")
        name = settings.get("along")
        if isinstance(name, str):
            _know_axis("along", name, axes, faults)
            values = axes.get(name)
            if values is not None and len(values) < 3:
                message = f"axis '{name}' has too few values ({len(values)})"
                faults.add(("along",), message, "an axis with at least 3 values")
        faults.settle()


FIGURES: dict[str, type[Product]] = {"bifurcation": Bifurcation}
TABLES: dict[str, type[Product]] = {"intervals": Intervals}


def _know_axis(role: str, name: str, axes: Iterable[str], faults: Faults) -> None:
    if name not in axes:
        faults.unknown((role,), "axis", name, axes)


def _product(registry: Mapping[str, type[Product]]) -> Callable[[str, Any], Product]:
    def entry(stem: str, data: Any) -> Product:
        faults, made = Faults(), None
        if not _STEM.fullmatch(stem):
            faults.add((), f"{show(stem)} cannot be the name of a file", _STEM_WORDS)
        with faults.of():
            made = _class_of(data, registry).model_validate(data)
        faults.settle()
        assert made is not None
        return made

    return entry


def _class_of(data: Any, registry: Mapping[str, type[Product]]) -> type[Product]:
    if not isinstance(data, dict):
        raise fault(f"not a mapping (value: {show(data)})", "kind and its settings")
    faults, kind = Faults(), ""
    if "kind" not in data:
        faults.add(("kind",), "'kind' is missing", words(registry))
    else:
        with faults.of("kind"):
            kind = Choice(*registry).check(data["kind"], None)
    faults.settle()
    return registry[kind]


# The study and the configuration.


class Study(Strict):
    """One study: fixed parameters, axes, what to measure, what to draw."""

    title: Annotated[str, Text()]
    source: Annotated[str, Text()]
    description: Annotated[str | None, Text()] = None
    parameters: Annotated[dict[str, Fixed], Section(_fixed, "parameter", PARAMETER_NAMES)] = {}
    axes: Annotated[dict[str, Axis], Section(_axis, "axis", PARAMETER_NAMES)] = {}
    transient: Annotated[int, Number(ge=0, whole=True)]
    periods: Annotated[int, Number(ge=1, whole=True)]
    observers: Annotated[dict[str, Strict], Section(_observer, "observer", OBSERVERS)]
    figures: Annotated[dict[str, Product], Section(_product(FIGURES), "figure")] = {}
    tables: Annotated[dict[str, Product], Section(_product(TABLES), "table")] = {}
    _name: str = PrivateAttr("")

    @property
    def name(self) -> str:
        """Stem of the study's file."""
        return self._name

    @property
    def axis_values(self) -> dict[str, tuple[float, ...]]:
        """Values of every axis, in the order of the cube's dimensions."""
        return {name: axis_values(axis) for name, axis in self.axes.items()}

    @property
    def fixed(self) -> dict[str, float]:
        """Value of every parameter that is not an axis, the phase included."""
        defaults = {q.name: q.default for q in QUANTITIES if q.default is not None}
        values = defaults | {name: fixed.value for name, fixed in self.parameters.items()}
        return {name: values[name] for name in PARAMETER_NAMES if name not in self.axes}

    @property
    def assumed(self) -> dict[str, str]:
        """The reason for every value that the source does not state."""
        entries: dict[str, Fixed | Axis] = {**self.parameters, **self.axes}
        return {n: e.assumed for n, e in entries.items() if e.assumed is not None}

    @property
    def fan_axes(self) -> tuple[str, ...]:
        """Axes along which each value is a job of its own."""
        return tuple(name for name, axis in self.axes.items() if axis.fan)

    @property
    def inner_axes(self) -> tuple[str, ...]:
        """Axes that run inside a job."""
        return tuple(name for name, axis in self.axes.items() if not axis.fan)

    def slices(self) -> list[dict[str, float]]:
        """Return the coordinates of every slice; without fanned axes, one that has none."""
        values = self.axis_values
        fanned = self.fan_axes
        return [
            dict(zip(fanned, point, strict=True)) for point in product(*(values[n] for n in fanned))
        ]

    def slice_path(self, coords: Mapping[str, float]) -> str:
        """Return the path of a slice, without suffix, such as ``mass_ratio~0.1/clearance~2``."""
        return "/".join(coordinate_name(n, coords[n]) for n in self.fan_axes) or "all"

    def figure_files(self) -> dict[str, tuple[str, dict[str, float]]]:
        """Return, for the stem of every figure file, the figure's name and fixed coordinates."""
        values = self.axis_values
        return {
            stem: (name, fixed)
            for name, figure in self.figures.items()
            for stem, fixed in figure.files(name, values).items()
        }

    def to_yaml(self) -> str:
        """Return the study as checked, every default spelt out; equal studies, equal text."""
        data = self.model_dump(mode="json", exclude_none=True)
        for section, order in (("parameters", PARAMETER_NAMES), ("observers", OBSERVERS)):
            data[section] = {name: data[section][name] for name in order if name in data[section]}
        return dump_yaml(data)

    @classmethod
    def relate(cls, data: dict[str, Any], model: Any, faults: Faults) -> None:
        # Works on the raw data: a mistake in one entry is to hide nothing about the others.
        raw = {key: {} if data.get(key) is None else data[key] for key in cls.model_fields}
        parameters, axes, observers = raw["parameters"], raw["axes"], raw["observers"]
        if isinstance(observers, dict):
            _relate_observers(observers, faults)
        if not isinstance(axes, dict):
            return
        if isinstance(parameters, dict):
            _give_once(parameters, axes, faults)
        sound = {name: _sound(name, axes[name]) for name in axes if name in PARAMETER_NAMES}
        values = {n: None if a is None else axis_values(a) for n, a in sound.items()}
        _limit_slices({n: len(axis_values(a)) for n, a in sound.items() if a and a.fan}, faults)
        if not isinstance(observers, dict):
            return
        for section, registry in (("figures", FIGURES), ("tables", TABLES)):
            entries = raw[section]
            for stem, settings in entries.items() if isinstance(entries, dict) else ():
                kind = settings.get("kind") if isinstance(settings, dict) else None
                if isinstance(kind, str) and kind in registry:
                    with faults.of(section, _part(stem)):
                        registry[kind].fit(settings, values, observers)


def _relate_observers(observers: dict[str, Any], faults: Faults) -> None:
    if not observers:
        faults.add(("observers",), "at least one observer must be given", words(OBSERVERS))
    if all(section in observers for section in SECTIONS):
        faults.add(
            ("observers",),
            f"{SECTIONS[0]} and {SECTIONS[1]} cannot both be asked for: "
            "both write displacement and velocity",
            "one of the two",
        )


def _give_once(parameters: dict[str, Any], axes: dict[str, Any], faults: Faults) -> None:
    strangers = [n for n in (*parameters, *axes) if isinstance(n, str) and n not in PARAMETER_NAMES]
    meant = {nearest(name, PARAMETER_NAMES) for name in strangers}
    for quantity in QUANTITIES:
        name = quantity.name
        if name in parameters and name in axes:
            message = f"'{name}' is given twice: under parameters and under axes"
            faults.add(("axes", name), message, "one of the two")
        given = name in parameters or name in axes or quantity.default is not None
        if not given and name not in meant:
            message = f"'{name}' is not given"
            allowed = f"{quantity.allowed}, under parameters or as an axis"
            faults.add(("parameters", name), message, allowed)


def _limit_slices(fanned: dict[str, int], faults: Faults) -> None:
    count = math.prod(fanned.values())
    if count > MOST_SLICES:
        sizes = ", ".join(f"{name} ({size} values)" for name, size in fanned.items())
        longest = max(fanned, key=lambda name: fanned[name])
        message = f"the fanned axes make {count} slices: {sizes}"
        allowed = f"at most {MOST_SLICES} slices; take 'fan: true' from {longest}"
        faults.add(("axes",), message, allowed)


def _sound(name: str, data: Any) -> Axis | None:
    try:
        return _axis(name, data)
    except ValidationError:
        return None


class Engine(Strict):
    """Settings of the event-driven engine."""

    accuracy: Annotated[float, Number(ge=1e-15, le=1e-3)] = 1e-12
    max_events: Annotated[int, Number(ge=1, whole=True)] = 1_000_000


class Config(Strict):
    """The workflow's configuration with its studies, checked."""

    studies: dict[str, Study]
    engine: Engine
    results: str


def _override(name: str, data: Any) -> dict[str, Any]:
    if data is not None and not isinstance(data, dict):
        raise fault(f"not a mapping (value: {show(data)})", "part of a study")
    return data or {}


class _Settings(Strict):
    """The configuration as written; which studies there are is known to the file system."""

    studies: Annotated[tuple[str, ...], ListOf(Text(), least=1)]
    engine: Engine = Engine()
    results: Annotated[str, Text()] = "results"
    overrides: Annotated[dict[str, Any], Section(_override, "study")] = {}


# Loading.

_STEM = re.compile(r"[A-Za-z0-9_-]+")
_STEM_WORDS = "letters, digits, _ and -"


def _load_studies(
    mapping: dict[str, Any], directory: Path, problems: list[Problem]
) -> dict[str, Study]:
    files = {p.stem: p for p in sorted((directory / "config" / "studies").glob("*.yaml"))}
    asked, overrides = mapping.get("studies"), mapping.get("overrides")
    asked = asked if isinstance(asked, list) else []
    overrides = overrides if isinstance(overrides, dict) else {}
    paths: dict[str, Path] = {}
    for i, entry in enumerate(asked):
        if not isinstance(entry, str) or not entry.strip() or entry in asked[:i]:
            continue  # told already
        path = directory / str(entry) if entry.endswith(".yaml") else files.get(entry)
        loc = ("studies", i)
        if path is None:
            problems.append(_unknown_study(loc, entry, files))
        elif not _STEM.fullmatch(path.stem):
            message = f"{show(path.stem)} cannot be the name of a study"
            problems.append(Problem("config", loc, message, _STEM_WORDS))
        elif path.stem.casefold() in {name.casefold() for name in paths}:
            message = f"two studies are called '{path.stem}'"
            problems.append(Problem("config", loc, message, "each name once"))
        else:
            paths[path.stem] = path
    for name in overrides:
        if isinstance(name, str) and name not in files and name not in paths:
            problems.append(_unknown_study(("overrides", name), name, files))
    studies = {}
    for name, path in paths.items():
        label = path.relative_to(directory) if path.is_relative_to(directory) else path
        override = overrides.get(name)
        override = override if isinstance(override, dict) else None
        study = _load_study(path, label.as_posix(), override, problems)
        if study is not None:
            studies[name] = study
    return studies


def _unknown_study(loc: Loc, name: str, files: Iterable[str]) -> Problem:
    allowed = f"{words(files)} (the files in config/studies), or a path that ends in .yaml"
    return Problem("config", loc, f"unknown study {show(name)}", allowed, nearest(name, files))


def _load_study(path: Path, label: str, override: Any, problems: list[Problem]) -> Study | None:
    """Return the study, or add to `problems` what is wrong with it."""
    try:
        file = read_yaml(path, label)
    except ConfigError as error:
        problems.extend(error.problems)
        return None
    found, study = list(file.problems), None
    data = _merged(file.data, override) if isinstance(override, dict) else file.data
    if override is not None and not isinstance(override, dict):
        place = f"{label} (overrides of config)"
        found.append(Problem(place, (), f"not a mapping (value: {show(override)})"))
    try:
        study = Study.model_validate(data)
    except ValidationError as error:
        for loc, message, allowed, near in _faults_of(error, data):
            place, line = _place(loc, file, override)
            found.append(Problem(place, loc, message, allowed, near, line))
    problems.extend(sorted(found, key=lambda problem: problem.line))
    if found or study is None:
        return None
    study._name = path.stem
    return study


def _faults_of(error: ValidationError, data: Any) -> list[tuple[Loc, str, str, str]]:
    lines = error.errors(include_url=False, include_input=False)
    contexts = [(line["loc"], line.get("ctx", {"message": line["msg"]})) for line in lines]
    return [
        (_as_written(loc, data), c["message"], c.get("allowed", ""), c.get("near", ""))
        for loc, c in contexts
    ]


def _as_written(loc: Loc, data: Any) -> Loc:
    """Drop the end of a path that only the written-out form of a shorthand has."""
    for i, part in enumerate(loc):
        if isinstance(data, dict):
            if part not in data:
                break
            data = data[part]
        elif isinstance(data, list | tuple) and isinstance(part, int) and part < len(data):
            data = data[part]
        else:
            return loc[:i]
    return loc


def _place(loc: Loc, file: YamlFile, override: Any) -> tuple[str, int]:
    """Return where the value at `loc` comes from, in words, and the line to sort by."""
    depth, line = file.find(loc)
    here = f"{file.label}:{line}" if line else file.label
    over, value = 0, override
    while over < len(loc) and isinstance(value, dict) and loc[over] in value:
        value = value[loc[over]]
        over += 1
    if isinstance(value, list | tuple):
        over += sum(1 for part in loc[over : over + 1] if isinstance(part, int))
    if over == 0 or over < depth:
        return here, line
    both = over == depth and isinstance(value, dict)
    return f"{here if both else file.label} ({'and ' if both else ''}overrides of config)", line


# The keys of an axis in the file that give way to a key in the override.
_YIELDS = {
    "values": ("start", "stop", "num", "step", "spacing"),
    "num": ("values", "step"),
    "step": ("values", "num", "spacing"),
    "start": ("values",),
    "stop": ("values",),
}


def _merged(file: dict[str, Any], override: dict[str, Any], loc: Loc = ()) -> dict[str, Any]:
    merged = dict(file)
    if len(loc) == 2 and loc[0] == "axes":
        for key in {old for new in override for old in _YIELDS.get(new, ())}:
            merged.pop(key, None)
    for key, value in override.items():
        old = merged.get(key)
        if isinstance(old, dict) and isinstance(value, dict) and len(loc) < _DEEPEST:
            value = _merged(old, value, (*loc, key))
        merged[key] = value
    return merged


class _SnakemakeText(str):
    """Text that may be a number, because Snakemake's YAML reader takes 1e-12 for text."""


_DEEPEST = 8


def _from_snakemake(value: Any, depth: int = 0, done: dict[int, Any] | None = None) -> Any:
    """Mark all text; depth and identity are watched, since a mapping may contain itself."""
    done = {} if done is None else done
    if isinstance(value, str):
        return _SnakemakeText(value)
    if not isinstance(value, Mapping | list | tuple) or depth > _DEEPEST:
        return value
    if id(value) not in done:
        done[id(value)] = None
        if isinstance(value, Mapping):
            done[id(value)] = {k: _from_snakemake(v, depth + 1, done) for k, v in value.items()}
        else:
            done[id(value)] = [_from_snakemake(v, depth + 1, done) for v in value]
    return done[id(value)]


def _part(name: object) -> str:
    """Return a key as a part of a path, whatever it is."""
    return name if isinstance(name, str) else show(name)

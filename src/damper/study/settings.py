"""The entries of a study: parameters, axes, draws, where runs start, observers.

The settings of an observer stand in its own file, `damper.observers`.
"""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping
from functools import cache, partial
from typing import Annotated, Any, Literal

from pydantic import (
    AfterValidator,
    Field,
    GetJsonSchemaHandler,
    TypeAdapter,
    ValidationInfo,
    create_model,
)
from pydantic_core import CoreSchema, core_schema

from damper.observers import OBSERVERS, observer_class
from damper.observers.common.settings import AxisPlace, Setting, Visibility
from damper.parameters.quantities import (
    ALL,
    PARAMETER_NAMES,
    Quantity,
    quantities_in,
    si_units,
)
from damper.parameters.setting import END
from damper.parameters.tables import read_table
from damper.parameters.unit_text import SIZES, each_number, number_in, split_unit
from damper.parameters.units import HERTZ, own_number
from damper.parameters.variables import SI_UNITS, SPEED
from damper.study.axes import MOST_VALUES, grid, short
from damper.study.fields import (
    Bound,
    Coordinate,
    Distinct,
    DistinctList,
    Line,
    NamedMapping,
    OrWord,
    Pair,
    Rule,
    SIUnit,
    StrictModel,
    Text,
    Unit,
    one_of,
    refused,
)
from damper.study.messages import Mistakes
from damper.study.schema import THE_PARAMETERS, Schema, nested
from damper.study.yaml_file import display, join_names
from damper.sweep.branches import DIRECTIONS
from damper.sweep.orbits import KINDS

Assumed = Annotated[
    Line | None,
    Field(description="Why this value, where the source gives none; not with `stated`."),
]
Stated = Annotated[
    Line | None, Field(description="Where the source gives this value; not with `assumed`.")
]

#: Nothing given; copied for each model.
_NONE: Any = {}
_WITH_SI = {units: f"{units}, {si}" for units, si in SI_UNITS.items()}


def _of_frequency(unit: str, info: ValidationInfo) -> str:
    """Refuse a unit of a quantity that is no angular frequency."""
    if info.context is not None and ALL[info.context].units != "rad/s":
        mistakes, frequencies = Mistakes(), [n for n, q in ALL.items() if q.units == "rad/s"]
        message = f"'{info.context}' has no other unit than its own (value: {display(unit)})"
        mistakes.add((), message, f"unit: {unit} is for {join_names(frequencies)}")
        mistakes.raise_any()
    return unit


InHertz = Annotated[
    Annotated[Literal["Hz"], AfterValidator(_of_frequency)] | None,
    Field(description="Of a frequency in rad/s that is given in Hz; results have it in Hz."),
]


class OfQuantity(StrictModel):
    """Numbers of the quantity under whose name they stand, such as 20 mm or [10 Hz, 12 Hz]."""

    @classmethod
    def quantity_named(cls, name: str) -> Quantity | None:
        """Return the quantity of a name, if there is one."""
        return ALL.get(name)

    @classmethod
    def without_units(
        cls, given: Mapping[str, Any], name: str | None, mistakes: Mistakes
    ) -> dict[str, Any]:
        read, quantity = dict(given), cls.quantity_named(name or "")
        if quantity is not None and quantity.words:
            known = dict(quantity.words)
            for key in _NUMBERS & given.keys():
                read[key] = each_number(read[key], lambda word: known.get(word, word))
            return read
        texts = dict(texts_with_unit(given))
        if quantity is None or not texts:
            return read
        units = si_units(quantity)
        if quantity.units == "rad/s" and all(u in SIZES["Hz"] for _, u in texts.values()):
            # Results keep the unit that a frequency is given in.
            units = ["Hz"]
            read["unit"] = HERTZ
        numbers = [item for key in _NUMBERS & given.keys() for item in _items(given[key])]
        if len(texts) < len(numbers) or "unit" in given:
            message = f"only some of the values have a unit ({', '.join(texts)})"
            mistakes.add((), message, "values that all have a unit, or none of them")
        for key in _NUMBERS & given.keys():
            with refused((key,), mistakes):
                read[key] = each_number(read[key], partial(number_in, "", units=units))
        return read


#: Settings of an `OfQuantity` with its numbers.
_NUMBERS = {"value", "values", "start", "stop", "step", "range"}


def _items(value: Any) -> list[Any]:
    return [item for item in value if item is not None] if isinstance(value, list) else [value]


def texts_with_unit(entry: Any) -> Iterator[tuple[str, tuple[str, str]]]:
    """Yield the texts with a unit in an entry of a quantity, each with its number and unit."""
    values = entry if isinstance(entry, dict) else {"value": entry}
    for key in values.keys() & _NUMBERS:
        for item in _items(values[key]):
            if parts := split_unit(item):
                yield item, parts


def numbers_at(given: Mapping[str, Any], axis: type[OfQuantity]) -> dict[str, Any]:
    """Return settings of a study with an axis's numbers for texts in ``at``, such as 20 mm.

    Other texts stay as they are.
    """

    def number(name: Any, value: Any) -> Any:
        mistakes = Mistakes()
        if not (isinstance(name, str) and isinstance(value, str)):
            return value
        read = axis.without_units({"value": value}, name, mistakes)
        return value if mistakes else read["value"]

    def placed(entry: Any) -> Any:
        at = entry.get("at") if isinstance(entry, dict) else None
        if not isinstance(at, dict):
            return entry
        return entry | {"at": {name: number(name, value) for name, value in at.items()}}

    read = dict(given)
    for section in ("observers", "figures", "tables"):
        if isinstance(entries := read.get(section), dict):
            read[section] = {name: placed(entry) for name, entry in entries.items()}
    return read


class Fixed(OfQuantity):
    """A parameter that is the same throughout the study."""

    shorthand = "value"
    value: Annotated[Coordinate, Field(description="The value.")]
    unit: InHertz = None
    assumed: Assumed = None
    stated: Stated = None

    @property
    def number(self) -> float:
        """The value in the quantity's own unit."""
        return float(own_number(self.value, self.unit))

    @property
    def given(self) -> tuple[float, ...]:
        """The value as given."""
        return (self.value,)

    def check_together(self, mistakes: Mistakes) -> None:
        check_origin(self, mistakes)


def _table(rows: Any, info: ValidationInfo) -> Any:
    """Check a table by the rules of the library."""
    try:
        return read_table(str(info.context), rows)
    except (ValueError, TypeError) as error:
        mistakes, (message, _, allowed) = Mistakes(), str(error).partition(": must ")
        mistakes.add((), message, f"must {allowed}" if allowed else "rows [speed, restitution]")
        mistakes.raise_any()


class OrFile:
    """Marks rows in whose place a file is named, which is read before the study is checked."""

    def __get_pydantic_json_schema__(
        self, core: CoreSchema, handler: GetJsonSchemaHandler
    ) -> Schema:
        return {"anyOf": [handler(core), {"type": "string"}]}


Rows = Annotated[
    tuple[Annotated[tuple[float, float], Field(strict=False)], ...],
    Field(strict=False, min_length=1),
    AfterValidator(_table),
    OrFile(),
]
"""A table of the restitution by the approach speed."""


class AxisValues(OfQuantity):
    """The values of a parameter, one by one or between two ends."""

    values: Annotated[
        DistinctList[Annotated[float, Unit(THE_PARAMETERS)]] | None,
        Field(description="The values one by one, in any order; without start, stop, num, step."),
    ] = None
    start: Annotated[
        float | None,
        Unit(THE_PARAMETERS),
        Field(description="First value; with stop and num or step."),
    ] = None
    stop: Annotated[
        float | None,
        Unit(THE_PARAMETERS),
        Field(description="Last value, included; more than start."),
    ] = None
    num: Annotated[
        int | None,
        Field(
            ge=2,
            le=MOST_VALUES,
            description="How many values, start and stop included; not with step.",
        ),
    ] = None
    step: Annotated[
        float | None,
        Unit(THE_PARAMETERS),
        Field(gt=0, description="Distance of the values; must divide the range; not with num."),
    ] = None
    spacing: Annotated[
        Literal["linear", "log"],
        Field(description="Equal distances, or equal ratios (start > 0, with num)."),
    ] = "linear"
    unit: Annotated[
        Literal["Hz"] | None,
        Field(description="Of a frequency in rad/s that is given in Hz; results have it in Hz."),
    ] = None

    @property
    def points(self) -> tuple[float, ...]:
        """The values in the own unit of the quantity; ValueError if the parts make no axis."""
        return tuple(own_number(value, self.unit) for value in self.given)

    @property
    def given(self) -> tuple[float, ...]:
        """The values in order, as given, distinct and finite; ValueError as for `points`."""
        parts = ("start", "stop", "num", "step")
        given = [name for name in parts if getattr(self, name) is not None]
        if self.values is not None:
            given += ["spacing"] if self.spacing != "linear" else []
            if given:
                raise ValueError(f"values stands alone, but {', '.join(given)} is given as well")
            return self.values
        if not given:
            raise ValueError("does not say which values it has")
        if missing := [name for name in ("start", "stop") if name not in given]:
            raise ValueError(f"{' and '.join(missing)} is missing")
        if self.num is not None and self.step is not None:
            raise ValueError(f"num ({self.num}) and step ({short(self.step)}) are both given")
        if self.num is None and self.step is None:
            raise ValueError("start and stop are given, but neither num nor step")
        assert self.start is not None
        assert self.stop is not None
        return grid(self.start, self.stop, self.num, self.step, self.spacing)

    def check_together(self, mistakes: Mistakes) -> None:
        try:
            _ = self.points
        except ValueError as error:
            ways = "values; or start and stop with num or step (spacing: log goes with num)"
            mistakes.add((), str(error), ways)


class Axis(AxisValues):
    """A parameter that runs through values."""

    values: Annotated[
        DistinctList[Coordinate] | None,
        Field(description="The values one by one, in any order; without start, stop, num, step."),
    ] = None
    start: Annotated[Bound | None, Field(description="First value; with stop and num or step.")] = (
        None
    )
    stop: Annotated[Bound | None, Field(description="Last value, included; more than start.")] = (
        None
    )
    unit: InHertz = None
    fan: Annotated[
        bool, Field(description="Whether each value is a job of its own; not with follow.")
    ] = False
    follow: Annotated[
        Annotated[str, one_of(DIRECTIONS)] | None,
        Field(
            description="Continuation: every run starts from its neighbour's end, towards larger "
            "values, smaller ones, or both in turn; on one axis, not one of an initial quantity."
        ),
    ] = None
    assumed: Assumed = None
    stated: Stated = None

    def check_together(self, mistakes: Mistakes) -> None:
        check_origin(self, mistakes)
        if self.fan and self.follow is not None:
            message = (
                f"fan and follow ({self.follow}) are both given: on a followed axis each point "
                "starts from its neighbour's end, so the axis cannot be cut into jobs"
            )
            mistakes.add(("fan",), message, "take away fan here and fan another axis, or none")
        super().check_together(mistakes)


def check_origin(entry: Any, mistakes: Mistakes) -> None:
    """Note that a value is both assumed and stated."""
    if entry.assumed is not None and entry.stated is not None:
        mistakes.add((), "assumed and stated are both given", "one of the two")


PrimaryStart = Annotated[
    Literal["rest", "steady"],
    Field(
        description="Where the primary starts: at rest in its middle, or on the steady response it "
        "would have without the damper. Initial quantities under parameters, axes and draws move "
        "it and the free mass from there."
    ),
]


class Drawn(OfQuantity):
    """What a quantity may be at random: in a range, one of some values, or either."""

    shorthand = "range"
    range: Annotated[
        Pair[Bound] | None,
        Unit(THE_PARAMETERS),
        Field(description="Where it lies; for a quantity that is a whole number give values."),
    ] = None
    unit: InHertz = None
    spacing: Annotated[
        Literal["linear", "log"],
        Field(description="Uniform in the range, or uniform in its logarithm (low > 0)."),
    ] = "linear"
    values: Annotated[
        DistinctList[Coordinate] | None,
        Field(description="Values of which it takes one, each as often as the others."),
    ] = None
    share: Annotated[
        float | None,
        Field(
            gt=0,
            lt=1,
            description="Part of the draws in which it takes one of the values; with both range "
            "and values.",
        ),
    ] = None
    assumed: Assumed = None
    stated: Stated = None

    @property
    def given(self) -> tuple[float, ...]:
        """Nothing: the numbers that are drawn are not given."""
        return ()

    @property
    def ends(self) -> tuple[float, ...]:
        """Ends of the range, and the values."""
        return tuple(own_number(v, self.unit) for v in (*(self.range or ()), *(self.values or ())))

    @property
    def rule(self) -> dict[str, Any]:
        """The rule of a draw, in the quantity's own unit, as `damper.sweep.branches.draw` takes
        it."""
        given: dict[str, Any] = {"spacing": self.spacing, "share": self.share}
        for key in ("range", "values"):
            numbers = getattr(self, key)
            given[key] = numbers and tuple(own_number(value, self.unit) for value in numbers)
        keys = ("range", "spacing", "values", "share")
        return {key: given[key] for key in keys if given[key] is not None}

    def check_together(self, mistakes: Mistakes) -> None:
        check_origin(self, mistakes)
        if not self.ends:
            mistakes.add((), "neither range nor values is given", "one of them, or both with share")
        elif self.range is None or self.values is None:
            if self.share is not None:
                mistakes.add(("share",), "share is of both a range and values", "range and values")
        elif self.share is None:
            message = "range and values are given, but not how often it takes one of the values"
            mistakes.add(("share",), message, "number > 0 and < 1")
        if self.spacing == "log" and (self.range is None or self.range[0] <= 0.0):
            mistakes.add(("spacing",), "spacing log needs a range with low > 0", "linear")


MOST_DRAWS = 100_000
"""More draws at each point are a slip of the pen."""


class DrawKeys(StrictModel):
    """Settings of draws beside the drawn quantities."""

    count: Annotated[
        int, Field(ge=1, le=MOST_DRAWS, description="How many draws each point of the axes has.")
    ]
    seed: Annotated[
        int, Field(ge=0, description="Seed of the draws: the same values on every machine.")
    ]


_DRAW_KEYS = {key: field.rebuild_annotation() for key, field in DrawKeys.model_fields.items()}


def _check_draws(draws: dict[str, Any]) -> dict[str, Any]:
    """Note what draws lack, and quantities that cannot be drawn from a range."""
    mistakes = Mistakes()
    with mistakes.at():
        if draws:
            DrawKeys.model_validate({key: draws[key] for key in _DRAW_KEYS if key in draws})
    for name, drawn in drawn_of(draws).items():
        if ALL[name].whole and drawn.range is not None:
            message = f"'{name}' is a whole number, and a range is drawn between"
            mistakes.add((name,), message, "values: its values")
    mistakes.raise_any()
    return draws


Draws = Annotated[
    dict[str, int | Drawn],
    NamedMapping(
        "drawn quantity",
        {**_DRAW_KEYS, **dict.fromkeys(ALL, Drawn)},
        to="[low, high], or what else it may be; and count, seed",
        masses=True,
    ),
    AfterValidator(_check_draws),
    Field(
        description="Quantities at random: `count` draws from a `seed`, the same ones at every "
        "point of the axes, along the dimension `draw`."
    ),
]


def drawn_of(draws: Mapping[str, Any]) -> dict[str, Drawn]:
    """Return the quantities that are drawn, in their order."""
    return {name: draws[name] for name in quantities_in(draws)}


def check_drawn(draws: Mapping[str, Any], mistakes: Mistakes) -> None:
    """Note draws of nothing."""
    if draws and not drawn_of(draws):
        message = "draws are asked for, but no quantity is drawn"
        mistakes.add((), message, "quantities with a range, such as restitution: [0.5, 0.7]")


def draw_settings(draws: Mapping[str, Any]) -> dict[str, Any]:
    """Return draws as plain values, as `damper.sweep.branches.draw` takes them."""
    rules = {name: drawn.rule for name, drawn in drawn_of(draws).items()}
    return {key: draws[key] for key in _DRAW_KEYS if key in draws} | rules


class Starts(StrictModel):
    """Where the runs of `damper.simulate` start, and what is drawn at random."""

    initial: PrimaryStart = "rest"
    draws: Draws = _NONE

    def check_together(self, mistakes: Mistakes) -> None:
        with mistakes.at("draws"):
            check_drawn(self.draws, mistakes)


Curves = Annotated[
    dict[str, Pair[float]],
    NamedMapping(
        "parameter", PARAMETER_NAMES, to="its range: [low, high]", dropped=True, masses=True
    ),
]


_BURST = r"[RL](S|[1-9]\d*)"
#: As `damper.sweep.orbits.word.word_of` writes it.
_WORD = re.compile(rf"{_BURST}( {_BURST})*( \| {_BURST}( {_BURST})*)*")


_PLACE = Annotated[
    dict[str, Coordinate],
    NamedMapping("axis", tuple(ALL), to="one of its values", masses=True),
]


class FollowedOrbit(StrictModel):
    """A periodic motion to follow along an axis, stable or not, at each value of the others."""

    along: Annotated[Text, Field(description="Axis to follow it along, over its whole range.")]
    start: Annotated[
        float,
        Unit(THE_PARAMETERS),
        Field(
            description="Value of that axis at which a run from rest shows it, after the transient."
        ),
    ]
    period: Annotated[
        int, Unit("cycles"), Field(ge=1, le=64, description="After which it repeats.")
    ] = 1
    expect: Annotated[
        Line | None,
        Field(
            description="Word of the motion that the run is to have, such as R1 L1 for one impact "
            "on each wall, as the table special_points writes it; a motion with another word is "
            "not followed, and the table names it. Any motion when not given."
        ),
    ] = None
    max_orbits: Annotated[
        int, Field(ge=1, le=100_000, description="Orbits after which to stop, either way.")
    ] = 500
    at: Annotated[
        _PLACE,
        Field(description="Values of other axes to follow it at; at each value when not given."),
    ] = _NONE
    curves: Annotated[
        dict[str, Curves],
        NamedMapping("special point", KINDS, to="a parameter and the range of it"),
        Field(
            description="Special points to follow along the axis and one more parameter: kind of "
            "the point -> parameter -> [low, high]."
        ),
    ] = _NONE

    def check_together(self, mistakes: Mistakes) -> None:
        """Note a word that no motion has."""
        if self.expect is not None and not _WORD.fullmatch(self.expect):
            message = f"not the word of a motion (value: {display(self.expect)})"
            allowed = (
                "R or L for each wall with the number of impacts there, S where a sequence "
                "completes, such as R1 L1 or RS LS; a bar between several masses"
            )
            mistakes.add(("expect",), message, allowed)


class Threshold(StrictModel):
    """The approach speed from which an impact is visible: `fraction` of the first, or `speed`."""

    shorthand = "fraction"
    fraction: Annotated[
        float | None,
        Rule("(of the first approach speed), or {speed: > 0}"),
        Field(gt=0, lt=1, description="Part of the burst's first approach speed; not with speed."),
    ] = None
    speed: Annotated[
        float | None,
        Unit(_WITH_SI[SPEED]),
        Field(
            gt=0, description="Absolute approach speed, in m/s in an SI study; not with fraction."
        ),
    ] = None
    assumed: Assumed = None
    stated: Stated = None

    def __str__(self) -> str:
        if self.speed is not None:
            return f"approach speed {self.speed:g}"
        return f"{self.fraction:.3g} of the burst's first approach speed"

    def check_together(self, mistakes: Mistakes) -> None:
        if (self.fraction is None) == (self.speed is None):
            message = "exactly one of fraction and speed must be given"
            mistakes.add((), message, "fraction, speed")
        check_origin(self, mistakes)


class InTime(StrictModel):
    """A length of time, in place of cycles."""

    time: Annotated[
        Annotated[float, Field(gt=0)],
        OrWord(END),
        SIUnit("s"),
        Field(
            description="In s in an SI study, else in sqrt(M/K); end: that of the record or noise "
            "that drives the damper."
        ),
    ]


class OrTime:
    """Marks a number of cycles: a mapping in its place gives a time."""

    def __get_pydantic_core_schema__(self, source: Any, handler: Any) -> CoreSchema:
        return core_schema.no_info_wrap_validator_function(
            lambda value, inner: (
                InTime.model_validate(value) if isinstance(value, dict | InTime) else inner(value)
            ),
            handler(source),
            serialization=core_schema.simple_ser_schema("any"),
        )

    def __get_pydantic_json_schema__(
        self, core: CoreSchema, handler: GetJsonSchemaHandler
    ) -> Schema:
        time = nested(handler, TypeAdapter(InTime).core_schema)
        return {"anyOf": [handler(core["schema"]), time | {"$comment": "(a time)"}]}  # type: ignore[typeddict-item]


class ObserverEntry(StrictModel):
    """Settings of an observer, which the observer itself checks against each other."""

    def check_together(self, mistakes: Mistakes) -> None:
        try:
            name = type(self).__module__.rpartition(".")[2]
            observer_class(name)(**given_settings(self)).check_together()
        except ValueError as error:
            message, _, allowed = str(error).partition(": must ")
            mistakes.add((), message, allowed)


def declared_class(
    name: str,
    about: str | None,
    declared: Mapping[str, Setting],
    base: type[StrictModel] = StrictModel,
) -> Any:
    """Class of an entry in a study whose settings are declared elsewhere."""
    fields: dict[str, Any] = {}
    for key, setting in declared.items():
        described = Field(description=setting.meaning)
        if isinstance(setting, Visibility):
            threshold = Threshold(fraction=setting.default)
            fields[key] = (Annotated[Threshold, described], threshold)
        elif isinstance(setting, AxisPlace):
            fields[key] = (Annotated[_PLACE | None, described], None)
        else:
            of = Annotated[_type(setting), Unit(setting.units)] if setting.units else _type(setting)
            fields[key] = (Annotated[of, described], ... if setting.stated else setting.default)
    return create_model(name, __base__=base, __doc__=about, **fields)


@cache
def observer_settings(name: str) -> type[StrictModel]:
    """Class of an observer's entry in a study, from the settings that the observer declares."""
    declared = observer_class(name)
    made = declared_class(declared.__name__, declared.__doc__, declared.settings, ObserverEntry)
    made.__module__ = declared.__module__  # under its name in schemas
    return made


def _type(setting: Setting) -> Any:
    """Return the type of what a study may give for a setting."""
    if setting.choices:
        return Literal[setting.choices]
    if isinstance(setting.default, bool):
        return bool
    bounds: dict[str, Any] = setting.bounds
    number: Any = int if setting.whole else float
    number = Annotated[number, Field(**bounds)]
    if setting.timed:
        return Annotated[number, OrTime()]
    if isinstance(setting.default, tuple):
        several: Any = tuple[number, ...]
        return Annotated[several, Field(min_length=setting.least or None), Distinct()]
    return number if setting.default is not None else number | None


class _Settings(Mapping[str, type[StrictModel]]):
    """Observer -> class of its settings, made when it is asked for."""

    def __getitem__(self, name: str) -> type[StrictModel]:
        if name not in OBSERVERS:
            raise KeyError(name)
        return observer_settings(name)

    def __iter__(self) -> Iterator[str]:
        return iter(OBSERVERS)

    def __len__(self) -> int:
        return len(OBSERVERS)


OBSERVER_SETTINGS: Mapping[str, type[StrictModel]] = _Settings()
SECTIONS = ("stroboscopic_section", "impact_section")


def given_settings(settings: StrictModel) -> dict[str, Any]:
    """Return the settings of an observer as it takes them, without remarks on their origin."""
    remarks = {"threshold": {"assumed", "stated"}}
    return settings.model_dump(exclude_none=True, exclude=remarks)

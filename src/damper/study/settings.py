"""The entries of a study: parameters, axes, initial states, observers.

What an observer may be told stands in its own file, `damper.observers`.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from functools import cache
from typing import Annotated, Any, ClassVar

from pydantic import Field, create_model

from damper.observers import OBSERVERS as NAMES
from damper.observers import observer_class
from damper.observers.common.settings import Setting, Visibility
from damper.parameters.quantities import INITIAL_NAMES
from damper.parameters.variables import SI_UNITS, SPEED
from damper.study.axes import MOST_VALUES, WAYS, axis_values
from damper.study.fields import (
    Choice,
    Coordinate,
    Faults,
    Flag,
    Kind,
    ListOf,
    Number,
    Range,
    Strict,
    Text,
)
from damper.study.schema import Schema
from damper.sweep.branches import DIRECTIONS

Assumed = Annotated[
    str | None,
    Text(),
    Field(description="Why this value, where the source gives none; not with `stated`."),
]
Stated = Annotated[
    str | None,
    Text(),
    Field(description="Where the source gives this value; not with `assumed`."),
]
_ONE_ORIGIN: Schema = {"not": {"required": ["assumed", "stated"]}}


class Fixed(Strict):
    """A parameter that is the same throughout the study."""

    shorthand = "value"
    rules: ClassVar[Schema] = _ONE_ORIGIN
    value: Annotated[float, Coordinate(), Field(description="The value.")]
    assumed: Assumed = None
    stated: Stated = None

    @classmethod
    def relate(cls, data: dict[str, Any], model: Fixed | None, faults: Faults) -> None:
        _one_origin(model, faults)


class Axis(Strict):
    """A parameter that runs through values; `axis_values` forms them."""

    rules: ClassVar[Schema] = {
        "oneOf": [
            {
                "required": ["values"],
                "properties": {
                    **dict.fromkeys(("start", "stop", "num", "step"), False),
                    "spacing": {"const": "linear"},
                },
            },
            {
                "required": ["start", "stop", "num"],
                "properties": {"values": False, "step": False},
            },
            {
                "required": ["start", "stop", "step"],
                "properties": {"values": False, "num": False, "spacing": {"const": "linear"}},
            },
        ],
        "allOf": [
            _ONE_ORIGIN,
            {"not": {"required": ["fan", "follow"], "properties": {"fan": {"const": True}}}},
            {
                "if": {"required": ["spacing"], "properties": {"spacing": {"const": "log"}}},
                "then": {"properties": {"start": {"exclusiveMinimum": 0}}},
            },
        ],
    }
    values: Annotated[
        tuple[float, ...] | None,
        ListOf(Coordinate(), least=1),
        Field(description="The values one by one, in any order; without start, stop, num, step."),
    ] = None
    start: Annotated[
        float | None, Coordinate(), Field(description="First value; with stop and num or step.")
    ] = None
    stop: Annotated[
        float | None, Coordinate(), Field(description="Last value, included; more than start.")
    ] = None
    num: Annotated[
        int | None,
        Number(ge=2, le=MOST_VALUES, whole=True),
        Field(description="How many values, start and stop included; not with step."),
    ] = None
    step: Annotated[
        float | None,
        Number(gt=0, units=Coordinate.units),
        Field(description="Distance of the values; must divide the range; not with num."),
    ] = None
    spacing: Annotated[
        str,
        Choice("linear", "log"),
        Field(description="Equal distances, or equal ratios (start > 0, with num)."),
    ] = "linear"
    fan: Annotated[
        bool, Flag(), Field(description="Whether each value is a job of its own; not with follow.")
    ] = False
    follow: Annotated[
        str | None,
        Choice(*DIRECTIONS),
        Field(
            description="Continuation: every run starts from its neighbour's end, towards larger "
            "values, smaller ones, or both in turn; on one axis, not one of an initial quantity."
        ),
    ] = None
    assumed: Assumed = None
    stated: Stated = None

    @classmethod
    def relate(cls, data: dict[str, Any], model: Axis | None, faults: Faults) -> None:
        _one_origin(model, faults)
        if model is not None and model.fan and model.follow is not None:
            message = (
                f"fan and follow ({model.follow}) are both given: on a followed axis each point "
                "starts from its neighbour's end, so the axis cannot be cut into jobs"
            )
            faults.add(("fan",), message, "take away fan here and fan another axis, or none")
        try:
            if model is not None:
                axis_values(model)
        except ValueError as error:
            faults.add((), str(error), WAYS)


def _one_origin(model: Fixed | Axis | Threshold | None, faults: Faults) -> None:
    if model is not None and model.assumed is not None and model.stated is not None:
        faults.add((), "assumed and stated are both given", "one of the two")


MOST_DRAWS = 100_000
"""More random states at each point are a slip of the pen."""


class Initial(Strict):
    """Where runs start, beside the initial quantities among the parameters and axes."""

    shorthand = "primary"
    rules: ClassVar[Schema] = {
        "dependentRequired": {
            "draws": ["seed"],
            **{name: ["draws"] for name in ("seed", *INITIAL_NAMES)},
        },
        "allOf": [
            {
                "if": {"required": ["draws"]},
                "then": {"anyOf": [{"required": [name]} for name in INITIAL_NAMES]},
            },
            {
                "if": {"required": ["primary"], "properties": {"primary": {"const": "steady"}}},
                "then": {"properties": {"initial_displacement": False, "initial_velocity": False}},
            },
        ],
    }
    primary: Annotated[
        str,
        Choice("rest", "steady"),
        Field(
            description="The primary starts at rest in its middle, or on the steady response it "
            "would have without the damper."
        ),
    ] = "rest"
    draws: Annotated[
        int | None,
        Number(ge=1, le=100_000, whole=True),
        Field(
            description="How many random initial states each point has; with a seed and a range "
            "for at least one quantity."
        ),
    ] = None
    seed: Annotated[
        int | None,
        Number(ge=0, whole=True),
        Field(description="Seed of the draws: the same states at every point, on every machine."),
    ] = None
    initial_displacement: Annotated[
        tuple[float, float] | None,
        Range("initial_displacement"),
        Field(description="Range of the primary's displacement, drawn uniformly."),
    ] = None
    initial_velocity: Annotated[
        tuple[float, float] | None,
        Range("initial_velocity"),
        Field(description="Range of the primary's velocity, drawn uniformly."),
    ] = None
    initial_position: Annotated[
        tuple[float, float] | None,
        Range("initial_position"),
        Field(description="Range of the free mass's place between the walls, drawn uniformly."),
    ] = None
    initial_relative_velocity: Annotated[
        tuple[float, float] | None,
        Range("initial_relative_velocity"),
        Field(description="Range of the free mass's relative velocity, drawn uniformly."),
    ] = None

    def settings(self) -> dict[str, Any]:
        """Return what is given as plain values."""
        return {name: value for name, value in self if value is not None}

    @property
    def random(self) -> tuple[str, ...]:
        """Names of the quantities that are drawn."""
        return tuple(name for name in INITIAL_NAMES if getattr(self, name) is not None)

    @classmethod
    def relate(cls, data: dict[str, Any], model: Initial | None, faults: Faults) -> None:
        if model is None:
            return
        if model.draws is not None:
            if model.seed is None:
                faults.add(("seed",), "'seed' is missing: draws are random", "integer >= 0")
            if not model.random:
                message = "draws are asked for, but no quantity has a range to draw from"
                faults.add((), message, ", ".join(f"{n}: [low, high]" for n in INITIAL_NAMES))
        elif model.seed is not None or model.random:
            given = model.random[0] if model.random else "seed"
            message = f"'{given}' is for random initial states, but 'draws' is missing"
            faults.add(("draws",), message, "integer >= 1")


class Threshold(Strict):
    """The approach speed from which an impact is visible: `fraction` of the first, or `speed`."""

    shorthand = "fraction"
    rules: ClassVar[Schema] = {
        "oneOf": [{"required": ["fraction"]}, {"required": ["speed"]}],
        **_ONE_ORIGIN,
    }
    fraction: Annotated[
        float | None,
        Number(gt=0, lt=1, note="(of the first approach speed), or {speed: > 0}"),
        Field(description="Part of the burst's first approach speed; not with speed."),
    ] = None
    speed: Annotated[
        float | None,
        Number(gt=0, units=f"{SPEED}, {SI_UNITS[SPEED]}"),
        Field(
            description="Absolute approach speed, in m/s in a study in SI units; not with fraction."
        ),
    ] = None
    assumed: Assumed = None
    stated: Stated = None

    def __str__(self) -> str:
        if self.speed is not None:
            return f"approach speed {self.speed:g}"
        return f"{self.fraction:.3g} of the burst's first approach speed"

    @classmethod
    def relate(cls, data: dict[str, Any], model: Threshold | None, faults: Faults) -> None:
        if model is not None and (model.fraction is None) == (model.speed is None):
            faults.add((), "exactly one of fraction and speed must be given", "fraction, speed")
        _one_origin(model, faults)


@cache
def observer_settings(name: str) -> type[Strict]:
    """Class of an observer's entry in a study, from the settings that the observer declares."""
    declared = observer_class(name)
    fields: dict[str, Any] = {}
    for key, setting in declared.settings.items():
        about = Field(description=setting.meaning)
        if isinstance(setting, Visibility):
            fields[key] = (Annotated[Threshold, about], Threshold(fraction=setting.default))
        else:
            fields[key] = (Annotated[Any, _kind(setting), about], setting.default)
    made = create_model(declared.__name__, __base__=Strict, **fields)
    # Under its name in schemas, and with its words in the reference.
    made.__module__, made.__doc__ = declared.__module__, declared.__doc__
    return made


def _kind(setting: Setting) -> Kind:
    """What a study may give for a setting."""
    if setting.choices:
        return Choice(*setting.choices)
    if isinstance(setting.default, bool):
        return Flag()
    bounds: dict[str, Any] = setting.bounds
    number = Number(whole=setting.whole, units=setting.units, **bounds)
    return ListOf(number, setting.least) if isinstance(setting.default, tuple) else number


class _Settings(Mapping[str, type[Strict]]):
    """Observer -> class of its settings, made when it is asked for."""

    def __getitem__(self, name: str) -> type[Strict]:
        if name not in NAMES:
            raise KeyError(name)
        return observer_settings(name)

    def __iter__(self) -> Iterator[str]:
        return iter(NAMES)

    def __len__(self) -> int:
        return len(NAMES)


OBSERVERS: Mapping[str, type[Strict]] = _Settings()
SECTIONS = ("stroboscopic_section", "impact_section")


def observer(name: str, data: Any) -> Strict:
    """Return the checked settings of an observer; nothing at all are the defaults."""
    return OBSERVERS[name].entry(name, {} if data is None else data)

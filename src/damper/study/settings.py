"""The entries of a study: parameters, axes, initial states, observers.

To add an observer, write its class of settings and enter it in the registry.
"""

from __future__ import annotations

from typing import Annotated, Any, ClassVar

from pydantic import Field

from damper.parameters.quantities import INITIAL_NAMES
from damper.parameters.variables import SI_UNITS, SPEED, TIME
from damper.study.axes import MOST_VALUES, WAYS, axis_values
from damper.study.fields import (
    Choice,
    Coordinate,
    Faults,
    Flag,
    ListOf,
    Number,
    Range,
    Strict,
    Text,
)
from damper.study.schema import Schema
from damper.sweep.branches import DIRECTIONS

OptionalText = Annotated[str | None, Text()]
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


# Observers.


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


FreeMass = Annotated[bool, Flag(), Field(description="Whether to record the free mass as well.")]
Visibility = Annotated[
    Threshold,
    Field(
        description="From which approach speed an impact is visible, and so counts: a complete "
        "burst has infinitely many."
    ),
]


class StroboscopicSection(Strict):
    """The state once per forcing period."""

    at: Annotated[
        float,
        Number(ge=0, lt=1, units="forcing periods"),
        Field(description="When in each period to look."),
    ] = 0.0
    free_mass: FreeMass = False


class ImpactSection(Strict):
    """The state just after each impact on one wall."""

    wall: Annotated[
        str, Choice("left", "right"), Field(description="The wall whose impacts are sampled.")
    ] = "right"
    samples: Annotated[
        int,
        Number(ge=1, le=100_000, whole=True),
        Field(description="Most impacts to keep of each run, the first ones of the record."),
    ] = 100
    free_mass: FreeMass = False


class Impacts(Strict):
    """Counts of visible impacts."""

    threshold: Visibility = Threshold(fraction=0.03)


class Bursts(Strict):
    """Bursts: their number, visible impacts and completion."""

    threshold: Visibility = Threshold(fraction=0.03)
    compare_thresholds: Annotated[
        tuple[float, ...],
        ListOf(Number(gt=0, lt=1)),
        Field(description="More fractions at which to count, along the dimension `threshold`."),
    ] = ()
    records: Annotated[
        int,
        Number(ge=0, whole=True),
        Field(description="Bursts of each run to list one by one, the first ones of the record."),
    ] = 0


class BurstAt(Strict):
    """The chatter burst that begins nearest to a time."""

    time: Annotated[
        float,
        Number(ge=0, units=f"{TIME}, {SI_UNITS[TIME]}"),
        Field(description="Where to look, counted from the start of the record."),
    ] = 0.0
    threshold: Visibility = Threshold(fraction=0.03)


class ChatterBursts(Strict):
    """How many bursts are chatter, how many of them complete, and how long these last."""

    since: Annotated[
        tuple[float, ...],
        ListOf(Number(ge=0, units="forcing periods"), least=1),
        Field(
            description="Starts of the parts of the record in which to count, each to its end, "
            "along the dimension `since`."
        ),
    ] = (0.0,)
    threshold: Visibility = Threshold(fraction=0.03)


class Response(Strict):
    """How strongly the primary moves, and where the energy goes."""

    modulation_work: Annotated[
        bool,
        Flag(),
        Field(
            description="Write what a time-varying free mass gains by its variation as well; zero "
            "in every other model."
        ),
    ] = False


class Accumulation(Strict):
    """Complete bursts of the rigid damper beside theory: what is left after each impact."""

    bursts: Annotated[
        int,
        Number(ge=1, le=100_000, whole=True),
        Field(description="Most complete bursts of each run to use, the first ones of the record."),
    ] = 20
    impacts: Annotated[
        int,
        Number(ge=1, le=100_000, whole=True),
        Field(description="Most impacts of each burst to use, the first ones."),
    ] = 100


class Trajectory(Strict):
    """The motion in time over a stretch of the record."""

    samples_per_period: Annotated[
        int,
        Number(ge=1, le=1_000_000, whole=True),
        Field(description="Equal time steps per forcing period."),
    ] = 100
    start: Annotated[
        float,
        Number(ge=0, units="forcing periods"),
        Field(description="Where the stretch begins, counted from the start of the record."),
    ] = 0.0
    length: Annotated[
        float | None,
        Number(gt=0, units="forcing periods"),
        Field(description="Length of the stretch; without it, to the end of the record."),
    ] = None
    events: Annotated[
        int,
        Number(ge=0, le=10_000_000, whole=True),
        Field(description="Most events to write; those beyond are counted."),
    ] = 1000


OBSERVERS: dict[str, type[Strict]] = {
    "stroboscopic_section": StroboscopicSection,
    "impact_section": ImpactSection,
    "impacts": Impacts,
    "bursts": Bursts,
    "burst_at": BurstAt,
    "chatter_bursts": ChatterBursts,
    "response": Response,
    "accumulation": Accumulation,
    "trajectory": Trajectory,
}
SECTIONS = ("stroboscopic_section", "impact_section")


def observer(name: str, data: Any) -> Strict:
    """Return the checked settings of an observer; nothing at all are the defaults."""
    return OBSERVERS[name].entry(name, {} if data is None else data)

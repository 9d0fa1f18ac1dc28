"""The entries of a study: parameters, axes, initial states, observers.

To add an observer, write its class of settings and enter it in the registry.
"""

from __future__ import annotations

from typing import Annotated, Any

from damper.quantities import INITIAL_NAMES
from damper.study.axes import MOST_VALUES, WAYS, axis_values
from damper.study.branches import DIRECTIONS
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

OptionalText = Annotated[str | None, Text()]


class Fixed(Strict):
    """A parameter that is the same throughout the study."""

    shorthand = "value"
    value: Annotated[float, Coordinate()]
    assumed: OptionalText = None
    stated: OptionalText = None

    @classmethod
    def relate(cls, data: dict[str, Any], model: Fixed | None, faults: Faults) -> None:
        _one_origin(model, faults)


class Axis(Strict):
    """A parameter that runs through values; `axis_values` forms them."""

    values: Annotated[tuple[float, ...] | None, ListOf(Coordinate(), least=1)] = None
    start: Annotated[float | None, Coordinate()] = None
    stop: Annotated[float | None, Coordinate()] = None
    num: Annotated[int | None, Number(ge=2, le=MOST_VALUES, whole=True)] = None
    step: Annotated[float | None, Number(gt=0)] = None
    spacing: Annotated[str, Choice("linear", "log")] = "linear"
    fan: Annotated[bool, Flag()] = False
    follow: Annotated[str | None, Choice(*DIRECTIONS)] = None
    assumed: OptionalText = None
    stated: OptionalText = None

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


class Initial(Strict):
    """Where runs start, beside the initial quantities among the parameters and axes."""

    shorthand = "primary"
    primary: Annotated[str, Choice("rest", "steady")] = "rest"
    draws: Annotated[int | None, Number(ge=1, le=100_000, whole=True)] = None
    seed: Annotated[int | None, Number(ge=0, whole=True)] = None
    initial_displacement: Annotated[tuple[float, float] | None, Range("initial_displacement")] = (
        None
    )
    initial_velocity: Annotated[tuple[float, float] | None, Range("initial_velocity")] = None
    initial_position: Annotated[tuple[float, float] | None, Range("initial_position")] = None
    initial_relative_velocity: Annotated[
        tuple[float, float] | None, Range("initial_relative_velocity")
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
    fraction: Annotated[
        float | None, Number(gt=0, lt=1, note="(of the first approach speed), or {speed: > 0}")
    ] = None
    speed: Annotated[float | None, Number(gt=0)] = None
    assumed: OptionalText = None
    stated: OptionalText = None

    @classmethod
    def relate(cls, data: dict[str, Any], model: Threshold | None, faults: Faults) -> None:
        if model is not None and (model.fraction is None) == (model.speed is None):
            faults.add((), "exactly one of fraction and speed must be given", "fraction, speed")
        _one_origin(model, faults)


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
    compare_thresholds: Annotated[tuple[float, ...], ListOf(Number(gt=0, lt=1))] = ()
    records: Annotated[int, Number(ge=0, whole=True)] = 0


class Response(Strict):
    """How strongly the primary moves, and where the energy goes."""


class Trajectory(Strict):
    """The motion in time over a stretch of the record."""

    samples_per_period: Annotated[int, Number(ge=1, le=1_000_000, whole=True)] = 100
    start: Annotated[float, Number(ge=0)] = 0.0
    length: Annotated[float | None, Number(gt=0)] = None
    events: Annotated[int, Number(ge=0, le=10_000_000, whole=True)] = 1000


OBSERVERS: dict[str, type[Strict]] = {
    "stroboscopic_section": StroboscopicSection,
    "impact_section": ImpactSection,
    "impacts": Impacts,
    "bursts": Bursts,
    "response": Response,
    "trajectory": Trajectory,
}
SECTIONS = ("stroboscopic_section", "impact_section")


def observer(name: str, data: Any) -> Strict:
    """Return the checked settings of an observer; nothing at all are the defaults."""
    return OBSERVERS[name].entry(name, {} if data is None else data)

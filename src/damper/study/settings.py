"""The entries of a study: parameters, axes, observers, figures and tables.

To add an observer, a figure or a table, write its class of settings and enter it in its registry.
"""

from __future__ import annotations

from collections.abc import Callable, Collection, Mapping
from typing import Annotated, Any

from damper.study.axes import MOST_VALUES, WAYS, axis_values, coordinate_name
from damper.study.fields import (
    STEM,
    STEM_WORDS,
    Choice,
    Coordinate,
    Faults,
    Flag,
    ListOf,
    Number,
    Strict,
    Text,
    as_mapping,
    fault,
)
from damper.study.yaml_file import show, words

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
    assumed: OptionalText = None
    stated: OptionalText = None

    @classmethod
    def relate(cls, data: dict[str, Any], model: Axis | None, faults: Faults) -> None:
        _one_origin(model, faults)
        try:
            if model is not None:
                axis_values(model)
        except ValueError as error:
            faults.add((), str(error), WAYS)


def _one_origin(model: Fixed | Axis | Threshold | None, faults: Faults) -> None:
    if model is not None and model.assumed is not None and model.stated is not None:
        faults.add((), "assumed and stated are both given", "one of the two")


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


OBSERVERS: dict[str, type[Strict]] = {
    "stroboscopic_section": StroboscopicSection,
    "impact_section": ImpactSection,
    "impacts": Impacts,
    "bursts": Bursts,
}
SECTIONS = ("stroboscopic_section", "impact_section")


def observer(name: str, data: Any) -> Strict:
    """Return the checked settings of an observer; nothing at all are the defaults."""
    return OBSERVERS[name].entry(name, {} if data is None else data)


# Figures and tables.

AxisValues = Mapping[str, tuple[float, ...] | None]
"""The values of every axis; an axis in error has none."""


class Product(Strict):
    """A figure or a table: its kind, and what it needs of the study."""

    kind: Annotated[str, Text()]

    @classmethod
    def fit(
        cls, settings: dict[str, Any], axes: AxisValues, observers: Collection[str], faults: Faults
    ) -> None:
        """Note what `settings`, as written, ask of the study in vain."""
        raise NotImplementedError

    def files(self, stem: str, axes: Mapping[str, tuple[float, ...]]) -> dict[str, dict[str, Any]]:
        """Return the file stems with the coordinates at which each is made."""
        return {stem: {}}


class Bifurcation(Product):
    """The section over one axis, with a row of panels for each value of a second one."""

    along: Annotated[str, Text()]
    each: OptionalText = None
    rows: OptionalText = None
    caption: OptionalText = None

    @classmethod
    def fit(
        cls, settings: dict[str, Any], axes: AxisValues, observers: Collection[str], faults: Faults
    ) -> None:
        if not any(section in observers for section in SECTIONS):
            faults.add((), "needs a section among the observers", " or ".join(SECTIONS))
        used: dict[str, str] = {}
        for role in ("along", "each", "rows"):
            name = settings.get(role)
            if not isinstance(name, str):
                continue
            if name not in axes:
                faults.unknown((role,), "axis", name, axes)
            if name in used:
                faults.add((role,), f"'{name}' is {used[name]} already", "three distinct axes")
            used[name] = role
        # Where a role is missing or misspelt, this would make a second error of the first.
        if faults.lines or "along" not in settings or settings.keys() - cls.model_fields.keys():
            return
        free = " or ".join(role for role in ("each", "rows") if role not in settings)
        for name, values in axes.items():
            if name not in used and values is not None and len(values) > 1:
                message = f"axis '{name}' has {len(values)} values but no place in the figure"
                faults.add((), message, f"name it as {free}" if free else "")

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
        cls, settings: dict[str, Any], axes: AxisValues, observers: Collection[str], faults: Faults
    ) -> None:
        if "bursts" not in observers:
            faults.add((), "needs bursts among the observers", "bursts")
        name = settings.get("along")
        if not isinstance(name, str):
            return
        if name not in axes:
            faults.unknown(("along",), "axis", name, axes)
        values = axes.get(name)
        if values is not None and len(values) < 3:
            message = f"axis '{name}' has too few values ({len(values)})"
            faults.add(("along",), message, "an axis with at least 3 values")


FIGURES: dict[str, type[Product]] = {"bifurcation": Bifurcation}
TABLES: dict[str, type[Product]] = {"intervals": Intervals}


def product(registry: Mapping[str, type[Product]]) -> Callable[[str, Any], Product]:
    """Return what checks the settings of a figure or a table."""

    def entry(stem: str, data: Any) -> Product:
        faults = Faults()
        if not STEM.fullmatch(stem):
            faults.add((), f"{show(stem)} cannot be the name of a file", STEM_WORDS)
        with faults.of():
            made = _kind_of(data, registry).entry(stem, data)
        faults.settle()
        return made

    return entry


def _kind_of(data: Any, registry: Mapping[str, type[Product]]) -> type[Product]:
    data, faults = as_mapping(data, "kind and its settings"), Faults()
    with faults.of("kind"):
        if "kind" not in data:
            raise fault("'kind' is missing", words(registry))
        kind = Choice(*registry).check(data["kind"], None)
    faults.settle()
    return registry[kind]

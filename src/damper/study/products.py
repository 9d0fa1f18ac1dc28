"""What is made of a cube: figures and tables.

To add a figure or a table, write its class of settings and enter it in its registry.
"""

from __future__ import annotations

from collections.abc import Callable, Collection, Mapping
from dataclasses import dataclass
from typing import Annotated, Any

from damper.study.axes import coordinate_name
from damper.study.fields import (
    STEM,
    STEM_WORDS,
    Choice,
    Faults,
    Number,
    Strict,
    Text,
    as_mapping,
    fault,
)
from damper.study.settings import SECTIONS, OptionalText
from damper.study.yaml_file import show, words


@dataclass(frozen=True)
class Offer:
    """What a study has to make figures and tables of."""

    axes: Mapping[str, tuple[float, ...] | None]
    """The values of every axis; an axis in error has none."""
    observers: Collection[str]
    branches: tuple[str, ...] = ()
    """Dimensions of the cube beside the axes: direction, draw."""


class Product(Strict):
    """A figure or a table: its kind, and what it needs of the study."""

    kind: Annotated[str, Text()]

    @classmethod
    def fit(cls, settings: dict[str, Any], offer: Offer, faults: Faults) -> None:
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
    def fit(cls, settings: dict[str, Any], offer: Offer, faults: Faults) -> None:
        if not any(section in offer.observers for section in SECTIONS):
            faults.add((), "needs a section among the observers", " or ".join(SECTIONS))
        used: dict[str, str] = {}
        for role in ("along", "each", "rows"):
            name = settings.get(role)
            if not isinstance(name, str):
                continue
            if name not in offer.axes:
                faults.unknown((role,), "axis", name, offer.axes)
            if name in used:
                faults.add((role,), f"'{name}' is {used[name]} already", "three distinct axes")
            used[name] = role
        # Where a role is missing or misspelt, this would make a second error of the first.
        if faults.lines or "along" not in settings or settings.keys() - cls.model_fields.keys():
            return
        free = " or ".join(role for role in ("each", "rows") if role not in settings)
        for name, values in offer.axes.items():
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
    def fit(cls, settings: dict[str, Any], offer: Offer, faults: Faults) -> None:
        if "bursts" not in offer.observers:
            faults.add((), "needs bursts among the observers", "bursts")
        if offer.branches:
            message = (
                "edges are bisected by runs from one initial state, but this study has "
                f"several at each point ({', '.join(offer.branches)})"
            )
            faults.add((), message, "a study without follow and without draws")
        name = settings.get("along")
        if not isinstance(name, str):
            return
        if name not in offer.axes:
            faults.unknown(("along",), "axis", name, offer.axes)
        values = offer.axes.get(name)
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

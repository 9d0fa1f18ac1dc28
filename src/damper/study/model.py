"""What a study file says as a whole, and what the workflow gets of it."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from itertools import product as combinations
from typing import Annotated, Any

from pydantic import PrivateAttr

from damper.parameters import PARAMETER_NAMES, QUANTITIES
from damper.study.axes import axis_values, coordinate_name
from damper.study.fields import Faults, ListOf, Number, Section, Strict, Text, as_mapping, nearest
from damper.study.settings import (
    FIGURES,
    OBSERVERS,
    SECTIONS,
    TABLES,
    Axis,
    Fixed,
    OptionalText,
    Product,
    observer,
    product,
)
from damper.study.yaml_file import as_part, dump_yaml, words

MOST_SLICES = 1000
"""One slice is one job; beyond this the workflow spends its time on bookkeeping."""

_NONE: dict[str, Any] = {}


class Study(Strict):
    """One study: fixed parameters, axes, what to measure, what to draw."""

    title: Annotated[str, Text()]
    source: Annotated[str, Text()]
    description: OptionalText = None
    parameters: Annotated[dict[str, Fixed], Section(Fixed.entry, "parameter", PARAMETER_NAMES)] = (
        _NONE
    )
    axes: Annotated[dict[str, Axis], Section(Axis.entry, "axis", PARAMETER_NAMES)] = _NONE
    transient: Annotated[int, Number(ge=0, whole=True)]
    periods: Annotated[int, Number(ge=1, whole=True)]
    observers: Annotated[dict[str, Strict], Section(observer, "observer", OBSERVERS)]
    figures: Annotated[dict[str, Product], Section(product(FIGURES), "figure")] = _NONE
    tables: Annotated[dict[str, Product], Section(product(TABLES), "table")] = _NONE
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
        return self._origins("assumed")

    @property
    def stated(self) -> dict[str, str]:
        """The place in the source for every value of which the study gives it."""
        return self._origins("stated")

    def observer_settings(self) -> dict[str, dict[str, Any]]:
        """Return the settings of each observer as plain values, without remarks on their origin."""
        remarks = {"threshold": {"assumed", "stated"}}
        return {
            name: settings.model_dump(exclude_none=True, exclude=remarks)
            for name, settings in self.observers.items()
        }

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
        fanned = {name: axis_values(axis) for name, axis in self.axes.items() if axis.fan}
        return [dict(zip(fanned, point, strict=True)) for point in combinations(*fanned.values())]

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

    def _origins(self, remark: str) -> dict[str, str]:
        entries: dict[str, Any] = {**self.parameters, **self.axes}
        for settings in self.observers.values():
            # Two observers with a threshold: the one that counts bursts comes last and is told.
            if hasattr(settings, "threshold"):
                entries["visibility_threshold"] = settings.threshold
        return {
            name: text
            for name, entry in entries.items()
            if (text := getattr(entry, remark)) is not None
        }

    @classmethod
    def relate(cls, data: dict[str, Any], model: Study | None, faults: Faults) -> None:
        # Works on the raw data: a mistake in one entry is to hide nothing about the others.
        raw = {key: {} if data.get(key) is None else data[key] for key in cls.model_fields}
        parameters, axes, observers = raw["parameters"], raw["axes"], raw["observers"]
        if isinstance(observers, dict):
            _relate_observers(observers, faults)
        if not isinstance(axes, dict):
            return
        if isinstance(parameters, dict):
            _give_once(parameters, axes, faults)
        sound = _sound_axes(axes) if model is None else model.axes
        values = {name: axis and axis_values(axis) for name, axis in sound.items()}
        _limit_slices({n: len(axis_values(a)) for n, a in sound.items() if a and a.fan}, faults)
        if not isinstance(observers, dict):
            return
        for section, registry in (("figures", FIGURES), ("tables", TABLES)):
            entries = raw[section]
            for stem, settings in entries.items() if isinstance(entries, dict) else ():
                kind = settings.get("kind") if isinstance(settings, dict) else None
                if isinstance(kind, str) and kind in registry:
                    found = Faults()
                    registry[kind].fit(settings, values, observers, found)
                    with faults.of(section, as_part(stem)):
                        found.settle()


def _relate_observers(observers: dict[str, Any], faults: Faults) -> None:
    if not observers:
        faults.add(("observers",), "at least one observer must be given", words(OBSERVERS))
    if all(section in observers for section in SECTIONS):
        both = " and ".join(SECTIONS)
        message = f"{both} cannot both be asked for: both write displacement and velocity"
        faults.add(("observers",), message, "one of the two")


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
            allowed = f"{quantity.allowed}, under parameters or as an axis"
            faults.add(("parameters", name), f"'{name}' is not given", allowed)


def _sound_axes(axes: dict[str, Any]) -> dict[str, Axis | None]:
    sound: dict[str, Axis | None] = {name: None for name in axes if name in PARAMETER_NAMES}
    for name in sound:
        with Faults().of():
            sound[name] = Axis.entry(name, axes[name])
    return sound


def _limit_slices(fanned: dict[str, int], faults: Faults) -> None:
    count = math.prod(fanned.values())
    if count > MOST_SLICES:
        sizes = ", ".join(f"{name} ({size} values)" for name, size in fanned.items())
        longest = max(fanned, key=lambda name: fanned[name])
        message = f"the fanned axes make {count} slices: {sizes}"
        allowed = f"at most {MOST_SLICES} slices; take 'fan: true' from {longest}"
        faults.add(("axes",), message, allowed)


class Engine(Strict):
    """Settings of the event-driven engine."""

    accuracy: Annotated[float, Number(ge=1e-15, le=1e-3)] = 1e-12
    max_events: Annotated[int, Number(ge=1, whole=True)] = 1_000_000


def _override(name: str, data: Any) -> dict[Any, Any]:
    return as_mapping({} if data is None else data, "part of a study")


class Settings(Strict):
    """The configuration as written; which studies there are is known to the file system."""

    studies: Annotated[tuple[str, ...], ListOf(Text(), least=1)]
    engine: Engine = Engine()
    results: Annotated[str, Text()] = "results"
    overrides: Annotated[dict[str, Any], Section(_override, "study")] = _NONE


@dataclass(frozen=True)
class Config:
    """The workflow's configuration with its studies, checked."""

    studies: dict[str, Study]
    engine: Engine
    results: str

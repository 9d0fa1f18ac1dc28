"""What a study file says as a whole, and what the workflow gets of it."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from itertools import product as combinations
from typing import Annotated, Any, ClassVar

from pydantic import Field, PrivateAttr

from damper.linear import steady_gain
from damper.quantities import ALL, INITIAL_NAMES, QUANTITIES, SI_QUANTITIES, is_si
from damper.study.axes import axis_values, coordinate_name
from damper.study.branches import DIRECTIONS
from damper.study.fields import (
    Faults,
    ListOf,
    Number,
    Section,
    Strict,
    Text,
    as_mapping,
    nearest,
)
from damper.study.products import FIGURES, TABLES, Offer, Product, product
from damper.study.schema import Schema
from damper.study.settings import (
    MOST_DRAWS,
    OBSERVERS,
    SECTIONS,
    Axis,
    Fixed,
    Initial,
    observer,
)
from damper.study.yaml_file import as_part, dump_yaml, words
from damper.variables import TIME

MOST_SLICES = 1000
"""One slice is one job; beyond this the workflow spends its time on bookkeeping."""

_NONE: dict[str, Any] = {}


class Study(Strict):
    """One study: fixed parameters, axes, what to measure, what to draw."""

    rules: ClassVar[Schema] = {
        "allOf": [
            {
                "properties": {
                    "observers": {
                        "type": "object",
                        "minProperties": 1,
                        "not": {"required": list(SECTIONS)},
                    }
                }
            }
        ]
    }
    title: Annotated[str, Text(), Field(description="What the study is about, for people.")]
    source: Annotated[
        str, Text(), Field(description="Where its values come from, such as a paper.")
    ]
    description: Annotated[
        str | None, Text(), Field(description="What it shows, in as many words as it takes.")
    ] = None
    parameters: Annotated[
        dict[str, Fixed],
        Section(Fixed.entry, "parameter", ALL, of=Fixed),
        Field(
            description="Quantities that are the same throughout. Every parameter without a "
            "default must stand here or under axes: all dimensionless ones, or all SI ones."
        ),
    ] = _NONE
    axes: Annotated[
        dict[str, Axis],
        Section(Axis.entry, "axis", ALL, of=Axis),
        Field(
            description="Quantities that run through values; their order is that of the cube's "
            "dimensions. Without axes the study is one point."
        ),
    ] = _NONE
    initial: Annotated[
        Initial,
        Field(
            description="Where runs start, beside the initial quantities under parameters and axes."
        ),
    ] = Initial()
    transient: Annotated[
        int,
        Number(ge=0, whole=True, units="forcing periods"),
        Field(description="How long each run goes on before it is recorded."),
    ]
    periods: Annotated[
        int,
        Number(ge=1, whole=True, units="forcing periods"),
        Field(description="How long the record is."),
    ]
    observers: Annotated[
        dict[str, Strict],
        Section(observer, "observer", OBSERVERS, of=OBSERVERS, bare=True),
        Field(
            description="What to measure, at least one; an observer without settings takes its "
            "defaults. No two may write one variable."
        ),
    ]
    figures: Annotated[
        dict[str, Product],
        Section(product(FIGURES), "figure", of=FIGURES),
        Field(description="What to draw: name of the file -> kind and its settings."),
    ] = _NONE
    tables: Annotated[
        dict[str, Product],
        Section(product(TABLES), "table", of=TABLES),
        Field(description="What to tabulate: name of the file -> kind and its settings."),
    ] = _NONE
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
        values = {"phase": 0.0} | {name: fixed.value for name, fixed in self.parameters.items()}
        return {name: values[name] for name in ALL if name in values and name not in self.axes}

    @property
    def follow(self) -> dict[str, str]:
        """The axis that continuation follows, if any -> up, down or both."""
        return {name: axis.follow for name, axis in self.axes.items() if axis.follow}

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
        for section, order in (("parameters", ALL), ("observers", OBSERVERS)):
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
        sound = _sound_axes(axes) if model is None else model.axes
        if isinstance(parameters, dict):
            _give_once(parameters, axes, faults)
            _relate_initial(raw["initial"], parameters, axes, faults)
        if model is not None and not faults.lines:
            model._check_steady(faults)
            model._check_stretch(faults)
        _follow_one(sound, faults)
        values = {name: axis and axis_values(axis) for name, axis in sound.items()}
        _limit_slices({n: len(axis_values(a)) for n, a in sound.items() if a and a.fan}, faults)
        if not isinstance(observers, dict):
            return
        offer = Offer(values, observers, **_branches(sound, raw["initial"]))
        for section, registry in (("figures", FIGURES), ("tables", TABLES)):
            entries = raw[section]
            for stem, settings in entries.items() if isinstance(entries, dict) else ():
                kind = settings.get("kind") if isinstance(settings, dict) else None
                if isinstance(kind, str) and kind in registry:
                    found = Faults()
                    registry[kind].fit(settings, offer, found)
                    with faults.of(section, as_part(stem)):
                        found.settle()

    def _check_stretch(self, faults: Faults) -> None:
        """Refuse a sampled stretch that leaves the record, and a figure that starts after it."""
        sampled = self.observers.get("trajectory")
        if sampled is None:
            return
        loc = ("observers", "trajectory")
        # As the observer counts its steps.
        rate, left = sampled.samples_per_period, self.periods - sampled.start
        length = left if sampled.length is None else sampled.length
        steps = math.floor(left * rate + 1e-9) if sampled.length is None else round(length * rate)
        if steps < 1 or steps / rate > left + 1e-9:
            message = (
                f"the stretch (start {sampled.start:g}, length {length:g}) does not lie in the "
                f"record of {self.periods} periods"
            )
            faults.add(loc, message, f"start + length <= {self.periods}, at least one sample step")
            return
        for stem, figure in self.figures.items():
            start = getattr(figure, "start", 0.0)
            if figure.kind == "trajectory" and start >= length:
                message = f"starts {start:g} periods into a sampled stretch of {length:g}"
                faults.add(("figures", stem, "start"), message, f"number >= 0 and < {length:g}")

    def _check_steady(self, faults: Faults) -> None:
        """Refuse a start on a steady response that does not exist."""
        if self.initial.primary != "steady":
            return
        given = self.axis_values | {name: (value,) for name, value in self.fixed.items()}
        if is_si(given):
            # The frequency ratio as `SIParameters` forms it.
            sizes = (given[n] for n in ("primary_mass", "stiffness", "forcing_frequency"))
            resonant = 0.0 in given["damping"] and any(
                omega * math.sqrt(mass / stiffness) == 1.0
                for mass, stiffness, omega in combinations(*sizes)
            )
        else:
            resonant = 0.0 in given["damping_ratio"] and 1.0 in given["frequency_ratio"]
        if resonant:
            try:
                steady_gain(0.0, 1.0)
            except ValueError as error:
                faults.add(("initial", "primary"), str(error), "rest")


def _relate_observers(observers: dict[str, Any], faults: Faults) -> None:
    if not observers:
        faults.add(("observers",), "at least one observer must be given", words(OBSERVERS))
    if all(section in observers for section in SECTIONS):
        both = " and ".join(SECTIONS)
        message = f"{both} cannot both be asked for: both write displacement and velocity"
        faults.add(("observers",), message, "one of the two")


# Names that tell which system of units a study is in.
_RATIOS = {quantity.name for quantity in QUANTITIES} - {quantity.name for quantity in SI_QUANTITIES}
_SI_ONLY = {quantity.name for quantity in SI_QUANTITIES} - {q.name for q in QUANTITIES}


def _give_once(parameters: dict[str, Any], axes: dict[str, Any], faults: Faults) -> None:
    given = [name for name in (*parameters, *axes) if isinstance(name, str)]
    for name in parameters:
        if name in axes and name in ALL:
            message = f"'{name}' is given twice: under parameters and under axes"
            faults.add(("axes", name), message, "one of the two")
    meant = {nearest(name, ALL) for name in given if name not in ALL}
    try:
        si = is_si(given)
    except ValueError as error:
        faults.add(("parameters",), str(error))
        return
    if not si and not any(name in _RATIOS for name in given):
        si = any(name in _SI_ONLY for name in meant)
    for quantity in SI_QUANTITIES if si else QUANTITIES:
        name = quantity.name
        if name not in given and name not in meant and quantity.default is None:
            units = f" in {quantity.units}" if si and quantity.units != "1" else ""
            allowed = f"{quantity.allowed}{units}, under parameters or as an axis"
            faults.add(("parameters", name), f"'{name}' is not given", allowed)


def _relate_initial(
    initial: Any, parameters: dict[str, Any], axes: dict[str, Any], faults: Faults
) -> None:
    steady = initial == "steady" or (isinstance(initial, dict) and "steady" in initial.values())
    for name in INITIAL_NAMES:
        places = [
            place
            for place, entries in (("parameters", parameters), ("axes", axes), ("initial", initial))
            if isinstance(entries, dict) and entries.get(name) is not None
        ]
        if "initial" in places and len(places) > 1:
            message = f"'{name}' is random here and given under {places[0]} as well"
            faults.add(("initial", name), message, "one of the two")
        if steady and places and name in ("initial_displacement", "initial_velocity"):
            message = f"'{name}' is given, but the primary starts on its steady response"
            faults.add((places[0], name), message, "one of the two")


def _follow_one(axes: Mapping[str, Axis | None], faults: Faults) -> None:
    followed = [name for name, axis in axes.items() if axis and axis.follow]
    for name in followed[1:]:
        message = f"'{followed[0]}' is followed already: a run has one neighbour to start from"
        faults.add(("axes", name, "follow"), message, "follow on one axis")
    for name in followed[:1]:
        if name in INITIAL_NAMES:
            message = f"'{name}' sets where a run starts, so it cannot be followed"
            faults.add(("axes", name, "follow"), message, "follow on an axis of a parameter")


def _branches(axes: Mapping[str, Axis | None], initial: Any) -> dict[str, Any]:
    """Return the dimensions of several runs at each point, and their values where known."""
    values: dict[str, tuple[Any, ...]] = {}
    for axis in axes.values():
        if axis and axis.follow:
            values["direction"] = DIRECTIONS[axis.follow]
    draws = initial.get("draws") if isinstance(initial, dict) else None
    if isinstance(draws, int) and 1 <= draws <= MOST_DRAWS:
        values["draw"] = tuple(range(draws))
    return {"branches": tuple(values), "branch_values": values}


def _sound_axes(axes: dict[str, Any]) -> dict[str, Axis | None]:
    sound: dict[str, Axis | None] = {name: None for name in axes if name in ALL}
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

    accuracy: Annotated[
        float,
        Number(ge=1e-15, le=1e-3, units=TIME),
        Field(
            description="Largest error of the time at which a complete burst ends; all else is "
            "exact to rounding. Dimensionless, also for a study in SI units."
        ),
    ] = 1e-12
    max_events: Annotated[
        int,
        Number(ge=1, whole=True),
        Field(description="Events after which a run stops; `status` in the cube says so."),
    ] = 1_000_000


def _override(name: str, data: Any) -> dict[Any, Any]:
    return as_mapping({} if data is None else data, "part of a study")


class Settings(Strict):
    """The configuration as written; which studies there are is known to the file system."""

    studies: Annotated[
        tuple[str, ...],
        ListOf(Text(), least=1),
        Field(
            description="The studies to make: names of files in config/studies without .yaml, or "
            "paths that end in .yaml."
        ),
    ]
    engine: Annotated[
        Engine, Field(description="How exact the simulation is, and when it gives up.")
    ] = Engine()
    results: Annotated[str, Text(), Field(description="Folder for everything that is made.")] = (
        "results"
    )
    overrides: Annotated[
        dict[str, Any],
        Section(_override, "study", of=Study, bare=True, partial=True),
        Field(
            description="Name of a study -> part of a study that is merged over its file. What it "
            "says about the values of an axis replaces the way in which the file gives them."
        ),
    ] = _NONE


@dataclass(frozen=True)
class Config:
    """The workflow's configuration with its studies, checked."""

    studies: dict[str, Study]
    engine: Engine
    results: str

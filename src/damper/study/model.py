"""The model of a study file, and its jobs for the workflow."""

from __future__ import annotations

import math
from collections.abc import Mapping
from contextlib import suppress
from dataclasses import dataclass
from functools import cached_property
from itertools import product as combinations
from typing import TYPE_CHECKING, Annotated, Any

from pydantic import Field

from damper.parameters import Parameters
from damper.parameters.forcing import (
    HARMONIC,
    SETTING_UNITS,
    Forcing,
    force_text,
    left_out,
)
from damper.parameters.masses import own_names, own_values, taken_by_none
from damper.parameters.models import models_of
from damper.parameters.named import damper_of
from damper.parameters.names import MOST_MASSES, OF_ANY_MASS, split
from damper.parameters.quantities import (
    ALL,
    INITIAL_NAMES,
    QUANTITIES,
    SI_ONLY,
    is_si,
    quantities_in,
    si_units,
)
from damper.parameters.run import EngineSettings, RunLength, declared_in
from damper.parameters.tables import WALL_TABLES, beside_numbers, listed_tables
from damper.parameters.unit_text import SIZES, allowed_units
from damper.parameters.units import FREE, HERTZ, own_number, shown_unit
from damper.study.axes import coordinate_name
from damper.study.fields import (
    DistinctList,
    Folder,
    NamedMapping,
    OrEqualMasses,
    StrictModel,
    Text,
)
from damper.study.forcing import FORCES, ForceEntry
from damper.study.kinds import FIGURES, TABLES
from damper.study.messages import Mistakes
from damper.study.products import Product, StudyContents
from damper.study.settings import (
    OBSERVER_SETTINGS,
    Axis,
    Drawn,
    Draws,
    Fixed,
    FollowedOrbit,
    PrimaryStart,
    Rows,
    declared_class,
    draw_settings,
    drawn_of,
    given_settings,
    numbers_at,
    texts_with_unit,
)
from damper.study.study_file import StudyFile
from damper.study.yaml_file import display, dump_yaml
from damper.sweep.branches import DIRECTIONS

_NONE: dict[str, Any] = {}
_OF_A_MASS = dict.fromkeys(OF_ANY_MASS, Fixed) | dict.fromkeys(WALL_TABLES, Rows)


# Keys of a study that hold for every run, and the block `engine` of the configuration.
if TYPE_CHECKING:
    from damper.parameters.run import EngineSettings as Engine
    from damper.parameters.run import RunLength as RunKeys
else:
    RunKeys, Engine = (
        declared_class(name, cls.__doc__, declared_in(cls))
        for name, cls in (("RunKeys", RunLength), ("Engine", EngineSettings))
    )


class Study(RunKeys, StudyFile):  # type: ignore[misc]
    """One study: fixed parameters, axes, what to measure, what to draw."""

    parameters: Annotated[
        dict[str, Fixed],
        NamedMapping("parameter", dict.fromkeys(ALL, Fixed) | dict.fromkeys(WALL_TABLES, Rows)),
        Field(
            description="Quantities that are the same throughout. Every parameter without a "
            "default must stand here or under axes: all dimensionless ones, or all SI ones."
        ),
    ] = _NONE
    masses: Annotated[
        tuple[Annotated[dict[str, Fixed], NamedMapping("quantity of a mass", _OF_A_MASS)], ...],
        OrEqualMasses(),
        Field(
            strict=False,
            max_length=MOST_MASSES,
            description="Several free masses, counted from 0: for each a mapping of what it has "
            "of its own, in place of what stands under parameters; `{}` where that is nothing. "
            "What every mass has need not stand there. `{count: 4, clearance_spread: 0.2}` divides "
            "one free mass equally.",
        ),
    ] = ()
    axes: Annotated[
        dict[str, Axis],
        NamedMapping("axis", tuple(ALL), masses=True),
        Field(
            description="Quantities that run through values; their order is that of the cube's "
            "dimensions. Without axes the study is one point. `clearance_1` is that of mass 1."
        ),
    ] = _NONE
    forcing: Annotated[
        ForceEntry,
        FORCES,
        Field(
            description="What drives every damper, and what force_amplitude multiplies: a harmonic "
            "force when not given."
        ),
    ] = FORCES["harmonic"](kind="harmonic")
    initial: PrimaryStart = "rest"
    draws: Draws = _NONE
    jobs: Annotated[
        int,
        Field(
            ge=1, description="How many jobs share the draws at each place along the fanned axes."
        ),
    ] = 1
    max_events: Annotated[
        int | None,
        Field(
            **declared_in(EngineSettings)["max_events"].bounds,
            description="Budget of a run of this study alone, in place of that of the engine.",
        ),
    ] = None
    observers: Annotated[
        dict[str, StrictModel],
        NamedMapping("observer", OBSERVER_SETTINGS, bare=True),
        Field(
            description="What to measure, at least one; an observer without settings takes its "
            "defaults. No two may write one variable."
        ),
    ]
    orbits: Annotated[
        dict[str, FollowedOrbit],
        NamedMapping("motion"),
        Field(
            description="Periodic motions to follow, stable or not: name -> from where, along "
            "which axis. Of a dimensionless study."
        ),
    ] = _NONE
    figures: Annotated[
        dict[str, Annotated[Product, FIGURES]],
        NamedMapping("figure"),
        Field(description="What to draw: name of the file -> kind and its settings."),
    ] = _NONE
    tables: Annotated[
        dict[str, Annotated[Product, TABLES]],
        NamedMapping("table"),
        Field(description="What to tabulate: name of the file -> kind and its settings."),
    ] = _NONE

    @classmethod
    def without_units(
        cls, given: Mapping[str, Any], name: str | None, mistakes: Mistakes
    ) -> dict[str, Any]:
        return numbers_at(super().without_units(given, name, mistakes), Axis)

    @classmethod
    def check_keys(cls, given: Mapping[str, Any], mistakes: Mistakes) -> None:
        """Note a unit in a study without SI units, and one of an amplitude of another force."""
        sections = ("parameters", "axes", "draws")
        entries = [(s, n, e) for s in sections for n, e in _mapping(given.get(s)).items()]
        with suppress(ValueError):  # of a mixture of units, which is said elsewhere
            si = is_si(name for _, name, _ in entries if name in ALL)
            entries += [
                (section, name, entry)
                for section in ("forcing", "transient", "periods")
                for name, entry in _mapping(given.get(section)).items()
                if name in ("time", *SETTING_UNITS)
            ]
            for section, name, entry in entries:
                # Quantities without a unit in any study are refused where they are read.
                own = si_units(ALL[name]) if name in ALL else ["s"]
                for text, (_, unit) in texts_with_unit(entry):
                    if not si and name not in SI_ONLY and own not in ([], ["1"]):
                        message = f"'{name}' has a unit ({text}) in a dimensionless study"
                        mistakes.add((section, name), message, "a number")
                    elif name == "force_amplitude" and unit not in SIZES[_force_unit(given)]:
                        message = f"the amplitude of this force is no number in {unit} ({text})"
                        mistakes.add((section, name), message, allowed_units([_force_unit(given)]))

    @cached_property
    def axis_values(self) -> dict[str, tuple[float, ...]]:
        """Values of every axis, in the order of the cube's dimensions."""
        return {name: axis.points for name, axis in self.axes.items()}

    @cached_property
    def in_hertz(self) -> dict[str, tuple[float, ...]]:
        """Values of every frequency that is given in Hz, as given; none of drawn ones."""
        entries = {n: entry for named in self.sections.values() for n, entry in named.items()}
        found = {name: entry.given for name, entry in entries.items() if entry.unit}
        return found | (
            {"forcing_frequency": (1.0,)} if "forcing_frequency" in self.left_out else {}
        )

    @cached_property
    def fixed(self) -> dict[str, float]:
        """Value of every parameter that is neither axis nor drawn, the phase included.

        A common value is left out where each mass has its own.
        """
        given = self.numbers | self.own
        values = {"phase": 0.0, **self.left_out}
        values |= {name: fixed.number for name, fixed in given.items()}
        varied = {*self.axes, *self.draws}
        own = own_names({*values, *varied}, self.masses)
        return {
            name: values[name]
            for name in quantities_in(values)
            if name not in varied and not taken_by_none(name, own)
        }

    @cached_property
    def left_out(self) -> dict[str, float]:
        """Values of the quantities that a force without a frequency lets a study leave out."""
        given = {name for section in self.sections.values() for name in section}
        found = left_out(self.force, not SI_ONLY.isdisjoint(given))
        return {name: value for name, value in found.items() if name not in given}

    @property
    def numbers(self) -> dict[str, Fixed]:
        """The parameters but for tables."""
        return {name: one for name, one in self.parameters.items() if name not in WALL_TABLES}

    @property
    def beside(self) -> dict[str, Any]:
        """Arguments of jobs for what is no number: how many masses, and tables."""
        tables = listed_tables({**self.parameters, "masses": self.masses})
        given = {"masses": len(self.masses), "tables": tables}
        return {name: value for name, value in given.items() if value}

    @property
    def own(self) -> dict[str, Fixed]:
        """Quantities of single masses, such as `clearance_1`."""
        return own_values(self.masses)

    @property
    def sections(self) -> dict[str, Mapping[str, Any]]:
        """Sections that give quantities."""
        return {
            "parameters": self.numbers,
            "masses": self.own,
            "axes": self.axes,
            "draws": self.drawn,
        }

    @cached_property
    def drawn(self) -> dict[str, Drawn]:
        """Quantities that are drawn at random."""
        return drawn_of(self.draws)

    @cached_property
    def ends(self) -> dict[str, tuple[float, ...]]:
        """Values of every quantity; of one that is drawn, the ends of its range and its values."""
        fixed = {name: (value,) for name, value in self.fixed.items()}
        return fixed | self.axis_values | {name: drawn.ends for name, drawn in self.drawn.items()}

    @cached_property
    def force(self) -> Forcing:
        """What drives every damper; of several, one."""
        return self.forcing.force(self._folder)

    @property
    def forcing_settings(self) -> dict[str, Any]:
        """Settings of the forcing for jobs, beside its file; empty for the default."""
        given = self.forcing.settings
        return {} if given == HARMONIC.settings else {"forcing": given}

    @property
    def force_files(self) -> dict[str, str]:
        """The file of its samples, if it has one: argument of a job -> path."""
        path = self.forcing.path(self._folder)
        return {} if path is None else {"samples": str(path)}

    @cached_property
    def corners(self) -> list[Parameters]:
        """Parameters at the ends of all axes and draws; ValueError when a value there is refused.

        Each dimensionless parameter is monotone in the quantities that form it, so the ends of the
        axes show whether the values between are allowed, and which models they need. Dimensionless
        parameters that every damper has ask for no model: their ends stand beside each other.
        """
        every: dict[str, Any] = {"forcing": self.force}
        every |= beside_numbers(**self.beside)
        # Quantities of different masses never form a parameter together: each mass goes through its
        # ends beside the others. Mass 0 may set the units of all.
        alone = set() if is_si(self.ends) else {q.name for q in QUANTITIES if q.default is None}
        ends: dict[Any, dict[str, set[float]]] = {0: {}}
        for name, values in self.ends.items():
            if name not in INITIAL_NAMES:
                group = name if name in alone else (split(name) or ("", 0))[1]
                ends.setdefault(group, {})[name] = {min(values), max(values)}
        common, *own = (
            [dict(zip(of, point, strict=True)) for point in combinations(*of.values())]
            for of in ends.values()
        )
        beside = [
            {name: value for points in own for name, value in points[k % len(points)].items()}
            for k in range(max(map(len, own), default=1))
        ]
        return [damper_of(p | q | every).dimensionless for p in common for q in beside]

    @cached_property
    def windows(self) -> list[tuple[float, float, float]]:
        """Length of a cycle, and cycles before and in the window, at the ends of the clock.

        ValueError where a force that has no end is to end them.
        """
        ends, length = self.ends, RunLength(**self.run)
        clock = ends.get("forcing_frequency") or ends.get("frequency_ratio") or (1.0,)
        cycles = (2.0 * math.pi / frequency for frequency in {min(clock): 0, max(clock): 0})
        return [(cycle, *length.cycles(cycle, self.force.end)) for cycle in cycles]

    @property
    def most_cycles(self) -> tuple[float, float]:
        """Cycles before and in the window of the longest runs."""
        return max((window[1:] for window in self.windows), key=sum)

    @property
    def main_feature(self) -> str:
        """The feature of the study's dampers on which the cost of an impact depends most."""
        return self.features[0]

    @property
    def features(self) -> tuple[str, ...]:
        """All features of `damper.parameters.models` that the study's values ask for."""
        found = dict.fromkeys(name for p in self.corners for name in models_of(p))
        return tuple(name for name in found if name != "rigid") or ("rigid",)

    @property
    def branches(self) -> dict[str, tuple[Any, ...]]:
        """Dimensions of several runs at each point, with their values."""
        values: dict[str, tuple[Any, ...]] = {}
        for way in self.follow.values():
            values["direction"] = DIRECTIONS[way]
        if self.draws:
            values["draw"] = tuple(range(self.draw_settings()["count"]))
        return values

    @cached_property
    def contents(self) -> StudyContents:
        """Parts of the study that figures and tables can use."""
        starts = tuple(name for name in self.drawn if name in INITIAL_NAMES)
        return StudyContents(
            self.axis_values | {n: v for n, v in self.in_hertz.items() if n in self.axes},
            self.branches,
            self.observers,
            self.orbits,
            min(periods for _, _, periods in self.windows),
            starts,
            self.force,
            not SI_ONLY.isdisjoint(self.ends),
            next((own for o in self.observers.values() if (own := getattr(o, "bodies", ()))), ()),
        )

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

    @property
    def run(self) -> dict[str, Any]:
        """Settings of every run."""
        return self.model_dump(include=set(declared_in(RunLength)))

    def run_settings(self, engine: Mapping[str, Any]) -> dict[str, Any]:
        """Return the settings of every run, and of the engine, of which the study may say one."""
        own = {} if self.max_events is None else {"max_events": self.max_events}
        return {**self.run, **engine, **own}

    def observer_settings(self) -> dict[str, dict[str, Any]]:
        """Return the settings of each observer as plain values, without remarks on their origin."""
        found = {name: given_settings(settings) for name, settings in self.observers.items()}
        for given in found.values():
            if at := given.get("at"):
                units = dict.fromkeys(self.in_hertz, HERTZ)
                given["at"] = {name: own_number(v, units.get(name)) for name, v in at.items()}
        return found

    def draw_settings(self) -> dict[str, Any]:
        """Return what is drawn as plain values, without remarks on its origin."""
        return draw_settings(self.draws)

    @property
    def fan_axes(self) -> tuple[str, ...]:
        """Axes along which each value is a job of its own."""
        return tuple(name for name, axis in self.axes.items() if axis.fan)

    @property
    def inner_axes(self) -> tuple[str, ...]:
        """Axes that run inside a job."""
        return tuple(name for name, axis in self.axes.items() if not axis.fan)

    def outputs(self) -> list[str]:
        """Return the paths of everything that is made of the study, below its folder."""
        return [*super().outputs(), *(["orbits.nc"] if self.orbits else [])]

    def slices(self) -> list[dict[str, float]]:
        """Return the coordinates of every slice; without fanned axes, one that has none."""
        fanned = {name: axis.points for name, axis in self.axes.items() if axis.fan}
        return [dict(zip(fanned, point, strict=True)) for point in combinations(*fanned.values())]

    def slice_path(self, coords: Mapping[str, float]) -> str:
        """Return the path of a slice, without suffix, such as ``mass_ratio~0.1/clearance~2``."""
        return "/".join(coordinate_name(n, coords[n]) for n in self.fan_axes) or "all"

    @property
    def units(self) -> dict[str, str]:
        si = is_si(self.ends)
        amplitude = FREE if self.fixed.get("force_amplitude") == 0.0 else self.force.amplitude
        units = {name: shown_unit(ALL[name].units, si, amplitude) for name in self.ends}
        return units | dict.fromkeys(self.in_hertz, HERTZ)

    @property
    def values(self) -> dict[str, str]:
        """Settings of the study for a page: name -> value."""
        given = {name: (value,) for name, value in self.fixed.items()} | self.axis_values
        si, units = is_si(self.ends), self.units
        given |= {name: values for name, values in self.in_hertz.items() if values}
        values = {name: _values_text(numbers, units[name]) for name, numbers in given.items()}
        if self.masses:
            values["masses"] = f"{len(self.masses)}"
        for name, rows in self.beside.get("tables", {}).items():
            values[name] = "; ".join(f"{r:g} at {speed:g}" for speed, r in rows)
        if self.forcing_settings:
            values["forcing"] = force_text(self.forcing.about(self._folder), si)
        for name, drawn in self.drawn.items():
            values[name] = f"at random: {_drawn_text(drawn, units[name])}"
        products = [settings for _, _, settings in self.products()]
        if not products or any(one.shows_chatter(self.contents) for one in products):
            for settings in self.observers.values():
                if (threshold := getattr(settings, "threshold", None)) is not None:
                    values["visibility_threshold"] = str(threshold)
        return values

    @property
    def origins(self) -> dict[str, str]:
        """Origins of the settings for a page: name -> remark."""
        origins = {name: f"assumed: {text}" for name, text in self.assumed.items()}
        return origins | {name: f"stated: {text}" for name, text in self.stated.items()}

    @property
    def interactive(self) -> dict[str, dict[str, Any]]:
        """Figures that the page shows interactively as well -> their settings, without words."""
        return {
            name: figure.model_dump(exclude={"caption", "see"}, exclude_none=True)
            for name, figure in self.figures.items()
            if getattr(figure, "interactive", False)
        }

    def about(self) -> dict[str, Any]:
        return super().about() | {
            "interactive": [
                (
                    f"{self.name}/interactive/{name}",
                    getattr(self.figures[name], "caption", None) or self.title,
                    getattr(self.figures[name], "see", None) or "",
                )
                for name in self.interactive
            ]
        }

    def to_yaml(self) -> str:
        """Return the study as checked, every default spelt out; equal studies, equal text."""
        data = self.model_dump(mode="json", exclude_none=True)
        defaults = {"masses": [], "orbits": {}, "draws": {}, "jobs": 1, "forcing": HARMONIC.kind}
        for section, default in defaults.items():
            if data[section] == default:
                del data[section]
        for section, order in (
            ("parameters", (*ALL, *WALL_TABLES)),
            ("observers", OBSERVER_SETTINGS),
        ):
            data[section] = {name: data[section][name] for name in order if name in data[section]}
        return dump_yaml(data)

    def _origins(self, remark: str) -> dict[str, str]:
        entries: dict[str, Any] = {}
        for section in self.sections.values():
            entries |= section
        for settings in self.observers.values():
            # Two observers with a threshold: the one that counts bursts comes last and counts.
            if hasattr(settings, "threshold"):
                entries["visibility_threshold"] = settings.threshold
        entries["forcing"] = self.forcing
        return {
            name: text
            for name, entry in entries.items()
            if (text := getattr(entry, remark)) is not None
        }


def _mapping(given: Any) -> Mapping[str, Any]:
    return given if isinstance(given, dict) else _NONE


def _force_unit(given: Mapping[str, Any]) -> str:
    """SI unit of a force's amplitude, from what a study says of the force."""
    forcing = given.get("forcing")
    kind = _mapping(forcing).get("kind", forcing)
    if _mapping(forcing).get("of") == "base_acceleration":
        return "m/s2"
    return {"base": "m", "unbalance": "kg m"}.get(str(kind), "N")


def _values_text(values: tuple[float, ...], units: str) -> str:
    """The values of a quantity, or their ends if they are many, with units."""
    if len(values) <= 6:
        return f"{', '.join(f'{value:g}' for value in values)} {units}".rstrip()
    return f"{min(values):g} to {max(values):g} {units}".rstrip() + f", {len(values)} values"


def _drawn_text(drawn: Drawn, units: str) -> str:
    """Text of a drawn quantity's range, with units."""
    ways = []
    if drawn.range is not None:
        low, high = drawn.range
        log = ", log-uniform" if drawn.spacing == "log" else ""
        ways.append(f"{low:g} to {high:g} {units}".rstrip() + log)
    if drawn.values is not None:
        ways.append(_values_text(drawn.values, units))
    often = "" if drawn.share is None else f" ({drawn.share:.0%})"
    return " or ".join(ways) + often


class Settings(StrictModel):
    """The configuration as written; the studies are found in the file system."""

    studies: Annotated[
        DistinctList[Text],
        Field(
            description="The studies to make: names of files in config/studies without .yaml, or "
            "paths that end in .yaml."
        ),
    ]
    targets: Annotated[
        dict[str, DistinctList[Text]],
        NamedMapping("target", to="its studies", dropped=False),
        Field(
            description="More studies, outside of the default run: name of a target -> studies "
            "that `snakemake <name>` makes."
        ),
    ] = _NONE
    engine: Annotated[
        Engine, Field(description="How exact the simulation is, and when it gives up.")
    ] = Engine()
    results: Annotated[
        Folder, Field(description="Folder for everything that is made; a link may stand there.")
    ] = "results"
    overrides: Annotated[
        dict[str, dict[Any, Any] | None],
        NamedMapping("study", to="part of a study", dropped=False),
        Field(
            description="Name of a study -> part of a study that is merged over its file. What it "
            "says about the values of an axis replaces the way in which the file gives them; a "
            "figure, table, scene, solver, case or set of runs that is null is left out."
        ),
    ] = _NONE

    def check_together(self, mistakes: Mistakes) -> None:
        for name in self.targets:
            if name.startswith("-"):
                message = f"{display(name)} reads like an option of snakemake"
                mistakes.add(("targets", name), message, "a name without - in front")


@dataclass(frozen=True)
class Config:
    """The workflow's configuration with its studies, checked.

    `studies` are all there are, `default` the names of those to make without being asked, and
    `targets` those of each named target.
    """

    studies: dict[str, StudyFile]
    default: tuple[str, ...]
    targets: dict[str, tuple[str, ...]]
    engine: Engine
    results: str

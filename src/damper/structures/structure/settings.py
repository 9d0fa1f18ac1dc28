"""Settings of a study of a structure with free masses in its boxes."""

from __future__ import annotations

import json
import math
import re
from collections.abc import Mapping
from functools import cached_property
from itertools import chain
from pathlib import Path
from typing import Annotated, Any, ClassVar, Literal

from pydantic import Field, GetJsonSchemaHandler, TypeAdapter
from pydantic_core import CoreSchema, core_schema

from damper.analysis.labels import label_of
from damper.observers import make_observers, of_all_masses
from damper.parameters.dampers import SIParameters
from damper.parameters.forcing import HARMONIC, Forcing, force_text
from damper.parameters.masses import own_names
from damper.parameters.names import OF_A_MASS_STRUCTURE, split
from damper.parameters.quantity import Quantity
from damper.parameters.structural import StructureParameters
from damper.parameters.structure import Structure
from damper.parameters.structure_files import MATRICES
from damper.parameters.structure_results import DIMENSIONS, MOST_POINTS, VARIABLES
from damper.parameters.tables import WALL_TABLES
from damper.parameters.unit_text import SIZES, number_in, split_unit
from damper.parameters.units import HERTZ
from damper.parameters.variables import Variable
from damper.study.fields import ONE_MISTAKE, NamedMapping, NumberOrText, StrictModel, Text, Unit
from damper.study.forcing import FORCES, ForceEntry, check_undriven
from damper.study.jobs import Job, shares
from damper.study.kinds import Kinds
from damper.study.messages import Mistakes
from damper.study.parts import engine_part
from damper.study.products import check_listed
from damper.study.settings import OBSERVER_SETTINGS, AxisValues, given_settings, numbers_at
from damper.study.study_file import ProductBase, StudyFile
from damper.study.yaml_file import words_of
from damper.sweep.estimate import MOST_CYCLES

_NONE: dict[str, Any] = {}
_HERE = "damper.structures.structure"
#: Work (`StructureParameters.work`) that takes compiled code some seconds.
_WORK_OF_A_JOB = 200_000.0
#: Work that takes plain Python some ten seconds.
_PLAIN_WORK = 4_000.0
#: Quantity of all masses -> quantities of a mass, of which one must be there.
_NEEDED = {
    "transverse_acceleration": {"friction_coefficient", "pendulum_length"},
    "inclination": {"gravity"},
    "yield_exponent": {"yield_speed"},
}
Place = Annotated[int | Text | Annotated[tuple[float, ...], Field(strict=False)], ONE_MISTAKE]
"""Number of a coordinate, name of a place or of an array, or weights."""


_Row = Annotated[tuple[float, ...], Field(strict=False)]
Matrix = Annotated[Text | Annotated[tuple[_Row, ...], Field(strict=False)], ONE_MISTAKE]
"""Path of a file, or rows."""


class OrPath:
    """Marks a list or a mapping: the path of a file may stand in its place."""

    def __get_pydantic_core_schema__(self, source: Any, handler: Any) -> CoreSchema:
        text = TypeAdapter(Text)
        return core_schema.no_info_wrap_validator_function(
            lambda value, inner: (
                text.validate_python(value) if isinstance(value, str) else inner(value)
            ),
            handler(source),
            serialization=core_schema.simple_ser_schema("any"),
        )

    def __get_pydantic_json_schema__(
        self, core: CoreSchema, handler: GetJsonSchemaHandler
    ) -> dict[str, Any]:
        return {"anyOf": [handler(core["schema"]), {"type": "string"}]}  # type: ignore[typeddict-item]


class ModeEntry(StrictModel):
    """A mode of the structure."""

    frequency: Annotated[float, Unit("Hz"), Field(ge=0, description="Natural frequency.")]
    damping_ratio: Annotated[float, Field(ge=0, description="Part of critical damping.")]
    modal_mass: Annotated[
        float, Unit("kg"), Field(gt=0, description="1 for shapes that are normalised by mass.")
    ] = 1.0
    shapes: Annotated[
        dict[str, float],
        Field(description="Name of a place -> its displacement in this mode; also force and base."),
    ]


class StructureEntry(StrictModel):
    """The structure, by its modes or by its matrices."""

    modes: Annotated[
        Annotated[tuple[ModeEntry, ...], Field(strict=False), OrPath()] | None,
        Field(
            description="A CSV file with one row a mode; or a list of modes: frequency in Hz, "
            "damping_ratio, modal_mass (1 for shapes normalised by mass) and shapes: name of a "
            "place -> its displacement, also force and base."
        ),
    ] = None
    matrices: Annotated[
        Annotated[dict[str, Matrix], OrPath()] | None,
        Field(
            description="A file .npz or .mat with the matrices; or for each of mass, damping, "
            "stiffness a file .mtx or .npy, or its rows."
        ),
    ] = None
    boxes: Annotated[
        dict[str, Place],
        Field(
            description="Of matrices: name -> number of a coordinate from 0, weights, or the name "
            "of an array in the file."
        ),
    ] = _NONE
    points: Annotated[
        dict[str, Place], Field(description="Of matrices: further places, likewise.")
    ] = _NONE
    force: Annotated[
        Place | None,
        Field(description="Where the force acts: the name of a place; of matrices, as for boxes."),
    ] = None
    base: Annotated[
        Place | None, Field(description="Of matrices: influence of the base's motion.")
    ] = None
    base_shares: Annotated[
        dict[str, float],
        Field(description="Of modes: displacement of a box in a unit displacement of the base."),
    ] = _NONE

    @classmethod
    def check_keys(cls, given: Any, mistakes: Mistakes) -> None:
        if (given.get("modes") is None) == (given.get("matrices") is None):
            mistakes.add((), "the structure is given by one of two", "modes or matrices")
        of_matrices = {"boxes", "points", "base"} if given.get("modes") is not None else set()
        for key in sorted(key for key in of_matrices if given.get(key)):
            mistakes.add((key,), f"{key} goes with matrices", "a column or shape of modes")

    @property
    def files(self) -> dict[str, str]:
        """Files that it is read from: name -> path."""
        own = self.matrices if isinstance(self.matrices, dict) else {"matrices": self.matrices}
        given: dict[str, Any] = {"modes": self.modes, **own}
        return {name: path for name, path in given.items() if isinstance(path, str)}

    def made(self, folder: Path) -> Structure:
        """Return the structure; paths are relative to a folder."""
        place: Any = self.force
        if isinstance(self.modes, str):
            return Structure.read_modes(
                folder / self.modes, force=place, base_shares=self.base_shares or None
            )
        if self.modes is not None:
            names = dict.fromkeys(name for mode in self.modes for name in mode.shapes)
            shapes: dict[str, Any] = {}
            for name in names:
                if lacking := [k for k, m in enumerate(self.modes, 1) if name not in m.shapes]:
                    raise ValueError(f"mode {lacking[0]} has no shape of {name!r}")
                shapes[name] = [mode.shapes[name] for mode in self.modes]
            shapes |= {} if place is None else {"force": place}
            return Structure.from_modes(
                [mode.frequency for mode in self.modes],
                [mode.damping_ratio for mode in self.modes],
                shapes,
                modal_masses=[mode.modal_mass for mode in self.modes],
                base_shares=self.base_shares or None,
            )
        paths, files = {name: folder / path for name, path in self.files.items()}, self.matrices
        found = dict(files) | paths if isinstance(files, Mapping) else paths["matrices"]
        return Structure.read_matrices(
            found, boxes=self.boxes, force=self.force, base=self.base, points=self.points
        )


def entry_of(structure: Structure) -> dict[str, Any]:
    """Return the entry of a structure that is made already."""
    given = structure.settings
    if "frequencies" not in given:
        matrices = {name: given.pop(name) for name in MATRICES}
        return {"matrices": matrices, **given}
    names = ("frequency", "damping_ratio", "modal_mass")
    columns = (given["frequencies"], given["damping_ratios"], given["modal_masses"])
    modes: list[dict[str, Any]] = [
        dict(zip(names, row, strict=True)) for row in zip(*columns, strict=True)
    ]
    for k, mode in enumerate(modes):
        mode["shapes"] = {name: shape[k] for name, shape in given["shapes"].items()}
    return {"modes": modes, "base_shares": given["base_shares"]}


_LENGTHS = Annotated[tuple[float, ...], Unit("m")]
_SPEEDS = Annotated[tuple[float, ...], Unit("m/s")]
_PLACES = tuple[Annotated[float, Field(ge=-1, le=1)], ...]


class StartEntry(StrictModel):
    """Where every run starts; what is not given is 0."""

    displacement: Annotated[
        _LENGTHS, Field(strict=False, description="Of each coordinate or mode, in m.")
    ] = ()
    velocity: Annotated[
        _SPEEDS, Field(strict=False, description="Of each coordinate or mode, in m/s.")
    ] = ()
    position: Annotated[
        _PLACES,
        Field(
            strict=False,
            description="Of each free mass between its walls: -1 at the left one, 1 at the right "
            "one.",
        ),
    ] = ()
    relative_velocity: Annotated[
        _SPEEDS, Field(strict=False, description="Of each free mass relative to its box, in m/s.")
    ] = ()

    @property
    def numbers(self) -> dict[str, list[float]]:
        """Arguments of `StructureParameters.started`."""
        return {name: list(values) for name, values in self if values}


class StructureAxis(AxisValues):
    """A quantity that runs through values."""

    @classmethod
    def quantity_named(cls, name: str) -> Quantity | None:
        common, _ = split(name, OF_A_MASS_STRUCTURE) or (name, 0)
        of_mode = re.fullmatch(r"mode_\d+_(frequency|damping_ratio)", name)
        if of_mode:
            return Quantity(name, "", name, "Hz" if of_mode[1] == "frequency" else "1")
        return next((q for q in StructureParameters.quantities if q.name == common), None)


FIGURES = Kinds(ProductBase, f"{_HERE}.figures")
TABLES = Kinds(ProductBase, f"{_HERE}.tables")


class StructureStudy(StudyFile):
    """Free masses in boxes of a structure, run over a grid of their quantities."""

    entries: ClassVar[Mapping[str, type[StrictModel]]] = {"axes": StructureAxis}
    figure_kinds: ClassVar[Mapping[str, type[ProductBase]]] = FIGURES
    table_kinds: ClassVar[Mapping[str, type[ProductBase]]] = TABLES
    models: ClassVar[tuple[str, ...]] = ("structure",)

    kind: Annotated[Literal["structure"], Field(description="That it is such a study.")]
    structure: Annotated[StructureEntry, Field(description="The structure.")]
    masses: Annotated[
        tuple[dict[str, NumberOrText], ...],
        Field(
            strict=False,
            min_length=1,
            description="The free masses: box, free_mass, gap, restitution, tie_stiffness and more "
            "of each, as for damper.SIParameters; a number may have a unit, as 20 mm, and "
            "restitution_table is the path of a CSV file.",
        ),
    ]
    parameters: Annotated[
        dict[str, NumberOrText],
        Field(description="force_amplitude, forcing_frequency, phase, and values for all masses."),
    ] = _NONE
    forcing: Annotated[
        ForceEntry,
        FORCES,
        Field(description="What drives the structure; a harmonic force when not given."),
    ] = FORCES["harmonic"](kind="harmonic")
    axes: Annotated[
        dict[str, StructureAxis],
        NamedMapping("axis"),
        Field(
            description="Quantities of parameters, of single masses (gap_0) and of modes "
            "(mode_1_frequency in Hz, mode_1_damping_ratio) that run through values."
        ),
    ] = _NONE
    transient: Annotated[
        int, Field(ge=0, le=MOST_CYCLES, description="Cycles before the window.")
    ] = 100
    periods: Annotated[int, Field(ge=1, le=MOST_CYCLES, description="Cycles in the window.")] = 20
    start: Annotated[
        StartEntry, Field(description="Where every run starts; at rest when not given.")
    ] = StartEntry()
    observers: Annotated[
        dict[str, StrictModel],
        NamedMapping("observer", OBSERVER_SETTINGS, bare=True),
        Field(
            description="What to measure beside the variables of every structure, of each free "
            "mass: observers that know structures."
        ),
    ] = _NONE
    samples: Annotated[
        int,
        Field(
            ge=4,
            le=10_000,
            description="Samples of displacements and energies in a cycle of the history.",
        ),
    ] = 64
    history: Annotated[
        int,
        Field(
            ge=0,
            description="Cycles from the window's start of which the samples are kept, over the "
            "dimension instant; up to periods.",
        ),
    ] = 0
    figures: Annotated[
        dict[str, Annotated[ProductBase, FIGURES]],
        NamedMapping("figure"),
        Field(description="What to draw: name of the file -> kind and its settings."),
    ] = _NONE
    tables: Annotated[
        dict[str, Annotated[ProductBase, TABLES]],
        NamedMapping("table"),
        Field(description="What to tabulate: name of the file -> kind and its settings."),
    ] = _NONE

    @classmethod
    def without_units(
        cls, given: Mapping[str, Any], name: str | None, mistakes: Mistakes
    ) -> dict[str, Any]:
        return numbers_at(super().without_units(given, name, mistakes), StructureAxis)

    @cached_property
    def damper(self) -> Any:
        """Parameters at the first point of the grid."""
        first = {name: axis.points[0] for name, axis in self.axes.items()}
        known = {"forcing_frequency", "force_amplitude"}
        given: dict[str, Any] = self._with_tables(self.parameters)
        given |= {name: value for name, value in first.items() if name in known}
        made: Any = SIParameters(
            structure=self.structure.made(self._folder),
            masses=[self._with_tables(one) for one in self.masses],
            forcing=self.forcing.force(self._folder),
            **given,
        )
        for name in first:
            made.quantity_of(name)
        return made.having(first) if first else made

    def _with_tables(self, given: Mapping[str, Any]) -> dict[str, Any]:
        """Values with the paths of tables from the study's folder."""
        return dict(given) | {n: self._folder / given[n] for n in WALL_TABLES if n in given}

    @property
    def force_files(self) -> dict[str, str]:
        """Files beside the study that its runs are of: name -> path."""
        found = {name: str(self._folder / path) for name, path in self.structure.files.items()}
        for k, one in enumerate((self.parameters, *self.masses)):
            found |= {f"{n}_{k}": str(self._folder / str(one[n])) for n in WALL_TABLES if n in one}
        samples = self.forcing.path(self._folder)
        return found | ({} if samples is None else {"samples": str(samples)})

    def check_files(self, mistakes: Mistakes) -> None:
        """Note what is refused when all files are read and every end of an axis is tried."""
        try:
            self.structure.made(self._folder)
        except (ValueError, TypeError, OSError) as error:
            mistakes.add(("structure",), words_of(error))
            return
        try:
            damper = self.damper
        except (ValueError, TypeError, OSError) as error:
            said = str(error).partition(" (did you mean")[0]
            named = (name for name in self.axes if re.search(rf"(^|'){name}\b", said))
            loc = next((("axes", name) for name in named), ("parameters",))
            mistakes.add(loc, words_of(error))
            return
        try:
            damper.started(**self.start.numbers)
        except ValueError as error:
            mistakes.add(("start",), str(error))
        if "decay" in self.observers:
            amplitude = self.axes.get("force_amplitude")
            amplitudes = amplitude.points if amplitude else [damper.force_amplitude]
            begins = [self.transient * damper.cycle]
            later = "a transient whose last cycle ends"
            check_undriven(damper.forcing, amplitudes, begins, mistakes, later)
        for name, axis in self.axes.items():
            for value in (axis.points[0], axis.points[-1]):
                try:
                    damper.having({name: value})
                except (ValueError, TypeError) as error:
                    mistakes.add(("axes", name), str(error))
                    break
        if not mistakes:
            self._check_lines(damper.structure, mistakes)

    def _check_lines(self, structure: Structure, mistakes: Mistakes) -> None:
        """Note values that the cube does not have, and dimensions that a figure does not show."""
        there: dict[str, tuple[Any, ...]] = {name: axis.given for name, axis in self.axes.items()}
        there |= {"point": tuple(structure.points), "body": tuple(range(len(self.masses)))}
        there["mode"] = tuple(range(1, len(structure.mass) + 1))
        observed = chain.from_iterable(one.variables for one in self._made_observers)
        variables = {one.name: one for one in (*VARIABLES, *observed)}
        for section, stem, made in self.products():
            if section != "figures":
                for i, name in enumerate(made.variables):
                    if "instant" in variables[name].dims:
                        message = f"'{name}' has a value at each instant"
                        mistakes.add((section, stem, "variables", i), message, "left out")
                continue
            (name,) = made.variables
            dims = {*self.axes, *variables[name].dims}
            shown = {key: getattr(made, key) for key in ("along", "lines", "panels")}
            given = [dim for dim in shown.values() if dim is not None]
            for dim in sorted({dim for dim in given if given.count(dim) > 1}):
                message = f"the figure shows '{dim}' twice"
                mistakes.add((section, stem), message, "a dimension in one place")
            for key, dim in shown.items():
                if dim is not None and dim not in dims:
                    message = f"{name} has no values along '{dim}'"
                    mistakes.add((section, stem, key), message, ", ".join(sorted(dims)))
            for dim, value in made.at.items():
                place = (section, stem, "at", dim)
                if dim not in dims and dim in there:
                    message = f"{name} has no values along '{dim}'"
                    mistakes.add(place, message, ", ".join(sorted(dims)))
                if dim in shown.values():
                    mistakes.add(place, f"the figure shows all values of '{dim}'", "left out")
                check_listed(place, dim, value, there, mistakes)
            for dim in sorted(dims & there.keys() - {*shown.values(), *made.at}):
                if len(there[dim]) > 1:
                    message = f"{name} has {len(there[dim])} values along '{dim}'"
                    words = f"'{dim}' as lines or panels, or one of its values in at"
                    mistakes.add((section, stem), message, words)

    def check_together(self, mistakes: Mistakes) -> None:
        if mistakes:
            return
        if math.prod(len(axis.given) for axis in self.axes.values()) > MOST_POINTS:
            mistakes.add(("axes",), "too many points", f"at most {MOST_POINTS}")
        common = {(split(name, OF_A_MASS_STRUCTURE) or (name, 0))[0] for name in self.axes}
        there = common.union(self.parameters, *self.masses)
        for name, needed in _NEEDED.items():
            for section in ("parameters", "axes"):
                if name in getattr(self, section) and not there & needed:
                    words = " or ".join(sorted(needed))
                    mistakes.add(
                        (section, name), f"'{name}' has no effect without {words}", "both or none"
                    )
        if self.forcing.drawn:
            mistakes.add(("forcing", "seed"), "runs on a structure have no draws", "integer >= 0")
        for name, axis in self.axes.items():
            if axis.unit and name != "forcing_frequency":
                mistakes.add(("axes", name, "unit"), f"{name} is not in Hz here", "left out")
        if self.history > self.periods:
            message = f"the window has {self.periods} cycles"
            mistakes.add(("history",), message, f"up to {self.periods}")
        shown = [v.name for v in VARIABLES if self.history or "instant" not in v.dims]
        of_history = "instant" if self.history else ""
        observed: list[Variable] = []
        try:
            made_observers = self._made_observers
        except ValueError as error:
            mistakes.add(("observers",), str(error))
            made_observers = []
        for one in made_observers:
            if any(v.name in shown or of_history in v.dims for v in one.variables):
                message = "the history of a run has variables or dimensions of this name"
                mistakes.add(("observers", one.name), message, "left out, or history: 0")
            try:
                one.allocate(0, self.periods)
            except ValueError as error:
                mistakes.add(("observers", one.name), str(error).removeprefix(f"{one.name}."))
            observed += one.variables
        shown += [v.name for v in observed]
        known = {*self.axes, *DIMENSIONS, *(dim for v in observed for dim in v.dims)}
        for section, stem, made in self.products():
            for key in ("along", "lines", "panels"):
                dim = getattr(made, key, None)
                if dim is not None and dim not in known:
                    message = f"'{dim}' is no dimension of the cube"
                    mistakes.add((section, stem, key), message, ", ".join(sorted(known)))
            for i, variable in enumerate(made.variables):
                if variable not in shown:
                    message = f"'{variable}' is not in the cube"
                    mistakes.add((section, stem, "variables", i), message, ", ".join(shown))

    @cached_property
    def _made_observers(self) -> list[Any]:
        """The observers; ValueError where two of them do not go together."""
        return list(make_observers(self._observed, boxes=True))

    @property
    def _observed(self) -> dict[str, dict[str, Any]]:
        """Settings of the observers, of all free masses."""
        given = {name: given_settings(entry) for name, entry in self.observers.items()}
        return of_all_masses(given, len(self.masses))

    def about(self) -> dict[str, Any]:
        return super().about() | {"interactive": ()}

    def parts(self, engine: Mapping[str, Any]) -> dict[str, Job]:
        """Return jobs that share the values of the first axis."""
        settings = {
            **self.damper.settings,
            "cycles": [self.transient, self.periods],
            "samples": self.samples,
            "history": self.history,
            "engine": dict(engine),
        }
        # A study that asks for neither keeps its results.
        if numbers := self.start.numbers:
            settings["start"] = numbers
        if self.observers:
            settings["observers"] = self._observed
        loads = ("damper.models.structure", *(f"damper.observers.{n}" for n in self.observers))
        for module, names in (("response", {"decay", "statistics"}), ("laws", {"laws"})):
            if self.observers.keys() & names:
                loads = (*loads, f"damper.models.structure.{module}")
        compiled = self._compiled
        return {
            name: Job(f"{_HERE}.runs", {**settings, "axes": axes}, loads=loads, compiled=compiled)
            for name, axes in self._split.items()
        }

    @property
    def force(self) -> Forcing:
        """What drives the structure."""
        return self.damper.forcing  # type: ignore[no-any-return]

    @property
    def windows(self) -> list[tuple[float, int, int]]:
        """Length of a cycle, and cycles before and in the window, at the ends of the clock."""
        clock = self.axes.get("forcing_frequency")
        ends = [{"forcing_frequency": value} for value in (clock.points if clock else ())]
        dampers = [self.damper.having(end) for end in ends] or [self.damper]
        return [(one.cycle, self.transient, self.periods) for one in dampers]

    @property
    def runs(self) -> int:
        """Number of runs, one at each point of the grid."""
        return math.prod(len(axis.points) for axis in self.axes.values())

    @property
    def _work(self) -> float:
        return float(self.runs * self.damper.work(self.transient + self.periods))

    @property
    def _compiled(self) -> tuple[str, ...]:
        """Code to compile before the jobs. The jobs compile that of tables and observers."""
        p = self.damper.dimensionless
        if self._work < _PLAIN_WORK or any(one.tables for one in p.each):
            return ()
        return (engine_part(p),)

    @property
    def _split(self) -> dict[str, dict[str, list[float]]]:
        """Values of the axes of each job."""
        axes = {name: list(axis.points) for name, axis in self.axes.items()}
        jobs = math.ceil(self._work / _WORK_OF_A_JOB)
        if not axes or jobs == 1:
            return {"all": axes}
        first, values = next(iter(axes.items()))
        return {
            f"{k:03d}": axes | {first: values[low:high]}
            for k, (low, high) in enumerate(shares(len(values), min(jobs, len(values))))
        }

    def gathered(self, engine: Mapping[str, Any]) -> dict[str, Job]:
        settings = {
            "axes": {
                name: [list(axis.given), self.units[name], self.damper.words_of(name)]
                for name, axis in self.axes.items()
            },
            "points": list(self.damper.structure.points),
            "attributes": self.attributes() | self._run | dict(engine),
            "fixed": self.fixed,
        }
        if self.observers:
            settings["observers"] = self._observed
        return {"cube.nc": Job(f"{_HERE}.runs", settings, needs=tuple(self._split))}

    @property
    def _run(self) -> dict[str, Any]:
        """Attributes of the cube that say how it was run, as in one of `damper.simulate`."""
        length = {"transient_periods": self.transient, "recorded_periods": self.periods}
        if self.force == HARMONIC:
            return length
        return {"forcing": json.dumps(self.forcing.about(self._folder)), **length}

    @property
    def values(self) -> dict[str, str]:
        """Settings of the study for a page: name -> value."""
        found = {"structure": repr(self.damper.structure)}
        for k, mass in enumerate(self.masses):
            found[f"mass {k}"] = ", ".join(f"{label_of(n)} {v}" for n, v in mass.items())
        found |= {label_of(name): str(value) for name, value in self.parameters.items()}
        for name, axis in self.axes.items():
            values, unit = axis.given, self.units[name]
            found[self.damper.words_of(name)] = (
                f"{values[0]:g} to {values[-1]:g} {unit}, {len(values)} values"
            )
        return found | {"forcing": force_text(self.forcing.about(self._folder), si=True)}

    @property
    def units(self) -> dict[str, str]:
        return {name: axis.unit or self._unit(name) for name, axis in self.axes.items()}

    def _unit(self, name: str) -> str:
        if name == "force_amplitude":
            return str(self.damper.forcing.si_unit)
        return str(self.damper.quantity_of(name).units.replace("1", ""))

    @property
    def fixed(self) -> dict[str, tuple[float, str, str]]:
        """Value, unit and words of each number that is given and no axis changes."""
        given: dict[str, Any] = {}
        for k, one in enumerate(self.masses):
            given |= {f"{name}_{k}": value for name, value in one.items() if name != "box"}
        of_masses = own_names((), self.masses)
        for name, value in self.parameters.items():
            takes = [k for k, names in enumerate(of_masses) if name not in names]
            every = len(takes) == len(of_masses)
            given |= {name: value} if every else {f"{name}_{k}": value for k in takes}
        found = {}
        for name, value in given.items():
            if name in self.axes or name.startswith(tuple(WALL_TABLES)):
                continue
            unit = self._unit(name)
            _, own = split_unit(value) or ("", "")
            if unit == "rad/s" and own in SIZES[HERTZ]:
                number, unit = number_in(name, value, [HERTZ]), HERTZ
            else:
                number = self.damper.value_of(name)
            found[name] = (number, unit, self.damper.words_of(name))
        return found

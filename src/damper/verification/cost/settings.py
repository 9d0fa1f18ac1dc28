"""Settings of a cost study: what each part of a run costs a scene that asks for it, or does not."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Annotated, Any, ClassVar

from pydantic import Field

from damper.parameters import Parameters, SIParameters
from damper.parameters.quantities import ALL, INITIAL_NAMES, QUANTITIES, SI_QUANTITIES, is_si
from damper.study.fields import Choice, Faults, ListOf, Number, Section, Strict, Text
from damper.study.kinds import Kinds
from damper.study.settings import OBSERVERS, SECTIONS, Fixed, observer
from damper.verification.base import (
    DRAWN,
    TABULATED,
    Made,
    Verification,
    figures_of,
    require,
    tables_of,
    values_of,
)

_NONE: dict[str, Any] = {}
_NAMES = tuple(ALL)
#: Sizes take turns less often than rungs: each is a process of its own.
MOST_GROWTH_REPEATS = 5
_COUNTS = ListOf(Number(ge=1, whole=True), least=2)
_FILES = ListOf(Text())


def _files(name: str, data: Any) -> tuple[str, ...]:
    files: tuple[str, ...] = _FILES.check(data, None)
    return files


Quantities = Annotated[
    dict[str, Fixed],
    Section(Fixed.entry, "parameter", _NAMES, of=Fixed),
    Field(description="Dimensionless or SI parameters, and initial quantities."),
]
Observers = Annotated[
    dict[str, Strict],
    Section(observer, "observer", OBSERVERS, of=OBSERVERS, bare=True),
    Field(description="What is measured; nothing for the bare engine."),
]


class Rung(Strict):
    """A scene, and what is observed in it."""

    parameters: Quantities
    observers: Observers = _NONE

    def settings(self) -> dict[str, Any]:
        """Return the rung as plain values."""
        remarks = {"threshold": {"assumed", "stated"}}
        return {
            "parameters": values_of(self.parameters),
            "observers": {
                name: made.model_dump(exclude_none=True, exclude=remarks)
                for name, made in self.observers.items()
            },
        }

    @classmethod
    def relate(cls, data: dict[str, Any], model: Rung | None, faults: Faults) -> None:
        if model is not None:
            check_scene(model.parameters, faults)
            if all(section in model.observers for section in SECTIONS):
                message = f"{' and '.join(SECTIONS)} cannot both be asked for"
                faults.add(("observers",), message, "one of the two")


class Growth(Rung):
    """A scene that is run with more and more lanes, and over more and more periods."""

    lanes: Annotated[tuple[int, ...], _COUNTS, Field(description="Numbers of lanes.")]
    lane_periods: Annotated[
        int,
        Number(ge=1, whole=True, units="forcing periods"),
        Field(description="How long each of these lanes is run."),
    ] = 10
    periods: Annotated[
        tuple[int, ...], _COUNTS, Field(description="Numbers of periods of a single lane.")
    ]


def check_scene(parameters: Mapping[str, Fixed], faults: Faults) -> None:
    """Note what is wrong with the parameters of one scene, in either system of units."""
    try:
        si = is_si(parameters)
    except ValueError as error:
        faults.add(("parameters",), str(error))
        return
    require(parameters, faults, SI_QUANTITIES if si else QUANTITIES)
    if faults.lines:
        return
    given = {n: value for n, value in values_of(parameters).items() if n not in INITIAL_NAMES}
    try:
        (SIParameters if si else Parameters)(**given)
    except ValueError as error:
        faults.add(("parameters",), str(error))


FIGURES = Kinds(Made, "damper.verification.cost.figures")
TABLES = Kinds(Made, "damper.verification.cost.tables")


class Cost(Verification):
    """What each part of a run costs: observers, models, lanes, periods, imports, jobs."""

    entries: ClassVar[Mapping[str, type[Strict]]] = {"rungs": Rung}
    figure_kinds: ClassVar[Mapping[str, type[Made]]] = FIGURES
    table_kinds: ClassVar[Mapping[str, type[Made]]] = TABLES
    has_cube: ClassVar[bool] = False

    kind: Annotated[str, Choice("cost"), Field(description="That it is such a study.")]
    rungs: Annotated[
        dict[str, Rung],
        Section(Rung.entry, "rung", of=Rung, dropped=True),
        Field(description="Name -> scene and observers; the first one is what others are beside."),
    ]
    lanes: Annotated[
        int, Number(ge=1, whole=True), Field(description="Lanes of each rung, a little different.")
    ] = 10
    periods: Annotated[
        int,
        Number(ge=1, whole=True, units="forcing periods"),
        Field(description="How long each of these lanes is run."),
    ] = 200
    repeats: Annotated[
        int,
        Number(ge=3, whole=True),
        Field(description="How often a rung and its bare engine take turns."),
    ] = 30
    unused: Annotated[
        Rung,
        Field(
            description="A rigid damper without bursts and without observers, to tell what "
            "features cost that it does not use."
        ),
    ]
    growth: Annotated[Growth, Field(description="How run time and memory grow.")]
    jobs: Annotated[
        dict[str, tuple[str, ...]],
        Section(_files, "target", of=_FILES, dropped=True),
        Field(
            description="Name -> files below the folder of results; how many jobs they need is "
            "counted, of no file at all those of the default run."
        ),
    ] = _NONE
    figures: Annotated[dict[str, Made], figures_of(FIGURES), DRAWN] = _NONE
    tables: Annotated[dict[str, Made], tables_of(TABLES), TABULATED] = _NONE

    @property
    def values(self) -> dict[str, str]:
        """What a page says of the study's settings: name -> value."""
        found = {}
        for name, rung in self.rungs.items():
            values = ", ".join(f"{key} {one.value:g}" for key, one in rung.parameters.items())
            watched = ", ".join(rung.observers) or "no observer"
            found[f"rung {name}"] = f"{values}; {watched}"
        return found | {"repeats": str(self.repeats)}

    def settings(self) -> dict[str, Any]:
        """Return what is to be measured as plain values."""
        sizes = {"lanes": self.lanes, "periods": self.periods, "repeats": self.repeats}
        rungs = {name: rung.settings() for name, rung in self.rungs.items()}
        return {
            "ladder": {"rungs": rungs, **sizes},
            "unused": {"parameters": values_of(self.unused.parameters), **sizes},
            "scaling": {
                **self.growth.settings(),
                "lanes": list(self.growth.lanes),
                "lane_periods": self.growth.lane_periods,
                "periods": list(self.growth.periods),
                "repeats": min(self.repeats, MOST_GROWTH_REPEATS),
            },
            "jobs": {name: list(files) for name, files in self.jobs.items()},
        }

    @classmethod
    def relate(cls, data: dict[str, Any], model: Cost | None, faults: Faults) -> None:
        if "rungs" in data and not data["rungs"]:
            faults.add(("rungs",), "at least one rung must be given")

"""Settings of a cost study: what each part of a run costs a scene that asks for it, or does not."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Annotated, Any, ClassVar

from pydantic import Field

from damper.quantities import ALL, INITIAL_QUANTITIES, QUANTITIES
from damper.study.fields import Choice, Faults, ListOf, Number, Section, Strict, Text
from damper.study.kinds.base import Made, OptionalCaption, Verification
from damper.study.products import product
from damper.study.settings import OBSERVERS, SECTIONS, Fixed, observer

_NONE: dict[str, Any] = {}
_NAMES = tuple(quantity.name for quantity in (*QUANTITIES, *INITIAL_QUANTITIES))
_TIMED = ("timed/cost.json",)
_COUNTS = ListOf(Number(ge=1, whole=True), least=2)


class Rung(Strict):
    """A scene, and what is observed in it."""

    parameters: Annotated[
        dict[str, Fixed],
        Section(Fixed.entry, "parameter", _NAMES, of=Fixed),
        Field(description="Dimensionless parameters, and initial quantities."),
    ]
    observers: Annotated[
        dict[str, Strict],
        Section(observer, "observer", OBSERVERS, of=OBSERVERS, bare=True),
        Field(description="What is measured in it; nothing for the bare engine."),
    ] = _NONE

    def settings(self) -> dict[str, Any]:
        """Return the rung as `damper.cost.ladder.read_rungs` reads it."""
        remarks = {"threshold": {"assumed", "stated"}}
        return {
            "parameters": {name: self.parameters[name].value for name in ALL if name in self.given},
            "observers": {
                name: made.model_dump(exclude_none=True, exclude=remarks)
                for name, made in self.observers.items()
            },
        }

    @property
    def given(self) -> Mapping[str, Fixed]:
        """The parameters by name."""
        return self.parameters

    @classmethod
    def relate(cls, data: dict[str, Any], model: Rung | None, faults: Faults) -> None:
        if model is None:
            return
        for quantity in QUANTITIES:
            if quantity.default is None and quantity.name not in model.parameters:
                loc = ("parameters", quantity.name)
                faults.add(loc, f"'{quantity.name}' is not given", quantity.allowed)
        if all(section in model.observers for section in SECTIONS):
            both = " and ".join(SECTIONS)
            faults.add(("observers",), f"{both} cannot both be asked for", "one of the two")


class CostLadder(Made):
    """Time per event and peak memory of every rung beside the bare engine."""

    reads: ClassVar[tuple[str, ...]] = _TIMED

    caption: OptionalCaption = None


class CostScaling(Made):
    """Run time and peak memory against the number of lanes and of periods."""

    reads: ClassVar[tuple[str, ...]] = _TIMED

    caption: OptionalCaption = None


class CostTable(Made):
    """All that was measured: rungs, growth, imports of each kind of job, jobs of one figure."""

    reads: ClassVar[tuple[str, ...]] = _TIMED


FIGURES: dict[str, type[Made]] = {"cost_ladder": CostLadder, "cost_scaling": CostScaling}
TABLES: dict[str, type[Made]] = {"cost": CostTable}


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
    repeats: Annotated[
        int,
        Number(ge=3, whole=True),
        Field(description="How often a rung and its bare engine take turns."),
    ] = 30
    lanes: Annotated[
        tuple[int, ...], _COUNTS, Field(description="Numbers of lanes to see growth with.")
    ] = (1, 10, 100, 1000, 10_000, 100_000)
    periods: Annotated[
        tuple[int, ...], _COUNTS, Field(description="Numbers of periods to see growth with.")
    ] = (1, 10, 100, 1000, 10_000, 100_000, 1_000_000)
    asked: Annotated[
        tuple[str, ...],
        ListOf(Text()),
        Field(description="Figures, as study/figure, of which the jobs are counted."),
    ] = ()
    figures: Annotated[
        dict[str, Made],
        Section(product(FIGURES), "figure", of=FIGURES, dropped=True),
        Field(description="What to draw: name of the file -> kind and its settings."),
    ] = _NONE
    tables: Annotated[
        dict[str, Made],
        Section(product(TABLES), "table", of=TABLES, dropped=True),
        Field(description="What to tabulate: name of the file -> kind and its settings."),
    ] = _NONE

    @property
    def values(self) -> dict[str, str]:
        """What a page says of the study's settings: name -> value."""
        found = {}
        for name, rung in self.rungs.items():
            values = ", ".join(f"{key} {one.value:g}" for key, one in rung.parameters.items())
            watched = ", ".join(rung.observers) or "no observer"
            found[f"rung {name}"] = f"{values}; {watched}"
        return found | {"repeats": str(self.repeats)}

    @classmethod
    def relate(cls, data: dict[str, Any], model: Cost | None, faults: Faults) -> None:
        if "rungs" in data and not data["rungs"]:
            faults.add(("rungs",), "at least one rung must be given")

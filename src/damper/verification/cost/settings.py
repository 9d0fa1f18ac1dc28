"""Settings of a cost study: what each part of a run costs a scene that asks for it, or does not."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Annotated, Any, ClassVar, Literal

from pydantic import Field

from damper.analysis.labels import label_of
from damper.observers import OBSERVERS
from damper.parameters import quantities
from damper.parameters.forcing import force_text
from damper.study.fields import NamedMapping, Strict, Unit
from damper.study.forcing import FORCES, ForceEntry
from damper.study.jobs import Job
from damper.study.kinds import Kinds
from damper.study.messages import Mistakes
from damper.study.settings import OBSERVER_SETTINGS, SECTIONS, Fixed, given_settings
from damper.sweep.estimate import MOST_PERIODS
from damper.sweep.points import read_point
from damper.verification.base import DRAWN, TABULATED, Made, Verification, require, values_of

_NONE: dict[str, Any] = {}


class Case(Strict):
    """A scene, and what is observed in it."""

    parameters: Annotated[
        dict[str, Fixed],
        NamedMapping("parameter", tuple(quantities.ALL)),
        Field(description="Dimensionless or SI parameters, and initial quantities."),
    ]
    forcing: Annotated[
        ForceEntry, FORCES, Field(description="What drives the scene; see `forcing` of studies.")
    ] = FORCES["harmonic"](kind="harmonic")
    observers: Annotated[
        dict[str, Strict],
        NamedMapping("observer", OBSERVER_SETTINGS, bare=True),
        Field(description="What is measured; nothing for the bare engine."),
    ] = _NONE

    def settings(self) -> dict[str, Any]:
        """Return scene and observers as plain values."""
        return {
            "parameters": values_of(self.parameters),
            "forcing": self.forcing.settings,
            "observers": {name: given_settings(made) for name, made in self.observers.items()},
        }

    def check_together(self, mistakes: Mistakes) -> None:
        self._check_scene(mistakes)
        if all(section in self.observers for section in SECTIONS):
            message = f"{' and '.join(SECTIONS)} cannot both be asked for"
            mistakes.add(("observers",), message, "one of the two")

    def _check_scene(self, mistakes: Mistakes) -> None:
        """Note what is wrong with the scene, in either system of units."""
        if self.forcing.path(Path()) is not None:
            mistakes.add(("forcing", "file"), "a case keeps its samples here", "time and value")
        try:
            si = quantities.is_si(self.parameters)
            known = quantities.SI_QUANTITIES if si else quantities.QUANTITIES
            require(self.parameters, mistakes, known)
            if not mistakes.lines:
                read_point(values_of(self.parameters) | {"forcing": self.forcing.force(Path())})
        except ValueError as error:
            mistakes.add(("parameters",), str(error))


FIGURES = Kinds(Made, "damper.verification.cost.figures")
TABLES = Kinds(Made, "damper.verification.cost.tables")


class Cost(Verification):
    """What each part of a run costs: observers and models."""

    entries: ClassVar[Mapping[str, type[Strict]]] = {"cases": Case}
    figure_kinds: ClassVar[Mapping[str, type[Made]]] = FIGURES
    table_kinds: ClassVar[Mapping[str, type[Made]]] = TABLES
    has_cube: ClassVar[bool] = False

    kind: Annotated[Literal["cost"], Field(description="That it is such a study.")]
    cases: Annotated[
        dict[str, Case],
        NamedMapping("case"),
        Field(
            description="Benchmark cases: name -> scene and observers; the first one is the base."
        ),
    ]
    runs: Annotated[
        int, Field(ge=1, description="Runs of each case, a little different in clearance.")
    ] = 10
    periods: Annotated[
        int,
        Unit("cycles"),
        Field(ge=1, le=MOST_PERIODS, description="Length of each of these runs."),
    ] = 200
    repeats: Annotated[
        int, Field(ge=3, description="How often a case and its bare engine take turns.")
    ] = 30
    figures: Annotated[dict[str, Annotated[Made, FIGURES]], NamedMapping("figure"), DRAWN] = _NONE
    tables: Annotated[dict[str, Annotated[Made, TABLES]], NamedMapping("table"), TABULATED] = _NONE

    @property
    def values(self) -> dict[str, str]:
        """What a page shows of the study's settings: name -> value."""
        found = {}
        for name, case in self.cases.items():
            parameters = case.parameters.items()
            values = ", ".join(f"{label_of(key)} {one.number:g}" for key, one in parameters)
            observers = ", ".join(map(label_of, case.observers)) or "no observer"
            driven = force_text(case.forcing.settings)
            found[f"case {label_of(name)}"] = f"{values}; {driven}; {observers}"
        return found | {"repeats": str(self.repeats)}

    def timed(self) -> dict[str, Job]:
        models = (f"damper.models.{name}" for name in ("rigid", *quantities.MODEL_NAMES))
        observers = (f"damper.observers.{name}" for name in OBSERVERS)
        loads = (*models, *observers)
        job = Job("damper.verification.cost.measure", self.settings(), loads=loads)
        return {"timed/cost.json": job}

    def settings(self) -> dict[str, Any]:
        """Return the keywords of `damper.verification.cost.measure.measure`."""
        cases = {name: case.settings() for name, case in self.cases.items()}
        numbers = {"runs": self.runs, "periods": self.periods, "repeats": self.repeats}
        return {"cases": cases} | numbers

    def check_together(self, mistakes: Mistakes) -> None:
        if not self.cases:
            mistakes.add(("cases",), "at least one case must be given")

"""Settings of a comparison of solvers: error against run time."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Annotated, Any, ClassVar, Literal

from pydantic import Field

from damper.analysis.labels import label_of
from damper.parameters import Parameters
from damper.parameters.dampers import BASIC, require_known
from damper.parameters.quantities import ALL, DIMENSIONLESS_NAMES, INITIAL_NAMES, QUANTITIES
from damper.parameters.variables import TIME
from damper.study.fields import DistinctList, NamedMapping, StrictModel, Text, Unit
from damper.study.jobs import Job
from damper.study.kinds import Kinds
from damper.study.messages import Mistakes
from damper.study.settings import Fixed
from damper.study.study_file import ProductBase, StudyFile
from damper.verification.comparison import SOLVERS

_NONE: dict[str, Any] = {}
_HERE = "damper.verification.comparison"


class SceneSettings(StrictModel):
    """A run on which all solvers are compared."""

    title: Annotated[Text, Field(description="A few words, for panels and tables.")]
    parameters: Annotated[
        dict[str, Fixed],
        NamedMapping("parameter", DIMENSIONLESS_NAMES),
        Field(
            description="Dimensionless parameters, those without a default all of them, and what "
            "is not zero of the initial state. Of the rigid damper."
        ),
    ]
    until: Annotated[
        float,
        Unit(TIME),
        Field(gt=0, description="Where it ends: before chaos takes over, if there is chaos."),
    ]

    @property
    def values(self) -> dict[str, float]:
        """Value of every quantity that is given."""
        return {name: self.parameters[name].number for name in ALL if name in self.parameters}

    def settings(self) -> dict[str, Any]:
        """Return the arguments of `damper.verification.comparison.solvers.read_scene`."""
        return {"values": self.values, "until": self.until}

    def check_together(self, mistakes: Mistakes) -> None:
        given = {n: value for n, value in self.values.items() if n not in INITIAL_NAMES}
        for quantity in QUANTITIES:
            if quantity.default is None and quantity.name not in given:
                message = f"'{quantity.name}' is not given"
                mistakes.add(("parameters", quantity.name), message, quantity.allowed)
        if mistakes:
            return
        try:
            damper = Parameters(**given)
            place = self.values.get("initial_position", 0.0)
            if not damper.clearance or abs(place) >= 1.0:
                message = "the other solvers start in flight, between two walls"
                mistakes.add(("parameters",), message, "clearance > 0, -1 < initial_position < 1")
            elif damper.main_feature != "rigid" or damper.law != "constant":
                message = "the other solvers have rigid walls and a constant restitution"
                mistakes.add(("parameters",), message, "a scene of the rigid damper")
            else:
                require_known(damper, BASIC, "the comparison")
        except ValueError as error:
            mistakes.add(("parameters",), str(error))


FIGURES = Kinds(ProductBase, "damper.verification.comparison.figures")
TABLES = Kinds(ProductBase, "damper.verification.comparison.tables")


class Comparison(StudyFile):
    """Solvers compared on scenes: errors against a reference to 50 digits, and run times."""

    entries: ClassVar[Mapping[str, type[StrictModel]]] = {"scenes": SceneSettings}
    figure_kinds: ClassVar[Mapping[str, type[ProductBase]]] = FIGURES
    table_kinds: ClassVar[Mapping[str, type[ProductBase]]] = TABLES
    models: ClassVar[tuple[str, ...]] = ("rigid",)

    kind: Annotated[Literal["comparison"], Field(description="That it is such a study.")]
    scenes: Annotated[
        dict[str, SceneSettings],
        NamedMapping("scene"),
        Field(description="Name -> what is simulated."),
    ]
    solvers: Annotated[
        dict[str, DistinctList[Annotated[float, Field(gt=0)]]],
        NamedMapping("solver", tuple(SOLVERS), dropped=True),
        Field(
            description="Name -> values of the one setting that makes it more exact, the coarsest "
            "first: accuracy (exact), tolerance (dop853), steps_per_period (rk4_located, "
            "rk4_step_end, moreau_jean)."
        ),
    ]
    digits: Annotated[
        int,
        Field(ge=30, le=200, description="Decimal digits of the reference."),
    ] = 50
    cap: Annotated[
        float,
        Unit("s"),
        Field(
            gt=0,
            description="Time after which a run is given up, kept as a number of evaluations: what "
            "is capped does not depend on the load of the machine.",
        ),
    ] = 2.0
    repeats: Annotated[
        int,
        Field(ge=1, description="How often each run is timed."),
    ] = 15
    spend: Annotated[
        float,
        Unit("s"),
        Field(gt=0, description="Time spent on one run, after which it is not repeated any more."),
    ] = 0.2
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

    def parts(self, engine: Mapping[str, Any]) -> dict[str, Job]:
        """Return two jobs for each scene: its reference, and the runs of all solvers."""
        found = {}
        for name, scene in self.scenes.items():
            given, reference = {"scene": scene.settings()}, f"reference/{name}"
            runs = {**given, "solvers": self.solvers, "cap": self.cap}
            found[reference] = Job(f"{_HERE}.reference", {**given, "digits": self.digits})
            found[f"errors/{name}"] = self._solvers_job("runs", runs, (reference,))
        return found

    def gathered(self, engine: Mapping[str, Any]) -> dict[str, Job]:
        errors, references = (
            tuple(f"{kind}/{name}" for name in self.scenes) for kind in ("errors", "reference")
        )
        return {
            "cube.nc": self._solvers_job("runs", self._described(), errors),
            "references.json": Job(
                f"{_HERE}.reference", {"scenes": list(self.scenes)}, needs=references
            ),
        }

    def outputs(self) -> list[str]:
        """Return the paths of everything that is made of the study, below its folder."""
        return [*super().outputs(), "references.json"]

    def timed(self) -> dict[str, Job]:
        settings = {
            **self._described(),
            "scenes": {name: scene.settings() for name, scene in self.scenes.items()},
            "repeats": self.repeats,
            "cap": self.cap,
            "spend": self.spend,
        }
        return {"timed/timings.nc": self._solvers_job("runs", settings)}

    def _described(self) -> dict[str, Any]:
        """Return what a dataset says of the study."""
        titles = {name: scene.title for name, scene in self.scenes.items()}
        return {"solvers": self.solvers, "titles": titles, "attributes": self.attributes()}

    def _solvers_job(
        self, module: str, settings: dict[str, Any], needs: tuple[str, ...] = ()
    ) -> Job:
        """Return a job whose module loads the solvers."""
        solvers = (f"{_HERE}.solvers.{name}" for name in sorted(self.solvers))
        loads = (*solvers, "damper.models.masses")
        compiled = ("solvers", *sorted(self.solvers))
        return Job(f"{_HERE}.{module}", settings, needs, loads, compiled)

    @property
    def values(self) -> dict[str, str]:
        """Settings of the study for a page: name -> value."""
        found = {}
        for name, scene in self.scenes.items():
            given = ", ".join(f"{label_of(key)} {value:g}" for key, value in scene.values.items())
            found[f"scene {label_of(name)}"] = f"{given}, until {scene.until:g}"
        for name, levels in self.solvers.items():
            found[f"solver {label_of(name)}"] = ", ".join(f"{value:g}" for value in levels)
        return found | {"digits": str(self.digits), "cap": f"{self.cap:g} s"}

    def check_together(self, mistakes: Mistakes) -> None:
        for section in ("scenes", "solvers"):
            if not getattr(self, section):
                mistakes.add((section,), f"at least one of the {section} must be given")

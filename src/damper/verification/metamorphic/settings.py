"""Settings of a study of metamorphic tests: random runs that are made again in other ways."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Annotated, Any, ClassVar, Literal

from pydantic import Field

from damper.parameters.quantities import DIMENSIONLESS_NAMES, MODEL_NAMES
from damper.study.fields import NamedMapping
from damper.study.jobs import Job, shares
from damper.study.kinds import Kinds
from damper.study.messages import Mistakes
from damper.study.settings import Draws, check_drawn, draw_settings, drawn_of
from damper.verification import base

_NONE: dict[str, Any] = {}
FIGURES = Kinds(base.Made, "damper.verification.metamorphic.figures")
TABLES = Kinds(base.Made, "damper.verification.metamorphic.tables")


class Metamorphic(base.Verification):
    """Random runs made again: mirrored, later, in SI units, with other accuracies, with noise."""

    figure_kinds: ClassVar[Mapping[str, type[base.Made]]] = FIGURES
    table_kinds: ClassVar[Mapping[str, type[base.Made]]] = TABLES

    kind: Annotated[Literal["metamorphic"], Field(description="That it is such a study.")]
    sets: Annotated[
        dict[str, Draws],
        NamedMapping("set of runs", to="its draws"),
        Field(
            description="Name -> draws of dimensionless parameters and initial quantities, as in a "
            "study; every parameter without a default must be drawn."
        ),
    ]
    jobs: Annotated[
        int, Field(ge=1, le=1000, description="How many jobs share the runs of each set.")
    ] = 1
    figures: Annotated[
        dict[str, Annotated[base.Made, FIGURES]], NamedMapping("figure"), base.DRAWN
    ] = _NONE
    tables: Annotated[
        dict[str, Annotated[base.Made, TABLES]], NamedMapping("table"), base.TABULATED
    ] = _NONE

    @property
    def models(self) -> tuple[str, ...]:
        """Models of the damper that its runs ask for."""
        return base.models_of(name for draws in self.sets.values() for name in draws)

    @property
    def values(self) -> dict[str, str]:
        """What a page shows of the study's settings: name -> value."""
        return {name: f"{draws['count']} runs" for name, draws in self.sets.items()}

    def parts(self, engine: Mapping[str, Any]) -> dict[str, Job]:
        found = {}
        for name, draws in self.sets.items():
            settings = draw_settings(draws)
            for i, (first, end) in enumerate(shares(settings["count"], self.jobs)):
                if end > first:
                    job = {"draws": settings, "first": first, "end": end}
                    found[f"{name}~{i}"] = self._job("relations", job)
        return found

    def gathered(self, engine: Mapping[str, Any]) -> dict[str, Job]:
        about = {"attributes": self.attributes()}
        return {"cube.nc": self._job("cube", about, tuple(self.parts(engine)))}

    def _job(self, module: str, settings: dict[str, Any], needs: tuple[str, ...] = ()) -> Job:
        models = [f"damper.models.{name}" for name in ("rigid", *MODEL_NAMES) if name != "several"]
        loads = [f"{model}{part}" for model in models for part in ("", ".response", ".laws")]
        compiled = () if needs else ("metamorphic",)
        place = f"damper.verification.metamorphic.{module}"
        return Job(place, settings, needs, tuple(loads), compiled)

    def check_together(self, mistakes: Mistakes) -> None:
        if not self.sets:
            mistakes.add(("sets",), "no runs are given", "a name and its draws")
        for name, draws in self.sets.items():
            with mistakes.at("sets", name):
                check_drawn(draws, mistakes)
                if drawn_of(draws):
                    base.require(drawn_of(draws), mistakes, at=())
                for one in drawn_of(draws):
                    if one not in DIMENSIONLESS_NAMES:
                        mistakes.unknown((one,), "dimensionless quantity", one, DIMENSIONLESS_NAMES)
                    elif one in MODEL_NAMES["several"]:
                        mistakes.add((one,), "these relations know one free mass", "without it")

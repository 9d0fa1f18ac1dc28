"""Settings of a stress study: the engine on the corners of the box of parameters, and inside."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from itertools import pairwise
from math import prod
from typing import Annotated, Any, ClassVar, Literal

from pydantic import Field

from damper.parameters.quantities import MODEL_NAMES
from damper.parameters.variables import TIME
from damper.study.fields import Coordinate, NamedMapping, Pair, Some, Strict, Unit, one_of
from damper.study.jobs import Job
from damper.study.kinds import Kinds
from damper.study.messages import Mistakes
from damper.study.settings import Fixed
from damper.sweep.estimate import MOST_PERIODS
from damper.verification.base import (
    DIMENSIONLESS,
    DRAWN,
    TABULATED,
    Made,
    Verification,
    models_of,
    require,
    values_of,
)
from damper.verification.labels import label_of
from damper.verification.stress.box import STARTS

_NONE: dict[str, Any] = {}
MOST_RUNS = 10_000_000
"""More runs in one study are a slip of the pen."""

PartCount = Annotated[
    int,
    Field(ge=1, le=1000, description="How many jobs share the runs."),
]


class Corners(Strict):
    """Every combination of some values and starts."""

    parameters: Annotated[
        dict[str, Some[Coordinate]],
        NamedMapping("parameter", DIMENSIONLESS),
        Field(description="Dimensionless parameters, each with its values."),
    ]
    starts: Annotated[
        Some[Annotated[str, one_of(STARTS)]],
        Field(
            description="At rest in the centre; at rest on a wall; on a wall and into it; so as to "
            "graze a wall."
        ),
    ] = STARTS
    parts: PartCount = 1

    @property
    def count(self) -> int:
        """How many runs these are."""
        return prod(len(values) for values in self.parameters.values()) * len(self.starts)

    def check_together(self, mistakes: Mistakes) -> None:
        require(self.parameters, mistakes)


class Draw(Strict):
    """What a quantity may be in runs at random."""

    shorthand = "range"
    range: Annotated[
        Pair[Coordinate] | None,
        Field(description="Where it lies, uniform in its logarithm if above zero."),
    ] = None
    values: Annotated[
        Some[Coordinate] | None,
        Field(description="Values of which it takes one, always or in a share of the runs."),
    ] = None

    def check_together(self, mistakes: Mistakes) -> None:
        if self.range is None and self.values is None:
            mistakes.add((), "neither range nor values is given", "one of them, or both")


class Other(Strict):
    """Another model of the damper, in a share of the runs."""

    share: Annotated[float, Field(gt=0, lt=1, description="Part of the runs.")]
    parameters: Annotated[
        dict[str, Draw],
        NamedMapping("parameter", DIMENSIONLESS),
        Field(description="What it adds."),
    ]


class Random(Strict):
    """Runs at random."""

    runs: Annotated[int, Field(ge=1, le=MOST_RUNS, description="How many.")]
    seed: Annotated[int, Field(ge=0, description="Of the random numbers.")]
    share: Annotated[
        float,
        Field(
            ge=0, le=1, description="Part of the runs in which a quantity has one of its values."
        ),
    ] = 0.25
    parameters: Annotated[
        dict[str, Draw],
        NamedMapping("parameter", DIMENSIONLESS),
        Field(description="Dimensionless parameters, and initial quantities."),
    ]
    models: Annotated[
        dict[str, Other],
        NamedMapping("model", tuple(MODEL_NAMES)),
        Field(description="Other models than the rigid damper."),
    ] = _NONE
    metamorphic: Annotated[
        int,
        Field(
            ge=0,
            le=MOST_RUNS,
            description="How many of the runs, the first ones, are made again mirrored, a period "
            "later, in SI units, with other accuracies and from a start moved a little.",
        ),
    ] = 0
    parts: PartCount = 1

    def box(self) -> dict[str, Any]:
        """Return the box as `damper.verification.stress.box.random_points` reads it."""
        return self.model_dump(include={"share", "parameters", "models"}, exclude_none=True)

    def check_together(self, mistakes: Mistakes) -> None:
        require(self.parameters, mistakes)
        if self.metamorphic > self.runs:
            message = f"{self.metamorphic} of {self.runs} runs cannot be made again"
            mistakes.add(("metamorphic",), message, f"integer <= {self.runs}")
        if sum(other.share for other in self.models.values()) > 1.0:
            mistakes.add(("models",), "the shares add up to more than 1", "at most 1")


class Long(Strict):
    """A run over many periods."""

    periods: Annotated[
        int, Unit("forcing periods"), Field(ge=1, le=MOST_PERIODS, description="How many.")
    ]
    parameters: Annotated[
        dict[str, Fixed],
        NamedMapping("parameter", DIMENSIONLESS),
        Field(description="Dimensionless parameters, and initial quantities."),
    ]

    @property
    def values(self) -> dict[str, float]:
        """Value of every quantity that is given."""
        return values_of(self.parameters)

    def check_together(self, mistakes: Mistakes) -> None:
        require(self.parameters, mistakes)


FIGURES = Kinds(Made, "damper.verification.stress.figures")
TABLES = Kinds(Made, "damper.verification.stress.tables")


class Stress(Verification):
    """The engine on corners, edges and random places of the box of parameters."""

    entries: ClassVar[Mapping[str, type[Strict]]] = {
        "corners": Corners,
        "random": Random,
        "long_runs": Long,
    }
    figure_kinds: ClassVar[Mapping[str, type[Made]]] = FIGURES
    table_kinds: ClassVar[Mapping[str, type[Made]]] = TABLES

    kind: Annotated[Literal["stress"], Field(description="That it is such a study.")]
    periods: Annotated[
        int,
        Unit("forcing periods"),
        Field(ge=1, le=MOST_PERIODS, description="Length of the runs of corners and at random."),
    ]
    accuracy: Annotated[
        float,
        Unit(TIME),
        Field(
            ge=1e-15,
            le=1e-3,
            description="Largest error of the time at which a complete burst ends.",
        ),
    ] = 1e-12
    max_events: Annotated[
        int,
        Field(
            ge=1,
            description="Budget of a run, after which it stops: events, and hundreds "
            "of evaluations that find none.",
        ),
    ] = 100_000
    longest: Annotated[
        float | None,
        Unit(TIME),
        Field(gt=0, description="Longest run of a corner or at random; it ends with its period."),
    ] = None
    corners: Annotated[
        dict[str, Corners],
        NamedMapping("set of corners"),
        Field(description="Name -> values whose every combination is run."),
    ] = _NONE
    random: Annotated[
        dict[str, Random],
        NamedMapping("set of runs"),
        Field(description="Name -> runs at random."),
    ] = _NONE
    long_runs: Annotated[
        dict[str, Long],
        NamedMapping("run"),
        Field(description="Name -> a run over many periods."),
    ] = _NONE
    figures: Annotated[dict[str, Annotated[Made, FIGURES]], NamedMapping("figure"), DRAWN] = _NONE
    tables: Annotated[dict[str, Annotated[Made, TABLES]], NamedMapping("table"), TABULATED] = _NONE

    @property
    def models(self) -> tuple[str, ...]:
        """Models of the damper that its runs ask for."""
        sets: list[Any] = [*self.corners.values(), *self.random.values(), *self.long_runs.values()]
        sets += [other for some in self.random.values() for other in some.models.values()]
        return models_of(name for one in sets for name in one.parameters)

    @property
    def values(self) -> dict[str, str]:
        """What a page shows of the study's settings: name -> value."""
        found = {"periods": str(self.periods), "event budget": str(self.max_events)}
        for name, some in self.corners.items():
            found[f"corners {label_of(name)}"] = f"{some.count} runs"
        for name, draws in self.random.items():
            found[f"random {label_of(name)}"] = (
                f"{draws.runs} runs, {draws.metamorphic} with metamorphic tests"
            )
        for name, run in self.long_runs.items():
            found[f"long run {label_of(name)}"] = f"{run.periods} periods"
        return found

    def _sets(self) -> Iterator[tuple[str, str, dict[str, Any], int]]:
        """Yield the origin of some runs, the stem of their parts, what they are, and how many."""
        for name, some in self.corners.items():
            runs: dict[str, Any] = {"values": some.parameters, "starts": some.starts}
            yield f"corner {name}", f"corners_{name}", {"corners": runs}, some.parts
        for name, draws in self.random.items():
            runs = {"count": draws.runs, "seed": draws.seed, "box": draws.box()}
            yield f"random {name}", f"random_{name}", {"random": runs}, draws.parts

    def parts(self, engine: Mapping[str, Any]) -> dict[str, Job]:
        """Return the parts whose runs are checked, and those of the metamorphic tests."""
        usual = {"periods": self.periods, "longest": self.longest, "max_events": self.max_events}
        checks = {
            f"{stem}~{i}": runs | {"part": (i, count)} | usual
            for _, stem, runs, count in self._sets()
            for i in range(count)
        }
        checks |= {
            f"long_{name}": {"run": run.values, "periods": run.periods}
            for name, run in self.long_runs.items()
        }
        return {
            name: self._job("checks", settings | {"accuracy": self.accuracy})
            for name, settings in checks.items()
        } | {
            f"metamorphic/{name}": self._job("metamorphic", settings)
            for name, settings in self.metamorphic().items()
        }

    def gathered(self, engine: Mapping[str, Any]) -> dict[str, Job]:
        groups, about = self.groups(), {"attributes": self.attributes()}
        counts = {origin: len(parts) for origin, parts in groups.items()}
        checks = tuple(part for parts in groups.values() for part in parts)
        again = tuple(f"metamorphic/{name}" for name in self.metamorphic())
        return {
            "cube.nc": self._job("cube", {"groups": counts, **about}, checks),
            "metamorphic.nc": self._job("cube", about, again),
        }

    def _job(self, module: str, settings: dict[str, Any], needs: tuple[str, ...] = ()) -> Job:
        within = "damper.verification.stress"
        models = ("rigid", *MODEL_NAMES)
        loads = (
            *(f"damper.models.{model}" for model in models),
            *(f"damper.models.{model}.response" for model in models),
            *(f"damper.models.{model}.laws" for model in models),
        )
        compiled = () if needs or module == "cube" else ("checks",)
        return Job(f"{within}.{module}", settings, needs, loads, compiled)

    def groups(self) -> dict[str, list[str]]:
        """Return the parts that make one list of runs each, in order, by origin and name."""
        found = {
            origin: [f"{stem}~{i}" for i in range(count)] for origin, stem, _, count in self._sets()
        }
        return found | {f"long {name}": [f"long_{name}"] for name in self.long_runs}

    def metamorphic(self) -> dict[str, dict[str, Any]]:
        """Return every part of the metamorphic tests: name -> settings of its job."""
        found: dict[str, dict[str, Any]] = {}
        for name, draws in self.random.items():
            ends = [i * draws.metamorphic // draws.parts for i in range(draws.parts + 1)]
            for i, (first, end) in enumerate(pairwise(ends)):
                if end > first:
                    runs = {"count": end - first, "seed": draws.seed, "box": draws.box()}
                    found[f"{name}~{i}"] = {"runs": runs | {"first": first}}
        return found

    def check_together(self, mistakes: Mistakes) -> None:
        if not (self.corners or self.random or self.long_runs):
            mistakes.add((), "no runs are given", "corners, random or long_runs")

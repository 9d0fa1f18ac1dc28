"""What the studies have in common that check the engine itself: they make no cube of parameters."""

from __future__ import annotations

from collections.abc import Container, Iterable, Mapping
from typing import Annotated, ClassVar

from pydantic import Field

from damper.parameters.quantities import ALL, MODEL_NAMES, QUANTITIES, Quantity
from damper.study.fields import Strict, Text
from damper.study.messages import Mistakes
from damper.study.settings import Fixed
from damper.study.study_file import Made as Made
from damper.study.study_file import See as See
from damper.study.study_file import StudyFile
from damper.study.yaml_file import dump_yaml

OptionalCaption = Annotated[
    Text | None, Field(description="Heading; the study's title when not given.")
]


def require(
    given: Container[str],
    mistakes: Mistakes,
    quantities: Iterable[Quantity] = QUANTITIES,
    at: tuple[str, ...] = ("parameters",),
) -> None:
    """Note every parameter without a default that is not given."""
    for quantity in quantities:
        if quantity.default is None and quantity.name not in given:
            mistakes.add((*at, quantity.name), f"'{quantity.name}' is not given", quantity.allowed)


def values_of(parameters: Mapping[str, Fixed]) -> dict[str, float]:
    """Return the value of every quantity that is given, in its own unit."""
    return {name: parameters[name].number for name in ALL if name in parameters}


def models_of(names: Iterable[str]) -> tuple[str, ...]:
    """Return the models of the damper that quantities of these names may ask for."""
    given = set(names)
    return ("rigid", *(m for m, asking in MODEL_NAMES.items() if given.intersection(asking)))


DRAWN = Field(description="What to draw: name of the file -> kind and its settings.")
TABULATED = Field(description="What to tabulate: name of the file -> kind and its settings.")


class Verification(StudyFile):
    """A study that checks the engine."""

    entries: ClassVar[Mapping[str, type[Strict]]] = {}
    """Sections whose entries are mappings of their own -> the class of these."""
    figure_kinds: ClassVar[Mapping[str, type[Made]]] = {}
    table_kinds: ClassVar[Mapping[str, type[Made]]] = {}

    def attributes(self) -> dict[str, str]:
        """Return the attributes of a file of results; figures and tables do not change it."""
        left_out = {"figures", "tables"}
        written = dump_yaml(self.model_dump(mode="json", exclude_none=True, exclude=left_out))
        return {"title": self.title, "source": self.source, "study": written}

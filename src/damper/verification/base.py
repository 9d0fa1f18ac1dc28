"""What the studies have in common that check the engine itself: they make no cube of parameters."""

from __future__ import annotations

from collections.abc import Container, Iterable, Mapping
from pathlib import PurePosixPath
from typing import Annotated, Any, ClassVar

from pydantic import Field

from damper.parameters.quantities import ALL, INITIAL_QUANTITIES, QUANTITIES, Quantity
from damper.study.fields import Strict, Text
from damper.study.messages import Faults
from damper.study.settings import Fixed
from damper.study.study_file import StudyFile
from damper.study.yaml_file import dump_yaml

OptionalCaption = Annotated[
    Text | None, Field(description="Heading; the study's title when not given.")
]


#: Dimensionless parameters and initial quantities: errors of different runs stand side by side.
DIMENSIONLESS = tuple(quantity.name for quantity in (*QUANTITIES, *INITIAL_QUANTITIES))


def require(
    given: Container[str], faults: Faults, quantities: Iterable[Quantity] = QUANTITIES
) -> None:
    """Note every parameter without a default that is not given."""
    for quantity in quantities:
        if quantity.default is None and quantity.name not in given:
            loc = ("parameters", quantity.name)
            faults.add(loc, f"'{quantity.name}' is not given", quantity.allowed)


def values_of(parameters: Mapping[str, Fixed]) -> dict[str, float]:
    """Return the value of every quantity that is given."""
    return {name: parameters[name].value for name in ALL if name in parameters}


class Made(Strict):
    """A figure or a table of such a study."""

    reads: ClassVar[tuple[str, ...]] = ("cube.nc",)
    """Files of the study that it shows. What shows times lies in the folder of times, as they do:
    all else has the same bytes whenever it is made."""

    kind: Annotated[Text, Field(description="Which kind of figure or table this is.")]

    @property
    def folder(self) -> str:
        """``timed`` if times are in it, else nothing."""
        return "timed" if any(path.startswith("timed/") for path in self.reads) else ""

    def files(self, stem: str, study: Any) -> dict[str, dict[str, Any]]:
        """Return the stems of the files that are made, with the settings each is made with."""
        return {stem: self.model_dump(exclude_none=True)}


DRAWN = Field(description="What to draw: name of the file -> kind and its settings.")
TABULATED = Field(description="What to tabulate: name of the file -> kind and its settings.")


class Verification(StudyFile):
    """A study that checks the engine."""

    entries: ClassVar[Mapping[str, type[Strict]]] = {}
    """Sections whose entries are mappings of their own -> the class of these."""
    figure_kinds: ClassVar[Mapping[str, type[Made]]] = {}
    table_kinds: ClassVar[Mapping[str, type[Made]]] = {}
    has_cube: ClassVar[bool] = True
    """Whether it has results that are the same each time, in ``cube.nc``."""

    @property
    def values(self) -> dict[str, str]:
        """What a page shows of the study's settings: name -> value."""
        raise NotImplementedError

    def files(self, section: str) -> dict[str, tuple[Made, dict[str, Any]]]:
        """Return every file of a section.

        Parameters
        ----------
        section : {"figures", "tables"}

        Returns
        -------
        dict
            Path below the study's folder, without suffix -> the product and the settings that
            this file is made with.
        """
        found = {}
        made: Mapping[str, Made] = getattr(self, section)
        for name, one in made.items():
            for stem, settings in one.files(name, self).items():
                path = PurePosixPath(one.folder, section, stem)
                found[path.as_posix()] = one, settings
        return found

    def about(self) -> dict[str, Any]:
        """Return what a page shows of the study, as plain values; paths without suffix."""
        return {
            "name": self.name,
            "title": self.title,
            "source": self.source,
            "description": self.description or "",
            "values": [(name, text, "") for name, text in self.values.items()],
            "figures": [
                (f"{self.name}/{path}", product.kind, settings.get("caption") or self.title)
                for path, (product, settings) in self.files("figures").items()
            ],
            "tables": [
                (f"{self.name}/{path}", product.kind)
                for path, (product, _) in self.files("tables").items()
            ],
        }

    def attributes(self) -> dict[str, str]:
        """Return the attributes of a file of results; figures and tables do not change it."""
        left_out = {"figures", "tables"}
        written = dump_yaml(self.model_dump(mode="json", exclude_none=True, exclude=left_out))
        return {"title": self.title, "source": self.source, "study": written}

"""The base class of all study files in config/studies."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from pathlib import Path, PurePosixPath
from typing import Annotated, Any, ClassVar

from pydantic import Field, PrivateAttr

from damper.study.fields import Line, StrictModel, Text
from damper.study.jobs import Job
from damper.study.messages import Mistakes
from damper.study.yaml_file import dump_yaml

SUFFIXES = {"figures": ("svg", "png"), "tables": ("csv", "md")}
"""Section of a study -> suffixes of the files that each of its entries makes."""

See = Annotated[
    Text | None,
    Field(description="What to see in it, in a sentence or two, for the page of results."),
]


class ProductBase(StrictModel):
    """A figure or a table of a study."""

    reads: ClassVar[tuple[str, ...]] = ("cube.nc",)
    """Files of the study that it shows; empty for a schematic, which waits for no simulation. A
    figure that shows run times lies in the folder of times, so every other file has the same bytes
    whenever it is made."""

    kind: Annotated[Text, Field(description="Which kind of figure or table this is.")]

    @property
    def folder(self) -> str:
        """``timed`` if times are in it, else nothing."""
        return "timed" if any(path.startswith("timed/") for path in self.reads) else ""

    def files(self, stem: str, study: Any) -> dict[str, dict[str, Any]]:
        """Return the stems of the files that are made, with the settings each is made with."""
        return {stem: self.model_dump(exclude={"see"}, exclude_none=True)}


class StudyFile(StrictModel):
    """A study: its subject, the origins of its values, its figures and tables."""

    entries: ClassVar[Mapping[str, type[StrictModel]]] = {}
    """Sections whose entries are mappings of their own -> the class of these, for the reference."""
    figure_kinds: ClassVar[Mapping[str, type[ProductBase]]] = {}
    table_kinds: ClassVar[Mapping[str, type[ProductBase]]] = {}

    title: Annotated[Line, Field(description="What the study is about, for people.")]
    source: Annotated[Text, Field(description="Where its values come from, such as a paper.")]
    description: Annotated[
        Text | None, Field(description="What it shows, in as many words as it takes.")
    ] = None
    _name: str = PrivateAttr("")
    _folder: Path = PrivateAttr(Path())

    @property
    def name(self) -> str:
        """Stem of the study's file."""
        return self._name

    @property
    def values(self) -> Mapping[str, str]:
        """Settings of the study for a page: name -> value."""
        raise NotImplementedError

    @property
    def units(self) -> Mapping[str, str]:
        """Units in which a page shows the study's quantities: name -> unit."""
        return {}

    @property
    def origins(self) -> Mapping[str, str]:
        """Origins of the settings for a page: name -> remark."""
        return {}

    def check_files(self, mistakes: Mistakes) -> None:
        """Note what is wrong in files beside the study's, once its folder is known."""

    def products(self) -> Iterator[tuple[str, str, Any]]:
        """Yield the section, the name and the settings of every figure and table."""
        for section in SUFFIXES:
            for stem, settings in getattr(self, section, {}).items():
                yield section, stem, settings

    def files(self, section: str) -> dict[str, tuple[Any, dict[str, Any]]]:
        """Return every file of a section, "figures" or "tables".

        Path below the study's folder, without suffix -> the figure or table, and the settings that
        this file is made with.
        """
        return {
            PurePosixPath(product.folder, section, stem).as_posix(): (product, settings)
            for name, product in getattr(self, section, {}).items()
            for stem, settings in product.files(name, self).items()
        }

    def outputs(self) -> list[str]:
        """Return the paths of everything that is made of the study, below its folder."""
        return ["cube.nc"] + [
            f"{path}.{end}"
            for section, ends in SUFFIXES.items()
            for path in self.files(section)
            for end in ends
        ]

    def attributes(self) -> dict[str, str]:
        """Return the attributes of a file of results; figures and tables do not change it."""
        left_out = {"figures", "tables"}
        written = dump_yaml(self.model_dump(mode="json", exclude_none=True, exclude=left_out))
        return {"title": self.title, "source": self.source, "study": written}

    def parts(self, engine: Mapping[str, Any]) -> Mapping[str, Job]:
        """Return the parts of the study, a job each: name -> job. `engine` are settings of runs."""
        return {}

    def gathered(self, engine: Mapping[str, Any]) -> Mapping[str, Job]:
        """Return the files that are gathered from parts: path below the study's folder -> job."""
        return {}

    def timed(self) -> dict[str, Job]:
        """Return the files of times, whose jobs are to be alone on the machine."""
        return {}

    def about(self) -> dict[str, Any]:
        """Return what a page shows of the study, as plain values; paths without suffix."""
        return {
            "name": self.name,
            "title": self.title,
            "source": self.source,
            "description": self.description or "",
            "values": [
                (name, text, self.origins.get(name, "")) for name, text in self.values.items()
            ],
            "figures": [
                (
                    f"{self.name}/{path}",
                    product.kind,
                    self._caption(settings),
                    getattr(product, "see", None) or "",
                    product.model_dump(mode="json", exclude={"caption", "see", "mark_label"}),
                )
                for path, (product, settings) in self.files("figures").items()
            ],
            "tables": [
                (f"{self.name}/{path}", product.kind)
                for path, (product, _) in self.files("tables").items()
            ],
        }

    def _caption(self, settings: Mapping[str, Any]) -> str:
        # A schematic shows the model, not what the study's title says.
        drawing = settings.get("drawing", "").replace("_", " ")
        drawing = drawing and f"Model: {drawing}"
        units = self.units
        where = (
            f"{axis.replace('_', ' ')} {value:g} {units.get(axis, '')}".rstrip()
            if isinstance(value, float)
            else f"{axis} {value}"
            for axis, value in settings.get("at", {}).items()
        )
        return "; ".join([settings.get("caption") or drawing or self.title, *where])

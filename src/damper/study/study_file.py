"""What every file in config/studies has in common, whatever kind of study it is."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Annotated, Any

from pydantic import Field, PrivateAttr

from damper.study.fields import Strict, Text


class StudyFile(Strict):
    """A study: what it is about, and where its values come from."""

    title: Annotated[Text, Field(description="What the study is about, for people.")]
    source: Annotated[Text, Field(description="Where its values come from, such as a paper.")]
    description: Annotated[
        Text | None, Field(description="What it shows, in as many words as it takes.")
    ] = None
    _name: str = PrivateAttr("")

    @property
    def name(self) -> str:
        """Stem of the study's file."""
        return self._name

    def products(self) -> Iterator[tuple[str, str, Any]]:
        """Yield the section, the name and the settings of every figure and table."""
        for section in ("figures", "tables"):
            for stem, settings in getattr(self, section, {}).items():
                yield section, stem, settings

    def about(self) -> dict[str, Any]:
        """Return what a page shows of the study, as plain values; paths without suffix."""
        raise NotImplementedError

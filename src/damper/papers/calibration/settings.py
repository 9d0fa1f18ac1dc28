"""Settings that the figure and the table of a calibration share."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Annotated, Any

from pydantic import Field

from damper.papers.statements import SCORES
from damper.study.fields import NamedMapping, Some, Text, one_of
from damper.study.messages import Mistakes
from damper.study.products import Place, Product, StudyContents, check_listed, need_one_run


class Scores(Product):
    """What a table or figure of a calibration scores."""

    statements: Annotated[
        Some[Annotated[str, one_of(SCORES)]],
        Field(description="Statements of the papers that this study tests; they are joined."),
    ]
    also: Annotated[
        Annotated[
            dict[str, Text], NamedMapping("statement", tuple(SCORES), to="the study that tests it")
        ]
        | None,
        Field(
            description="More statements to join -> the studies that test them; these are to be "
            "among the studies of the configuration. Parameters that only the other study varies "
            "take their best values."
        ),
    ] = None
    preset: Annotated[
        Place | None,
        Field(
            description="Values of some axes whose place in the ranking is listed, exactly as the "
            "axes list them."
        ),
    ] = None

    @property
    def beside(self) -> Mapping[str, str]:
        """Statement -> the study that tests it."""
        return self.also or {}

    def others(self, results: Mapping[str, Any]) -> dict[str, Any]:
        """Statement -> the cube that it is tested on, of those that other studies test."""
        return {name: results[name] for name in self.beside}

    def check_together(self, mistakes: Mistakes) -> None:
        for name in self.beside:
            if name in self.statements:
                message = f"'{name}' is among the statements that this study tests"
                mistakes.add(("also", name), message, "each statement once")

    def check_against(self, study: StudyContents, mistakes: Mistakes) -> None:
        need_one_run(study, mistakes)
        for name in self.statements:
            self.check_beside(name, study, mistakes)
        about = {axis for name in self.statements for axis in SCORES[name].axes}
        if not mistakes and not set(study.axes) - about:
            message = "no axis is left whose values could be ranked"
            mistakes.add((), message, "an axis that no statement is about")
        for axis, value in (self.preset or {}).items():
            check_listed(("preset", axis), axis, value, study.axes, mistakes)

    def check_beside(self, what: str, study: StudyContents, mistakes: Mistakes) -> None:
        """Note what a study lacks to test the statement `what`."""
        statement = SCORES[what]
        for observer in statement.observers:
            if observer not in study.observers:
                mistakes.add((), f"{what} needs {observer} among the observers", observer)
        for axis, needed in statement.needs.items():
            if not needed.met(study.axes.get(axis, ())):
                mistakes.add((), f"{what} needs an axis {axis} with {needed.words}")

"""Basins of attraction: the share of initial conditions that end in each motion."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Annotated, Any, ClassVar

from pydantic import Field

from damper.analysis.basins import basin_fractions
from damper.analysis.labels import label_of
from damper.study.fields import Text
from damper.study.messages import Mistakes
from damper.study.products import Product, Role, StudyContents, require_starts
from damper.tables import Table, with_units


class Basins(Product):
    """The share of initial conditions that end in each motion, with confidence limits."""

    needs = ("motion",)
    roles: ClassVar[Mapping[str, Role]] = {"along": Role()}

    along: Annotated[
        Text | None, Field(description="Axis at each of whose values to count; none: all at once.")
    ] = None
    confidence: Annotated[float, Field(gt=0, lt=1, description="Of the limits.")] = 0.95

    def check_against(self, study: StudyContents, mistakes: Mistakes) -> None:
        super().check_against(study, mistakes)
        require_starts(study, mistakes, self.along)


def make(results: Mapping[str, Any], settings: Basins) -> Table:
    """Show the part of each motion."""
    cube = results["cube"]
    data = basin_fractions(cube, settings.along, settings.confidence)
    cells = data.map(lambda cell: f"{cell:.4g}" if isinstance(cell, float) else cell)
    if along := settings.along:
        cells = cells.rename(columns={along: with_units(label_of(along), cube[along])})
    text = (
        "Runs that end in each motion, of all that did not stop. The limits are Wilson's, of "
        f"{settings.confidence:.0%} confidence, as if the starts were drawn at random."
    )
    if stopped := int((cube.status != 0).sum()):
        text += f" {stopped} of {cube.status.size} runs stopped early (`status` in the cube)."
    return Table.of(cube, "basins of attraction", data, [text, cells])

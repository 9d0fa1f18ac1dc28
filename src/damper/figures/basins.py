"""Basins: the share of initial conditions that end in each motion, over one parameter."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from typing import Annotated, Any, ClassVar

from pydantic import Field

from damper.analysis.basins import basin_fractions
from damper.figures.common.layout import place_label
from damper.figures.common.panels import finish, note_empty_panel, panel_grid
from damper.figures.common.style import COLUMN, mirror_kind, motion_colours
from damper.parameters.lazy import Figure
from damper.study.fields import Text
from damper.study.messages import Mistakes
from damper.study.products import Caption, Product, Role, StudyContents, require_starts
from damper.study.study_file import See


class BasinsFigure(Product):
    """The share of initial conditions that end in each motion, stacked over one axis.

    All other axes and draws are starts.
    """

    needs = ("motion",)
    roles: ClassVar[Mapping[str, Role]] = {"along": Role(least=2)}

    along: Annotated[Text, Field(description="Axis of the abscissa.")]
    caption: Caption = None
    see: See = None

    def check_against(self, study: StudyContents, mistakes: Mistakes) -> None:
        super().check_against(study, mistakes)
        require_starts(study, mistakes, self.along)


def draw(results: Mapping[str, Any], settings: BasinsFigure) -> Figure:
    """Draw the share of initial conditions that end in each motion."""
    cube, along = results["cube"], settings.along
    found = basin_fractions(cube, along)
    parts = found.pivot(index=along, columns="motion", values="fraction")
    parts = parts[pairs_together(found.motion.unique())]
    figure, ((ax,),) = panel_grid(1, width=COLUMN, height=3.0 + 0.14 * len(parts.columns))
    # In steps: between two values nothing is known.
    style: dict[str, Any] = {"step": "mid", "edgecolor": "white", "lw": 0.4}
    colours = [*motion_colours(parts.columns).values()]
    areas = []
    if found.empty:
        note_empty_panel(ax)
    else:
        areas = ax.stackplot(parts.index, parts.T, colors=colours, labels=parts, **style)
    ax.set(ylim=(0.0, 1.0), ylabel="share of initial conditions")
    ax.set_xlim(cube[along].min(), cube[along].max())
    ax.set_xlabel(place_label(cube, along, COLUMN))
    remarks = [] if found.empty else [f"{found.of.max()} starts at each value"]
    # The legend has the order of the stack.
    return finish(figure, cube, settings.caption, reversed(areas), remarks)


def pairs_together(names: Iterable[str]) -> list[str]:
    """Put each motion beside its mirror image, at the place of the first of the two."""
    groups: dict[tuple[object, ...], list[str]] = {}
    for name in names:
        groups.setdefault(mirror_kind(name), []).append(name)
    return [name for group in groups.values() for name in group]

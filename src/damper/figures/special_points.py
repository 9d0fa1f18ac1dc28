"""Special points: where periodic motions change, as curves over two parameters."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Annotated, Any, ClassVar, Literal

import numpy as np
from pydantic import Field

from damper.figures.common.layout import place_text
from damper.figures.common.panels import finish, note_empty_panel, panel_grid, title
from damper.figures.common.style import COLUMN, axis_label
from damper.figures.overlays import Panels, draw_overlays, orbits
from damper.parameters.lazy import Artist, Figure, xr
from damper.study.fields import Text
from damper.study.messages import Mistakes
from damper.study.products import Caption, Product, StudyContents, require_orbits
from damper.study.study_file import See
from damper.study.yaml_file import join_names

_PANEL = 2.2
"""Height of a panel in inches."""


class SpecialPointsFigure(Product):
    """Curves of special points over two parameters, a panel for each place of the other axes."""

    reads: ClassVar[tuple[str, ...]] = ("orbits.nc",)

    x: Annotated[Text, Field(description="Parameter of the abscissa.")]
    y: Annotated[
        Text,
        Field(description="Parameter of the ordinate; curves of the study's orbits have both."),
    ]
    theory: Annotated[
        Literal["small_mass_limit"] | None,
        Field(
            description="Theory to draw over it: the restitution up to which bursts complete, in "
            "the limit of a small free mass; over restitution and clearance."
        ),
    ] = None
    caption: Caption = None
    see: See = None

    def check_against(self, study: StudyContents, mistakes: Mistakes) -> None:
        require_orbits((), study, mistakes)
        if not study.orbits:
            return
        pairs = [
            (entry.along, other)
            for entry in study.orbits.values()
            for ranges in entry.curves.values()
            for other in ranges
        ]
        over = f"{self.x} and {self.y}"
        if {self.x, self.y} not in [{*pair} for pair in pairs]:
            allowed = join_names(map(" and ".join, pairs)) if pairs else "curves in orbits"
            mistakes.add(("y",), f"the study follows no special points over {over}", allowed)
        elif self.theory and {self.x, self.y} != {"restitution", "clearance"}:
            message = f"the small-mass limit has no place over {over}"
            mistakes.add(("theory",), message, "restitution and clearance")


def draw(results: Mapping[str, Any], settings: SpecialPointsFigure) -> Figure:
    """Draw curves of special points, from what `damper.analysis.orbits.follow_orbits` found."""
    branches, x, y = results["orbits"], settings.x, settings.y
    panels = _panels(branches, x, y)
    rows = max(len(panels), 1)
    figure, grid = panel_grid(rows, width=COLUMN, height=1.0 + _PANEL * rows)
    axes = grid.ravel()
    handles: list[Artist] = []
    for ax, panel in zip(axes, panels, strict=False):
        ax.set(xlim=panel[x].values, ylim=panel[y].values)
        over = Panels({"curves": ax}, (x, y), panel, results)
        handles += orbits.overlay(over)
        handles += draw_overlays(over, settings.theory)
        if rows > 1:
            places = (
                place_text(panel, name, float(panel[name])) for name in _others(branches, x, y)
            )
            title(ax, ", ".join(places))
    if not panels:
        note_empty_panel(axes[0], "no such special point was found")
    for ax in axes:
        ax.set_ylabel(axis_label(y))
    axes[-1].set_xlabel(axis_label(x))
    # Of several panels, what they share.
    shown = panels[0] if len(panels) == 1 else branches.drop_vars([x, y], errors="ignore")
    return finish(figure, shown, settings.caption, handles)


def _others(branches: xr.Dataset, x: str, y: str) -> list[str]:
    """Axes of the study but these two."""
    axes = (str(name) for name in branches.data_vars if branches[name].attrs.get("axis"))
    return [name for name in axes if name not in (x, y)]


def _panels(branches: xr.Dataset, x: str, y: str) -> list[xr.Dataset]:
    """Places with curves: scalar coordinates, and the ends of x and y, which all share."""
    along = branches.along.values[branches.curve_branch.values]
    mine = np.array(
        [{*pair} == {x, y} for pair in zip(along, branches.curve_other.values, strict=True)], bool
    )
    if not mine.any():
        return []
    points = branches.isel(curve_point=mine[branches.curve.values])
    ends = {}
    for name in (x, y):
        array = points.curve_value if name == along[mine][0] else points.curve_other_value
        ends[name] = [float(array.min()), float(array.max())]
    others = _others(branches, x, y)
    rows = branches.curve_branch.values[mine].tolist()
    places = {tuple(float(branches[name][k]) for name in others): k for k in rows}
    fixed = {str(name): value for name, value in branches.coords.items() if value.ndim == 0}
    base = xr.Dataset(coords=fixed, attrs=branches.attrs)
    return [
        base.assign_coords({name: branches[name][k] for name in others} | ends)
        for k in places.values()
    ]

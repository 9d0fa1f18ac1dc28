"""Bifurcation diagrams: displacement and velocity on the section over one parameter."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from importlib import import_module
from typing import TYPE_CHECKING, Annotated, Any, ClassVar, Literal

import numpy as np
from pydantic import Field

from damper.analysis.intervals import chatter_in_range
from damper.analysis.runs import runs
from damper.figures import THEORY
from damper.figures.common.layout import head, legend, place_label, place_text, say, select
from damper.figures.common.style import (
    BLACK,
    BLUE,
    COLUMN,
    ORANGE,
    PAGE,
    SYMBOLS,
    VARIABLE_SYMBOLS,
    VERMILION,
    label,
)
from damper.study.fields import Pair, Some, Text, one_of
from damper.study.messages import Faults
from damper.study.products import (
    MOST_PANELS,
    SECTION_VARIABLES,
    At,
    Caption,
    Each,
    FigureSettings,
    Offer,
    Role,
    need_section,
)
from damper.study.settings import SECTIONS

if TYPE_CHECKING:
    import xarray as xr
    from matplotlib.artist import Artist
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure
    from matplotlib.transforms import ScaledTranslation

_CHATTER = {1: ("incomplete chatter", ORANGE), 2: ("complete chatter", BLUE)}
#: Direction -> colour, size and order of its points. Down lies beneath and is larger, so that a
#: rim of it shows where both agree, and it stands alone where they do not.
_DIRECTIONS: dict[str | None, tuple[str, float, float]] = {
    "up": (BLACK, 0.9, 2.1),
    "down": (VERMILION, 1.9, 2.0),
}
_SINGLE = (BLACK, 0.9, 2.0)
_LABELS: dict[str | None, str] = {"up": "continued upwards", "down": "continued downwards"}
#: Distance of the bars of both directions above the panels, in points.
_STRIPS: dict[str | None, float] = {"up": 9.0, "down": 3.0}
_BRACKET: dict[str, Any] = {"color": VERMILION, "lw": 0.9}


class Bifurcation(FigureSettings):
    """The section over one axis, with a row of panels for each value of a second one.

    Both directions of a continuation are drawn, and all random initial states over each other.
    """

    roles: ClassVar[Mapping[str, Role]] = {
        "along": Role(),
        "each": Role(),
        "rows": Role(most=MOST_PANELS),
    }
    overlays: ClassVar[bool] = True

    along: Annotated[Text, Field(description="Axis of the abscissa.")]
    each: Each = None
    rows: Annotated[
        Text | None, Field(description="Axis of whose values each makes a row of panels.")
    ] = None
    at: At = None
    variables: Annotated[
        Some[Annotated[str, one_of(SECTION_VARIABLES)]],
        Field(description="What is drawn, a panel each; one alone fits a printed column."),
    ] = SECTION_VARIABLES
    mark: Annotated[
        Pair[float] | None,
        Field(
            description="Part of the abscissa to mark by a bracket, such as a range that the "
            "source states; above the panels stands how far the chatter found agrees with it."
        ),
    ] = None
    mark_label: Annotated[Text | None, Field(description="What the mark is; with mark.")] = None
    theory: Annotated[
        Literal["two_impacts"] | None,
        Field(
            description="Theory to draw over it: the closed-form motion with two impacts per "
            "period, where it exists and where it is stable."
        ),
    ] = None
    caption: Caption = None

    def measured(self, observers: Mapping[str, dict[str, Any]]) -> dict[str, Any]:
        """Return the section, if theory is to be drawn on it."""
        if self.theory is None:
            return {}
        return {"section": {name: observers[name] for name in SECTIONS if name in observers}}

    @classmethod
    def needs(cls, settings: dict[str, Any], offer: Offer, faults: Faults) -> None:
        need_section(offer, faults)
        if "mark" in settings and "bursts" not in offer.observers:
            faults.add(("mark",), "needs bursts among the observers, to compare with", "bursts")

    @classmethod
    def relate(cls, data: dict[str, Any], model: Bifurcation | None, faults: Faults) -> None:
        if model is not None and (model.mark is None) != (model.mark_label is None):
            given, missing = ("mark", "mark_label") if model.mark else ("mark_label", "mark")
            allowed = "text" if model.mark else "[low, high], low < high"
            faults.add((missing,), f"'{given}' is given, but '{missing}' is missing", allowed)


def draw(
    cube: xr.Dataset,
    *,
    along: str,
    rows: str | None = None,
    at: Mapping[str, Any] | None = None,
    variables: Sequence[str] = SECTION_VARIABLES,
    mark: tuple[float, float] | None = None,
    mark_label: str | None = None,
    theory: str | None = None,
    section: Mapping[str, Mapping[str, Any]] | None = None,
    caption: str | None = None,
) -> Figure:
    """Draw displacement (left) and velocity (right) on the section over one axis.

    Both directions of a continuation are drawn in their own colours; random initial states are
    drawn over each other.

    Parameters
    ----------
    cube : xarray.Dataset
        With the variables; chatter ranges are marked if it has `chatter`.
    along : str
        Axis of the abscissa.
    rows : str, optional
        Axis whose values make one row of panels each.
    at : mapping, optional
        Value of every other axis.
    variables : sequence of str, optional
        One or both of `displacement` and `velocity`; one alone fits a printed column.
    mark : (float, float), optional
        Part of the abscissa to mark by a bracket. Above each row stands at which of the points
        within it there is chatter, and at which of those outside.
    mark_label : str, optional
        What the mark is, for the legend.
    theory : {"two_impacts"}, optional
        Draw the closed-form motion with two impacts per period over the points.
    section : mapping, optional
        The section's observer with its settings, which a cube does not hold; needed for `theory`.
    caption : str, optional
        Heading above the line of parameters; the cube's title when not given.

    Returns
    -------
    matplotlib.figure.Figure

    Raises
    ------
    ValueError
        When a range is marked and the cube has no `chatter` to compare it with.
    """
    from matplotlib.figure import Figure

    if mark is not None and "chatter" not in cube:
        raise ValueError("mark is compared with where chatter is found, but the cube has none")
    known = [name for name in (*variables, "chatter") if name in cube]
    own = [dim for dim in ("direction", "draw", "sample") if dim in cube.dims]
    keep = (along, rows, *(dim for dim in own if dim not in (at or {})))
    place = select(cube, known, at, keep)
    values = place[rows].values.tolist() if rows else [None]
    width = PAGE if len(variables) > 1 else COLUMN
    height = 1.1 + 1.55 * len(values)
    if mark is not None:
        height += 0.3 + 0.2 * len(values)
    figure = Figure(figsize=(width, height), layout="constrained")
    axes = figure.subplots(len(values), len(variables), sharex=True, squeeze=False)
    drawn: dict[str, Artist] = {}
    for row, value in zip(axes, values, strict=True):
        panel = place if value is None else place.sel({rows: value})
        for ax, name in zip(row, variables, strict=True):
            _points(ax, panel, along, name)
        _mark_chatter(row, panel, along)
        titles = [place_text(place, rows, value)] if rows else []
        if mark is not None:
            for ax in row:
                _bracket(ax, mark)
            titles.append(_agreement(panel, along, mark))
        if titles:
            style = {} if mark is None else {"fontsize": 7.0}
            row[0].set_title("\n".join(titles), loc="left", pad=_above(place), **style)
        if theory:
            for handle in import_module(THEORY[theory]).overlay(
                dict(zip(variables, row, strict=True)), panel, along, section or {}
            ):
                drawn[str(handle.get_label())] = handle
        for ax, name in zip(row, variables, strict=True):
            ax.set_ylabel(label(name, VARIABLE_SYMBOLS[name], place[name].attrs["units"]))
    for ax in axes[-1]:
        ax.set_xlabel(place_label(place, along, 0.8 * width / len(variables)))
    figure.get_layout_engine().set(wspace=0.06)  # type: ignore[union-attr, call-arg]
    figure.align_ylabels()
    head(figure, place, caption, remarks=_remarks(place, variables[0]))
    legend(figure, [*_handles(place, mark_label), *drawn.values()])
    return figure


def _bracket(ax: Axes, mark: tuple[float, float]) -> None:
    """Mark a part of the abscissa by a bracket along the panel's lower edge."""
    low, high = mark
    heights = [0.05, 0.015, 0.015, 0.05]
    ax.plot([low, low, high, high], heights, transform=ax.get_xaxis_transform(), **_BRACKET)


def _agreement(panel: xr.Dataset, along: str, mark: tuple[float, float]) -> str:
    """Say where chatter is found, and at how many points within the mark and outside it."""
    found = chatter_in_range(panel, along, *mark)
    if math.isnan(found["lowest"]):
        return "chatter found: none"
    return (
        f"chatter found: {SYMBOLS[along]} = {found['lowest']:g} to {found['highest']:g};\n"
        f"at {found['chatter_in_range']} of {found['in_range']} points in the marked range, "
        f"{found['chatter_outside']} of {found['outside']} outside"
    )


def _above(place: xr.Dataset) -> float | None:
    """Points that the strips of both directions need below a title."""
    return 14.0 if "direction" in place.dims and "chatter" in place else None


def _directions(panel: xr.Dataset) -> Iterator[tuple[str | None, xr.Dataset]]:
    """Each direction with its part of the cube; None where there are no directions."""
    if "direction" not in panel.dims:
        yield None, panel
        return
    for direction in panel.direction.values.tolist():
        yield direction, panel.sel(direction=direction)


def _points(ax: Axes, panel: xr.Dataset, along: str, name: str) -> None:
    grid = panel[along].values
    for direction, branch in _directions(panel):
        colour, size, order = _DIRECTIONS.get(direction, _SINGLE)
        samples = branch[name].transpose(along, ...).values.reshape(len(grid), -1)
        x = np.repeat(grid, samples.shape[1])
        # Rasterised: tens of thousands of vector points make files that no reader opens.
        ax.plot(
            x, samples.ravel(), ".", ms=size, mew=0.0, color=colour, zorder=order, rasterized=True
        )
    if len(grid) > 1:
        ax.set_xlim(grid.min(), grid.max())
    finite = panel[name].values[np.isfinite(panel[name].values)]
    if not finite.size:
        say(ax)
        return
    low, high = finite.min(), finite.max()
    margin = 0.06 * (high - low) or 0.1 * max(abs(high), 1.0)
    ax.set_ylim(low - margin, high + margin)


def _mark_chatter(row: np.ndarray, panel: xr.Dataset, along: str) -> None:
    """Mark chatter by bars along the upper edge, and by shading where there is one direction."""
    if "chatter" not in panel:
        return
    grid = panel[along].values
    middle = 0.5 * (grid[1:] + grid[:-1])
    edges = np.concatenate([grid[:1], middle, grid[-1:]])
    for direction, branch in _directions(panel):
        # Of random initial states, the one with the most chatter.
        chatter = branch.chatter.max([dim for dim in branch.chatter.dims if dim != along]).values
        for ax in row:
            if direction is not None:
                _strip(ax, direction)
            for kind, (_, colour) in _CHATTER.items():
                for first, last in runs(chatter == kind):
                    ends = (edges[first], edges[last + 1])
                    if direction is None:
                        ax.axvspan(*ends, color=colour, alpha=0.18, lw=0, zorder=0)
                    _bar(ax, ends, direction, colour, 3.0 if kind == 2 else 1.5)


def _bar(
    ax: Axes, ends: tuple[float, float], direction: str | None, colour: str, width: float
) -> None:
    ax.plot(
        ends,
        [1.0, 1.0],
        transform=ax.get_xaxis_transform() + _raised(ax, _STRIPS.get(direction, 0.0)),
        color=colour,
        lw=width,
        solid_capstyle="butt",
        clip_on=False,
    )


def _strip(ax: Axes, direction: str) -> None:
    """Name the strip in which a direction's bars lie."""
    ax.annotate(
        direction,
        (1.0, 1.0),
        (3.0, _STRIPS[direction]),
        xycoords="axes fraction",
        textcoords="offset points",
        color=_DIRECTIONS[direction][0],
        fontsize=6.0,
        va="center",
        annotation_clip=False,
    )


def _raised(ax: Axes, points: float) -> ScaledTranslation:
    from matplotlib.transforms import ScaledTranslation

    return ScaledTranslation(0.0, points / 72.0, ax.figure.dpi_scale_trans)


def _remarks(place: xr.Dataset, variable: str) -> list[str]:
    # "primary displacement once per forcing period" -> where the section lies
    section = place[variable].attrs.get("long_name", "").removeprefix(f"primary {variable} ")
    remarks = [f"{place.sizes['draw']} random initial states"] if "draw" in place.dims else []
    return remarks + ([f"section {section}"] if section else [])


def _handles(place: xr.Dataset, mark_label: str | None) -> list[Artist]:
    from matplotlib.lines import Line2D
    from matplotlib.patches import Patch

    handles: list[Artist] = [
        Line2D(
            [],
            [],
            ls="",
            marker=".",
            ms=2.0 + 2.0 * size,
            mew=0.0,
            color=colour,
            label=_LABELS[name],
        )
        for name, (colour, size, _) in _DIRECTIONS.items()
        if "direction" in place.dims and name in place.direction
    ]
    if "chatter" in place:
        handles += [
            Patch(color=colour, alpha=0.5 if not handles else 1.0, label=text)
            for text, colour in _CHATTER.values()
        ]
    if mark_label is not None:
        handles.append(Line2D([], [], label=mark_label, **_BRACKET))
    return handles

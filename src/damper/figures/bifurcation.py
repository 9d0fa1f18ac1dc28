"""Bifurcation diagrams: the section, approach speeds or amplitudes over one parameter."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from typing import TYPE_CHECKING, Annotated, Any, ClassVar, Literal

import numpy as np
from pydantic import Field

from damper.analysis.labels import label_of
from damper.analysis.runs import runs
from damper.analysis.stretches import half_gap_of
from damper.figures.common import layout, panels, style
from damper.figures.common.undamped import OVER, REFERENCE, undamped
from damper.figures.overlays import Panels, draw_overlays
from damper.parameters.lazy import Artist, Axes, Figure, xr
from damper.parameters.quantities import INITIAL_NAMES, quantities_in
from damper.parameters.units import units_of
from damper.parameters.variables import Chatter
from damper.study import products
from damper.study.fields import DistinctList, Pair, Text, one_of
from damper.study.messages import Mistakes
from damper.study.settings import SECTIONS
from damper.study.yaml_file import join_names
from damper.sweep.grid import geometric
from damper.sweep.idle import of_any_mass

if TYPE_CHECKING:
    from matplotlib.transforms import ScaledTranslation

#: Of the free mass between the walls, on the section.
_RELATIVE = ("relative_displacement", "relative_velocity")
#: With one value at each point.
_AMPLITUDES = ("peak_displacement", "rms_displacement")
#: With ordinates of their own nature logarithmic: chatter is a ladder, resonance a peak.
LOGARITHMIC = ("approach_speed", *_AMPLITUDES)
#: Of the study's orbits; the cube has none.
_MULTIPLIER = "multiplier"
_MEANINGS = {
    "relative_displacement": "relative displacement\n",
    "relative_velocity": "relative velocity\n",
    "approach_speed": "approach speed\n",
    "peak_displacement": "largest displacement\n",
    "rms_displacement": "rms displacement\n",
    _MULTIPLIER: "size of the multipliers\n",
}
_DRAWN = (*products.SECTION_VARIABLES, *_RELATIVE, *LOGARITHMIC, _MULTIPLIER)
_CHATTER = {
    Chatter.INCOMPLETE: ("incomplete chatter", style.ORANGE),
    Chatter.COMPLETE: ("complete chatter", style.BLUE),
}
#: Direction -> colour, size and order of its points. Down lies beneath and is larger, so that a
#: rim of it shows where both agree, and it stands alone where they do not.
_DIRECTIONS: dict[str | None, tuple[str, float, float]] = {
    "up": (style.BLACK, 0.9, 2.1),
    "down": (style.SKY, 1.9, 2.0),
}
_SINGLE = (style.BLACK, 0.9, 2.0)
#: Amplitudes have one point at each place: larger ones, and not joined, for between two places the
#: motion may jump.
_LARGER = 1.8
#: Distance of the bars of both directions above the panels, in points.
_STRIPS: dict[str | None, float] = {"up": 9.0, "down": 3.0}
_BRACKET: dict[str, Any] = {"color": style.THEORY, "lw": 0.9}


class Bifurcation(products.FigureSettings):
    """The section over one axis, with a row of panels for each value of a second one.

    The directions of a continuation and the draws are drawn over each other.
    """

    roles: ClassVar[Mapping[str, products.Role]] = {
        "along": products.Role(),
        "each": products.Role(),
        "rows": products.Role(most=products.MOST_PANELS),
    }
    overlays: ClassVar[bool] = True
    marks_chatter: ClassVar[bool] = True

    along: Annotated[Text, Field(description="Axis of the abscissa.")]
    each: products.Each = None
    rows: Annotated[
        Text | None, Field(description="Axis of whose values each makes a row of panels.")
    ] = None
    at: products.At = None
    variables: Annotated[
        DistinctList[Annotated[str, one_of(_DRAWN)]],
        Field(
            description="What is drawn, a panel each; one alone fits a printed column. The "
            "relative displacement is over the clearance, so that the walls are at -1 and 1. "
            "Chatter shows in relative motion and approach speeds rather than in the primary's "
            "motion. multiplier: sizes of the multipliers of the orbits that are drawn, all of "
            "which are below 1 where the motion is stable."
        ),
    ] = products.SECTION_VARIABLES
    mark: Annotated[
        Pair[float] | None,
        Field(
            description="Part of the abscissa to mark by a bracket, such as a range that the "
            "source states; the table intervals says how far the chatter found agrees with it."
        ),
    ] = None
    mark_label: Annotated[Text | None, Field(description="What the mark is; with mark.")] = None
    theory: Annotated[
        Literal["two_impacts", "ball_on_table"] | None,
        Field(
            description="Theory to draw over it: the closed-form motion with two impacts per "
            "period, where it exists and where it is stable. Or the stable motions of a ball on an "
            "oscillating table, over approach speeds."
        ),
    ] = None
    orbits: Annotated[
        bool,
        Field(description="Whether to draw the study's orbits over it, with their special points."),
    ] = False
    about_orbits: Annotated[
        bool,
        Field(
            description="Whether displacement and velocity are shown about those of the stable "
            "orbits, where chaos reaches several times as far; with orbits."
        ),
    ] = False
    interactive: products.Interactive = False
    caption: products.Caption = None

    @property
    def knows(self) -> tuple[str, ...]:  # type: ignore[override]
        """Quantities that its theory knows."""
        if self.theory != "ball_on_table":
            return super().knows
        from damper.theory.ball_on_table import KNOWN

        return KNOWN

    @property
    def reads(self) -> tuple[str, ...]:  # type: ignore[override]
        """Files of the study that it shows."""
        return ("cube.nc", "orbits.nc") if self.orbits else ("cube.nc",)

    def check_against(self, study: products.StudyContents, mistakes: Mistakes) -> None:
        super().check_against(study, mistakes)
        self._require_variables(study, mistakes)
        if self.orbits:
            products.require_orbits(("orbits",), study, mistakes)

    def _require_variables(self, study: products.StudyContents, mistakes: Mistakes) -> None:
        shown = set(self.variables)
        if self.orbits or shown & {*products.SECTION_VARIABLES, *_RELATIVE}:
            products.need(study, mistakes, SECTIONS)
        if shown & set(_AMPLITUDES):
            products.need(study, mistakes, "response")
        if "approach_speed" in shown and not study.asks("impacts", "speeds"):
            message = "needs impacts that lists them among the observers, for approach_speed"
            mistakes.add(("variables",), message, "impacts: {speeds: 60}")
        relative = join_names(name for name in _RELATIVE if name in shown)
        if shown & set(_RELATIVE) and not any(study.asks(name, "free_mass") for name in SECTIONS):
            message = f"needs a section that holds the free mass as well, for {relative}"
            mistakes.add(("variables",), message, f"{SECTIONS[0]}: {{free_mass: true}}")

    def check_together(self, mistakes: Mistakes) -> None:
        if _MULTIPLIER in self.variables and not self.orbits:
            message = "'multiplier' is of the study's orbits, which are not drawn"
            mistakes.add(("variables",), message, "orbits: true")
        if self.about_orbits and not self.orbits:
            message = "no orbits are drawn, about which to show the motion"
            mistakes.add(("about_orbits",), message, "orbits: true")
        if self.theory == "ball_on_table" and "approach_speed" not in self.variables:
            message = "the motions of a ball on a table have a place over its approach speeds"
            mistakes.add(("variables",), message, "[approach_speed]")
        if (self.mark is None) != (self.mark_label is None):
            given, missing = ("mark", "mark_label") if self.mark else ("mark_label", "mark")
            allowed = "text" if self.mark else "[low, high], low < high"
            mistakes.add((missing,), f"'{given}' is given, but '{missing}' is missing", allowed)


def draw(results: Mapping[str, Any], settings: Bifurcation) -> Figure:
    """Draw variables over one axis, a column of panels each.

    The directions of a continuation have a colour each; random initial states are drawn over each
    other.
    """
    place, variables = _shown(results["cube"], settings), settings.variables
    rows = panels.parts(place, settings.rows)
    width = style.PAGE if len(variables) > 1 else style.COLUMN
    height = 1.1 + 1.55 * len(rows)
    figure, axes = panels.panel_grid(len(rows), len(variables), width=width, height=height)
    handles = _handles(place, variables, settings.mark_label)
    for row, (text, panel) in zip(axes, rows, strict=True):
        for ax, name in zip(row, variables, strict=True):
            _points(ax, panel, settings.along, name)
        _mark_chatter(row, panel, settings.along)
        _title(row, text, panel, settings)
        shown = dict(zip(variables, row, strict=True))
        over = Panels(shown, (settings.along,), panel, results, settings.about_orbits)
        handles += draw_overlays(over, settings.theory, settings.orbits)
        for ax, name in zip(row, variables, strict=True):
            ax.set_ylabel(_ordinate(place, name))
    for ax in axes[-1]:
        ax.set_xlabel(layout.place_label(place, settings.along, 0.8 * width / len(variables)))
    figure.get_layout_engine().set(wspace=0.06)  # type: ignore[union-attr, call-arg]
    remarks = _remarks(place, variables)
    if settings.about_orbits:
        remarks.append("about stable motions")
    return panels.finish(figure, place, settings.caption, handles, remarks, room=3)


def _shown(cube: xr.Dataset, settings: Bifurcation) -> xr.Dataset:
    """Return the piece of a cube to show."""
    cube = with_relative(cube, settings.variables)
    marked = [name for name in ("chatter", "status") if name in cube]
    if "chatter" in cube and "body" not in (settings.at or {}):
        cube = cube.assign(chatter=of_any_mass(cube.chatter))
    beside = [OVER[name] for name in settings.variables if name in OVER]
    known = [*(name for name in settings.variables if name != _MULTIPLIER), *marked]
    known += [name for name in beside if name in cube]
    there = cube[[name for name in known if name in cube]].dims
    own = [dim for dim in ("direction", "draw", "sample", "impact") if dim in there]
    kept = (dim for dim in own if dim not in (settings.at or {}))
    return layout.select(cube, known, settings.at, (settings.along, settings.rows, *kept))


def _title(row: np.ndarray, text: str, panel: xr.Dataset, settings: Bifurcation) -> None:
    """Say at which place a row is, and mark a range."""
    look = {"pad": 14.0} if "direction" in panel.dims and "chatter" in panel else {}
    if settings.mark is not None:
        for ax in row:
            _bracket(ax, settings.mark)
    panels.title(row[0], text, **look)


def _ordinate(place: xr.Dataset, name: str) -> str:
    symbol = style.VARIABLE_SYMBOLS[name]
    if name == "relative_displacement" and "gap" in place.coords:
        symbol = "$(y - x)/D$"
    meaning = _MEANINGS.get(name, label_of(name))
    return style.label(meaning, symbol, "1" if name == _MULTIPLIER else units_of(place[name].attrs))


def with_relative(cube: xr.Dataset, variables: Sequence[str]) -> xr.Dataset:
    """Return the cube with the relative motion that is asked for, over the clearance."""
    if not set(_RELATIVE) & set(variables):
        return cube
    if "free_displacement" not in cube:
        raise ValueError("the section has no free mass: give it free_mass: true")
    if "body" in cube.free_displacement.dims:
        half: Any = sum(half_gap_of(cube, k) * (cube.body == k) for k in cube.body.values)
    else:
        half = half_gap_of(cube, int(cube.coords.get("body", 0)))
    between = (cube.free_displacement - cube.displacement) / half.where(half > 0.0)
    velocity = cube.free_velocity - cube.velocity
    name = {"long_name": cube.displacement.attrs.get("long_name", "")}
    # Not assign_attrs: a difference may have kept what its terms are scaled by.
    between.attrs = name | {"units": "1"}
    velocity.attrs = name | {"units": units_of(cube.velocity.attrs)}
    return cube.assign(relative_displacement=between, relative_velocity=velocity)


def _bracket(ax: Axes, mark: tuple[float, float]) -> None:
    """Mark a part of the abscissa by a bracket along the panel's lower edge."""
    low, high = mark
    heights = [0.05, 0.015, 0.015, 0.05]
    ax.plot([low, low, high, high], heights, transform=ax.get_xaxis_transform(), **_BRACKET)


def _directions(panel: xr.Dataset) -> Iterator[tuple[str | None, xr.Dataset]]:
    """Each direction with its part of the cube; None where there are no directions."""
    here = panel.direction.values.tolist() if "direction" in panel.dims else [None]
    yield from ((name, panel.sel(direction=name) if name else panel) for name in here)


def _points(ax: Axes, panel: xr.Dataset, along: str, name: str) -> None:
    grid = panel[along].values
    if geometric(grid):
        ax.set_xscale("log")
    if len(grid) > 1:
        ax.set_xlim(grid.min(), grid.max())
    layout.few_decades(ax)
    if name == _MULTIPLIER:
        ax.axhline(1.0, color=style.BLACK, lw=0.6)
        ax.set_ylim(0.0, 2.0)
        return
    for direction, branch in _directions(panel):
        colour, size, order = _DIRECTIONS.get(direction, _SINGLE)
        samples = branch[name].transpose(along, ...).values.reshape(len(grid), -1)
        size *= _LARGER if name in _AMPLITUDES else 1.0
        x = np.repeat(grid, samples.shape[1])
        # Rasterised: tens of thousands of vector points make files that no reader opens.
        ax.plot(
            x, samples.ravel(), ".", ms=size, mew=0.0, color=colour, zorder=order, rasterized=True
        )
    shown = panel[name].values
    if OVER.get(name) in panel:
        alone = undamped(panel, name, along).values
        ax.plot(grid, alone, zorder=1.0, **REFERENCE)
        shown = np.append(shown, alone)
    finite = shown[np.isfinite(shown)]
    if not finite.size:
        panels.note_empty_panel(ax)
        return
    if name in LOGARITHMIC and (finite := finite[finite > 0.0]).size:
        ax.set_yscale("log")
        ax.set_ylim(finite.min() / 1.2, finite.max() * 1.2)
        layout.few_decades(ax)
        return
    low, high = finite.min(), finite.max()
    margin = 0.06 * (high - low) or 0.1 * max(abs(high), 1.0)
    ax.set_ylim(low - margin, high + margin)


def _mark_chatter(row: np.ndarray, panel: xr.Dataset, along: str) -> None:
    """Mark chatter by bars along the upper edge, and by shading where there is one direction."""
    if "chatter" not in panel:
        return
    grid = panel[along].values
    borders = np.concatenate([grid[:1], layout.edges(grid)[1:-1], grid[-1:]])
    for direction, branch in _directions(panel):
        # Of several draws, the one with the most chatter.
        chatter = branch.chatter.max([dim for dim in branch.chatter.dims if dim != along]).values
        for ax in row:
            if direction is not None:
                _strip(ax, direction)
            for kind, (_, colour) in _CHATTER.items():
                for first, last in runs(chatter == kind):
                    ends = (borders[first], borders[last + 1])
                    if direction is None:
                        ax.axvspan(*ends, color=colour, alpha=0.18, lw=0, zorder=0)
                    _bar(ax, ends, direction, colour, 3.0 if kind == Chatter.COMPLETE else 1.5)


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


def _remarks(place: xr.Dataset, variables: Sequence[str]) -> list[str]:
    remarks = []
    if "draw" in place.dims:
        drawn = [n for n in quantities_in(place.coords) if place[n].dims == ("draw",)]
        what = "initial states" if set(drawn) <= {*INITIAL_NAMES} else "draws"
        remarks += [f"{place.sizes['draw']} random {what}"]
    remarks += layout.idle(place)
    sampled = [name for name in variables if name not in (*LOGARITHMIC, _MULTIPLIER)]
    return remarks + (layout.section_text(place[sampled[0]]) if sampled else [])


def _handles(place: xr.Dataset, variables: Sequence[str], mark_label: str | None) -> list[Artist]:
    handles = []
    for name, (colour, size, _) in _DIRECTIONS.items():
        look = {"ls": "", "marker": ".", "mew": 0.0, "ms": 2.0 + 2.0 * size}
        if name in place.get("direction", ()):
            handles.append(panels.legend_line(f"continued {name}wards", color=colour, **look))
    shade = 1.0 if handles else 0.5
    if "chatter" in place:
        handles += [
            panels.legend_patch(text, color=c, alpha=shade) for text, c in _CHATTER.values()
        ]
    if mark_label is not None:
        handles.append(panels.legend_line(mark_label, **_BRACKET))
    if any(OVER.get(name) in place for name in variables):
        handles.append(panels.legend_line("without damper", **REFERENCE))
    return handles

"""Curves: variables over one parameter, a line for each value of another."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Annotated, Any, ClassVar

import numpy as np
from pydantic import Field

from damper.analysis.optimum import SAME
from damper.analysis.reduction import BEST, MEDIAN, REDUCTIONS, least, reduced, runs_over
from damper.figures.common import layout, panels
from damper.figures.common.style import BLACK, BLUE, COLUMN, RATIOS, SYMBOLS, label, shades
from damper.figures.common.undamped import OVER, REFERENCE, undamped
from damper.parameters.lazy import Artist, Axes, Figure, xr
from damper.study import products
from damper.study.fields import DistinctList, Text
from damper.study.messages import Mistakes
from damper.sweep.grid import geometric

_DASHES = ("-", "--", "-.", ":")
_PANEL = 1.75
"""Height of a panel in inches."""
_ABSCISSA = 2.1
"""Inches about the middle of a panel that a label has before it is cut off on the right."""


class Curves(products.FigureSettings):
    """Variables over one axis, each in a panel of its own, with a line for each value of another.

    Amplitudes have that without damper beside them, their ratios a thin line at 1. An axis that is
    free to choose has a panel of its own.
    """

    roles: ClassVar[Mapping[str, products.Role]] = {
        "along": products.Role(least=2),
        "lines": products.Role(most=products.MOST_LINES, branches=True),
        "panels": products.Role(most=products.MOST_PANELS),
        "each": products.Role(),
        "best": products.Role(),
        **products.REDUCTIONS,
    }

    variables: Annotated[
        DistinctList[Text],
        Field(
            description="Variables of the cube, each with one value at each point; a panel each, "
            f"{products.MOST_VARIABLES} at most."
        ),
    ]
    along: Annotated[Text, Field(description="Axis of the abscissa.")]
    lines: Annotated[
        Text | None,
        Field(
            description="Axis, or direction or draw, of whose values each makes a line; "
            f"{products.MOST_LINES} at most."
        ),
    ] = None
    panels: Annotated[
        Text | None,
        Field(description="Axis of whose values each makes a panel of its own; with one variable."),
    ] = None
    each: products.Each = None
    at: products.At = None
    best: Annotated[
        Text | None,
        Field(
            description="Axis that is set, for each line, to the value at which the greatest "
            "value of the first variable along the abscissa is least, of those at which all runs "
            "finished."
        ),
    ] = None
    worst: products.Worst = None
    band: products.Band = None
    share: products.Share = None
    above: products.Above = None
    natural_frequency: Annotated[
        bool,
        Field(
            description="Whether the abscissa, which is the stiffness then, is drawn as the "
            "primary's natural frequency in Hz: a response spectrum under a shock or record."
        ),
    ] = False
    choose: products.Choose = None
    log: Annotated[bool, Field(description="Whether ordinates are logarithmic.")] = False
    slope: Annotated[
        float | None,
        Field(
            description="Exponent of a power law to draw beneath the lines as a guide; with log."
        ),
    ] = None
    caption: products.Caption = None

    def check_against(self, study: products.StudyContents, mistakes: Mistakes) -> None:
        super().check_against(study, mistakes)
        for i, name in enumerate(self.variables):
            products.check_written(("variables", i), name, study, mistakes)
        if self.natural_frequency and "primary_mass" in study.dimensions:
            message = "one natural frequency of a stiffness needs one primary_mass, which varies"
            mistakes.add(("natural_frequency",), message, "false")

    def check_together(self, mistakes: Mistakes) -> None:
        if self.natural_frequency and (self.along != "stiffness" or self.best):
            message = f"along is {self.along}" if self.along != "stiffness" else "best is given"
            mistakes.add(("natural_frequency",), message, "along: stiffness, without best")
        products.check_reduction(self.variables, self, mistakes)
        if self.slope is not None and not self.log:
            mistakes.add(("slope",), "no power law is a line over these ordinates", "log: true")
        if len(self.variables) > products.MOST_VARIABLES:
            message = f"{len(self.variables)} variables are too many for one figure"
            mistakes.add(("variables",), message, f"at most {products.MOST_VARIABLES}")
        if self.panels is not None and len(self.variables) > 1:
            message = f"{len(self.variables)} variables have panels already"
            mistakes.add(("panels",), message, "one variable, or no panels")


def draw(results: Mapping[str, Any], settings: Curves) -> Figure:
    """Draw variables over one axis, one panel each."""
    cube = results["cube"]
    place, variables = _shown(cube, settings)
    if settings.natural_frequency:
        natural = np.sqrt(place.stiffness.values / place.primary_mass.item()) / (2.0 * np.pi)
        place = place.assign_coords(stiffness=natural)
    figure, shown = _panels(place, variables, settings)
    if settings.natural_frequency:
        text = label("natural frequency", r"$\sqrt{K/M} / (2\pi)$", "Hz")
        for ax in figure.axes:
            ax.set_xlabel(text if ax.get_xlabel() else "")
    of = f"worst of {runs_over(cube, settings.band)}" if settings.band else ""
    handles: list[Artist] = []
    for ax, text, part, name in shown:
        drawn = _lines(part, variables[0], settings, of)
        if settings.panels and not settings.lines:  # there is one line: the title says what it is
            text = ", ".join(filter(None, (text, drawn[0][1].pop("label"))))
        panels.title(ax, text)
        ends = [_draw_line(ax, line, name, style, settings) for line, style in drawn]
        if name + _UNDAMPED in part:
            alone = part[name + _UNDAMPED]
            own = settings.lines in alone.dims
            for line, style in drawn if own else [(part, REFERENCE)]:
                look = REFERENCE | {"color": style["color"], "alpha": 0.4 if own else 1.0}
                x = line[settings.along].values
                ax.plot(x, line[alone.name].values, zorder=1.0, **look)
        _dress(ax, part, name, settings.along, settings.log)
        if settings.slope is not None:
            _guide(ax, part[settings.along].values, settings.slope)
        if settings.lines and not settings.panels:
            values = part[settings.lines].values.tolist()
            names = [layout.place_text(part, settings.lines, value) for value in values]
            panels.label_ends(ax, ends, names, _PANEL)
            drawn = drawn if settings.best else []
        handles += [panels.legend_line(**style) for _, style in drawn if style.get("label")]
    handles += _handles(of, place, variables, settings)
    if settings.slope is not None:
        handles.append(panels.legend_line(f"slope {settings.slope:g}", **_GUIDE))
    remarks = layout.reductions(cube, settings) + layout.idle(cube)
    if settings.best:
        remarks.append("best: lowest peak over the band")
    return panels.finish(figure, place, settings.caption, handles, remarks, room=3)


def _guide(ax: Axes, x: np.ndarray, slope: float) -> None:
    """Draw a power law just beneath the lowest line."""
    shown = np.vstack([np.asarray(line.get_xydata(), float) for line in ax.lines])
    ratios = shown[:, 1] / shown[:, 0] ** slope
    if np.isfinite(ratios).any():
        ax.plot(x, 0.8 * np.nanmin(ratios) * x**slope, **_GUIDE)


def _panels(
    place: xr.Dataset, variables: Sequence[str], settings: Curves
) -> tuple[Figure, list[tuple[Axes, str, xr.Dataset, str]]]:
    """Return a figure and its panels: title, piece of the cube, and variable of each."""
    along = settings.along
    if settings.panels is None:
        names = [*variables, *(settings.choose or ())]
        figure, grid = panels.panel_grid(len(names), width=COLUMN, height=1.0 + _PANEL * len(names))
        for ax, name in zip(grid.flat, names, strict=True):
            ax.set_ylabel(_ordinate(place, name))
        grid[-1, 0].set_xlabel(layout.place_label(place, along, _ABSCISSA))
        return figure, [(ax, "", place, name) for ax, name in zip(grid.flat, names, strict=True)]
    shown = panels.parts(place, settings.panels)
    figure, axes = panels.wrapped_panels(len(shown), _HEIGHTS, rest=1.0)
    width, height = (0.9 * size for size in panels.panel_size(axes, _HEIGHTS))
    ordinate = layout.variable_label(place[variables[0]], height)
    panels.label_outer(axes, layout.place_label(place, along, width), ordinate)
    return figure, [(ax, *part, variables[0]) for ax, part in zip(axes, shown, strict=True)]


def _draw_line(
    ax: Axes, line: xr.Dataset, name: str, style: Mapping[str, Any], settings: Curves
) -> Artist:
    """Draw one line, which is returned, the band from it to the best runs, and its peak."""

    def ordinates(of: str) -> np.ndarray:
        return _ordinates(line[of], settings.along, settings.log)

    x, y = line[settings.along].values, ordinates(name)
    if settings.best and name == settings.variables[0] and np.isfinite(y).any():
        highest = np.nanargmax(y)
        ax.plot(x[highest], y[highest], **_WORST | {"color": style["color"]})
    beside = [name + of for of in (BEST, MEDIAN) if name + of in line]
    x, y, *others = _parted(settings.log, x, y, *map(ordinates, beside))
    (drawn,) = ax.plot(x, y, **style)
    # Beside one black line a colour is seen better than grey; among several a median is lost.
    for of, other in zip(beside, others, strict=True):
        if of == name + BEST:
            colour = style["color"] if settings.lines else BLUE
            ax.fill_between(x, other, y, color=colour, **_BAND)
        elif not settings.lines:
            ax.plot(x, other, **_MEDIAN)
    return drawn


def _parted(log: bool, x: np.ndarray, y: np.ndarray, *others: np.ndarray) -> list[np.ndarray]:
    """Part lines where the first, y, jumps from one motion to another: nothing is known between."""
    heights = np.where(np.isfinite(y), np.log(y) if log else y, np.nan)
    places = layout.jumps(heights, _JUMP, _LEAST_JUMP)
    return [np.insert(np.asarray(each, float), places, np.nan) for each in (x, y, *others)]


def _handles(
    of: str, place: xr.Dataset, variables: Sequence[str], settings: Curves
) -> list[Artist]:
    """Entries of the legend beside the values of lines."""
    handles = []
    if variables[0] + BEST in place:
        colour = BLACK if settings.lines else BLUE
        if settings.lines or settings.panels or not settings.best:
            handles.append(panels.legend_line(of, **_SINGLE))
        if variables[0] + MEDIAN in place and not settings.lines:
            handles.append(panels.legend_line("their median", **_MEDIAN))
        handles.append(panels.legend_patch("their best to their worst", color=colour, **_BAND))
    names = [
        n for n in variables if n + _UNDAMPED in place and place[n + _UNDAMPED].notnull().any()
    ]
    if names or any(name in RATIOS for name in variables):
        if not (settings.lines or settings.band or settings.best or settings.panels):
            handles.append(panels.legend_line("with damper", **_SINGLE))
        own = any(settings.lines in place[n + _UNDAMPED].dims for n in names)
        text = "without damper" + ", in the colours of the lines" * own
        handles.append(panels.legend_line(text, **REFERENCE))
    if settings.best is not None:
        handles.append(panels.legend_line("where a line is highest", **_WORST))
    return handles


def _ordinate(place: xr.Dataset, name: str) -> str:
    if name in SYMBOLS:
        return "best " + layout.place_label(place, name, 0.72 * _PANEL)
    return layout.variable_label(place[name], 0.72 * _PANEL)


def _shown(cube: xr.Dataset, settings: Curves) -> tuple[xr.Dataset, list[str]]:
    """Return the piece of a cube to show, and the names of the variables drawn in it."""
    beside = [OVER[name] for name in settings.variables if OVER.get(name) in cube]
    names = list(dict.fromkeys([*settings.variables, *beside]))
    given = settings.model_dump()
    over = (name for key in REDUCTIONS for name in given[key] or ())
    keep = (settings.along, settings.lines, settings.panels, settings.best, *over)
    place = layout.select(cube, names, settings.at, keep).sortby(settings.along)
    alone = {
        name + _UNDAMPED: _alone(place, name, settings)
        for name in settings.variables
        if OVER.get(name) in place
    }
    place, names = reduced(place, settings.variables, given)
    return place.assign(alone), names


def _alone(place: xr.Dataset, name: str, settings: Curves) -> xr.DataArray:
    """Return amplitudes without damper, for each line where lines have different ones."""
    own = undamped(place, name, settings.along, settings.panels, settings.lines)
    common = undamped(place, name, settings.along, settings.panels)
    return own if (own < common * (1.0 - SAME)).any() else common


#: Ending of the name of an amplitude without damper.
_UNDAMPED = "_undamped"
_SINGLE: dict[str, Any] = {"color": BLACK, "ls": "-", "lw": 1.1}
_WORST: dict[str, Any] = {"ls": "", "marker": "o", "ms": 3.5, "color": BLACK}
_MEDIAN: dict[str, Any] = {"color": BLUE, "ls": "-", "lw": 0.7, "zorder": 1.9}
_GUIDE: dict[str, Any] = {"color": "#777777", "ls": (0, (1.0, 1.5)), "lw": 1.0, "zorder": 1.5}
_BAND: dict[str, Any] = {"alpha": 0.25, "lw": 0.0, "zorder": 1.2}
#: A step is a jump if it is so many times as high as those beside it, and such a part of the line.
_JUMP, _LEAST_JUMP = 3.0, 0.25
#: Points of a line that are marked, if there are no more.
_FEW = 20
#: Height of a row of so many panels, in inches.
_HEIGHTS = {1: 2.4, 2: 2.4, 3: 2.0}


def _lines(
    place: xr.Dataset, first: str, settings: Curves, of: str
) -> list[tuple[xr.Dataset, dict[str, Any]]]:
    """Return each line's piece of the cube, and how it is drawn; `of` says of which runs it is."""
    along, lines, best = settings.along, settings.lines, settings.best
    values = place[lines].values.tolist() if lines else [None]
    drawn = []
    colours = shades(len(values))
    for index, value in enumerate(values):
        line, texts = place, []
        if lines is not None:
            line = line.sel({lines: value})
            texts.append(layout.place_text(place, lines, value))
        if best is not None:
            line = line.sel({best: _best(line[first], along, best)})
            text = layout.place_text(place, best, float(f"{line[best].item():.4g}"))
            texts.append(f"best {text}")
            heights = layout.numbers(line[first], along)
            if lines is not None and np.isfinite(heights).any():
                at = line[along].values[np.nanargmax(heights)]
                texts.append(f"highest at {layout.place_text(place, along, at)}")
            if of and not lines and not settings.panels:
                texts.insert(0, of)
        style: dict[str, Any] = {"label": ", ".join(texts) or None}
        # Where there are no panels, its end says which line it is.
        dashes = _DASHES[index % len(_DASHES)] if settings.panels else "-"
        style |= _SINGLE | {"color": colours[index], "ls": dashes}
        if place.sizes[along] <= _FEW:
            style |= {"marker": "o", "ms": 2.2, "clip_on": False}
        drawn.append((line, style))
    return drawn


def _best(array: xr.DataArray, along: str, best: str) -> float:
    """Value of an axis at which the greatest value along another is least; of equals the first."""
    # NaN where some run stopped.
    greatest = layout.numbers(array, best, along).max(axis=1)
    return float(array[best].values[least(greatest)])


def _ordinates(array: xr.DataArray, along: str, log: bool) -> np.ndarray:
    values = layout.numbers(array, along)
    return np.where(values > 0.0, values, np.nan) if log else values


def _dress(ax: Axes, place: xr.Dataset, name: str, along: str, log: bool) -> None:
    """Scales, label, and the line to compare with."""
    from matplotlib.ticker import MaxNLocator

    grid = place[along].values
    if geometric(grid):
        ax.set_xscale("log")
    ax.set_xlim(grid.min(), grid.max())
    if not any(np.isfinite(line.get_ydata()).any() for line in ax.lines):
        panels.note_empty_panel(ax)
    elif log:
        ax.set_yscale("log")
    elif layout.whole(place[name]):
        ax.yaxis.set_major_locator(MaxNLocator(integer=True, min_n_ticks=1))
    layout.few_decades(ax)
    if name in RATIOS:
        ax.axhline(1.0, zorder=1.0, **REFERENCE)

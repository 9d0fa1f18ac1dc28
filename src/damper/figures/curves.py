"""Curves: variables over one parameter, a line for each value of another."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Annotated, Any, ClassVar

import numpy as np
from pydantic import Field

from damper.analysis.optimum import least
from damper.analysis.places import in_millimetres
from damper.analysis.reduction import reduced, runs_over
from damper.figures.common import layout
from damper.figures.common.panels import finish, legend_line, note_empty_panel, panel_grid
from damper.figures.common.style import BLACK, COLUMN, RATIOS, VARIABLE_SYMBOLS, label
from damper.study import products
from damper.study.fields import Some, Text
from damper.study.messages import Mistakes

if TYPE_CHECKING:
    import xarray as xr
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

_DASHES = ("-", "--", "-.", ":")
_PANEL = 1.75
"""Height of a panel in inches."""
_ABSCISSA = 2.1
"""Inches about the middle of a panel that a label has before it is cut off on the right."""


class Curves(products.FigureSettings):
    """Variables over one axis, each in a panel of its own, with a line for each value of another.

    Amplitudes have that without damper beside them, their ratios a thin line at 1.
    """

    roles: ClassVar[Mapping[str, products.Role]] = {
        "along": products.Role(least=2),
        "lines": products.Role(most=products.MOST_LINES, branches=True),
        "each": products.Role(),
        "best": products.Role(),
        **products.REDUCTIONS,
    }

    variables: Annotated[
        Some[Text],
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
    share: products.Share = None
    above: products.Above = None
    natural_frequency: Annotated[
        bool,
        Field(
            description="Whether the abscissa, which is the stiffness then, is drawn as the "
            "primary's natural frequency in Hz: a response spectrum under a shock or record."
        ),
    ] = False
    log: Annotated[bool, Field(description="Whether ordinates are logarithmic.")] = False
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
        if len(self.variables) > products.MOST_VARIABLES:
            message = f"{len(self.variables)} variables are too many for one figure"
            mistakes.add(("variables",), message, f"at most {products.MOST_VARIABLES}")


def draw(results: Mapping[str, Any], settings: Curves) -> Figure:
    """Draw variables over one axis, one panel each."""
    cube = results["cube"]
    along, lines, best = settings.along, settings.lines, settings.best
    place, variables = _shown(cube, settings)
    abscissa = layout.place_label(place, along, _ABSCISSA)
    if settings.natural_frequency:
        natural = np.sqrt(place.stiffness.values / place.primary_mass.item()) / (2.0 * np.pi)
        place = place.assign_coords(stiffness=natural)
        abscissa = label("natural frequency", r"$\sqrt{K/M} / (2\pi)$", "Hz")
    beside = [_OVER[name] for name in variables if _OVER.get(name) in place]
    height = 1.0 + _PANEL * len(variables)
    figure, axes = panel_grid(len(variables), width=COLUMN, height=height)
    drawn = _lines(place, variables[0], along, lines, best)
    for ax, name in zip(axes.flat, variables, strict=True):
        for line, style in drawn:
            ax.plot(line[along].values, _ordinates(line[name], along, settings.log), **style)
            highest = _highest(line[name], along)
            if best is not None and name == variables[0] and highest is not None:
                top = line[along].values[highest], layout.numbers(line[name], along)[highest]
                ax.plot(*top, **_WORST | {"color": style["color"]})
        if _OVER.get(name) in place:
            ax.plot(place[along].values, _undamped(place, name, along), zorder=1.0, **_REFERENCE)
        _dress(ax, place, name, along, settings.log)
    axes[-1, 0].set_xlabel(abscissa)
    remarks = [f"worst of {runs_over(cube, settings.worst)}"] if settings.worst else []
    if best:
        symbol = VARIABLE_SYMBOLS.get(variables[0], variables[0].replace("_", " "))
        remarks.append(f"best: the largest {symbol} is least")
    handles = [legend_line(**style) for _, style in drawn if style["label"]]
    if beside or any(name in RATIOS for name in variables):
        handles.append(legend_line("without damper", **_REFERENCE))
    if best is not None:
        handles.append(legend_line("where that line is highest", **_WORST))
    return finish(figure, place, settings.caption, handles, remarks)


def _shown(cube: xr.Dataset, settings: Curves) -> tuple[xr.Dataset, list[str]]:
    """Return the piece of a cube to show, and the names of the variables drawn in it."""
    beside = [_OVER[name] for name in settings.variables if _OVER.get(name) in cube]
    names = list(dict.fromkeys([*settings.variables, *beside]))
    reduce = settings.worst, settings.share
    keep = (
        settings.along,
        settings.lines,
        settings.best,
        *(n for some in reduce for n in some or ()),
    )
    place = layout.select(cube, names, settings.at, keep).sortby(settings.along)
    place, names = reduced(place, names, *reduce, settings.above)
    return in_millimetres(place), names[: len(settings.variables)]


_REFERENCE: dict[str, Any] = {"color": "#BBBBBB", "lw": 2.0}
_WORST: dict[str, Any] = {"ls": "", "marker": "o", "ms": 3.5, "color": BLACK}
#: Amplitude -> what it is over that without damper.
_OVER = {"peak_displacement": "amplitude_ratio", "rms_displacement": "rms_ratio"}


def _undamped(place: xr.Dataset, name: str, along: str) -> np.ndarray:
    """Amplitude without damper, from any place where its ratio is known."""
    undamped = place[name] / place[_OVER[name]].where(place[_OVER[name]] > 0.0)
    return undamped.max([dim for dim in undamped.dims if dim != along]).values


def _highest(array: xr.DataArray, along: str) -> int | None:
    """Index of a line's highest point."""
    values = layout.numbers(array, along)
    return int(np.nanargmax(values)) if np.isfinite(values).any() else None


def _lines(
    place: xr.Dataset, first: str, along: str, lines: str | None, best: str | None
) -> list[tuple[xr.Dataset, dict[str, Any]]]:
    """Return each line's piece of the cube, and how it is drawn."""
    values = place[lines].values.tolist() if lines else [None]
    drawn = []
    for index, value in enumerate(values):
        line, texts = place, []
        if lines is not None:
            line = line.sel({lines: value})
            texts.append(layout.place_text(place, lines, value))
        if best is not None:
            line = line.sel({best: _best(line[first], along, best)})
            texts.append(
                f"best {layout.place_text(place, best, float(f'{line[best].item():.4g}'))}"
            )
            if (highest := _highest(line[first], along)) is not None:
                worst = layout.place_text(place, along, line[along].values[highest])
                texts.append(f"highest at {worst}")
        style = _style(index, len(values)) | {"label": ", ".join(texts) or None}
        drawn.append((line, style))
    return drawn


def _best(array: xr.DataArray, along: str, best: str) -> float:
    """Value of an axis at which the greatest value along another is least; of equals the first."""
    # NaN where some run stopped.
    greatest = layout.numbers(array, best, along).max(axis=1)
    return float(array[best].values[least(greatest)])


def _style(index: int, count: int) -> dict[str, Any]:
    """Colours from dark to light, and dashes in turn: lines differ in grey as well."""
    from matplotlib import colormaps

    if count == 1:
        return {"color": BLACK, "ls": "-", "lw": 1.1}
    # The lightest colours of the map are lost on white paper.
    shade = 0.8 * index / (count - 1)
    return {"color": colormaps["cividis"](shade), "ls": _DASHES[index % len(_DASHES)], "lw": 1.1}


def _ordinates(array: xr.DataArray, along: str, log: bool) -> np.ndarray:
    values = layout.numbers(array, along)
    return np.where(values > 0.0, values, np.nan) if log else values


def _dress(ax: Axes, place: xr.Dataset, name: str, along: str, log: bool) -> None:
    """Scales, label, and the line to compare with."""
    from matplotlib.ticker import MaxNLocator

    grid = place[along].values
    if layout.geometric(grid):
        ax.set_xscale("log")
    ax.set_xlim(grid.min(), grid.max())
    if not any(np.isfinite(line.get_ydata()).any() for line in ax.lines):
        note_empty_panel(ax)
    elif log:
        ax.set_yscale("log")
    elif layout.whole(place[name]):
        ax.yaxis.set_major_locator(MaxNLocator(integer=True, min_n_ticks=1))
    layout.few_decades(ax)
    if name in RATIOS:
        ax.axhline(1.0, zorder=1.0, **_REFERENCE)
    ax.set_ylabel(layout.variable_label(place[name], 0.72 * _PANEL))

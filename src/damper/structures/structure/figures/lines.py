"""Lines: a variable of a structure over an axis or over time."""

from __future__ import annotations

from collections.abc import Mapping
from textwrap import fill
from typing import Annotated, Any

from pydantic import Field

from damper.analysis.labels import label_of
from damper.figures.common import panels
from damper.figures.common.style import COLOURS, label, shades, units_text
from damper.parameters.lazy import Axes, Figure, xr
from damper.parameters.units import handy
from damper.study.fields import DistinctList, NumberOrText, Text
from damper.study.products import Caption
from damper.study.study_file import ProductBase, See

_DASHES = ("-", "--", "-.", ":")
#: Most letters in a line of the ordinate's label.
_WIDTH = 32
_HEIGHTS = {1: 2.2, 2: 1.9, 3: 1.7}


class StructureLines(ProductBase):
    """A variable over an axis, or over time, with a line for each value of another dimension.

    Where the variable has several values at one place, such as the samples of a section, each is a
    dot.
    """

    variables: Annotated[
        DistinctList[Text], Field(max_length=1, description="The variable of the ordinate.")
    ]
    along: Annotated[
        Text, Field(description="Axis of the abscissa; instant for time, which needs history.")
    ]
    lines: Annotated[
        Text | None,
        Field(description="Dimension of whose values each makes a line: point, mode or an axis."),
    ] = None
    panels: Annotated[
        Text | None, Field(description="Dimension of whose values each makes a panel.")
    ] = None
    at: Annotated[
        dict[str, NumberOrText],
        Field(description="Value of each other dimension: axis, point, mode (from 1) or body."),
    ] = {}  # noqa: RUF012
    log: Annotated[bool, Field(description="Whether ordinates are logarithmic.")] = False
    caption: Caption = None
    see: See = None


def draw(results: Mapping[str, Any], settings: StructureLines) -> Figure:
    """Draw a variable over an axis or over time."""
    (name,) = settings.variables
    whole = results["cube"]
    cube = whole.sel(settings.at)
    shown = [cube] if settings.panels is None else _each(cube, settings.panels)
    figure, axes = panels.wrapped_panels(len(shown), _HEIGHTS, rest=1.1)
    variable = cube[name]
    # Names of some variables of observers are longer than a panel is high.
    words = fill(variable.attrs["long_name"], _WIDTH)
    ordinate = label(words, "", variable.attrs.get("units", ""))
    if settings.along == "instant":
        abscissa = label("time", "", "s")
    else:
        unit = cube[settings.along].attrs.get("units", "")
        abscissa = label(words_of(cube, settings.along), "", unit)
    panels.label_outer(axes, abscissa, ordinate)
    handles: dict[str, Any] = {}
    for ax, part in zip(axes, shown, strict=True):
        handles |= _panel(ax, part, name, settings)
        if settings.panels is not None:
            ax.set_title(value_text(part, settings.panels), pad=3.0)
    made = [panels.legend_line(text, **style) for text, style in handles.items() if text]
    ax = axes[0]
    if settings.panels is None and len(ax.lines) == len(made):  # the ends say which line it is
        panels.label_ends(ax, ax.lines, list(handles), _HEIGHTS[1])
        made = []
    alone = [n for n in map(str, whole.coords) if cube[n].ndim == 0]
    remarks = [value_text(cube, n) for n in alone if n != "body" or whole.sizes[n] > 1]
    return panels.finish(figure, whole.drop_vars(alone), settings.caption, made, remarks)


def _each(cube: xr.Dataset, dim: str) -> list[xr.Dataset]:
    return [cube.isel({dim: k}) for k in range(cube.sizes[dim])]


def value_text(part: xr.Dataset, dim: str) -> str:
    """Words for the value of a coordinate, with its unit."""
    value, words = part[dim].item(), words_of(part, dim)
    if isinstance(value, str) or "units" not in part[dim].attrs:
        return f"{'mass' if dim == 'body' else words} {value}"
    size, unit = handy(value, part[dim].attrs["units"])
    return f"{words}: {value / size:g} {units_text(unit)}".strip()


def words_of(cube: xr.Dataset, dim: str) -> str:
    """Words for a coordinate."""
    return str(cube[dim].attrs.get("long_name", label_of(dim)))


def _panel(ax: Axes, part: xr.Dataset, name: str, settings: StructureLines) -> dict[str, Any]:
    parts = [part] if settings.lines is None else _each(part, settings.lines)
    found = {}
    ordered = settings.lines is None or "units" in part[settings.lines].attrs
    colours = shades(len(parts)) if ordered else COLOURS
    for k, one in enumerate(parts):
        text = "" if settings.lines is None else value_text(one, settings.lines)
        dashes = _DASHES[k // len(colours) % len(_DASHES)]
        style: dict[str, Any] = {"color": colours[k % len(colours)], "lw": 0.9, "ls": dashes}
        times = "time" if "time" in one else "trajectory_time"
        x = one[times if settings.along == "instant" else settings.along]
        values = one[name].squeeze().transpose(*x.dims, ...).values
        if values.ndim > x.ndim:
            style = {"color": style["color"], "ls": "", "marker": ".", "ms": 1.5}
        ax.plot(x.values, values, **style)
        found[text] = style
    if settings.log:
        ax.set_yscale("log")
    return found

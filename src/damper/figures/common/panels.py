"""What makes a figure of panels: rows, columns, titles, labels, heading, legend, empty panels."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from typing import Any

import numpy as np

from damper.figures.common.layout import head, legend, place_text, write_prefixes
from damper.figures.common.style import COLUMN, PAGE
from damper.parameters.lazy import Artist, Axes, Figure, xr

#: Height of a line of a legend in inches.
_LINE = 0.145
#: Lines of a heading for which heights of figures have room.
_HEADING = 5
#: Least distance of labels at the ends of lines, in inches of a panel with all about it.
_END = 0.17


def parts(place: xr.Dataset, axis: str | None) -> list[tuple[str, xr.Dataset]]:
    """Return the part of a cube at each value of an axis, with its title; all of it without one."""
    if axis is None:
        return [("", place)]
    values = place[axis].values.tolist()
    return [(place_text(place, axis, value), place.sel({axis: value})) for value in values]


def panel_grid(
    rows: int, columns: int = 1, *, width: float = PAGE, height: float, **shared: Any
) -> tuple[Figure, np.ndarray]:
    """Return a figure and its panels, row by row, with one abscissa to a column."""
    from matplotlib.figure import Figure

    figure = Figure(figsize=(width, height), layout="constrained")
    given: dict[str, Any] = {"sharex": True, "squeeze": False} | shared
    return figure, figure.subplots(rows, columns, **given)


def wrapped_panels(
    count: int, heights: Mapping[int, float], rest: float
) -> tuple[Figure, list[Axes]]:
    """Return a figure of equal panels in rows of up to three, with no empty ones after the last.

    `heights` are those of a row of so many panels, in inches; `rest` is that of all else.
    """
    columns = 2 if count == 4 else min(3, count)
    rows = -(-count // columns)
    width, height = COLUMN if columns == 1 else PAGE, rest + heights[columns] * rows
    figure, axes = panel_grid(rows, columns, width=width, height=height, sharey=True)
    for ax in axes.flat[count:]:
        ax.remove()
    return figure, list(axes.flat[:count])


def panel_size(axes: Sequence[Axes], heights: Mapping[int, float]) -> tuple[float, float]:
    """Width and height of wrapped panels in inches, with all that is about them."""
    columns = _columns(axes)
    return axes[0].figure.get_figwidth() / columns, heights[columns]  # type: ignore[union-attr]


def label_outer(axes: Sequence[Axes], x: str, y: str = "") -> None:
    """Label wrapped panels: abscissas where there is none below, ordinates on the left."""
    columns = _columns(axes)
    for index, ax in enumerate(axes):
        if index + columns >= len(axes):
            ax.set_xlabel(x)
            ax.tick_params(labelbottom=True)
        if index % columns == 0:
            ax.set_ylabel(y)


def _columns(axes: Sequence[Axes]) -> int:
    return axes[0].get_subplotspec().get_gridspec().ncols  # type: ignore[union-attr]


def title(ax: Axes, text: str, **style: Any) -> None:
    """Write above a panel, on the left, what it shows."""
    if text:
        ax.set_title(text, loc="left", **style)


def label_ends(ax: Axes, lines: Sequence[Any], texts: Sequence[str], inches: float) -> None:
    """Write beside the right end of each line of a panel what it is, in its colour.

    Texts keep a distance in a panel as high as `inches`; each is as near to its line as it can be.
    """
    ends = []
    for line, text in zip(lines, texts, strict=True):
        y = np.asarray(line.get_ydata(), float)
        known = y[np.isfinite(y)]
        if known.size:
            point = ax.transData.transform((ax.get_xlim()[1], known[-1]))
            ends.append((ax.transAxes.inverted().transform(point)[1], text, line.get_color()))
    ends.sort(key=lambda end: end[0])
    step = min(_END / inches, 1.0 / max(len(ends) - 1, 1))
    heights = np.array([min(max(end[0], 0.0), 1.0) for end in ends])
    order = step * np.arange(len(ends))
    # Each at least a step above the one before, and none above the panel.
    heights = np.maximum.accumulate(heights - order) + order
    heights = np.minimum(heights, 1.0 - order[::-1])
    for height, (_, text, colour) in zip(heights, ends, strict=True):
        place: dict[str, Any] = {"transform": ax.transAxes, "va": "center", "fontsize": 7.0}
        ax.text(1.02, height, text, color=colour, **place)


def note_empty_panel(ax: Axes, text: str = "no run finished here", **style: Any) -> None:
    """Write in the middle of a panel why there is nothing to be seen."""
    middle: dict[str, Any] = {"ha": "center", "va": "center", "fontsize": 7.0}
    ax.text(0.5, 0.5, text, transform=ax.transAxes, **middle, **style)


def legend_line(label: str, **style: Any) -> Artist:
    """Return what a legend shows of a line or of marks."""
    from matplotlib.lines import Line2D

    return Line2D([], [], label=label, **style)


def legend_patch(label: str, **style: Any) -> Artist:
    """Return what a legend shows of an area."""
    from matplotlib.patches import Patch

    return Patch(label=label, **style)


def finish(
    figure: Figure,
    place: xr.Dataset,
    caption: str | None,
    handles: Iterable[Artist] = (),
    remarks: Iterable[str] = (),
    room: int | None = None,
) -> Figure:
    """Write heading and legend of a figure; what has one name is listed once.

    Where its height has `room` for so many lines of the legend, it grows with more of them, and
    with a heading of many lines.
    """
    write_prefixes(figure)
    figure.align_ylabels()
    head(figure, place, caption, remarks=remarks)
    lines = legend(figure, list({str(handle.get_label()): handle for handle in handles}.values()))
    more = max(figure.get_suptitle().count("\n") - _HEADING, 0)
    more += max(lines - room, 0) if room is not None else 0
    figure.set_figheight(figure.get_figheight() + _LINE * more)
    return figure

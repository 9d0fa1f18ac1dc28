"""Bifurcation diagrams: displacement and velocity on the section over one parameter."""

from collections.abc import Mapping

import numpy as np
import xarray as xr
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import Patch

from damper.figures.style import (
    BLUE,
    ORANGE,
    PAGE,
    SYMBOLS,
    axis_label,
    value_text,
)
from damper.study.runs import runs

_CHATTER = {1: ("incomplete chatter", ORANGE), 2: ("complete chatter", BLUE)}


def draw(
    cube: xr.Dataset,
    *,
    along: str,
    rows: str | None = None,
    at: Mapping[str, float] | None = None,
    caption: str | None = None,
) -> Figure:
    """Draw displacement (left) and velocity (right) on the section over one axis.

    Parameters
    ----------
    cube : xarray.Dataset
        With `displacement` and `velocity`; chatter ranges are marked if it has `chatter`.
    along : str
        Axis of the abscissa.
    rows : str, optional
        Axis whose values make one row of panels each.
    at : mapping, optional
        Value of every other axis.
    caption : str, optional
        Heading above the line of parameters; the cube's title when not given.

    Returns
    -------
    matplotlib.figure.Figure
    """
    place = cube.sel(at or {})
    place = place.squeeze(
        [
            dim
            for dim in place.displacement.dims
            if dim not in (along, rows, "sample") and place.sizes[dim] == 1
        ]
    )
    values = place[rows].values.tolist() if rows else [None]
    height = 1.1 + 1.55 * len(values)
    figure = Figure(figsize=(PAGE, height), layout="constrained")
    axes = figure.subplots(len(values), 2, sharex=True, squeeze=False)
    for row, value in zip(axes, values, strict=True):
        panel = place if value is None else place.sel({rows: value})
        for ax, name in zip(row, ("displacement", "velocity"), strict=True):
            _points(ax, panel, along, name)
        _mark_chatter(row, panel, along)
        if value is not None:
            row[0].set_title(value_text(rows, value), loc="left", fontweight="bold")
        row[0].set_ylabel("displacement $x$ / ($F_0/K$)")
        row[1].set_ylabel(r"velocity $\dot x$ / ($F_0/\sqrt{KM}$)")
    for ax in axes[-1]:
        ax.set_xlabel(axis_label(along))
    figure.get_layout_engine().set(wspace=0.06)
    figure.align_ylabels()
    _head(figure, place, along, rows, caption)
    return figure


def _points(ax: Axes, panel: xr.Dataset, along: str, name: str) -> None:
    samples = panel[name].transpose(along, "sample").values
    x = np.repeat(panel[along].values, samples.shape[1])
    # Rasterised: tens of thousands of vector points make files that no reader opens.
    ax.plot(x, samples.ravel(), ".", ms=0.9, mew=0.0, color="black", rasterized=True)
    grid = panel[along].values
    if len(grid) > 1:
        ax.set_xlim(grid.min(), grid.max())
    finite = samples[np.isfinite(samples)]
    if finite.size:
        low, high = finite.min(), finite.max()
        margin = 0.06 * (high - low) or 0.1 * max(abs(high), 1.0)
        ax.set_ylim(low - margin, high + margin)


def _mark_chatter(row: np.ndarray, panel: xr.Dataset, along: str) -> None:
    """Shade chatter behind the points, and repeat it as a bar on the upper edge."""
    if "chatter" not in panel:
        return
    grid = panel[along].values
    middle = 0.5 * (grid[1:] + grid[:-1])
    edges = np.concatenate([grid[:1], middle, grid[-1:]])
    chatter = panel.chatter.values
    for kind, (_, colour) in _CHATTER.items():
        for first, last in runs(chatter == kind):
            for ax in row:
                ax.axvspan(edges[first], edges[last + 1], color=colour, alpha=0.18, lw=0, zorder=0)
                ax.plot(
                    [edges[first], edges[last + 1]],
                    [1.0, 1.0],
                    transform=ax.get_xaxis_transform(),
                    color=colour,
                    lw=3.0 if kind == 2 else 1.5,
                    solid_capstyle="butt",
                    clip_on=False,
                )


def _head(
    figure: Figure, place: xr.Dataset, along: str, rows: str | None, caption: str | None
) -> None:
    fixed = [
        value_text(name, float(place[name]))
        for name in SYMBOLS
        if name in place.coords and place[name].ndim == 0 and name not in (along, rows)
    ]
    # "primary displacement once per forcing period" -> where the section lies
    section = place.displacement.attrs.get("long_name", "").removeprefix("primary displacement ")
    heading = caption or place.attrs.get("title", "")
    lines = [heading, ", ".join(fixed) + (f"; section {section}" if section else "")]
    figure.suptitle("\n".join(line for line in lines if line), fontsize=8.5)
    if "chatter" in place:
        handles = [Patch(color=colour, alpha=0.5, label=text) for text, colour in _CHATTER.values()]
        figure.legend(handles=handles, loc="outside lower center", ncols=2, frameon=False)

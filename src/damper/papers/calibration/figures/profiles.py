"""Profiles: how far statements pin a parameter down, whatever the other parameters are."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from itertools import product
from typing import Any

import numpy as np

from damper.analysis.labels import label_of
from damper.figures.common import style
from damper.figures.common.layout import geometric, place_label, place_text, wrap
from damper.figures.common.panels import finish, legend_line, panel_grid, title
from damper.papers.calibration.ranking import HOLDS, JOINED, Ranking, rank
from damper.papers.calibration.settings import Scores
from damper.parameters.lazy import Artist, Axes, Figure, xr
from damper.study.products import Caption

#: Least number of values that make a curve; dimensions with fewer make a row of panels each.
_CURVE = 3
#: Letters of a title that fit in an inch.
_TITLE = 13.0
#: Values of an axis up to which each is marked.
_MOST_MARKED = 30
#: An axis over more than this ratio is logarithmic, whatever its spacing.
_WIDE = 20.0
_COLOURS = (style.ORANGE, style.SKY, style.GREEN, style.PURPLE, style.BLUE, style.VERMILION)
_DASHES = ("--", "-.", ":", (0, (5, 1, 1, 1, 1, 1)), (0, (1, 2)), (0, (6, 3)))
_WORDS: dict[tuple[str, Any], str] = {
    ("phase", 0.0): "sine force",
    ("phase", math.pi / 2.0): "cosine force",
    ("resonance", "below"): "below resonance",
    ("resonance", "above"): "above resonance",
    ("counted", "complete"): "complete chatter",
    ("counted", "any"): "any chatter",
    ("contact_tension", 0.0): "without tension",
    ("contact_tension", 1.0): "with tension",
}


class Profiles(Scores):
    """The best score that each value of a parameter allows, for each statement and for all.

    Axes with two values, such as the phase, make a row of panels each.
    """

    caption: Caption = None


def draw(results: Mapping[str, Any], settings: Profiles) -> Figure:
    """Draw the best score that each value of a parameter allows, for each statement and joined.

    The values of `preset` are marked.
    """
    cube = results["cube"]
    found = rank(cube, settings.statements, settings.others(results))
    joined = found.scores[JOINED]
    along = [
        str(dim) for dim in joined.dims if joined.sizes[dim] >= _CURVE and dim in style.SYMBOLS
    ]
    split = [str(dim) for dim in joined.dims if dim not in along and joined.sizes[dim] > 1]
    rows = [
        dict(zip(split, values, strict=True))
        for values in product(*(joined[dim].values.tolist() for dim in split))
    ]
    width = style.PAGE if len(along) > 2 else style.COLUMN
    shared: dict[str, Any] = {"width": width, "sharex": "col", "sharey": True}
    figure, axes = panel_grid(len(rows), len(along), height=1.15 + 1.25 * len(rows), **shared)
    lines = _lines(found)
    for row, line in zip(axes, rows, strict=True):
        for ax, axis in zip(row, along, strict=True):
            for array, look in lines:
                _curve(ax, array, axis, line, look)
            _dress(ax, cube, axis, line, settings.preset or {})
        words = [_WORDS.get(item) or place_text(cube, *item) for item in line.items()]
        title(row[0], wrap(words, _TITLE * width / len(along)))
    for ax, axis in zip(axes[-1], along, strict=True):
        ax.set_xlabel(place_label(cube, axis, 0.8 * width / len(along)))
    for row in axes:
        row[0].set_ylabel("best score")
    fixed = cube[list(cube.data_vars)[:1]]
    return finish(figure, fixed, settings.caption, _legend(lines, settings.preset))


def _lines(found: Ranking) -> list[tuple[xr.DataArray, dict[str, Any]]]:
    """Return what is drawn, statements first, and how."""
    drawn = []
    for index, (name, array) in enumerate(found.own.items()):
        look: dict[str, Any] = {
            "color": _COLOURS[index % len(_COLOURS)],
            "ls": _DASHES[index % len(_DASHES)],
            "lw": 1.1,
            "label": label_of(name),
        }
        drawn.append((array, look))
    look = {"color": style.BLACK, "ls": "-", "lw": 1.4, "label": "joined: geometric mean"}
    return [*drawn, (found.scores[JOINED], look)]


def _curve(
    ax: Axes, array: xr.DataArray, axis: str, line: Mapping[str, Any], look: Mapping[str, Any]
) -> None:
    if axis not in array.dims:
        return
    array = array.sel({name: value for name, value in line.items() if name in array.dims})
    profile = array.max([dim for dim in array.dims if dim != axis]).sortby(axis)
    marked: dict[str, Any] = {"marker": "o", "ms": 1.8} if profile.size <= _MOST_MARKED else {}
    ax.plot(profile[axis].values, profile.values, **look, **marked)


def _dress(
    ax: Axes, cube: xr.Dataset, axis: str, line: Mapping[str, Any], preset: Mapping[str, Any]
) -> None:
    """Scales, and what is to be compared with."""
    from matplotlib.ticker import NullFormatter

    grid = np.sort(cube[axis].values)
    if geometric(grid) or (grid[0] > 0.0 and grid[-1] > _WIDE * grid[0]):
        ax.set_xscale("log")
        ax.xaxis.set_minor_formatter(NullFormatter())
    ax.set_ylim(-0.03, 1.05)
    ax.axhline(HOLDS, **_LIMIT)
    if axis in preset and all(preset.get(name, value) == value for name, value in line.items()):
        ax.axvline(preset[axis], **_PRESET)


_LIMIT: dict[str, Any] = {"color": "#777777", "lw": 0.6, "zorder": 1.0}
_PRESET: dict[str, Any] = {"color": style.VERMILION, "lw": 0.8, "ls": "-", "zorder": 1.0}


def _legend(
    lines: Sequence[tuple[xr.DataArray, dict[str, Any]]], preset: Mapping[str, Any] | None
) -> list[Artist]:
    handles = [legend_line(**look) for _, look in lines]
    if preset:
        handles.append(legend_line("preset", **_PRESET))
    return [*handles, legend_line("holds from here on", **_LIMIT)]

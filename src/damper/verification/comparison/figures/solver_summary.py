"""Summary of the comparison: how exact each solver becomes on each scene, and at what cost."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, ClassVar

import numpy as np

from damper.analysis.labels import capital, short, time_text
from damper.figures.common.layout import wrap
from damper.figures.common.panels import finish, panel_grid
from damper.figures.common.style import BLACK, MISSING
from damper.parameters.lazy import Axes, Figure, xr
from damper.study.products import Caption
from damper.study.study_file import ProductBase, See
from damper.verification.comparison import best
from damper.verification.comparison.errors import OUTCOMES
from damper.verification.comparison.marks import FAILURES

#: What is compared: of the run as a whole, and not of its end, where most motions settle.
ERROR = "impact_time_error"
#: The error for which times are compared.
TARGET = 1e-6

_ROW = 0.215
#: Letters: of corners, and at most of cells, whose numbers fit into a column.
_CORNER, _SIZE, _FIT = 4.2, 5.6, 46.0
#: Least and largest value that colours distinguish: of the error, of the ratio of times.
_ERRORS, _RATIOS = (1e-14, 1.0), (1.0, 1e5)


class SolverSummary(ProductBase):
    """Smallest error of each solver on each scene, and its run time beside the engine's."""

    reads: ClassVar[tuple[str, ...]] = best.FILES

    caption: Caption = None
    see: See = None


def draw(results: Mapping[str, Any], settings: SolverSummary) -> Figure:
    """Draw two tables in colour, scenes by solvers: best error, and relative time for 1e-6."""
    errors, timings = results["cube"], results["timings"]
    height = 2.1 + _ROW * errors.sizes["scene"]
    figure, ((left, right),) = panel_grid(1, 2, height=height, sharey=True)
    smallest, times = (
        best.best_error(errors, ERROR),
        best.time_to_reach(errors, timings, ERROR, TARGET),
    )
    ratios = best.relative_to_base(times)
    failed = np.array([[letters(runs) for runs in row] for row in errors.outcome.values], object)
    reached = smallest.notnull().values
    shown, corners = failed.copy(), failed.copy()
    shown[reached] = np.vectorize(short)(smallest)[reached]
    corners[~reached] = ""
    _cells(left, smallest.values, _ERRORS, shown, corners)
    relative = (times.solver != best.BASE).values & ratios.notnull().values
    shown, corners = np.vectorize(time_text)(times).astype(object), np.full_like(failed, "")
    shown[relative] = np.vectorize(short)(ratios)[relative]
    _cells(right, ratios.values, _RATIOS, shown, corners)
    left.set_xlabel(
        "smallest error of impact times / $\\sqrt{M/K}$\n(letters: how other settings failed)"
    )
    right.set_xlabel(
        "time to errors of $10^{-6}$ in impact times, over\nthat of the engine, itself in µs"
    )
    for ax in (left, right):
        names = [wrap(text.split(), 16.0) for text in errors.label.values]
        ax.set_xticks(range(len(names)), names)
        ax.tick_params(axis="x", rotation=90, top=True, labeltop=True, labelbottom=False)
        ax.set_yticks(range(len(smallest.scene)), [capital(text) for text in errors.title.values])
        ax.tick_params(length=0.0)
        ax.spines[:].set_visible(False)
    return finish(figure, errors, settings.caption, remarks=_remarks(errors))


def letters(outcomes: np.ndarray) -> str:
    """Letters of the failures among the levels, each once, the most frequent ones first."""
    counts = {
        letter: int((outcomes == OUTCOMES.index(name)).sum())
        for name, (_, letter) in FAILURES.items()
    }
    return "".join(k for k in sorted(counts, key=lambda k: -counts[k]) if counts[k])


def _cells(
    ax: Axes,
    values: np.ndarray,
    limits: tuple[float, float],
    texts: np.ndarray,
    corners: np.ndarray,
) -> None:
    from matplotlib import colormaps
    from matplotlib.colors import LogNorm

    rows, columns = values.shape
    ax.pcolormesh(
        np.arange(columns + 1) - 0.5,
        np.arange(rows + 1) - 0.5,
        np.ma.masked_invalid(np.maximum(values, limits[0])),
        cmap=colormaps["viridis_r"].with_extremes(bad=MISSING),  # light is good
        norm=LogNorm(*limits, clip=True),
        edgecolors="white",
        lw=0.8,
    )
    ax.set_ylim(rows - 0.5, -0.5)
    size = min(_SIZE, _FIT / columns)
    for row, column in np.ndindex(rows, columns):
        dark = values[row, column] > np.sqrt(limits[0] * limits[1])
        ink = "white" if dark else BLACK
        text, corner = str(texts[row, column]), str(corners[row, column])
        ax.text(column, row, text, ha="center", va="center", size=size, color=ink)
        ax.text(column + 0.43, row - 0.44, corner, ha="right", va="top", size=_CORNER, color=ink)


def _remarks(errors: xr.Dataset) -> list[str]:
    occur = [
        f"{letter} {meaning}"
        for name, (meaning, letter) in FAILURES.items()
        if (errors.outcome == OUTCOMES.index(name)).any()
    ]
    return [*occur, "grey: not reached"]

"""Laws of the model: how far all runs are from their limits, and the worst in each regime."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from damper.analysis.labels import label_of, short
from damper.analysis.laws import GRADED, Row, excesses, regimes
from damper.figures.common.layout import heading, wrap
from damper.figures.common.panels import note_empty_panel, panel_grid
from damper.figures.common.style import BLUE, ORANGE, SKY
from damper.observers.common.laws import LIMIT
from damper.parameters.lazy import Axes, Figure, pd
from damper.study.messages import Mistakes
from damper.study.products import Caption, Product, StudyContents, require_laws
from damper.study.study_file import See

#: Colours by violation over its limit: roundoff, thousands of it, nearly the limit, beyond.
_EDGES = (0.0, 1e-2, 1e-1, 1.0, np.inf)
_COLOURS = ("#DCEBF7", SKY, ORANGE, "#5B4636")
_LINES = ("-", "--", "-.", ":")


class LawsFigure(Product):
    """How far each law is from its limit, over all runs, and the worst in each regime."""

    caption: Caption = None
    see: See = None

    def check_against(self, study: StudyContents, mistakes: Mistakes) -> None:
        require_laws(study, mistakes)


def draw(results: Mapping[str, Any], settings: LawsFigure) -> Figure:
    """Draw all runs' violations as distributions, and the worst ones by regime as a matrix."""
    cube = results["cube"]
    rows = regimes(cube)
    far = excesses(cube)
    shared: dict[str, Any] = {"sharex": False, "height_ratios": [1.7, 0.19 * len(rows) + 0.3]}
    figure, ((upper,), (lower,)) = panel_grid(2, height=2.6 + 0.19 * len(rows), **shared)
    _distributions(upper, far)
    _matrix(lower, rows)
    stopped, failed = rows[0].outcomes[1:]
    ends = (
        f"{rows[0].runs} runs: {stopped} stopped by their event budget, "
        f"{failed} by a search that failed; {rows[0].broken} break a law"
    )
    words = (settings.caption or cube.attrs.get("title", "")).split()
    heading(figure, words, ends.split(), letters=110.0)
    return figure


def _distributions(ax: Axes, far: pd.DataFrame) -> None:
    """Part of the runs beyond each violation, law by law."""
    looks = [(colour, line) for colour in (BLUE, ORANGE) for line in _LINES]
    for name, (colour, line) in zip(GRADED, looks, strict=False):
        values = np.sort(far[name].dropna().values)[::-1]
        # A few hundred steps look the same as a hundred thousand.
        keep = np.unique(np.geomspace(1, max((values > 0.0).sum(), 1), 300).astype(int))
        if values.size:
            x, y = LIMIT * values[keep - 1], keep / values.size
            ax.plot(x, y, lw=1.0, color=colour, ls=line, label=label_of(name))
    ax.axvline(LIMIT, color="#777777", lw=0.8)
    ax.text(1.1 * LIMIT, 1.0, "limit", va="top", fontsize=7.0)
    ax.set_xscale("log")
    ax.set_yscale("log")
    ax.set_xlim(1e-18, 10.0 * LIMIT)
    ax.set_xlabel("violation relative to its terms; energy scaled to the same limit")
    ax.set_ylabel("share of runs with\nat least that violation")
    if not ax.get_legend_handles_labels()[0]:
        note_empty_panel(ax)
    else:
        ax.legend(frameon=False, ncols=1, loc="center left", bbox_to_anchor=(1.0, 0.5))


def _matrix(ax: Axes, rows: Sequence[Row]) -> None:
    """Worst value of each law in each regime, coloured by its distance to the limit."""
    from matplotlib.colors import BoundaryNorm, ListedColormap

    ratios = np.array([[row.nearest[name] for name in GRADED] for row in rows])
    colours = ListedColormap(list(_COLOURS), name="limits").with_extremes(bad="white")
    norm = BoundaryNorm(range(len(_EDGES)), colours.N)
    classes = np.searchsorted(_EDGES[1:], ratios, side="left").astype(float)
    classes[np.isnan(ratios)] = np.nan
    ax.imshow(np.ma.masked_invalid(classes), cmap=colours, norm=norm, aspect="auto")
    for (row, column), ratio in np.ndenumerate(ratios):
        ink = "white" if ratio > 1.0 else "black"
        text = short(LIMIT * ratio)
        ax.text(column, row, text, ha="center", va="center", fontsize=6.5, color=ink)
    ax.set_xticks(range(len(GRADED)), [wrap(label_of(n).split(), 12) for n in GRADED], fontsize=6.5)
    names = [f"{row.regime.name} ({row.runs}, {row.stopped})" for row in rows]
    ax.set_yticks(range(len(rows)), names)
    ax.tick_params(length=0, top=True, labeltop=True, bottom=False, labelbottom=False)
    ax.spines[["left", "bottom"]].set_visible(False)
    texts = ("up to 1/100 of the limit", "up to 1/10", "up to the limit", "beyond")
    handles = [
        ax.scatter([], [], marker="s", s=36, color=colour, label=text)
        for colour, text in zip(_COLOURS, texts, strict=True)
    ]
    ax.legend(
        handles=handles,
        loc="upper center",
        bbox_to_anchor=(0.5, -0.01),
        ncols=4,
        frameon=False,
        title="worst violation in a regime, scaled as above (in brackets: runs, stopped runs)",
        title_fontsize=7.0,
    )

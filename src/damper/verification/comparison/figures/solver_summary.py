"""Summary of the comparison: how exact each solver becomes on each scene, and at what cost."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, ClassVar

import numpy as np

from damper.figures.common.layout import head
from damper.figures.common.style import BLACK, MISSING, PAGE, PALE
from damper.verification.base import (
    Made,
    OptionalCaption,
)
from damper.verification.comparison.best import (
    BASE,
    FILES,
    best_error,
    relative_to_base,
    time_to_reach,
)
from damper.verification.comparison.errors import VERDICTS
from damper.verification.comparison.figures.work_precision import Scenes, shown_scenes
from damper.verification.comparison.marks import FAILURES, SHORT_LABELS

if TYPE_CHECKING:
    import xarray as xr
    from matplotlib.axes import Axes
    from matplotlib.colors import Colormap
    from matplotlib.figure import Figure
    from matplotlib.typing import ColorType

#: What is compared: of the run as a whole, and not of its end, where most motions settle.
ERROR = "impact_time_error"
#: The error for which times are compared.
TARGET = 1e-6

_ROW = 0.215
_SIZE = 5.6
#: Least and largest logarithm that colours distinguish: of the error, of the ratio of times.
_ERRORS, _RATIOS = (-14.0, 0.0), (0.0, 5.0)


class SolverSummary(Made):
    """What each solver reaches on each scene, and what it costs beside the engine."""

    reads: ClassVar[tuple[str, ...]] = FILES

    scenes: Scenes = None
    caption: OptionalCaption = None


def draw(
    errors: xr.Dataset,
    timings: xr.Dataset,
    *,
    scenes: Sequence[str] | None = None,
    caption: str | None = None,
) -> Figure:
    """Draw two tables in colour, scenes by solvers: best error, and relative time for 1e-6.

    Parameters
    ----------
    errors, timings : xarray.Dataset
        Of the same scenes, solvers and settings; see `damper.verification.comparison.cube`.
    scenes : sequence of str, optional
        Names of the scenes to show; all when not given.
    caption : str, optional
        Heading; the title when not given.

    Returns
    -------
    matplotlib.figure.Figure

    Raises
    ------
    ValueError
        For an unknown scene, or datasets of different runs.
    """
    from matplotlib import colormaps
    from matplotlib.figure import Figure

    names = shown_scenes(errors, scenes)
    errors, timings = errors.sel(scene=names), timings.sel(scene=names)
    times = time_to_reach(errors, timings, ERROR, TARGET)
    best, ratios = best_error(errors, ERROR), relative_to_base(times)
    figure = Figure(figsize=(PAGE, 1.95 + _ROW * len(names)), layout="constrained")
    left, right = figure.subplots(1, 2, sharey=True)
    for ax, title in (
        (
            left,
            "smallest error of impact times / $\\sqrt{M/K}$\n(letters: failed at other settings)",
        ),
        (right, "time to errors of $10^{-6}$ in impact times,\nover that of the exact engine"),
    ):
        _frame(ax, errors, title)
    colours = colormaps["viridis"]  # light is good
    for row, scene in enumerate(names):
        for column, solver in enumerate(errors.solver.values.tolist()):
            at = {"scene": scene, "solver": solver}
            verdicts = errors.verdict.sel(at).values
            _best_cell(left, row, column, float(best.sel(at)), verdicts, colours)
            if not (verdicts >= 0).any():
                _cell(right, row, column, "", PALE)
            else:
                ratio, time = float(ratios.sel(at)), float(times.sel(at))
                _ratio_cell(right, row, column, ratio, time, solver, colours)
    head(figure, errors, caption, remarks=_remarks(errors))
    return figure


def letters(verdicts: np.ndarray) -> str:
    """Letters of the failures among the levels, each once, the most frequent ones first."""
    counts = {
        letter: int((verdicts == VERDICTS.index(name)).sum())
        for name, (_, letter) in FAILURES.items()
    }
    return "".join(k for k in sorted(counts, key=lambda k: -counts[k]) if counts[k])


def _frame(ax: Axes, errors: xr.Dataset, title: str) -> None:
    solvers = errors.solver.values.tolist()
    texts = [str(text) for text in errors.title.values]
    ax.set_xlim(0, len(solvers))
    ax.set_ylim(len(texts), 0)
    ax.set_xticks(np.arange(len(solvers)) + 0.5, [SHORT_LABELS[name] for name in solvers])
    ax.tick_params(axis="x", rotation=90, top=True, labeltop=True, bottom=False, labelbottom=False)
    ax.set_yticks(np.arange(len(texts)) + 0.5, [text[:1].upper() + text[1:] for text in texts])
    ax.tick_params(length=0.0)
    for spine in ax.spines.values():
        spine.set_visible(False)
    ax.set_xlabel(title)


def _best_cell(
    ax: Axes, row: int, column: int, best: float, verdicts: np.ndarray, colours: Colormap
) -> None:
    failed = letters(verdicts)
    if not (verdicts >= 0).any():
        _cell(ax, row, column, "", PALE)
    elif np.isnan(best):
        _cell(ax, row, column, failed or "\N{EN DASH}", MISSING)
    else:
        part = (np.log10(max(best, 1e-300)) - _ERRORS[0]) / (_ERRORS[1] - _ERRORS[0])
        place = 1.0 - float(np.clip(part, 0.0, 1.0))
        _cell(ax, row, column, _power(best), colours(place), failed)


def _ratio_cell(
    ax: Axes, row: int, column: int, ratio: float, time: float, solver: str, colours: Colormap
) -> None:
    if np.isnan(time):
        _cell(ax, row, column, "\N{EN DASH}", MISSING)
    elif solver == BASE or np.isnan(ratio):
        _cell(ax, row, column, _seconds(time), PALE if np.isnan(ratio) else colours(1.0))
    else:
        part = (np.log10(ratio) - _RATIOS[0]) / (_RATIOS[1] - _RATIOS[0])
        _cell(ax, row, column, _ratio(ratio), colours(1.0 - float(np.clip(part, 0.0, 1.0))))


def _cell(ax: Axes, row: int, column: int, text: str, colour: ColorType, corner: str = "") -> None:
    from matplotlib.patches import Rectangle

    ax.add_patch(Rectangle((column, row), 1, 1, fc=colour, ec="white", lw=0.8))
    ink = BLACK if _bright(colour) else "white"
    ax.text(column + 0.5, row + 0.55, text, ha="center", va="center", fontsize=_SIZE, color=ink)
    if corner:
        ax.text(column + 0.93, row + 0.06, corner, ha="right", va="top", fontsize=4.2, color=ink)


def _bright(colour: ColorType) -> bool:
    from matplotlib.colors import to_rgb

    red, green, blue = to_rgb(colour)
    return 0.299 * red + 0.587 * green + 0.114 * blue > 0.5


def _power(value: float) -> str:
    if value < 1e-16:
        return "<1e\N{MINUS SIGN}16"
    return f"{value:.0e}".replace("e-0", "e-").replace("e+0", "e").replace("-", "\N{MINUS SIGN}")


def _ratio(value: float) -> str:
    rounded = float(f"{value:.2g}")
    if rounded >= 1000.0:
        thousands = rounded / 1000.0
        return f"{thousands:.0f}k" if thousands >= 10.0 else f"{thousands:g}k"
    return f"{rounded:.0f}" if rounded >= 10.0 else f"{rounded:g}"


def _seconds(value: float) -> str:
    value = float(f"{value:.2g}")  # 999.9 µs are 1 ms
    for size, unit in ((1.0, "s"), (1e-3, "ms"), (1e-6, "µs")):
        if value >= size:
            rounded = float(f"{value / size:.2g}")
            return f"{rounded:g} {unit}"
    return f"{value * 1e9:.0f} ns"


def _remarks(errors: xr.Dataset) -> list[str]:
    occur = [
        f"{letter} {meaning}"
        for name, (meaning, letter) in FAILURES.items()
        if (errors.verdict == VERDICTS.index(name)).any()
    ]
    return [*occur, "grey: not reached", "blank: another model"]

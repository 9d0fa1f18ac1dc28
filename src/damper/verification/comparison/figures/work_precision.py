"""Work and precision: error against run time, a line for each solver, failures at the margin."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Annotated, Any, ClassVar

import numpy as np
from pydantic import Field

from damper.analysis.labels import capital
from damper.figures.common import panels
from damper.figures.common.layout import wrap
from damper.figures.common.style import BLACK, BLUE, ORANGE, PALE, PURPLE, label
from damper.parameters.lazy import Artist, Axes, Figure, xr
from damper.parameters.units import units_of
from damper.study.fields import one_of
from damper.study.products import Caption
from damper.study.study_file import ProductBase, See
from damper.verification.comparison import GOOD, OUTCOMES

#: One colour for a family of solvers; marker and line distinguish its members.
SOLVER_MARKS: dict[str, dict[str, Any]] = {
    "exact": {"color": BLACK, "marker": "o", "ls": "-"},
    "rk4_step_end": {"color": ORANGE, "marker": "v", "ls": "--"},
    "rk4_located": {"color": ORANGE, "marker": "^", "ls": "-"},
    "dop853": {"color": BLUE, "marker": "s", "ls": "-"},
    "moreau_jean": {"color": PURPLE, "marker": "<", "ls": "-"},
}
_LINE = {"ms": 3.2, "lw": 0.9, "mew": 0.0}
#: Failure -> how it is called at the margin.
FAILURES = {
    "missed": "events missed",
    "left_box": "beyond a wall",
    "stalled": "stalled",
    "capped": "capped",
    "failed": "failed",
}
#: Errors below are drawn there: that is rounding.
LEAST_ERROR = 1e-16
_TOP = 1e1
#: Height of a row of so many panels, and of all else, in inches.
_HEIGHTS, _REST = {1: 2.4, 2: 1.62, 3: 1.62}, 1.5
#: Height of a strip of failures, in decades of the error.
_STRIP = 1.9
_TICKS = (1e-16, 1e-12, 1e-8, 1e-4, 1e0)
_FLOOR_LINE: dict[str, Any] = {"color": "#777777", "lw": 0.6, "ls": ":"}
_MEANINGS = {
    "state_error": "largest error at the end of $x$, $y$, "
    r"$\dot{x}\sqrt{M/K}$ or $\dot{y}\sqrt{M/K}$",
    "impact_time_error": "largest error of an impact time",
    "accumulation_error": "largest error of an accumulation time",
    "release_error": "largest error of a release time",
}


class WorkPrecision(ProductBase):
    """Error against run time, one panel for each scene and one line for each solver."""

    reads: ClassVar[tuple[str, ...]] = ("cube.nc", "timed/timings.nc")

    error: Annotated[str, one_of(_MEANINGS), Field(description="Which error is shown.")] = (
        "state_error"
    )
    caption: Caption = None
    see: See = None


def draw(results: Mapping[str, Any], settings: WorkPrecision) -> Figure:
    """Draw an error of every run over its run time, a panel for each scene with such errors."""
    errors, timings = results["cube"], results["timings"]
    error = settings.error
    known = errors[error].notnull().any(("solver", "level"))
    names = errors.scene.values[known] if known.any() else errors.scene.values
    place = errors.sel(scene=names).assign(run_time=timings.run_time.sel(scene=names))
    strips = _strips(place)
    figure, axes = panels.wrapped_panels(len(names), _HEIGHTS, rest=_REST)
    # Before anything is drawn: where all errors are missing, no limits follow from them.
    _scales(axes[0], place.run_time.values, strips)
    for ax, name in zip(axes, names, strict=True):
        _panel(ax, place.sel(scene=name), error, strips)
        ax.set_title(capital(str(place.title.sel(scene=name).item())), pad=3.0)
    panels.label_outer(axes, "run time / s")
    words = [*_MEANINGS[error].split(), label("", "", units_of(errors[error].attrs))]
    height = figure.get_figheight() - _REST
    figure.supylabel(wrap(words, 15.0 * height), fontsize=8.0)
    return panels.finish(figure, place, settings.caption, _handles(place), _remarks(timings))


def _strips(place: xr.Dataset) -> dict[str, float]:
    """Height of the strip of each failure that occurs; the lowest is next to the panel."""
    occur = [name for name in FAILURES if (place.outcome == OUTCOMES.index(name)).any()]
    return {name: _TOP * 10.0 ** (_STRIP * (k + 0.6)) for k, name in enumerate(occur)}


def _panel(ax: Axes, scene: xr.Dataset, error: str, strips: dict[str, float]) -> None:
    if strips:
        top = _TOP * 10.0 ** (_STRIP * (len(strips) + 0.2))
        ax.axhspan(_TOP, top, color=PALE, lw=0.0, zorder=0)
    ax.axhline(LEAST_ERROR, **_FLOOR_LINE, zorder=1)
    nothing = True
    for solver in scene.solver.values.tolist():
        place = scene.sel(solver=solver)
        time, outcome = place.run_time.values, place.outcome.values
        look = SOLVER_MARKS[solver] | _LINE
        shown = np.where(outcome == GOOD, np.clip(place[error].values, LEAST_ERROR, _TOP), np.nan)
        ax.plot(time, shown, **look, zorder=3)
        nothing &= not np.isfinite(shown).any()
        for name, height in strips.items():
            at = outcome == OUTCOMES.index(name)
            if at.any():
                marks = look | {"ls": "none", "mew": 0.6, "mfc": "none"}
                ax.plot(time[at], np.full(at.sum(), height), **marks, zorder=2)
    if nothing:
        panels.note_empty_panel(ax, "nothing to compare")


def _scales(ax: Axes, times: np.ndarray, strips: dict[str, float]) -> None:
    from matplotlib.ticker import FixedLocator, LogLocator, NullFormatter, NullLocator

    ax.set_xscale("log")
    ax.set_yscale("log")
    good = times[np.isfinite(times)]
    if good.size:
        ax.set_xlim(good.min() / 2.0, good.max() * 2.0)
    ax.set_ylim(LEAST_ERROR / 5.0, _TOP * 10.0 ** (_STRIP * (len(strips) + 0.2)))
    texts = [r"$\leq 10^{-16}$", *(f"$10^{{{round(np.log10(t))}}}$" for t in _TICKS[1:-1]), "$1$"]
    ax.yaxis.set_major_locator(FixedLocator([*_TICKS, *strips.values()]))
    ax.yaxis.set_minor_locator(NullLocator())
    ax.set_yticklabels([*texts, *(FAILURES[name] for name in strips)])
    ax.xaxis.set_major_locator(LogLocator(numticks=8))
    ax.xaxis.set_minor_formatter(NullFormatter())


def _handles(place: xr.Dataset) -> list[Artist]:
    return [
        panels.legend_line(label, **(SOLVER_MARKS[solver] | _LINE))
        for solver, label in zip(place.solver.values, place.label.values, strict=True)
    ]


def _remarks(timings: xr.Dataset) -> list[str]:
    processor = timings.attrs.get("processor")
    return ["open marks on grey: failed runs", *([str(processor)] if processor else [])]

"""Work and precision: error against run time, a line for each solver, failures at the margin."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Annotated, Any, ClassVar, Literal

import numpy as np
from pydantic import Field

from damper.figures.common.layout import head, legend, say, wrap
from damper.figures.common.style import COLUMN, PAGE, PALE, units_text
from damper.study.fields import Some, Text, one_of
from damper.verification.base import (
    Made,
    OptionalCaption,
)
from damper.verification.comparison.best import FILES, GOOD_RUN, check_same_runs
from damper.verification.comparison.errors import VERDICTS
from damper.verification.comparison.marks import FAILURES, line_of

if TYPE_CHECKING:
    import xarray as xr
    from matplotlib.artist import Artist
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

#: Panels of one page, and of one row.
MOST, _COLUMNS = 12, 3
#: Errors below are drawn there: that is rounding.
LEAST_ERROR = 1e-16
_TOP = 1e1
#: Height of a strip of failures, in decades of the error.
_STRIP = 1.9
_TICKS = (1e-16, 1e-12, 1e-8, 1e-4, 1e0)
_FLOOR_LINE: dict[str, Any] = {"color": "#777777", "lw": 0.6, "ls": ":"}
_MEANINGS = {
    "state_error": "error of displacements and velocities at the end",
    "impact_time_error": "largest error of an impact time",
    "accumulation_error": "largest error of an accumulation time",
    "release_error": "largest error of a release time",
}


Scenes = Annotated[
    Some[Text] | None,
    Field(description="Names of the scenes to show; all of the study when not given."),
]


class WorkPrecision(Made):
    """Error against run time, one panel for each scene and one line for each solver."""

    reads: ClassVar[tuple[str, ...]] = FILES

    error: Annotated[str, one_of(_MEANINGS), Field(description="Which error is shown.")] = (
        "state_error"
    )
    scenes: Scenes = None
    each: Annotated[
        Literal["scene"] | None,
        Field(description="`scene`: a file for each scene, in place of one with all."),
    ] = None
    caption: OptionalCaption = None

    def files(self, stem: str, study: Any) -> dict[str, dict[str, Any]]:
        settings = self.model_dump(exclude_none=True, exclude={"each"})
        if self.each is None:
            return {stem: settings}
        return {
            f"{stem}_{scene}": settings | {"scenes": (scene,)}
            for scene in self.scenes or study.scenes
        }


def draw(
    errors: xr.Dataset,
    timings: xr.Dataset,
    *,
    error: str = "state_error",
    scenes: Sequence[str] | None = None,
    caption: str | None = None,
) -> Figure:
    """Draw one error of every run over its run time, one panel for each scene.

    Parameters
    ----------
    errors, timings : xarray.Dataset
        Of the same scenes, solvers and settings; see `damper.verification.comparison.cube`.
    error : str
        Variable of `errors`.
    scenes : sequence of str, optional
        Names of the scenes to show, 12 at most; all in which there is such an error when not given.
        One alone fits a column.
    caption : str, optional
        Heading; the title when not given.

    Returns
    -------
    matplotlib.figure.Figure

    Raises
    ------
    ValueError
        For an unknown error or scene, more scenes than fit a page, or datasets of different runs.
    """
    from matplotlib.figure import Figure

    check_same_runs(errors, timings)
    if error not in _MEANINGS:
        raise ValueError(f"error = {error!r}: must be one of {', '.join(_MEANINGS)}")
    names = shown_scenes(errors, scenes)
    if scenes is None:  # of some scenes no run has such an error
        known = errors[error].notnull().any(("solver", "level"))
        names = [name for name in names if known.sel(scene=name)] or names
    if len(names) > MOST:
        raise ValueError(f"{len(names)} scenes do not fit a page: give at most {MOST} in scenes")
    place = errors.sel(scene=names).assign(run_time=timings.run_time.sel(scene=names))
    strips = _strips(place)
    columns = min(len(names), _COLUMNS)
    rows = -(-len(names) // columns)
    wide = COLUMN if columns == 1 else PAGE
    tall = 2.4 if columns == 1 else 1.62
    figure = Figure(figsize=(wide, 1.5 + tall * rows), layout="constrained")
    axes = figure.subplots(rows, columns, sharex=True, sharey=True, squeeze=False)
    for ax in axes.ravel()[len(names) :]:
        ax.remove()
    # Before anything is drawn: where all errors are missing, no limits follow from them.
    _scales(axes[0, 0], place.run_time.values, strips)
    for number, (ax, name) in enumerate(zip(axes.ravel(), names, strict=False)):
        _panel(ax, place.sel(scene=name), error, strips)
        ax.set_title(_capital(str(place.title.sel(scene=name).item())), pad=3.0)
        if number + columns >= len(names):  # nothing below
            ax.tick_params(labelbottom=True)
            ax.set_xlabel("run time / s")
    units = units_text(errors[error].attrs["units"])
    figure.supylabel(
        wrap([*_MEANINGS[error].split(), f"/ {units}"], 15.0 * tall * rows), fontsize=8.0
    )
    head(figure, place, caption, remarks=_remarks(timings))
    legend(figure, _handles(place))
    return figure


def shown_scenes(errors: xr.Dataset, scenes: Sequence[str] | None) -> list[str]:
    """Names of the scenes to show.

    Raises
    ------
    ValueError
        For an unknown one, with the known ones.
    """
    known = errors.scene.values.tolist()
    for name in scenes or ():
        if name not in known:
            raise ValueError(f"no scene {name!r}: must be one of {', '.join(known)}")
    return list(scenes or known)


def _strips(place: xr.Dataset) -> dict[str, float]:
    """Height of the strip of each failure that occurs; the lowest is next to the panel."""
    occur = [name for name in FAILURES if (place.verdict == VERDICTS.index(name)).any()]
    return {name: _TOP * 10.0 ** (_STRIP * (k + 0.6)) for k, name in enumerate(occur)}


def _panel(ax: Axes, scene: xr.Dataset, error: str, strips: dict[str, float]) -> None:
    if strips:
        top = _TOP * 10.0 ** (_STRIP * (len(strips) + 0.2))
        ax.axhspan(_TOP, top, color=PALE, lw=0.0, zorder=0)
    ax.axhline(LEAST_ERROR, **_FLOOR_LINE, zorder=1)
    nothing = True
    for solver in scene.solver.values.tolist():
        place = scene.sel(solver=solver)
        time, verdict = place.run_time.values, place.verdict.values
        look = line_of(solver)
        shown = np.where(
            verdict == GOOD_RUN, np.clip(place[error].values, LEAST_ERROR, _TOP), np.nan
        )
        ax.plot(time, shown, **look, zorder=3)
        nothing &= not np.isfinite(shown).any()
        for name, height in strips.items():
            at = verdict == VERDICTS.index(name)
            if at.any():
                marks = look | {"ls": "none", "mew": 0.6, "mfc": "none"}
                ax.plot(time[at], np.full(at.sum(), height), **marks, zorder=2)
    if nothing:
        say(ax, "nothing to compare")


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
    ax.set_yticklabels([*texts, *(FAILURES[name][0] for name in strips)])
    ax.xaxis.set_major_locator(LogLocator(numticks=8))
    ax.xaxis.set_minor_formatter(NullFormatter())


def _handles(place: xr.Dataset) -> list[Artist]:
    """Of the solvers that some scene suits."""
    from matplotlib.lines import Line2D

    return [
        Line2D([], [], label=str(place.label.sel(solver=solver).item()), **line_of(solver))
        for solver in place.solver.values.tolist()
        if (place.verdict.sel(solver=solver) >= 0).any()
    ]


def _remarks(timings: xr.Dataset) -> list[str]:
    processor = timings.attrs.get("processor")
    return ["open marks on grey: failed runs", *([str(processor)] if processor else [])]


def _capital(text: str) -> str:
    return text[:1].upper() + text[1:]

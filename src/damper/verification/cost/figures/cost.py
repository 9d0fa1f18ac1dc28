"""What the parts of the software cost: the ladder of scenes, and growth with lanes and periods."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import TYPE_CHECKING, Annotated, Any, ClassVar

import numpy as np
from pydantic import Field

from damper.figures.common.layout import legend, wrap
from damper.figures.common.style import BLUE, ORANGE, PAGE, VERMILION
from damper.study.fields import Choice
from damper.verification.base import (
    Made,
    OptionalCaption,
)

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

_MB = 1e6
_ROW = 0.19
"""Height of a rung in inches."""
_GUIDE: dict[str, Any] = {"color": "#777777", "lw": 0.8, "ls": ":"}
_LINE: dict[str, Any] = {"color": "#B0B0B0", "lw": 0.7, "zorder": 0}
_LOOKS: dict[str, dict[str, Any]] = {
    "bare": {"color": BLUE, "marker": "o", "ls": "-", "label": "bare engine"},
    "observed": {"color": VERMILION, "marker": "s", "ls": "--", "label": "observed"},
}
_ASKED: dict[str, Any] = {"color": ORANGE, "marker": "", "ls": "-.", "lw": 0.9}


class CostFigure(Made):
    """Time and memory beside the bare engine: of a ladder of scenes, or as runs grow."""

    reads: ClassVar[tuple[str, ...]] = ("timed/cost.json",)

    show: Annotated[
        str,
        Choice("ladder", "scaling"),
        Field(description="Every rung, or run time and memory over lanes and periods."),
    ]
    caption: OptionalCaption = None


def draw(timings: Mapping[str, Any], *, show: str, caption: str | None = None) -> Figure:
    """Draw one part of the timings.

    Parameters
    ----------
    timings : mapping
        From `damper.verification.cost.measure.measure`, or its file.
    show : {"ladder", "scaling"}
        Time and memory of scenes and observers against the bare engine, or of lanes and periods.
    caption : str, optional
        Heading above the line that names the machine.

    Returns
    -------
    matplotlib.figure.Figure

    Raises
    ------
    ValueError
        For an unknown part, or one that the timings do not have.
    """
    if show not in _SHOWN:
        raise ValueError(f"show = {show!r}: must be one of {', '.join(_SHOWN)}")
    if show not in timings:
        raise ValueError(f"the timings have no {show}: {', '.join(timings)}")
    return _SHOWN[show](timings, caption)


def _ladder(timings: Mapping[str, Any], caption: str | None) -> Figure:
    from matplotlib.figure import Figure
    from matplotlib.lines import Line2D

    ladder = timings["ladder"]
    rungs = ladder["rungs"]
    figure = Figure(figsize=(PAGE, 1.25 + _ROW * len(rungs)), layout="constrained")
    time, memory = figure.subplots(1, 2, sharey=True, width_ratios=(3, 2))
    places = np.arange(len(rungs))
    low, _, high = ladder["noise"]
    time.axvspan(min(low, 2.0 - high), max(high, 2.0 - low), color="#E4E4E4", lw=0.0, zorder=0)
    time.axvline(1.0, **_LINE)
    handles = []
    rows: tuple[tuple[str, dict[str, Any], float], ...] = (
        ("over_bare", {"color": VERMILION, "marker": "s"}, 0.0),
        ("over_base", {"color": BLUE, "marker": "o"}, -0.22),
        ("over_rigid", {"color": ORANGE, "marker": "^"}, 0.22),
    )
    for key, look, shift in rows:
        spreads = [_ratio(rung, key) for rung in rungs.values()]
        values = np.array([spread[1] for spread in spreads])
        if np.isnan(values).all():
            continue
        ends = np.array([[spread[1] - spread[0], spread[2] - spread[1]] for spread in spreads]).T
        time.errorbar(
            values, places + shift, xerr=np.abs(ends), ls="", ms=3.4, lw=0.0, elinewidth=0.8, **look
        )
        handles.append(Line2D([], [], ls="", ms=3.4, label=_RATIOS[key], **look))
    time.set_xscale("log")
    _plain(time)
    time.set_xlabel("ratio of times per event, median and quartiles")
    time.set_yticks(places, list(rungs))
    time.set_ylim(len(rungs) - 0.4, -0.6)
    if all("memory" in rung for rung in rungs.values()):
        for key, width, color in (("more", 0.62, "#BBD7E8"), ("asked", 0.26, BLUE)):
            sizes = [max(rung["memory"][key], 0) / _MB for rung in rungs.values()]
            memory.barh(places, sizes, width, color=color)
            handles.append(Line2D([], [], color=color, lw=5.0, label=_MEMORY[key]))
        memory.set_xlabel("peak memory beyond the bare engine / MB")
    memory.tick_params(left=False, labelleft=False)
    for ax in (time, memory):
        ax.grid(axis="y", color="#EEEEEE", lw=0.6)
        ax.set_axisbelow(True)
    _head(
        figure,
        timings,
        caption or "Time and memory of scenes and observers against the bare engine",
        f"{ladder['repeats']} interleaved repeats; grey: two runs of the same",
    )
    legend(figure, handles)
    return figure


_RATIOS = {
    "over_bare": "observed / bare engine of the scene",
    "over_base": "bare engine / that of the first scene",
    "over_rigid": "bare engine / rigid with the same numbers",
}
_MEMORY = {"more": "whole process", "asked": "arrays and log asked for"}


def _scaling(timings: Mapping[str, Any], caption: str | None) -> Figure:
    from matplotlib.figure import Figure
    from matplotlib.lines import Line2D
    from matplotlib.ticker import LogLocator

    scaling = timings["scaling"]
    figure = Figure(figsize=(PAGE, 4.6), layout="constrained")
    axes = figure.subplots(2, 2, sharex="col", sharey="row")
    for column, along in enumerate(("lanes", "periods")):
        time, memory = axes[:, column]
        for how, rows in scaling[along].items():
            size = np.asarray(rows["size"], dtype=float)
            look = {"lw": 0.9, "ms": 3.0} | _LOOKS[how]
            time.plot(size, rows["seconds"], **look)
            memory.plot(size, np.maximum(np.asarray(rows["memory"]), 1024) / _MB, **look)
            if how == "observed":
                memory.plot(size, np.asarray(rows["asked"]) / _MB, **_ASKED)
            else:
                largest, longest = size[-1], rows["seconds"][-1]
                guide = np.array([size[0], largest])
                time.plot(guide, 0.4 * longest * guide / largest, **_GUIDE)
            slope = f"{rows['time_slope']:.2f}"
            time.text(
                0.04,
                0.94 if how == "bare" else 0.85,
                f"slope {slope} {_LOOKS[how]['label']}",
                transform=time.transAxes,
                fontsize=7.0,
                va="top",
                color=_LOOKS[how]["color"],
            )
        for ax in (time, memory):
            ax.set_xscale("log")
            ax.set_yscale("log")
            ax.minorticks_off()
            ax.xaxis.set_major_locator(LogLocator(numticks=9))
        words = {
            "lanes": f"lanes of {scaling['lane_periods']} periods",
            "periods": "periods of one lane",
        }
        memory.set_xlabel(f"number of {words[along]}")
    axes[0, 0].set_ylabel("run time / s")
    axes[1, 0].set_ylabel("peak memory beyond\na run of one lane / MB")
    figure.align_ylabels()
    _head(
        figure,
        timings,
        caption or "Run time and peak memory against lanes and periods",
        f"observed by {', '.join(name.replace('_', ' ') for name in scaling['observers'])}",
    )
    handles = [Line2D([], [], lw=0.9, ms=3.0, **look) for look in _LOOKS.values()]
    handles.append(Line2D([], [], label="arrays of the observers", **_ASKED))
    handles.append(Line2D([], [], label="slope 1", **_GUIDE))
    legend(figure, handles)
    return figure


_SHOWN: dict[str, Callable[[Mapping[str, Any], str | None], Figure]] = {
    "ladder": _ladder,
    "scaling": _scaling,
}


def _ratio(rung: Mapping[str, Any], key: str) -> Sequence[float]:
    """Return the quartiles of a ratio, NaN where it says nothing new."""
    missing = [np.nan] * 3
    if key == "over_bare" and not rung["observers"]:
        return missing
    if key == "over_base" and rung["observers"]:
        return missing
    return rung.get(key, missing)


def _plain(ax: Axes) -> None:
    """Mark a logarithmic axis of ratios in plain numbers."""
    from matplotlib.ticker import LogLocator, NullFormatter

    ax.xaxis.set_major_locator(LogLocator(subs=(1.0, 2.0, 5.0)))
    ax.xaxis.set_major_formatter("{x:g}")
    ax.xaxis.set_minor_formatter(NullFormatter())


def _head(figure: Figure, timings: Mapping[str, Any], caption: str, remark: str) -> None:
    letters = figure.get_figwidth() * 16.0
    machine = f"{timings['machine']}, {timings['core']};"
    lines = [wrap(caption.split(), letters), wrap([*machine.split(), *remark.split()], letters)]
    figure.suptitle("\n".join(lines), fontsize=8.5)

"""What the parts of a run cost: the benchmark suite, and growth with runs and periods."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Annotated, Any, ClassVar, Literal

import numpy as np
from pydantic import Field

from damper.figures.common.layout import legend, wrap
from damper.figures.common.style import BLUE, ORANGE, PAGE, VERMILION
from damper.verification.base import Made, OptionalCaption
from damper.verification.cost.tables.cost import slopes
from damper.verification.labels import label_of
from damper.verification.timing import machine_text

if TYPE_CHECKING:
    from matplotlib.figure import Figure

_MB = 1e6
_ROW = 0.19
"""Height of a case in inches."""
_GUIDE: dict[str, Any] = {"color": "#777777", "lw": 0.8, "ls": ":", "label": "slope 1"}
_RATIOS: dict[str, dict[str, Any]] = {
    "over_bare": {"color": VERMILION, "marker": "s", "label": "observed / bare engine"},
    "over_base": {"color": BLUE, "marker": "o", "label": "bare engine / that of the first case"},
    "over_rigid": {"color": ORANGE, "marker": "^", "label": "bare engine / rigid damper"},
}
_MEMORY: dict[str, dict[str, Any]] = {
    "memory": {"height": 0.62, "color": "#BBD7E8", "label": "memory of the process"},
    "arrays": {"height": 0.26, "color": BLUE, "label": "arrays of the observers"},
}
_LINES: dict[str, dict[str, Any]] = {
    "bare": {"color": BLUE, "marker": "o", "ls": "-", "label": "bare engine"},
    "observed": {"color": VERMILION, "marker": "s", "ls": "--", "label": "observed"},
}
_ARRAYS: dict[str, Any] = {
    "color": ORANGE,
    "ls": "-.",
    "lw": 0.9,
    "label": "arrays of the observers",
}


class CostFigure(Made):
    """Time and memory beside the bare engine: of a benchmark suite, or as runs grow."""

    reads: ClassVar[tuple[str, ...]] = ("timed/cost.json",)

    show: Annotated[
        Literal["suite", "growth"],
        Field(description="Every case, or run time and memory over runs and periods."),
    ]
    caption: OptionalCaption = None


def draw(timings: Mapping[str, Any], *, show: str, caption: str | None = None) -> Figure:
    """Draw one part of the timings.

    Parameters
    ----------
    timings : mapping
        From `damper.verification.cost.measure.measure`, or its file.
    show : {"suite", "growth"}
        Time and memory of cases against the bare engine, or of growing runs.
    caption : str, optional
        Heading above the line that names the machine.

    Returns
    -------
    matplotlib.figure.Figure
    """
    figure, usual, remark = (_suite if show == "suite" else _growth)(timings[show])
    letters = figure.get_figwidth() * 16.0
    machine = f"{machine_text(timings['machine'])}; {remark}"
    lines = [wrap((caption or usual).split(), letters), wrap(machine.split(), letters)]
    figure.suptitle("\n".join(lines), fontsize=8.5)
    return figure


def _suite(suite: Mapping[str, Any]) -> tuple[Figure, str, str]:
    from matplotlib.figure import Figure
    from matplotlib.ticker import LogLocator, NullFormatter

    cases = suite["cases"]
    figure = Figure(figsize=(PAGE, 1.25 + _ROW * len(cases)), layout="constrained")
    time, memory = figure.subplots(1, 2, sharey=True, width_ratios=(3, 2))
    low, _, high = suite["noise"]
    time.axvspan(min(low, 2.0 - high), max(high, 2.0 - low), color="#E4E4E4", lw=0.0, zorder=0)
    time.axvline(1.0, color="#B0B0B0", lw=0.7, zorder=0)
    handles: list[Any] = []
    for key, look in _RATIOS.items():
        there = [k for k, case in enumerate(cases.values()) if key in case]
        if there:
            low, middle, high = np.transpose([list(cases.values())[k][key] for k in there])
            ends = np.abs([middle - low, high - middle])
            shown = {"ls": "", "ms": 3.4, "elinewidth": 0.8} | look
            # The two ratios of a bare engine stand one above the other.
            places = np.asarray(there) + {"over_base": -0.2, "over_rigid": 0.2}.get(key, 0.0)
            handles.append(time.errorbar(middle, places, xerr=ends, **shown))
    time.set_xscale("log")
    time.xaxis.set_major_locator(LogLocator(subs=(1.0, 2.0, 5.0)))
    time.xaxis.set_major_formatter("{x:g}")
    time.xaxis.set_minor_formatter(NullFormatter())
    time.set_xlabel("ratio of times per event, median and quartiles")
    time.set_yticks(range(len(cases)), [label_of(name) for name in cases])
    time.set_ylim(len(cases) - 0.4, -0.6)
    for key, look in _MEMORY.items():
        sizes = [max(case.get(key, 0), 0) / _MB for case in cases.values()]
        handles.append(memory.barh(range(len(cases)), sizes, **look))
    memory.set_xlabel("peak memory beyond the bare engine / MB")
    memory.tick_params(left=False, labelleft=False)
    for ax in (time, memory):
        ax.grid(axis="y", color="#EEEEEE", lw=0.6)
        ax.set_axisbelow(True)
    legend(figure, handles)
    return (
        figure,
        "Time and memory of benchmark cases against the bare engine",
        f"{suite['repeats']} interleaved repeats; grey: two timings of the same",
    )


def _growth(growth: Mapping[str, Any]) -> tuple[Figure, str, str]:
    from matplotlib.figure import Figure
    from matplotlib.ticker import LogLocator

    figure = Figure(figsize=(PAGE, 4.6), layout="constrained")
    axes = figure.subplots(2, 2, sharex="col", sharey="row")
    handles: list[Any] = []
    for (time, memory), along in zip(axes.T, ("runs", "periods"), strict=True):
        handles = []
        for how, rows in growth[along].items():
            size, seconds = (np.asarray(rows[key], dtype=float) for key in ("size", "seconds"))
            look = {"lw": 0.9, "ms": 3.0} | _LINES[how]
            handles += time.plot(size, seconds, **look)
            memory.plot(size, np.maximum(rows["memory"], 1024) / _MB, **look)
        handles += memory.plot(size, np.asarray(rows["arrays"]) / _MB, **_ARRAYS)
        handles += time.plot(size, 0.2 * seconds[-1] * size / size[-1], **_GUIDE)
        time.set_title(slopes(growth[along]), fontsize=7.5)
        for ax in (time, memory):
            ax.set_xscale("log")
            ax.set_yscale("log")
            ax.minorticks_off()
            ax.xaxis.set_major_locator(LogLocator(numticks=9))
    axes[1, 0].set_xlabel("number of runs of ten periods")
    axes[1, 1].set_xlabel("number of periods of one run")
    axes[0, 0].set_ylabel("run time / s")
    axes[1, 0].set_ylabel("peak memory beyond\na short run / MB")
    figure.align_ylabels()
    legend(figure, handles)
    return (
        figure,
        "Run time and peak memory against number of runs and periods",
        f"observed by {', '.join(map(label_of, growth['observers']))}",
    )

"""What the parts of a run cost: time and memory of every case beside the bare engine."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, ClassVar

import numpy as np

from damper.analysis.labels import label_of
from damper.figures.common.layout import heading, legend
from damper.figures.common.panels import panel_grid
from damper.figures.common.style import BLUE, ORANGE, VERMILION
from damper.parameters.lazy import Figure
from damper.verification.base import Made, OptionalCaption, See
from damper.verification.timing import machine_text

_ROW = 0.19
"""Height of a case in inches."""
_RATIOS: dict[str, dict[str, Any]] = {
    "over_bare": {"color": VERMILION, "marker": "s", "label": "observed / bare engine"},
    "over_base": {"color": BLUE, "marker": "o", "label": "bare engine / first case"},
    "over_rigid": {"color": ORANGE, "marker": "^", "label": "bare engine / rigid damper"},
}


class CostFigure(Made):
    """Time and memory of every case beside the bare engine."""

    reads: ClassVar[tuple[str, ...]] = ("timed/cost.json",)

    caption: OptionalCaption = None
    see: See = None


def draw(results: Mapping[str, Any], settings: CostFigure) -> Figure:
    """Draw time and memory of cases, as `measure` found them, against the bare engine."""
    from matplotlib.ticker import LogLocator, NullFormatter

    timings = results["cost"]
    cases = timings["cases"]
    shared: dict[str, Any] = {"sharex": False, "sharey": True, "width_ratios": (3, 2)}
    figure, ((time, memory),) = panel_grid(1, 2, height=1.25 + _ROW * len(cases), **shared)
    low, _, high = timings["noise"]
    time.axvspan(min(low, 2.0 - high), max(high, 2.0 - low), color="#E4E4E4", lw=0.0, zorder=0)
    time.axvline(1.0, color="#B0B0B0", lw=0.7, zorder=0)
    handles: list[Any] = []
    for key, look in _RATIOS.items():
        there = [k for k, case in enumerate(cases.values()) if key in case]
        if there:
            low, middle, high = np.transpose([case[key] for case in cases.values() if key in case])
            ends = np.abs([middle - low, high - middle])
            # The two ratios of one bare engine stand one above the other.
            both = [{"over_base", "over_rigid"} <= case.keys() for case in cases.values()]
            apart = {"over_base": -0.2, "over_rigid": 0.2}.get(key, 0.0)
            places = np.asarray(there) + apart * np.asarray(both)[there]
            shown = {"ls": "", "ms": 3.4, "elinewidth": 0.8} | look
            handles.append(time.errorbar(middle, places, xerr=ends, **shown))
    time.set_xscale("log")
    time.xaxis.set_major_locator(LogLocator(subs=(1.0, 2.0, 5.0)))
    time.xaxis.set_major_formatter("{x:g}")
    time.xaxis.set_minor_formatter(NullFormatter())
    time.set_xlabel("ratio of times per event, median and quartiles")
    time.set_yticks(range(len(cases)), [label_of(name) for name in cases])
    time.set_ylim(len(cases) - 0.4, -0.6)
    sizes = [case.get("arrays", 0) / 1e6 for case in cases.values()]
    bars = memory.barh(range(len(cases)), sizes, height=0.6, color=BLUE)
    texts = [f"{size:.2g}" if size else "" for size in sizes]
    memory.bar_label(bars, texts, padding=2.0, fontsize=7.0)
    memory.margins(x=0.12)
    memory.set_xlabel("arrays of the observers / MB")
    memory.tick_params(left=False, labelleft=False)
    for ax in (time, memory):
        ax.grid(axis="y", color="#EEEEEE", lw=0.6)
        ax.set_axisbelow(True)
    legend(figure, handles)
    letters = figure.get_figwidth() * 15.0  # of versions, whose digits are wide
    usual = "Time and memory of benchmark cases against the bare engine"
    # The table has the versions, too.
    machine = {name: timings["machine"][name] for name in ("processor", "cores")}
    about = f"{machine_text(machine)}; {timings['repeats']} interleaved repeats;"
    parts = [about, "grey: spread of two timings of the same case"]
    heading(figure, (settings.caption or usual).split(), parts, letters=letters)
    return figure

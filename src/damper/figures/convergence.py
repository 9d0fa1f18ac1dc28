"""Convergence: the distance to the rigid damper over the stiffness of the contact."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any, ClassVar

import numpy as np

from damper.analysis.convergence import distance_to_rigid, order_of_convergence
from damper.analysis.places import value_on
from damper.figures.common.layout import place_label, place_text, wrap
from damper.figures.common.panels import finish, legend_line, note_empty_panel, panel_grid
from damper.figures.common.style import BLUE, COLUMN, ORANGE, label
from damper.parameters.lazy import Axes, Figure
from damper.parameters.units import units_of
from damper.study.messages import Mistakes
from damper.study.products import At, Caption, FigureSettings, Role, StudyContents
from damper.tables.convergence import Compared, Conventions, Stiffness, check_convergence

_PANEL = 1.35
"""Height of a panel in inches."""
_STYLES: tuple[dict[str, Any], ...] = (
    {"color": BLUE, "marker": "o", "ls": "-", "lw": 0.9, "ms": 2.8},
    {"color": ORANGE, "marker": "s", "ls": "--", "lw": 0.9, "ms": 2.8},
)
_HALF: dict[str, Any] = {"color": "#777777", "lw": 0.8, "ls": ":"}


class Convergence(FigureSettings):
    """The distance to the rigid damper over the stiffness of a compliant contact, and its order."""

    roles: ClassVar[Mapping[str, Role]] = {"along": Role(least=2), "lines": Role(most=2)}
    runs_more = True

    variables: Compared
    along: Stiffness
    lines: Conventions = None
    at: At = None
    caption: Caption = None

    def check_against(self, study: StudyContents, mistakes: Mistakes) -> None:
        super().check_against(study, mistakes)
        check_convergence(self, study, mistakes)


def draw(results: Mapping[str, Any], settings: Convergence) -> Figure:
    """Draw the distance of each variable to that of the rigid damper, one panel each.

    The cube is of a study with no axes but those of the contact, with the study in its attributes.
    Of sections the last sample counts, of records of bursts the first one.
    """
    cube = results["cube"]
    variables, along, lines = settings.variables, settings.along, settings.lines
    at = {name: value_on(cube[name], value) for name, value in (settings.at or {}).items()}
    place = cube.sel(at).sortby(along)
    found = distance_to_rigid(place, variables, along)
    height = 1.2 + _PANEL * len(variables)
    figure, axes = panel_grid(len(variables), width=COLUMN, height=height)
    values = place[lines].values.tolist() if lines else [None]
    for ax, name in zip(axes.flat, variables, strict=True):
        rows = found[found["variable"] == name]
        drawn = [rows[rows[lines] == value] if lines else rows for value in values]
        _panel(ax, place[along].values, [line["distance"].to_numpy() for line in drawn])
        attrs = cube[name].attrs
        words = [r"$|\Delta|$", *_SHORT.get(name, attrs.get("long_name", name)).split()]
        units = label("", "", units_of(attrs))
        ax.set_ylabel(wrap([*words, *([units] if units else [])], _PANEL * 16.0))
    axes[-1, 0].set_xlabel(place_label(place, along, 0.7 * COLUMN))
    handles = []
    for value, look in zip(values, _STYLES, strict=False):
        if lines:
            text = _TENSION.get(value) if lines == "contact_tension" else None
            handles.append(legend_line(text or place_text(place, lines, value), **look))
    handles.append(legend_line("slope \N{MINUS SIGN}1/2", **_HALF))
    remark = r"$|\Delta|$: distance to the value with rigid walls"
    return finish(figure, place, settings.caption, handles, [remark])


def _panel(ax: Axes, stiffness: np.ndarray, lines: Sequence[np.ndarray]) -> None:
    """Draw distances over the stiffness, with their slopes and a slope to compare with."""
    for distance, look in zip(lines, _STYLES, strict=False):
        ax.plot(stiffness, np.where(distance > 0.0, distance, np.nan), **look)
    last = lines[-1][-1]
    if last > 0.0:
        ax.plot(stiffness, 0.4 * last * (stiffness / stiffness[-1]) ** -0.5, **_HALF)
    ax.set_xscale("log")
    if any((distance > 0.0).any() for distance in lines):
        ax.set_yscale("log")
        # Each in the colour of its line.
        corner: dict[str, Any] = {"ha": "right", "va": "top", "fontsize": 7.0}
        for row, (distance, look) in enumerate(zip(lines, _STYLES, strict=False)):
            text = f"slope, stiffer half: {order_of_convergence(stiffness, distance):.2f}"
            place = 0.98, 0.97 - 0.1 * row
            text = text.replace("-", "\N{MINUS SIGN}")
            ax.text(*place, text, transform=ax.transAxes, color=look["color"], **corner)
    else:
        note_empty_panel(ax, "no distance to show")
    ax.minorticks_off()
    ax.set_xlim(stiffness.min() / 1.5, stiffness.max() * 3.0)


_TENSION = {0.0: "releases at zero force", 1.0: "holds until the gap reopens"}
#: Meanings that are too long for a panel.
_SHORT = {
    "burst_onset": "time of first impact",
    "burst_duration": "duration of the burst",
    "burst_accumulation_time": "time of sticking",
    "burst_sticking_time": "length of sticking",
    "displacement": "displacement on section",
    "velocity": "velocity on section",
}

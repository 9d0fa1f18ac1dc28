"""The closed-form motion with two impacts per period, drawn over a bifurcation diagram."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any

import numpy as np

from damper.analysis.closed_forms import admissible_orbits, damper_at, dense, section_point
from damper.figures.common.panels import legend_line
from damper.figures.common.style import BLACK, THEORY
from damper.figures.overlays import Panels, reach
from damper.parameters.lazy import Artist, Axes, xr
from damper.study.settings import SECTIONS
from damper.sweep.record import observers_of
from damper.theory.free_decay import least_at_resonance
from damper.theory.two_impacts import Orbit

_SHOWN = ("displacement", "velocity", "peak_displacement")
#: Points of the curve between two of the diagram, and most of them in all.
_BETWEEN, _MOST = 4, 600
#: The stable motion lies beneath the points, as a band of which a rim shows where they agree.
_CURVES: dict[bool, dict[str, Any]] = {
    True: {"color": THEORY, "alpha": 0.6, "lw": 3.4, "ls": "-", "zorder": 1.5},
    False: {"color": THEORY, "lw": 1.1, "ls": (0, (3.0, 1.2)), "zorder": 3.0},
}
_LEAST: dict[str, Any] = {
    "color": BLACK,
    "ls": "",
    "marker": "D",
    "mfc": "white",
    "ms": 4.0,
    "zorder": 4.0,
}


def overlay(panels: Panels) -> list[Artist]:
    """Draw both closed-form motions over `displacement`, `velocity` and `peak_displacement`."""
    axes, (along,), panel, *_ = panels
    observers = observers_of(panel)
    section = {name: observers[name] for name in SECTIONS if name in observers}
    grid = panel[along].values
    values = dense(grid, _BETWEEN, _MOST)
    found = admissible_orbits(panel, along, values)
    stable = np.array([[bool(o and o.stable) for o in both] for both, _ in found])
    exists = np.array([[o is not None for o in both] for both, _ in found])
    points = np.full((*exists.shape, len(_SHOWN)), np.nan)
    sides = np.zeros(exists.shape)
    sampled = not axes.keys().isdisjoint(_SHOWN[:2])
    for i, (both, units) in enumerate(found):
        for k, orbit in enumerate(both):
            if orbit is not None:
                sides[i, k] = _side(orbit, section)
                x, v = section_point(orbit, section) if sampled else (math.nan, math.nan)
                points[i, k] = x * units.length, v * units.speed, orbit.peak * units.length
    for name, ax in axes.items():
        if name not in _SHOWN:
            continue
        column = _SHOWN.index(name)
        # The peak is the same whatever the side.
        parts = np.zeros_like(sides) if name == "peak_displacement" else sides
        for is_stable, style in _CURVES.items():
            for side in np.unique(parts[exists]):
                shown = exists & (stable == is_stable) & (parts == side)
                for branch in np.where(shown, points[..., column], np.nan).T:
                    ax.plot(values, branch, **style)
        reach(ax, points[stable, column])
    handles = _handles(bool(stable.any()), bool((exists & ~stable).any()))
    if along == "clearance" and "peak_displacement" in axes:
        handles += _mark_least(axes["peak_displacement"], panel, grid)
    return handles


def _mark_least(ax: Axes, panel: xr.Dataset, grid: np.ndarray) -> list[Artist]:
    """Mark the least amplitude at resonance, where the clearance for it is in the grid."""
    damper, _ = damper_at(panel, clearance=float(grid[0]))
    if damper.frequency_ratio != 1.0 or damper.restitution == 1.0:
        return []
    least = least_at_resonance(damper)
    if not grid.min() <= least.clearance <= grid.max():
        return []
    ax.plot(least.clearance, least.amplitude, **_LEAST)
    # The mark has a size of its own.
    reach(ax, np.array([0.9 * least.amplitude]))
    return [legend_line("least amplitude by the closed form of a light free mass", **_LEAST)]


def _side(orbit: Orbit, section: Mapping[str, Mapping[str, Any]]) -> float:
    """Sign that changes where an impact passes the section: the velocity jumps there."""
    if "stroboscopic_section" not in section:
        return 0.0
    when = section["stroboscopic_section"].get("when", 0.0)
    return math.copysign(
        1.0, math.sin(math.tau * when + orbit.parameters.phase - orbit.forcing_phase)
    )


def _handles(stable: bool, unstable: bool) -> list[Artist]:
    texts = {
        True: "two impacts per period, closed form, stable",
        False: "two impacts per period, closed form, unstable",
    }
    shown = [kind for kind, seen in ((True, stable), (False, unstable)) if seen]
    return [legend_line(texts[kind], **_CURVES[kind]) for kind in shown]

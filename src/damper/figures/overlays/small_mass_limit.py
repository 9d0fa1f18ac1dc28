"""The small-mass limit r_crit(G), drawn over a map of bursts."""

from __future__ import annotations

import math
from functools import cache
from typing import Any

import numpy as np

from damper.analysis.closed_forms import damper_at, reduced_gap
from damper.figures.common.panels import legend_line
from damper.figures.common.style import BLACK, SKY
from damper.figures.overlays import Panels
from damper.parameters.lazy import Artist
from damper.theory.small_mass import critical_restitution

#: Reduced gaps of the curve, closer where it is steeper; it starts at r_crit(0) = 1.
_GAPS = np.concatenate([[0.0], math.pi * np.linspace(0.1, 1.0, 61) ** 3])
_CURVE: dict[str, Any] = {"color": SKY, "lw": 0.9}


def overlay(panels: Panels) -> list[Artist]:
    """Draw r_crit(2 d / A) over a panel of a map, A the steady amplitude of the primary alone.

    Its axes are restitution and clearance (or gap), either way round.
    """
    from matplotlib.patheffects import withStroke

    (ax,), (x, y) = panels.axes.values(), panels.over
    free = y if x == "restitution" else x
    limits = ax.get_xlim(), ax.get_ylim()
    # G is proportional to the free travel.
    scale = reduced_gap(damper_at(panels.cube, restitution=0.0, **{free: 1.0})[0])
    if scale == 0.0:  # undamped at resonance: no amplitude lasts
        return []
    values = _GAPS / scale
    pair = (values, _critical()) if free == x else (_critical(), values)
    # A dark rim, so that the line is seen on every colour.
    ax.plot(*pair, **_CURVE, path_effects=[withStroke(linewidth=1.6, foreground=BLACK)])
    ax.set(xlim=limits[0], ylim=limits[1])
    text = r"small-mass limit $r_\mathrm{crit}(2d/A)$"
    return [legend_line(text, **_CURVE)]


@cache
def _critical() -> np.ndarray:
    """r_crit along the curve, the same in every panel."""
    return critical_restitution(_GAPS)

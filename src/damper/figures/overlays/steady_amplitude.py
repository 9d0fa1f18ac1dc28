"""The steady amplitude without damper, drawn over a map of frequency ratio and clearance."""

from __future__ import annotations

from typing import Any

import numpy as np

from damper.analysis.closed_forms import damper_at
from damper.figures.common.panels import legend_line
from damper.figures.common.style import BLACK
from damper.figures.overlays import Panels
from damper.parameters.lazy import Artist
from damper.theory import require_basic
from damper.theory.steady import steady_amplitude

_CURVE: dict[str, Any] = {"color": BLACK, "lw": 0.9, "ls": (0, (3.0, 1.5))}
#: Points of the curve.
_POINTS = 400


def overlay(panels: Panels) -> list[Artist]:
    """Draw d = A over a map of clearance over frequency ratio, with one damping ratio.

    Beyond it the steady primary does not reach the walls.
    """

    (ax,) = panels.axes.values()
    limits = ax.get_ylim()
    values = np.linspace(*ax.get_xlim(), _POINTS)
    damper, _ = damper_at(panels.cube, frequency_ratio=1.0, clearance=1.0)
    require_basic(damper)
    zeta = damper.damping_ratio
    ax.plot(values, [steady_amplitude(zeta, omega) for omega in values], **_CURVE)
    ax.set_ylim(limits)
    return [legend_line("$d = A$, amplitude without damper", **_CURVE)]

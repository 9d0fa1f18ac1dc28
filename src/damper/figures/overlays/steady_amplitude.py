"""The steady amplitude without damper, drawn over a map of frequency ratio and clearance."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from damper.analysis.closed_forms import damper_at
from damper.engine.steady import steady_amplitude
from damper.figures.common.style import BLACK
from damper.theory import need_basic

if TYPE_CHECKING:
    import xarray as xr
    from matplotlib.artist import Artist
    from matplotlib.axes import Axes

_CURVE: dict[str, Any] = {"color": BLACK, "lw": 0.9, "ls": (0, (3.0, 1.5))}
#: Points of the curve.
_POINTS = 400


def overlay(ax: Axes, panel: xr.Dataset, x: str, y: str) -> list[Artist]:
    """Draw d = A over one panel: beyond it the steady primary does not reach the walls.

    Parameters
    ----------
    ax : Axes
    panel : xarray.Dataset
        The panel's part of the cube, with one damping ratio.
    x, y : str
        frequency_ratio and clearance.

    Returns
    -------
    list of Artist
        What the legend has to say.
    """
    from matplotlib.lines import Line2D

    limits = ax.get_ylim()
    values = np.linspace(*ax.get_xlim(), _POINTS)
    damper, _ = damper_at(panel, frequency_ratio=1.0, clearance=1.0)
    need_basic(damper)
    zeta = damper.damping_ratio
    ax.plot(values, [steady_amplitude(zeta, omega) for omega in values], **_CURVE)
    ax.set_ylim(limits)
    return [Line2D([], [], label="$d = A$, amplitude without damper", **_CURVE)]

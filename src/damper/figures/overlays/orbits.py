"""Branches of periodic motions, drawn over a bifurcation diagram."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

import numpy as np

from damper.analysis.runs import runs
from damper.figures.common.style import BLACK, GREEN

if TYPE_CHECKING:
    import xarray as xr
    from matplotlib.artist import Artist
    from matplotlib.axes import Axes

#: Stable and unstable orbits.
_LINES: dict[bool, dict[str, Any]] = {
    True: {"color": GREEN, "lw": 1.4, "ls": "-", "zorder": 3.0},
    False: {"color": GREEN, "lw": 0.8, "ls": (0, (3.0, 1.2)), "zorder": 3.0},
}
#: Kind of special point -> its marker.
_MARKERS = {
    "fold": "o",
    "period doubling": "s",
    "torus": "D",
    "symmetry breaking": "^",
    "branch point": "v",
    "grazing": "x",
    "complete chatter": "*",
}


def overlay(
    axes: Mapping[str, Axes], panel: xr.Dataset, along: str, branches: xr.Dataset
) -> list[Artist]:
    """Draw the branches of a row of a bifurcation diagram, with their special points.

    Parameters
    ----------
    axes : mapping of str to Axes
        Of `displacement`, `velocity`, or both.
    panel : xarray.Dataset
        The row's part of the cube: scalar coordinates, and the axis of the abscissa.
    along : str
        Axis of the abscissa.
    branches : xarray.Dataset
        From `damper.analysis.orbits.follow_orbits`.

    Returns
    -------
    list of Artist
        What the legend has to say.
    """
    from matplotlib.lines import Line2D

    drawn: dict[str, Artist] = {}
    for k in np.flatnonzero(branches.along.values == along):
        others = (name for name in branches.data_vars if name in panel.coords and name != along)
        if any(float(branches[name][k]) != float(panel[name]) for name in others):
            continue
        orbits = branches.isel(orbit=branches.branch.values == k)
        points = branches.isel(point=branches.point_branch.values == k)
        for name, ax in axes.items():
            limits = ax.get_xlim(), ax.get_ylim()
            for stable, style in _LINES.items():
                for first, last in runs(orbits.stable.values == stable):
                    # One more orbit, so that the pieces join.
                    part = orbits.isel(orbit=slice(first, last + 2))
                    ax.plot(part.value, part[name], **style)
                text = "periodic motion, " + ("stable" if stable else "unstable")
                drawn[text] = Line2D([], [], label=text, **style)
            for kind, marker in _MARKERS.items():
                here = points.isel(point=points.kind.values == kind)
                if here.sizes["point"]:
                    style = {"ls": "", "marker": marker, "ms": 3.0, "color": BLACK, "mew": 0.6}
                    style |= {} if marker == "x" else {"mfc": "white"}
                    x = np.repeat(here.point_value.values, here.sizes["turn"])
                    values = here[f"point_{name}"].values.ravel()
                    ax.plot(x, values, zorder=4.0, **style)
                    drawn[kind] = Line2D([], [], label=kind, **style)
            ax.set(xlim=limits[0], ylim=limits[1])
    return list(drawn.values())

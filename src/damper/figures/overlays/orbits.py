"""Branches of periodic motions over a bifurcation diagram, and special points over a map."""

from __future__ import annotations

from typing import Any

import numpy as np

from damper.analysis.runs import runs
from damper.figures.common.layout import jumps
from damper.figures.common.panels import legend_line
from damper.figures.common.style import BLACK, THEORY
from damper.figures.overlays import Panels
from damper.parameters.lazy import Artist, xr
from damper.sweep.orbits import MARKERS

#: Stable and unstable orbits.
_LINES: dict[bool, dict[str, Any]] = {
    True: {"color": THEORY, "lw": 1.4, "ls": "-", "zorder": 3.0},
    False: {"color": THEORY, "lw": 0.8, "ls": (0, (3.0, 1.2)), "zorder": 3.0},
}
#: A step is a jump if it is so many times as high as those beside it, and such a part of the line.
_JUMP, _LEAST_JUMP = 5.0, 0.02
#: Room beside the stable motions, over their range.
_MARGIN = 0.3
#: Curves of special points, and the rim by which they are seen on every colour.
_CURVE: dict[str, Any] = {"color": THEORY, "lw": 1.2}
#: The variable that is the size of the multipliers, and changes at which none is 1.
_SIZES, _NOT_AT_ONE = "multiplier", ("grazing", "complete chatter")


def overlay(panels: Panels) -> list[Artist]:
    """Draw branches and special points over one axis, or the curves of these over two."""
    return _branches(panels) if len(panels.over) == 1 else _curves(panels)


def _branches(panels: Panels) -> list[Artist]:
    """Draw branches over `displacement`, `velocity` and `multiplier`, with their special points."""
    axes, (along,), panel, results, about_orbits = panels
    branches = results["orbits"]
    drawn: dict[str, Artist] = {}
    stable_values: dict[str, list[np.ndarray]] = {name: [] for name in axes}
    for k in np.flatnonzero(branches.along.values == along):
        if not _there(branches.isel(branch=k), panel, along):
            continue
        orbits = branches.isel(orbit=branches.branch.values == k)
        points = branches.isel(point=branches.point_branch.values == k)
        for name, ax in ((name, ax) for name, ax in axes.items() if name in orbits):
            limits = ax.get_xlim(), ax.get_ylim()
            for stable, style in _LINES.items():
                for first, last in runs(orbits.stable.values == stable):
                    # Unstable pieces reach to the stable ones.
                    reach = 0 if stable else 1
                    part = orbits.isel(orbit=slice(max(first - reach, 0), last + 1 + reach))
                    for column in part[name].values.reshape(part.sizes["orbit"], -1).T:
                        # An impact passes the section there.
                        places = jumps(column, _JUMP, _LEAST_JUMP)
                        ax.plot(
                            *(np.insert(a, places, np.nan) for a in (part.value.values, column)),
                            **style,
                        )
                        stable_values[name] += [column] * stable
                text = "periodic motion, " + ("stable" if stable else "unstable")
                drawn[text] = legend_line(text, **style)
            for kind, marker in MARKERS.items():
                here = points.isel(point=points.kind.values == kind)
                # At grazing and the border of chatter no multiplier is 1: they are marked above.
                if here.sizes["point"] and not (name == _SIZES and kind in _NOT_AT_ONE):
                    style = {"ls": "", "marker": marker, "ms": 3.0, "color": BLACK, "mew": 0.6}
                    style |= {} if marker == "x" else {"mfc": "white"}
                    values = _at_one(here[f"point_{name}"].values, name == _SIZES)
                    x = np.repeat(here.point_value.values, values.shape[1])
                    ax.plot(x, values.ravel(), zorder=4.0, **style)
                    drawn[kind] = legend_line(kind, **style)
            ax.set(xlim=limits[0], ylim=limits[1])
    for name in axes.keys() - {_SIZES} if about_orbits else ():
        if stable_values[name]:
            every = np.concatenate(stable_values[name])
            low, high = np.nanmin(every), np.nanmax(every)
            margin = _MARGIN * (high - low) or _MARGIN * max(abs(high), 1.0)
            axes[name].set_ylim(low - margin, high + margin)
    return list(drawn.values())


def _at_one(values: np.ndarray, are_sizes: bool) -> np.ndarray:
    """Values of special points to mark: of sizes of multipliers the one nearest to 1."""
    if not are_sizes:
        return values
    distances = np.where(np.isfinite(values), abs(values - 1.0), np.inf)
    return np.take_along_axis(values, distances.argmin(axis=1)[:, None], axis=1)


def _curves(panels: Panels) -> list[Artist]:
    """Draw the curves of special points over a map, where both its axes are theirs."""
    from matplotlib.patheffects import withStroke

    (ax,), (x, y) = panels.axes.values(), panels.over
    panel, branches = panels.cube, panels.results["orbits"]
    drawn: dict[str, Artist] = {}
    limits = ax.get_xlim(), ax.get_ylim()
    for k, curve in enumerate(branches.curve_branch.values):
        branch, other = branches.isel(branch=curve), str(branches.curve_other[k].item())
        points = branches.isel(curve_point=branches.curve.values == k)
        values = {str(branch.along.item()): points.curve_value, other: points.curve_other_value}
        if set(values) != {x, y} or not _there(branch, panel, x, y):
            continue
        ax.plot(values[x], values[y], **_CURVE, path_effects=[withStroke(linewidth=2.0)])
        kind = str(branches.curve_kind[k].item())
        text = f"border of {kind}" if kind == "complete chatter" else kind
        drawn[text] = legend_line(text, **_CURVE)
    ax.set(xlim=limits[0], ylim=limits[1])
    return list(drawn.values())


def _there(branch: xr.Dataset, panel: xr.Dataset, *along: str) -> bool:
    """Whether a branch lies at the place of a panel."""
    others = (name for name in branch.variables if name in panel.coords and name not in along)
    return all(float(branch[name]) == float(panel[name]) for name in others)

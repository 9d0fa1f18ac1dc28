"""What is drawn over a figure: a theory, or the study's orbits; a file for each, with `overlay`."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from importlib import import_module
from typing import Any, NamedTuple

import numpy as np

from damper.parameters.lazy import Artist, Axes, xr


class Panels(NamedTuple):
    """Panels of one part of a cube, for an overlay, which returns what the legend is to list."""

    axes: Mapping[str, Axes]
    """Variable -> its panel; an overlay leaves those of others as they are."""
    over: tuple[str, ...]
    """Axis of the abscissa, and that of the ordinate of a map."""
    cube: xr.Dataset
    """The part that is shown: scalar coordinates, and the axes `over`."""
    results: Mapping[str, Any]
    """Everything that the figure reads."""
    about_orbits: bool = False
    """Whether displacement and velocity are to be shown about those of the stable orbits."""


def overlay_modules(theory: str | None = None, orbits: bool = False) -> list[str]:
    """Return the modules that draw over a figure with these settings."""
    names = [*([theory] if theory else []), *(["orbits"] if orbits else [])]
    return [f"{__name__}.{name}" for name in names]


def draw_overlays(panels: Panels, theory: str | None, orbits: bool = False) -> Iterator[Artist]:
    """Draw what these settings ask for; yield what the legend is to list."""
    for module in overlay_modules(theory, orbits):
        yield from import_module(module).overlay(panels)


def reach(ax: Axes, values: np.ndarray) -> None:
    """Widen the ordinate so that it shows some values as well."""
    low, high = ax.get_ylim()
    ends = (values.min(), values.max()) if values.size else (low, high)
    if ax.get_yscale() == "log":
        ax.set_ylim(min(low, ends[0] / 1.1), max(high, ends[1] * 1.1))
        return
    margin = 0.03 * (max(high, ends[1]) - min(low, ends[0]))
    ax.set_ylim(
        ends[0] - margin if ends[0] < low else low, ends[1] + margin if ends[1] > high else high
    )

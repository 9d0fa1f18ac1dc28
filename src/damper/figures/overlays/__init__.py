"""What is drawn over a figure: a theory, or the study's orbits; a file for each, with `overlay`."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from importlib import import_module
from typing import Any, NamedTuple

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


def overlay_modules(theory: str | None = None, orbits: bool = False) -> list[str]:
    """Return the modules that draw over a figure with these settings."""
    names = [*([theory] if theory else []), *(["orbits"] if orbits else [])]
    return [f"{__name__}.{name}" for name in names]


def draw_overlays(panels: Panels, theory: str | None, orbits: bool = False) -> Iterator[Artist]:
    """Draw what these settings ask for; yield what the legend is to list."""
    for module in overlay_modules(theory, orbits):
        yield from import_module(module).overlay(panels)

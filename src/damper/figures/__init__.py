"""Figures: cubes -> plots, one file for each kind, with the class of its settings and its `draw`.

The file's name is that of the kind. matplotlib is loaded where a figure is drawn.
"""

from collections.abc import Mapping
from typing import Any

from damper.study.kinds import FIGURES

#: What `theory` of a kind may be -> module; each has an `overlay`.
THEORY = {
    name: f"damper.figures.overlays.{name}"
    for name in ("two_impacts", "small_mass_limit", "steady_amplitude")
}


def draw(kind: str, cube: Any, **settings: Any) -> Any:
    """Draw one figure.

    Parameters
    ----------
    kind : str
        A key of `damper.study.kinds.FIGURES`.
    cube : xarray.Dataset or None
        What it shows; None for a kind that shows no results.
    **settings
        Those of the kind's ``draw``.

    Returns
    -------
    matplotlib.figure.Figure

    Raises
    ------
    ValueError
        For an unknown kind, with the known ones.
    """
    return FIGURES.module(kind).draw(cube, **settings)


def modules(kind: str, settings: Mapping[str, Any]) -> list[str]:
    """Modules that draw a figure of these settings: that of its kind, and of what is over it."""
    theory = settings.get("theory")
    over = [THEORY[theory]] if theory else []
    return [kind, *over, *(["damper.figures.overlays.orbits"] if settings.get("orbits") else [])]

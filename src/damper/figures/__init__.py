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


def draw(kind: str, *results: Any, **settings: Any) -> Any:
    """Draw one figure.

    Parameters
    ----------
    kind : str
        A key of `damper.study.kinds.FIGURES`.
    *results : xarray.Dataset
        What it shows: most kinds a cube, some the study's orbits as well.
    **settings
        Those of the kind; they are not checked against the cube.

    Returns
    -------
    matplotlib.figure.Figure

    Raises
    ------
    ValueError
        For an unknown kind, with the known ones; for settings that the kind has not or that are
        wrong, with what is allowed.
    """
    module = FIGURES.module(kind)
    given = {name: value for name, value in settings.items() if value is not None}
    return module.draw(*results, settings=FIGURES[kind].checked(kind, {"kind": kind, **given}))


def modules(kind: str, settings: Mapping[str, Any]) -> list[str]:
    """Modules that draw a figure of these settings: that of its kind, and of what is over it."""
    theory = settings.get("theory")
    over = [THEORY[theory]] if theory else []
    return [kind, *over, *(["damper.figures.overlays.orbits"] if settings.get("orbits") else [])]

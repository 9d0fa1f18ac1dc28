"""Figures: cubes -> plots, one file each. matplotlib is imported here only."""

from importlib import import_module
from typing import Any

#: Kind in study files -> module; each has `draw(cube, **settings) -> Figure`.
FIGURES = {
    name: f"damper.figures.{name}"
    for name in (
        "bifurcation",
        "map",
        "curves",
        "trajectory",
        "histories",
        "phase_portrait",
        "accumulation",
        "convergence",
    )
}


def draw(kind: str, cube: Any, **settings: Any) -> Any:
    """Draw one figure of a cube.

    Parameters
    ----------
    kind : str
        A key of `FIGURES`.
    cube : xarray.Dataset
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
    if kind not in FIGURES:
        raise ValueError(f"unknown figure kind {kind!r}: must be one of {', '.join(FIGURES)}")
    return import_module(FIGURES[kind]).draw(cube, **settings)

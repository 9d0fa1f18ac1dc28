"""Figures: cubes -> plots, one file each. matplotlib is imported here only."""

from collections.abc import Mapping
from importlib import import_module
from typing import Any

#: Kind in study files -> module; each has `draw(cube, **settings) -> Figure`.
FIGURES = {
    **{
        name: f"damper.figures.{name}"
        for name in (
            "bifurcation",
            "map",
            "curves",
            "trajectory",
            "histories",
            "phase_portrait",
            "accumulation",
            "free_mass",
            "schematic",
            "slow_manifold",
            "convergence",
        )
    },
    "profiles": "damper.papers.calibration.profiles",
    "work_precision": "damper.verification.comparison.work_precision",
    "solver_summary": "damper.verification.comparison.summary",
    "stress": "damper.verification.stress.figure",
    "twins": "damper.verification.stress.twins_figure",
    "cost": "damper.verification.cost.figure",
}
#: What `theory` of a kind may be -> module; each has an `overlay`.
THEORY = {name: f"damper.figures.{name}" for name in ("two_impacts", "small_mass_limit")}


def draw(kind: str, *cubes: Any, **settings: Any) -> Any:
    """Draw one figure.

    Parameters
    ----------
    kind : str
        A key of `FIGURES`.
    *cubes : xarray.Dataset
        What it shows: one cube, None for a kind that shows no results, or, for a study that checks
        the engine, what each of the files holds that the kind reads.
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
    return import_module(FIGURES[kind]).draw(*cubes, **settings)


def modules(settings: Mapping[str, Any]) -> list[str]:
    """Modules that draw a figure of these settings: kind, and theory if any."""
    theory = settings.get("theory")
    return [FIGURES[settings["kind"]], *([THEORY[theory]] if theory else [])]

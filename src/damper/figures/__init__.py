"""Figures: results -> plots, one file for each kind, with the class of its settings and its `draw`.

The file's name is that of the kind. matplotlib is loaded where a figure is drawn.
"""

from collections.abc import Mapping
from typing import Any

from damper.figures.overlays import overlay_modules
from damper.study.kinds import FIGURES


def draw(kind: str, results: Mapping[str, Any], **settings: Any) -> Any:
    """Draw one figure.

    Parameters
    ----------
    kind : str
        A key of `damper.study.kinds.FIGURES`.
    results : mapping of str to xarray.Dataset
        What it shows, by name: ``cube``; of some kinds also, or only, the study's ``orbits``.
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
    module, checked = FIGURES.asked(kind, settings)
    return module.draw(results, checked)


def modules(kind: str, settings: Mapping[str, Any]) -> list[str]:
    """Modules that draw a figure of these settings: that of its kind, and of what is over it."""
    over = {name: settings[name] for name in ("theory", "orbits") if name in settings}
    return [kind, *overlay_modules(**over)]

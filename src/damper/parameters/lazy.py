"""Libraries that take long to load, imported where something of theirs is first used.

Matplotlib's names here serve annotations only.
"""

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    import pandas as pd
    import xarray as xr
    from matplotlib.artist import Artist
    from matplotlib.axes import Axes
    from matplotlib.axis import Axis
    from matplotlib.figure import Figure
    from matplotlib.ticker import Formatter
else:

    class _Library:
        """Stands for a library until it is needed."""

        def __init__(self, name: str) -> None:
            self._name = name

        def __getattr__(self, name: str) -> Any:
            value = getattr(import_module(self._name), name)
            setattr(self, name, value)
            return value

    pd, xr = _Library("pandas"), _Library("xarray")
    Artist = Axes = Axis = Figure = Formatter = Any

__all__ = ["Artist", "Axes", "Axis", "Figure", "Formatter", "pd", "xr"]

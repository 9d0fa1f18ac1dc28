"""Exact event-driven dynamics of impact dampers, and the studies built on it.

Layers, each importing only those above it:

1. `quantities`: names, ranges, meanings. `parameters`: `Parameters`, `State`, SI units. No
   numerics.
2. `flow`: exact linear flow of a forced oscillator, its derivatives and their bounds. `linear`:
   the primary's steady response without the damper.
3. `contact`: restitution law, certified search for impacts, burst tail, sticking, release.
4. `engine`: the event loop of one trajectory; its product is the segment log. `event_list` turns
   the log into the array that `events` returns.
   `theory` has closed forms to compare with.
5. `observers`: one file each, each a pass over the segment log.
6. `points`, `lanes`: many points of a study through engine and observers.
7. `comparison`: other solvers on the same scenes, and how far off each one is. `stress`: the
   engine on extreme parameters. `cost`: what each part costs. Only their studies load them.
8. `study`: YAML -> slices -> cubes -> tables; xarray is imported here (and by `simulate`).
9. `figures`: cubes -> plots; matplotlib is imported here only.

`compiled` (numba where it is installed) stands beside them. Importing damper loads none of
these: a name loads what it needs when it is first used.
"""

from importlib import import_module
from typing import Any

__version__ = "0.1.0"

#: Name -> the module that holds it.
HOME = {
    "Parameters": "damper.parameters",
    "SIParameters": "damper.parameters",
    "State": "damper.parameters",
    "events": "damper.event_list",
    "simulate": "damper.simulation",
}

__all__ = ["Parameters", "SIParameters", "State", "__version__", "events", "simulate"]


def __getattr__(name: str) -> Any:
    if name not in HOME:
        raise AttributeError(f"module 'damper' has no attribute {name!r}")
    value = getattr(import_module(HOME[name]), name)
    globals()[name] = value
    return value


def __dir__() -> list[str]:
    return sorted({*globals(), *__all__})

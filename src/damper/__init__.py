"""Exact event-driven dynamics of impact dampers, and the studies built on it.

Layers, each importing only those above it:

1. `parameters`: `Parameters`, `State`, SI units; names, ranges, meanings. No numerics.
2. `engine`: one run. `oscillator`: exact linear flow of a forced oscillator, its derivatives and
   their bounds. `steady`: the primary's steady response without the damper. `search`: restitution
   law, certified search for impacts, burst tail, sticking, release. `trajectory`: the event loop;
   its product is the segment log. `compiled`: numba where it is installed.
   `models`: one package for each model of the damper, what the event loop asks of it.
3. `observers`: one file each, each a pass over the segment log; a model's `response` is beside it.
   `theory`: closed forms to compare with.
4. `sweep`: points through engine and observers: runs, slices, cubes, `events`, `periodic_orbit`.
   xarray is imported by its cubes.
5. `comparison`: other solvers on the same scenes, and how far off each one is. `stress`: the
   engine on extreme parameters. `cost`: what each part costs. Only their studies load them.
6. `study`: YAML -> slices -> cubes -> tables.
7. `figures`: cubes -> plots; matplotlib is imported here only.

Importing damper loads none of these: a name loads what it needs when it is first used.
"""

from importlib import import_module
from typing import Any

__version__ = "0.1.0"

#: Name -> the module that holds it.
HOME = {
    "Parameters": "damper.parameters",
    "SIParameters": "damper.parameters",
    "State": "damper.parameters",
    "PeriodicOrbit": "damper.sweep.orbits",
    "events": "damper.sweep.events",
    "periodic_orbit": "damper.sweep.orbits",
    "simulate": "damper.study.simulation",
}

__all__ = [
    "Parameters",
    "PeriodicOrbit",
    "SIParameters",
    "State",
    "__version__",
    "events",
    "periodic_orbit",
    "simulate",
]


def __getattr__(name: str) -> Any:
    if name == "analysis":
        return import_module("damper.analysis")
    if name not in HOME:
        raise AttributeError(f"module 'damper' has no attribute {name!r}")
    value = getattr(import_module(HOME[name]), name)
    globals()[name] = value
    return value


def __dir__() -> list[str]:
    return sorted({*globals(), *__all__})

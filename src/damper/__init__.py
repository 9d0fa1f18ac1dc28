"""Exact event-driven dynamics of impact dampers, and the studies built on it.

Rooms, each importing only those above it:

- `parameters`: `Parameters`, `State`, forces, SI units; names, ranges, meanings.
- `engine`: one run, whatever the model: exact flow, certified search, event loop, segment log.
- `models`: one file or folder for each damper. `theory`: closed forms to compare with.
- `observers`: a file for each, which reads the segment log.
- `sweep`: many runs: points, slices, cubes, `events`, `periodic_orbit`, `continue_orbit`,
  `continue_point`, `smallest_shock`.
- `study`: YAML -> slices -> cubes, `simulate`.
- `analysis`, `tables`, `figures`: cubes -> numbers, files, plots.
- `papers`, `verification`, `structures`, `report`: verdicts, studies that check the engine,
  studies of structures, the page.
- `notebook`, `sizing`, `fmu`, `identification`, `shell`: `run`, the accessor of cubes, `design`,
  FMUs, `identify`, the command `damper`.

Importing damper loads none of these: a name loads what it needs when it is first used.
"""

from importlib import import_module
from typing import Any

__version__ = "0.1.0"

#: Name -> the module that holds it.
HOME = {
    "Base": "damper.parameters.forcing",
    "Harmonic": "damper.parameters.forcing",
    "Harmonics": "damper.parameters.forcing",
    "NoForce": "damper.parameters.forcing",
    "Noise": "damper.parameters.forcing",
    "Parameters": "damper.parameters",
    "Record": "damper.parameters.forcing",
    "Recording": "damper.identification.recordings",
    "SIParameters": "damper.parameters",
    "State": "damper.parameters",
    "Structure": "damper.parameters.structure",
    "Unbalance": "damper.parameters.forcing",
    "PeriodicOrbit": "damper.sweep.orbits.periodic",
    "continue_orbit": "damper.sweep.orbits.branch",
    "continue_point": "damper.sweep.orbits.point_curve",
    "design": "damper.sizing.answer",
    "identify": "damper.identification.answer",
    "read_recording": "damper.identification.recordings",
    "equal_masses": "damper.parameters.masses",
    "events": "damper.sweep.events",
    "periodic_orbit": "damper.sweep.orbits.periodic",
    "run": "damper.notebook.run",
    "simulate": "damper.notebook",
    "smallest_shock": "damper.sweep.orbits.shock",
    "start": "damper.sweep.started",
    "EventKind": "damper.engine.segment",
    **dict.fromkeys(
        ("IMPACT", "STICK", "RELEASE", "STOPPED", "REST", "SLIP", "REVERSAL"),
        "damper.sweep.events",
    ),
}

__all__ = sorted([*HOME, "__version__"])


def __getattr__(name: str) -> Any:
    if name == "analysis":
        return import_module("damper.analysis")
    if name not in HOME:
        message = f"module 'damper' has no attribute {name!r}"
        # Python names the nearest one.
        raise AttributeError(message, name=name, obj=import_module(__name__))
    value = getattr(import_module(HOME[name]), name)
    globals()[name] = value
    return value


def __dir__() -> list[str]:
    return sorted([*__all__, "analysis"])

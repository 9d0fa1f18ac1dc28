"""Compile parts of a model into numba's cache by running short scenes.

Parts are the event loop with observers ("engine+bursts+impacts"), under a force of another
sort than the harmonic one ("engine_record_force+bursts"), with a weight ("engine_weight+bursts")
or friction of several masses or on a structure ("engine_friction"), orbits ("orbits"),
or solvers of a comparison ("solvers+dop853+exact").
"""

import sys
from pathlib import Path
from typing import Any

from damper.engine.compiled import COMPILED, compile_at_once
from damper.parameters.models import MODELS

sys.stderr = open(snakemake.log[0], "w", buffering=1)

MODEL, (PART, *NAMES) = snakemake.wildcards.model, snakemake.wildcards.parts.split("+")
POINT = {
    "mass_ratio": 0.1,
    "damping_ratio": 0.05,
    "frequency_ratio": 0.2,
    "clearance": 0.25,
    "restitution": 0.3,
} | (MODELS[MODEL].example if MODEL in MODELS else {})


#: Kind of a force -> an example; what names its sort beside the kind is its setting.
FORCES = {
    "none": ("", {}),
    "base": ("frame", {}),
    "harmonics": ("", {"orders": [1, 2], "amplitudes": [1.0, 0.5]}),
    "record": ("of", {"time": [0.0, 1.0, 2.0], "value": [0.0, 1.0, 0.0]}),
}


def force_of_part() -> Any:
    """Return an example of the force under which the part runs; None for a harmonic one."""
    from damper.parameters.forcing import forcing_of

    sort = PART.removesuffix("_weight").removesuffix("_friction")
    if sort == "engine":
        return None
    _, kind, *word = sort.split("_", 2)
    key, example = FORCES[kind]
    return forcing_of({"kind": kind, **example, **({key: word[0]} if word else {})})


def run_observers() -> None:
    from damper.observers import observer_class
    from damper.sweep.slices import simulate_slice

    point = POINT | ({"gravity": 0.1} if PART.endswith("_weight") else {})
    point |= {"friction": 0.01} if PART.endswith("_friction") else {}

    def asked(name):
        several = MODEL == "several" and "bodies" in observer_class(name).settings
        return {name: {"bodies": [0]} if several else None}

    # Not all at once: two sections exclude each other.
    for observers in ({}, *map(asked, NAMES)):
        simulate_slice(
            point,
            {},
            transient=1,
            periods=1,
            observers=observers,
            forcing=force_of_part(),
            accuracy=1e-12,
            max_events=1000,
        )


def run_structure() -> None:
    from damper.parameters.dampers import SIParameters
    from damper.parameters.structure import Structure
    from damper.sweep.structures import measured_grid

    shapes = {"tip": [1.0, -1.0], "force": [1.0, 0.5], "base": [1.0, 0.5]}
    mass = {"box": "tip", "free_mass": 0.1, "gap": 0.04, "restitution": 0.3}
    mass |= {"gravity": 0.1} if PART.endswith("_weight") else {}
    mass |= {"friction_coefficient": 0.01} if PART.endswith("_friction") else {}
    driven = {"force_amplitude": 2.0, "forcing_frequency": 6.0, "transverse_acceleration": 1.0}
    if force := force_of_part():
        driven["forcing"] = force
    if PART.startswith("engine_none"):
        del driven["force_amplitude"]
    made = SIParameters(
        structure=Structure.from_modes([1.0, 6.3], 0.05, shapes), masses=[mass], **driven
    )
    measured_grid(made, {}, (1, 1))


def run_orbits() -> None:
    from damper.analysis.orbits import follow_orbits

    values = POINT | {"clearance": 12.0, "restitution": 0.6}
    del values["frequency_ratio"]
    entry = {"along": "frequency_ratio", "start": 1.0, "period": 1, "settle": 200, "max_orbits": 3}
    follow_orbits({"any": entry}, values, {"frequency_ratio": [0.95, 1.05]})


def run_solvers() -> None:
    from damper.verification.comparison import SOLVERS
    from damper.verification.comparison.solvers import load, read_scene

    scene = read_scene(POINT | {"frequency_ratio": 0.8}, 5.0)
    coarse = {"accuracy": 1e-6, "steps_per_period": 100, "tolerance": 1e-3}
    for name in NAMES:
        load(name).solve(scene, coarse[SOLVERS[name]], 10_000)


compile_at_once()
RUN = {
    "engine": run_structure if MODEL == "structure" else run_observers,
    "orbits": run_orbits,
    "solvers": run_solvers,
}
RUN[PART.partition("_")[0]]()
how = "compiled by numba" if COMPILED else "plain Python: numba is not installed"
Path(snakemake.output[0]).write_text(f"{how}\n")

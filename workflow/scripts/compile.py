"""Compile one part of a model into numba's cache by running one short scene.

Parts are the event loop ("engine"), and each of the observers.
"""

import sys
from pathlib import Path

from damper.engine.compiled import COMPILED, compile_at_once
from damper.models import MODELS
from damper.sweep.slices import simulate_slice

sys.stderr = open(snakemake.log[0], "w", buffering=1)

part = snakemake.wildcards.part
compile_at_once()
simulate_slice(
    {
        "mass_ratio": 0.1,
        "damping_ratio": 0.05,
        "frequency_ratio": 0.2,
        "clearance": 0.25,
        "restitution": 0.3,
    }
    | MODELS[snakemake.wildcards.model],
    {},
    transient=1,
    periods=1,
    observers={} if part == "engine" else {part: None},
    accuracy=1e-12,
    max_events=1000,
)
how = "compiled by numba" if COMPILED else "plain Python: numba is not installed"
Path(snakemake.output[0]).write_text(f"{how}\n")

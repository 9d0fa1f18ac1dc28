"""Compile engine and observers into numba's cache by running one short scene."""

from pathlib import Path

from damper.compiled import COMPILED
from damper.study.slices import simulate_slice

simulate_slice(
    {
        "mass_ratio": 0.1,
        "damping_ratio": 0.05,
        "frequency_ratio": 0.2,
        "clearance": 0.25,
        "restitution": 0.3,
    },
    {},
    transient=1,
    periods=1,
    observers=dict.fromkeys(snakemake.wildcards.observers.split("+")),
    accuracy=1e-12,
    max_events=1000,
)
how = "compiled by numba" if COMPILED else "plain Python: numba is not installed"
Path(snakemake.output[0]).write_text(f"{how}\n")

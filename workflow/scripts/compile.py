"""Compile engine and observers into numba's cache by running one short scene."""

from pathlib import Path

from damper.engine.compiled import COMPILED
from damper.sweep.slices import simulate_slice

#: What a short scene needs to be one of each model.
MODELS = {
    "rigid": {},
    "grounded": {"support_stiffness_ratio": 0.01},
    "compliant": {"contact_stiffness_ratio": 1e4},
    "time_varying": {"modulation_depth": 0.1},
}

# With a model its limit, which runs as a rigid damper.
for model in dict.fromkeys(("rigid", snakemake.wildcards.model)):
    simulate_slice(
        {
            "mass_ratio": 0.1,
            "damping_ratio": 0.05,
            "frequency_ratio": 0.2,
            "clearance": 0.25,
            "restitution": 0.3,
        }
        | MODELS[model],
        {},
        transient=1,
        periods=1,
        observers=dict.fromkeys(snakemake.wildcards.observers.split("+")),
        accuracy=1e-12,
        max_events=1000,
    )
how = "compiled by numba" if COMPILED else "plain Python: numba is not installed"
Path(snakemake.output[0]).write_text(f"{how}\n")

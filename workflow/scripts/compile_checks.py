"""Compile the checks of stress studies into numba's cache by running a short lane of each model."""

from pathlib import Path

from damper.engine.compiled import COMPILED
from damper.stress.checks import run_checks
from damper.stress.identities import run_identities

POINT = {
    "mass_ratio": 0.1,
    "damping_ratio": 0.05,
    "frequency_ratio": 0.2,
    "clearance": 0.25,
    "restitution": 0.3,
}
LANES = [
    POINT | more
    for more in (
        {},
        {"support_stiffness_ratio": 0.01},
        {"contact_stiffness_ratio": 1e4},
        {"modulation_depth": 0.1},
    )
]
run_checks(LANES, 1)
run_identities(LANES, periods=1)
how = "compiled by numba" if COMPILED else "plain Python: numba is not installed"
Path(snakemake.output[0]).write_text(f"{how}\n")

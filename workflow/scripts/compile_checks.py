"""Compile the checks of stress studies for one model into numba's cache by a short run."""

import sys
from pathlib import Path

from damper.engine.compiled import COMPILED, compile_at_once
from damper.models import MODELS
from damper.verification.stress.checks import run_checks
from damper.verification.stress.metamorphic import run_metamorphic

sys.stderr = open(snakemake.log[0], "w", buffering=1)

POINT = {
    "mass_ratio": 0.1,
    "damping_ratio": 0.05,
    "frequency_ratio": 0.2,
    "clearance": 0.25,
    "restitution": 0.3,
} | MODELS[snakemake.wildcards.model]

compile_at_once()
run_checks([POINT], 1)
run_metamorphic([POINT], periods=1)
how = "compiled by numba" if COMPILED else "plain Python: numba is not installed"
Path(snakemake.output[0]).write_text(f"{how}\n")

"""Run all solvers on one scene and compare them with its reference."""

import sys
from pathlib import Path

import numpy as np

from damper.study.fingerprint import stamp
from damper.verification.comparison.reference import read_reference
from damper.verification.comparison.runs import run_scene
from damper.verification.comparison.scene import read_scene

sys.stderr = open(snakemake.log[0], "w", buffering=1)

job = snakemake.params.job
reference = read_reference(Path(snakemake.input.reference))
runs = run_scene(read_scene(**job["scene"]), job["solvers"], reference, job["cap"])
np.savez(snakemake.output[0], **runs)
stamp(snakemake.output, job)

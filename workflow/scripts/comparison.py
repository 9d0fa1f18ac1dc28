"""Gather the errors of all scenes into one cube."""

import sys
from pathlib import Path

import numpy as np

from damper.study.fingerprint import stamp
from damper.sweep.cube import REFERENCES, write_cube
from damper.verification.comparison.cube import gather_errors

sys.stderr = open(snakemake.log[0], "w", buffering=1)

job = snakemake.params.job
parts = {}
for name, path in zip(job["titles"], snakemake.input.errors, strict=True):
    with np.load(path) as file:
        parts[name] = dict(file)
attributes = {**job["about"], "references": REFERENCES, "code_digest": job["code"]}
cube = gather_errors(parts, job["solvers"], job["titles"], attributes)
write_cube(cube, Path(snakemake.output[0]))
stamp(snakemake.output, job)

"""Gather the errors of all scenes into one cube."""

import sys
from pathlib import Path

from damper.study.fingerprint import stamp
from damper.sweep.cube import REFERENCES, write_cube
from damper.sweep.slices import read_part
from damper.verification.comparison.cube import gather_errors

sys.stderr = open(snakemake.log[0], "w", buffering=1)

job = snakemake.params.job
errors = [read_part(Path(path)) for path in snakemake.input.errors]
parts = dict(zip(job["titles"], errors, strict=True))
attributes = {**job["about"], "references": REFERENCES, "code_digest": job["code"]}
cube = gather_errors(parts, job["solvers"], job["titles"], attributes)
write_cube(cube, Path(snakemake.output[0]))
stamp(snakemake.output, job)

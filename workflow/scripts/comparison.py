"""Gather the errors of all scenes into one cube."""

import sys
from pathlib import Path

import numpy as np

from damper.sweep.cube import REFERENCES, write_cube
from damper.verification.comparison.cube import gather_errors

sys.stderr = open(snakemake.log[0], "w", buffering=1)

params = snakemake.params
parts = {}
for name, path in zip(params.titles, snakemake.input, strict=True):
    with np.load(path) as file:
        parts[name] = dict(file)
attributes = {**params.about, "references": REFERENCES, "code_digest": params.code}
cube = gather_errors(parts, params.solvers, params.titles, attributes)
write_cube(cube, Path(snakemake.output[0]))

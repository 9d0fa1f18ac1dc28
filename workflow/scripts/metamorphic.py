"""Run points of a stress study in other ways that must not matter."""

import sys
from pathlib import Path

from damper.study.fingerprint import stamp
from damper.verification.stress.box import random_points
from damper.verification.stress.cube import write_part
from damper.verification.stress.metamorphic import run_metamorphic

sys.stderr = open(snakemake.log[0], "w", buffering=1)

job = snakemake.params.job
asked = job["run"]
runs = random_points(**asked["runs"])
arrays = run_metamorphic(runs, seed=asked["seed"], first=asked["runs"]["first"])
write_part(Path(snakemake.output[0]), runs, arrays)
stamp(snakemake.output, job)

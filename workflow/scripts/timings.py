"""Time all solvers on all scenes; nothing else is to run beside it."""

import sys
from pathlib import Path

from damper.study.fingerprint import stamp
from damper.sweep.cube import write_cube
from damper.verification.comparison.cube import gather_timings
from damper.verification.comparison.scene import read_scene
from damper.verification.comparison.timings import time_solvers
from damper.verification.timing import machine

sys.stderr = open(snakemake.log[0], "w", buffering=1)

job = snakemake.params.job
scenes = {name: read_scene(**scene) for name, scene in job["scenes"].items()}
arrays = time_solvers(scenes, job["solvers"], job["repeats"], job["cap"], job["spend"])
attributes = {**job["about"], **machine(), "code_digest": job["code"]}
cube = gather_timings(arrays, job["solvers"], job["titles"], attributes)
write_cube(cube, Path(snakemake.output[0]))
stamp(snakemake.output, job)

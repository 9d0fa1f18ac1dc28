"""Follow the periodic motions of a study."""

import sys
from pathlib import Path

from damper.analysis.orbits import follow_orbits
from damper.engine.compiled import compile_at_once
from damper.study.fingerprint import stamp
from damper.sweep.cube import write_cube

sys.stderr = open(snakemake.log[0], "w", buffering=1)

job = snakemake.params.job
# Many short runs, known to be worth it.
compile_at_once()
branches = follow_orbits(
    job["orbits"],
    job["fixed"],
    job["axes"],
    job["when"],
    job["forcing"],
    job.get("masses", 0),
    job.get("tables"),
)
for name in job["axes"]:
    branches[name].attrs["axis"] = 1
branches.attrs |= {**job["about"], "code_digest": job["code"]}
write_cube(branches, Path(snakemake.output[0]))
stamp(snakemake.output, job)

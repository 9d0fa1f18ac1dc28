"""Follow the periodic motions of a study."""

import sys
from pathlib import Path

from damper.analysis.orbits import follow_orbits
from damper.study.fingerprint import stamp
from damper.sweep.cube import write_cube

sys.stderr = open(snakemake.log[0], "w", buffering=1)

job = snakemake.params.job
branches = follow_orbits(job["orbits"], job["fixed"], job["axes"], job["at"])
for name in job["axes"]:
    branches[name].attrs["axis"] = 1
branches.attrs |= {**job["about"], "code_digest": job["code"]}
write_cube(branches, Path(snakemake.output[0]))
stamp(snakemake.output, job)

"""Simulate one slice of a study."""

import sys
from pathlib import Path

from damper.study.fingerprint import stamp
from damper.sweep.progress import progress_lines
from damper.sweep.slices import simulate_slice, write_slice

sys.stderr = open(snakemake.log[0], "w", buffering=1)

job = snakemake.params.job
part = simulate_slice(
    job["fixed"],
    job["axes"],
    observers=job["observers"],
    primary=job["primary"],
    draws=job["draws"],
    follow=job["follow"],
    progress=progress_lines(sys.stderr),
    **job["run"],
)
write_slice(part, Path(snakemake.output[0]))
stamp(snakemake.output, job)

"""Take times for a study; nothing else is to run beside it."""

import sys
from importlib import import_module

from damper.study.fingerprint import stamp
from damper.study.jobs import write

sys.stderr = open(snakemake.log[0], "w", buffering=1)

job = snakemake.params.job
made = import_module(job["module"]).measure(**job["settings"])
write(made, snakemake.output[0], job["code"])
stamp(snakemake.output, job)

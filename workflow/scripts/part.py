"""Make one part of a study."""

import sys
from importlib import import_module
from pathlib import Path

from damper.study.fingerprint import stamp
from damper.study.jobs import read_files, read_parts
from damper.sweep.parts import write_part

sys.stderr = open(snakemake.log[0], "w", buffering=1)

job = snakemake.params.job
needed = read_parts(snakemake.input.needs, job["needs"])
files = read_files(snakemake.params.files, job["files"])
part = import_module(job["module"]).run_part(needed, **job["settings"], **files)
write_part(part, Path(snakemake.output[0]))
stamp(snakemake.output, job)

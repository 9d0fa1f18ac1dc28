"""Gather parts of a study into one of its files."""

import sys
from importlib import import_module

from damper.study.fingerprint import stamp
from damper.study.jobs import read_parts, write

sys.stderr = open(snakemake.log[0], "w", buffering=1)

job = snakemake.params.job
parts = read_parts(snakemake.input.needs, job["needs"])
made = import_module(job["module"]).gather(parts, **job["settings"])
write(made, snakemake.output[0], job["code"])
stamp(snakemake.output, job)

"""Judge the papers' statements by the cubes of the studies."""

import sys

from damper.analysis.results import opened
from damper.papers.verdicts import judge, table
from damper.study.fingerprint import stamp

sys.stderr = open(snakemake.log[0], "w", buffering=1)

job = snakemake.params.job
with opened([snakemake.input[name] for name in job["cubes"]]) as cubes:
    found = judge(dict(zip(job["cubes"], cubes, strict=True)))

table(found, job["figures"]).save(snakemake.output.csv, snakemake.output.md)
stamp(snakemake.output, job)

"""Judge the papers' statements by the cubes of the studies."""

import sys

from damper.analysis.results import Results
from damper.papers.verdicts import judge, table
from damper.study.fingerprint import stamp

sys.stderr = open(snakemake.log[0], "w", buffering=1)

job = snakemake.params.job
with Results({name: snakemake.input[name] for name in job["cubes"]}) as cubes:
    found = judge(cubes)

table(found, job["figures"]).save(snakemake.output.csv, snakemake.output.md)
stamp(snakemake.output, job)

"""Write one table as CSV and Markdown."""

import sys
from importlib import import_module

from damper.analysis.results import opened
from damper.study.fingerprint import stamp
from damper.study.kinds import TABLES
from damper.tables import make

sys.stderr = open(snakemake.log[0], "w", buffering=1)

job = snakemake.params.job
settings = dict(job["settings"])
kind = settings.pop("kind")

with opened(snakemake.input.of, settings, snakemake.input.beside) as results:
    if kind in TABLES:
        table = make(kind, *results, settings)
    else:  # of a study that checks the engine
        table = import_module(job["module"]).make(*results, **settings)

table.save(snakemake.output.csv, snakemake.output.md)
stamp(snakemake.output, job)

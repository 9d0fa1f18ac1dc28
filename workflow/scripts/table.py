"""Write one table as CSV and Markdown."""

import sys
from importlib import import_module

from damper.analysis.results import Results
from damper.observers import class_in
from damper.study.fingerprint import stamp
from damper.study.study_file import ProductBase

sys.stderr = open(snakemake.log[0], "w", buffering=1)

job = snakemake.params.job
module = import_module(job["module"])
settings = class_in(module, ProductBase).model_construct(**job["settings"])

with Results(dict(snakemake.input.items())) as results:
    table = module.make(results, settings)

table.save(snakemake.output.csv, snakemake.output.md)
stamp(snakemake.output, job)

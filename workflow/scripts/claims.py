"""Judge the papers' statements by the cubes of the studies."""

import sys
from contextlib import ExitStack

import xarray as xr

from damper.papers.verdicts import judge, table

sys.stderr = open(snakemake.log[0], "w", buffering=1)

with ExitStack() as stack:
    cubes = {
        name: stack.enter_context(xr.open_dataset(path)) for name, path in snakemake.input.items()
    }
    found = judge(cubes)

table(found, snakemake.params.figures).save(snakemake.output.csv, snakemake.output.md)

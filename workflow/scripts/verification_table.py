"""Write one table of a study that checks the engine."""

import sys
from pathlib import Path

from damper.analysis.open_cubes import read_results
from damper.verification.kinds import TABLES

sys.stderr = open(snakemake.log[0], "w", buffering=1)

settings = dict(snakemake.params.settings)
results = [read_results(Path(path)) for path in snakemake.input]
table = TABLES.module(settings.pop("kind")).make(*results, **settings)
table.save(snakemake.output.csv, snakemake.output.md)

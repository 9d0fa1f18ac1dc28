"""Write one table of a cube as CSV and Markdown."""

import sys

from damper.analysis.open_cubes import open_cubes
from damper.tables import make

sys.stderr = open(snakemake.log[0], "w", buffering=1)

settings = dict(snakemake.params.settings)

with open_cubes(snakemake.input.cube, settings, snakemake.input.beside) as cube:
    table = make(settings.pop("kind"), cube, settings)

table.save(snakemake.output.csv, snakemake.output.md)

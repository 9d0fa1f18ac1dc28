"""Write one table of a cube as CSV and Markdown."""

from damper.analysis.open_cubes import open_cubes
from damper.tables import make

settings = dict(snakemake.params.settings)

with open_cubes(snakemake.input.cube, settings, snakemake.input.beside) as cube:
    table = make(settings.pop("kind"), cube, settings)

table.save(snakemake.output.csv, snakemake.output.md)

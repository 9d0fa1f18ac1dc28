"""Write one table of a cube as CSV and Markdown."""

from pathlib import Path

from damper.analysis.open_cubes import open_cubes
from damper.tables import About, make

settings = dict(snakemake.params.settings)

with open_cubes(snakemake.input.cube, settings, snakemake.input.beside) as cube:
    texts = make(settings.pop("kind"), cube, settings, About(**snakemake.params.about))

for path, text in zip((snakemake.output.csv, snakemake.output.md), texts, strict=True):
    Path(path).write_text(text, encoding="utf-8", newline="\n")

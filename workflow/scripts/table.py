"""Write one table of a cube as CSV and Markdown."""

from pathlib import Path

import xarray as xr

from damper.study.tables import About, make

settings = dict(snakemake.params.settings)

with xr.open_dataset(snakemake.input.cube) as cube:
    texts = make(settings.pop("kind"), cube, settings, About(**snakemake.params.about))

for path, text in zip((snakemake.output.csv, snakemake.output.md), texts, strict=True):
    Path(path).write_text(text, encoding="utf-8", newline="\n")

"""Judge the papers' statements by the cubes of the studies."""

from contextlib import ExitStack
from pathlib import Path

import xarray as xr

from damper.papers.verdicts import judge, to_csv, to_markdown

with ExitStack() as stack:
    cubes = {
        name: stack.enter_context(xr.open_dataset(path)) for name, path in snakemake.input.items()
    }
    found = judge(cubes)

texts = to_csv(found), to_markdown(found, snakemake.params.figures)
for path, text in zip((snakemake.output.csv, snakemake.output.md), texts, strict=True):
    Path(path).write_text(text, encoding="utf-8", newline="\n")

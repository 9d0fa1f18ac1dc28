"""Bisect the edges of chatter intervals and write them as CSV and Markdown."""

from pathlib import Path

import xarray as xr

from damper.study.tables import chatter_intervals, places, to_csv, to_markdown

params = snakemake.params
along = params.settings["along"]
resolution = params.settings["resolution"]

with xr.open_dataset(snakemake.input.cube) as cube:
    found = chatter_intervals(
        cube,
        along=along,
        resolution=resolution,
        observer=params.observer,
        settings=params.run,
    )
    where = places(cube, along)
    stopped = int((cube.status != 0).sum())

Path(snakemake.output.csv).write_text(to_csv(found, along, where), encoding="utf-8", newline="\n")
Path(snakemake.output.md).write_text(
    to_markdown(
        found,
        title=params.title,
        along=along,
        where=where,
        resolution=resolution,
        observer=params.observer,
        fixed=params.fixed,
        assumed=params.assumed,
        stopped=stopped,
    ),
    encoding="utf-8",
    newline="\n",
)

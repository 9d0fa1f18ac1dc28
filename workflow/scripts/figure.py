"""Draw one figure of a cube."""

from pathlib import Path

import xarray as xr

from damper.figures import draw
from damper.figures.style import save, style

settings = dict(snakemake.params.settings)

with style(), xr.open_dataset(snakemake.input[0]) as cube:
    figure = draw(settings.pop("kind"), cube, **settings)
    for path in snakemake.output:
        save(figure, Path(path))

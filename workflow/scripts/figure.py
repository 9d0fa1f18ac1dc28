"""Draw one figure: of a cube, or a schematic, which has none."""

from contextlib import nullcontext
from pathlib import Path

import xarray as xr

from damper.figures import draw
from damper.figures.style import save, style

settings = dict(snakemake.params.settings)
source = xr.open_dataset(snakemake.input[0]) if snakemake.input else nullcontext()

with style(), source as cube:
    figure = draw(settings.pop("kind"), cube, **settings)
    for path in snakemake.output:
        save(figure, Path(path))

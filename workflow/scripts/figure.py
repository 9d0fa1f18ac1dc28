"""Draw one figure: of a cube, or a schematic, which has none."""

import sys
from pathlib import Path

from damper.analysis.open_cubes import open_cubes
from damper.figures import draw
from damper.figures.common.style import save, style

sys.stderr = open(snakemake.log[0], "w", buffering=1)

settings = dict(snakemake.params.settings)
path = snakemake.input.cube or None

with style(), open_cubes(path, settings, snakemake.input.beside) as cube:
    figure = draw(settings.pop("kind"), cube, **settings)
    for path in snakemake.output:
        save(figure, Path(path))

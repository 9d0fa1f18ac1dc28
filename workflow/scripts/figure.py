"""Draw one figure of a cube."""

from pathlib import Path

from damper.figures import draw
from damper.figures.style import save, style
from damper.study.open_cubes import open_cubes

settings = dict(snakemake.params.settings)

with style(), open_cubes(snakemake.input.cube, settings, snakemake.input.beside) as cube:
    figure = draw(settings.pop("kind"), cube, **settings)
    for path in snakemake.output:
        save(figure, Path(path))

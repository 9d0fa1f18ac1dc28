"""Draw one figure of a study that checks the engine."""

from pathlib import Path

from damper.analysis.open_cubes import read_results
from damper.figures import draw
from damper.figures.style import save, style

settings = dict(snakemake.params.settings)
results = [read_results(Path(path)) for path in snakemake.input]

with style():
    figure = draw(settings.pop("kind"), *results, **settings)
    for path in snakemake.output:
        save(figure, Path(path))

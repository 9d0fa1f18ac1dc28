"""Draw one figure of a study that checks the engine."""

import sys
from pathlib import Path

from damper.analysis.open_cubes import read_results
from damper.figures.common.style import save, style
from damper.verification.kinds import FIGURES

sys.stderr = open(snakemake.log[0], "w", buffering=1)

settings = dict(snakemake.params.settings)
results = [read_results(Path(path)) for path in snakemake.input]

with style():
    figure = FIGURES.module(settings.pop("kind")).draw(*results, **settings)
    for path in snakemake.output:
        save(figure, Path(path))

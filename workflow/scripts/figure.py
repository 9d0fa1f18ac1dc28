"""Draw one figure."""

import sys
from importlib import import_module
from pathlib import Path

from damper.analysis.results import opened
from damper.figures.common.style import save, style
from damper.study.fingerprint import stamp

sys.stderr = open(snakemake.log[0], "w", buffering=1)

job = snakemake.params.job
settings = {name: value for name, value in job["settings"].items() if name != "kind"}

with style(), opened(snakemake.input.of, settings, snakemake.input.beside) as results:
    figure = import_module(job["module"]).draw(*results, **settings)
    for path in snakemake.output:
        save(figure, Path(path))
stamp(snakemake.output, job)

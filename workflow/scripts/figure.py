"""Draw one figure."""

import sys
from importlib import import_module
from pathlib import Path

from damper.analysis.results import opened
from damper.figures.common.style import save, style
from damper.observers import class_in
from damper.study.fingerprint import stamp
from damper.study.study_file import Made

sys.stderr = open(snakemake.log[0], "w", buffering=1)

job = snakemake.params.job
settings = dict(job["settings"])
module = import_module(job["module"])

with style(), opened(snakemake.input.of, settings, snakemake.input.beside) as results:
    figure = module.draw(*results, settings=class_in(module, Made).model_construct(**settings))
    for path in snakemake.output:
        save(figure, Path(path))
stamp(snakemake.output, job)

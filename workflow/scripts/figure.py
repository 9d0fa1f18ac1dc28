"""Draw one figure."""

import sys
from importlib import import_module
from pathlib import Path

from damper.analysis.results import Results
from damper.figures.common.style import save, style
from damper.observers import class_in
from damper.study.fingerprint import stamp
from damper.study.study_file import Made

sys.stderr = open(snakemake.log[0], "w", buffering=1)

job = snakemake.params.job
module = import_module(job["module"])
settings = class_in(module, Made).model_construct(**job["settings"])

with style(), Results(dict(snakemake.input.items())) as results:
    figure = module.draw(results, settings)
    for path in snakemake.output:
        save(figure, Path(path))
stamp(snakemake.output, job)

"""Draw the figures of a study that show the same files."""

import os
import sys
from importlib import import_module
from pathlib import Path

from damper.analysis.results import Results
from damper.figures.common.style import save, style
from damper.observers import class_in
from damper.study.fingerprint import fingerprint, fingerprint_in, stamp
from damper.study.study_file import ProductBase

sys.stderr = open(snakemake.log[0], "w", buffering=1)

with Results(dict(snakemake.input.items())) as results:
    for svg, png in zip(snakemake.output[::2], snakemake.output[1::2], strict=True):
        job = snakemake.params.jobs[svg]
        if {fingerprint_in(svg), fingerprint_in(png)} == {fingerprint(job)}:
            os.utime(svg)
            os.utime(png)
            continue
        print(f"drawing {svg}", file=sys.stderr)
        module = import_module(job["module"])
        settings = class_in(module, ProductBase).model_construct(**job["settings"])
        with style():
            figure = module.draw(results, settings)
            for path in (svg, png):
                save(figure, Path(path))
        stamp((svg, png), job)

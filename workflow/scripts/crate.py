"""Describe the results as an RO-Crate, and put each study beside its cube, as it was run."""

import json
import sys
from pathlib import Path
from shutil import copyfile

from netCDF4 import Dataset

from damper.report.crate import crate
from damper.report.page import versions

sys.stderr = open(snakemake.log[0], "w", buffering=1)

metadata, *studies = map(Path, snakemake.output)
results, records = metadata.parent, snakemake.params.records
for path, record in records.items():
    copyfile(record, path)
for path in studies:
    with Dataset(path.with_name("cube.nc")) as cube:
        path.write_text(cube.study, encoding="utf-8", newline="\n")
files = sorted({*snakemake.input, *map(str, studies), *records})
made = crate(
    results,
    snakemake.params.studies,
    [Path(path).relative_to(results).as_posix() for path in files],
    versions(),
)
metadata.write_text(json.dumps(made, indent=1) + "\n", encoding="utf-8", newline="\n")

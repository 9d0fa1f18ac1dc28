"""Gather all parts of a stress study: the checks of all runs, and the metamorphic tests."""

import sys
from itertools import islice
from pathlib import Path

from damper.study.fingerprint import stamp
from damper.sweep.cube import REFERENCES, write_cube
from damper.verification.stress.cube import gather_checks, gather_metamorphic

sys.stderr = open(snakemake.log[0], "w", buffering=1)

job = snakemake.params.job
about = {**job["about"], "references": REFERENCES, "code_digest": job["code"]}
files = map(Path, snakemake.input.parts)
groups = {origin: list(islice(files, len(parts))) for origin, parts in job["groups"].items()}
write_cube(gather_checks(groups, about), Path(snakemake.output.cube))
again = gather_metamorphic([Path(path) for path in snakemake.input.metamorphic], about)
write_cube(again, Path(snakemake.output.metamorphic))
stamp(snakemake.output, job)

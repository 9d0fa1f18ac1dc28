"""Gather all parts of a stress study: the checks of all runs, and the metamorphic tests."""

import sys
from pathlib import Path

from damper.sweep.cube import REFERENCES, write_cube
from damper.verification.stress.cube import gather_checks
from damper.verification.stress.metamorphic_cube import gather_metamorphic

sys.stderr = open(snakemake.log[0], "w", buffering=1)

params = snakemake.params
about = {**params.about, "references": REFERENCES, "code_digest": params.code}
groups = {origin: [Path(path) for path in paths] for origin, paths in params.groups.items()}
write_cube(gather_checks(groups, about), Path(snakemake.output.cube))
again = gather_metamorphic([Path(path) for path in snakemake.input.metamorphic], about)
write_cube(again, Path(snakemake.output.metamorphic))

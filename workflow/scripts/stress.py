"""Gather all parts of a stress study: the checks of all lanes, and the lanes run in other ways."""

from pathlib import Path

from damper.sweep.cube import REFERENCES, write_cube
from damper.verification.stress.cube import gather
from damper.verification.stress.twins_cube import gather_twins

params = snakemake.params
about = {**params.about, "references": REFERENCES, "code_digest": params.code}
groups = {origin: [Path(path) for path in paths] for origin, paths in params.groups.items()}
write_cube(gather(groups, about), Path(snakemake.output.cube))
twins = gather_twins([Path(path) for path in snakemake.input.twins], about)
write_cube(twins, Path(snakemake.output.twins))

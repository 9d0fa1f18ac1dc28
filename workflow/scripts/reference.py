"""Work out one scene to many digits."""

import sys
from pathlib import Path

from damper.verification.comparison.reference import make_reference, write_reference
from damper.verification.comparison.scene import read_scene

sys.stderr = open(snakemake.log[0], "w", buffering=1)

scene = read_scene(**snakemake.params.scene)
write_reference(Path(snakemake.output[0]), make_reference(scene, snakemake.params.digits))

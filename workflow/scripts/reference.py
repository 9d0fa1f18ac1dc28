"""Work out one scene to many digits."""

import sys
from pathlib import Path

from damper.study.fingerprint import stamp
from damper.verification.comparison.reference import make_reference, write_reference
from damper.verification.comparison.scene import read_scene

sys.stderr = open(snakemake.log[0], "w", buffering=1)

job = snakemake.params.job
scene = read_scene(**job["scene"])
write_reference(Path(snakemake.output[0]), make_reference(scene, job["digits"]))
stamp(snakemake.output, job)

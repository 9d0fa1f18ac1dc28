"""Gather the slices of a study into its cube."""

import sys
from pathlib import Path

from damper.study.fingerprint import fingerprint_in, stamp
from damper.sweep.cube import REFERENCES, gather, write_cube
from damper.sweep.record import record
from damper.sweep.slices import DamagedSliceError, read_slice

sys.stderr = open(snakemake.log[0], "w", buffering=1)

job = snakemake.params.job
parts, refused = [], []
for path, made_of in zip(map(Path, snakemake.input.slices), job["slices"], strict=True):
    try:
        found = fingerprint_in(path)
        if found != made_of:
            what = "of other parameters, settings or code" if found else "damaged"
            raise DamagedSliceError(f"{path} is {what}")
        parts.append(read_slice(path))
    except DamagedSliceError as error:
        refused.append(str(error))
        path.unlink(missing_ok=True)
if refused:
    sys.exit(
        "\n".join(refused) + "\nThese slices are removed: the same command again makes them anew."
    )
attributes = {
    **job["about"],
    "references": REFERENCES,
    **record(job["observers"], job["primary"], job["run"], job["followed"]),
    "code_digest": job["code"],
}
cube = gather(parts, job["axes"], job["fan_axes"], job["fixed"], attributes, job["notes"])
write_cube(cube, Path(snakemake.output[0]))
stamp(snakemake.output, job)

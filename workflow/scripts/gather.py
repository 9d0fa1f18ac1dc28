"""Gather the slices of a study into its cube."""

import sys
from pathlib import Path

from damper.sweep.cube import REFERENCES, gather, write_cube
from damper.sweep.record import record
from damper.sweep.slices import DamagedSliceError, read_slice

sys.stderr = open(snakemake.log[0], "w", buffering=1)

params = snakemake.params
parts, damaged = [], []
for path in map(Path, snakemake.input):
    try:
        parts.append(read_slice(path))
    except DamagedSliceError as error:
        damaged.append(str(error))
        path.unlink()
if damaged:
    sys.exit(
        "\n".join(damaged) + "\nThese slices are removed: the same command again makes them anew."
    )
attributes = {
    **params.about,
    "references": REFERENCES,
    **record(params.observers, params.primary, params.run),
    "code_digest": params.code,
}
cube = gather(parts, params.axes, params.fan_axes, params.fixed, attributes, params.notes)
write_cube(cube, Path(snakemake.output[0]))

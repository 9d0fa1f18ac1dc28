"""Gather the slices of a study into its cube."""

from pathlib import Path

from damper.sweep.cube import REFERENCES, gather, write_cube
from damper.sweep.record import record
from damper.sweep.slices import read_slice

params = snakemake.params
parts = [read_slice(Path(path)) for path in snakemake.input]
attributes = {
    **params.about,
    "references": REFERENCES,
    **record(params.observers, params.primary, params.run),
    "code_digest": params.code,
}
cube = gather(parts, params.axes, params.fan_axes, params.fixed, attributes, params.notes)
write_cube(cube, Path(snakemake.output[0]))

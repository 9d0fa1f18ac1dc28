"""Simulate one slice of a study."""

from math import prod
from pathlib import Path

from damper.sweep.branches import DIRECTIONS
from damper.sweep.slices import simulate_slice, write_slice

params = snakemake.params
lanes = prod(len(values) for values in params.axes.values()) * params.initial.get("draws", 1)
for way in params.follow.values():
    lanes *= len(DIRECTIONS[way])

with Path(snakemake.log[0]).open("w", buffering=1) as log:

    def progress(done: int) -> None:
        if done * 10 // lanes > (done - 1) * 10 // lanes:
            print(f"{done} of {lanes} points", file=log)

    part = simulate_slice(
        params.fixed,
        params.axes,
        transient=params.transient,
        periods=params.periods,
        observers=params.observers,
        initial=params.initial,
        follow=params.follow,
        progress=progress,
        **params.engine,
    )

write_slice(part, Path(snakemake.output[0]))

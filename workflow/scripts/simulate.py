"""Simulate one slice of a study."""

import sys
from pathlib import Path

from damper.sweep.slices import simulate_slice, write_slice

sys.stderr = open(snakemake.log[0], "w", buffering=1)

params = snakemake.params


def progress(done: int, runs: int) -> None:
    if done * 10 // runs > (done - 1) * 10 // runs:
        print(f"{done} of {runs} points", file=sys.stderr)


part = simulate_slice(
    params.fixed,
    params.axes,
    observers=params.observers,
    initial=params.initial,
    follow=params.follow,
    progress=progress,
    **params.run,
)
write_slice(part, Path(snakemake.output[0]))

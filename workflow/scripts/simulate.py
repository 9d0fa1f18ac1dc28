"""Simulate one slice of a study."""

from pathlib import Path

from damper.sweep.slices import simulate_slice, write_slice

params = snakemake.params

with Path(snakemake.log[0]).open("w", buffering=1) as log:

    def progress(done: int, runs: int) -> None:
        if done * 10 // runs > (done - 1) * 10 // runs:
            print(f"{done} of {runs} points", file=log)

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

"""Time all solvers on all scenes; nothing else is to run beside it."""

import sys
from pathlib import Path

from damper.sweep.cube import write_cube
from damper.verification.comparison.cube import gather_timings
from damper.verification.comparison.scene import read_scene
from damper.verification.comparison.timings import time_peers, time_solvers
from damper.verification.timing import machine

sys.stderr = open(snakemake.log[0], "w", buffering=1)

params = snakemake.params
scenes = {name: read_scene(**scene) for name, scene in params.scenes.items()}
given = scenes, params.solvers, params.repeats, params.cap, params.spend
arrays = time_solvers(*given) | time_peers(*given)
attributes = {**params.about, **machine(), "code_digest": params.code}
cube = gather_timings(arrays, list(scenes), params.solvers, params.titles, attributes)
write_cube(cube, Path(snakemake.output[0]))

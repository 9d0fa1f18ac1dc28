"""Run all solvers on one scene and compare them with its reference."""

from pathlib import Path

from damper.comparison.runs import run_scene, write_runs

from damper.comparison.reference import read_reference
from damper.comparison.scene import read_scene

params = snakemake.params
reference = read_reference(Path(snakemake.input[0]))
runs = run_scene(read_scene(**params.scene), params.solvers, reference, params.cap)
write_runs(Path(snakemake.output[0]), runs)

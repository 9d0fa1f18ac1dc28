"""Run some lanes of a stress study in other ways that must not matter."""

from pathlib import Path

from damper.verification.stress.box import random_lanes
from damper.verification.stress.identities import run_identities
from damper.verification.stress.parts import write_part

run = snakemake.params.run
lanes = random_lanes(**run["lanes"])
arrays = run_identities(lanes, seed=run["seed"], first=run["lanes"]["first"])
write_part(Path(snakemake.output[0]), lanes, arrays)

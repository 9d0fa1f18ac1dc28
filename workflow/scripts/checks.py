"""Make one part of a stress study's runs and check each of them."""

import sys
from math import inf
from pathlib import Path

from damper.study.fingerprint import stamp
from damper.verification.stress.box import corners, part, random_points
from damper.verification.stress.checks import run_checks
from damper.verification.stress.cube import write_part

sys.stderr = open(snakemake.log[0], "w", buffering=1)

job = snakemake.params.job
asked = job["run"]
if "run" in asked:
    runs = [asked["run"]]
elif "corners" in asked:
    runs = part(corners(**asked["corners"]), *asked["part"])
else:
    runs = random_points(**asked["random"], which=asked["part"])
longest = asked.get("longest")
arrays = run_checks(
    runs,
    asked["periods"],
    job["accuracy"],
    job["max_events"] if "run" not in asked else 1_000_000_000,
    longest=inf if longest is None else longest,
)
write_part(Path(snakemake.output[0]), runs, arrays)
stamp(snakemake.output, job)

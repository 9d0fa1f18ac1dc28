"""Run one part of a stress study's lanes and check each of them."""

from math import inf
from pathlib import Path

from damper.verification.stress.box import corners, part, random_lanes
from damper.verification.stress.checks import run_checks
from damper.verification.stress.parts import write_part

params = snakemake.params
run = params.run
if "lane" in run:
    lanes = [run["lane"]]
elif "corners" in run:
    lanes = part(corners(**run["corners"]), *run["part"])
else:
    lanes = random_lanes(**run["random"], which=run["part"])
longest = run.get("longest")
arrays = run_checks(
    lanes,
    run["periods"],
    params.accuracy,
    params.max_events if "lane" not in run else 1_000_000_000,
    longest=inf if longest is None else longest,
)
write_part(Path(snakemake.output[0]), lanes, arrays)

"""Measure what the parts of a run cost; nothing else is to run beside it."""

import json
from pathlib import Path

from damper.verification.cost.measure import measure

params = snakemake.params
# Jobs run in the folder of the project.
found = measure(
    params.settings,
    Path(),
    [Path(path) for path in params.config_files],
    Path("logs/benchmarks"),
)
text = json.dumps(found | {"title": params.title}, indent=1)
Path(snakemake.output[0]).write_text(f"{text}\n", encoding="utf-8")

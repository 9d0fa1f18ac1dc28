"""Measure what the parts of a run cost; nothing else is to run beside it."""

import json
from pathlib import Path

from damper.verification.cost.measure import measure

text = json.dumps(measure(**snakemake.params.settings), indent=1)
Path(snakemake.output[0]).write_text(f"{text}\n", encoding="utf-8")

"""Measure what the parts of a run cost; nothing else is to run beside it."""

import json
import sys
from pathlib import Path

from damper.study.fingerprint import stamp
from damper.verification.cost.measure import measure

sys.stderr = open(snakemake.log[0], "w", buffering=1)

text = json.dumps(measure(**snakemake.params.job["settings"]), indent=1)
Path(snakemake.output[0]).write_text(f"{text}\n", encoding="utf-8")
stamp(snakemake.output, snakemake.params.job)

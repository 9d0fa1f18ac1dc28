"""Prepare one interactive figure of the page."""

import sys
from pathlib import Path

from damper.analysis.results import Results
from damper.report.interactive import interactive, script_of
from damper.study.fingerprint import stamp

sys.stderr = open(snakemake.log[0], "w", buffering=1)

job = snakemake.params.job
with Results({"cube": snakemake.input.cube}) as results:
    data = interactive(results["cube"], job["settings"], job["study"])
text = script_of(snakemake.wildcards.figure, data)
Path(snakemake.output[0]).write_text(text, encoding="utf-8", newline="\n")
stamp(snakemake.output, job)

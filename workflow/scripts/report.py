"""Write the page with all verdicts, figures and tables."""

import csv
import sys
from pathlib import Path

from damper.report.page import captions, chapter, page, plotly_script
from damper.study.fingerprint import stamp

sys.stderr = open(snakemake.log[0], "w", buffering=1)

job = snakemake.params.job
texts = Path(snakemake.params.captions)
results = Path(snakemake.output[0]).parent

verdicts = []
for path in snakemake.input.claims:
    if path.endswith(".csv"):
        with Path(path).open(encoding="utf-8", newline="") as file:
            verdicts = list(csv.DictReader(file))

text = page(
    [chapter(about, results) for about in job["studies"]],
    verdicts,
    captions(texts, job["kinds"]),
    texts / "page.html",
)
Path(snakemake.output[0]).write_text(text, encoding="utf-8", newline="\n")
for path in snakemake.output[1:]:
    Path(path).write_text(plotly_script(), encoding="utf-8")
stamp(snakemake.output, job)

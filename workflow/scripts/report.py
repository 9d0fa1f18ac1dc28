"""Write the page with all verdicts, figures and tables."""

import csv
import sys
from pathlib import Path

from damper.report.page import captions, chapter, page

sys.stderr = open(snakemake.log[0], "w", buffering=1)

template = Path(snakemake.input.template)
results = Path(snakemake.output[0]).parent

verdicts = []
for path in snakemake.input.claims:
    if path.endswith(".csv"):
        with Path(path).open(encoding="utf-8", newline="") as file:
            verdicts = list(csv.DictReader(file))

text = page(
    [chapter(about, results) for about in snakemake.params.studies],
    verdicts,
    captions(template.parent, snakemake.params.kinds),
    template,
)
Path(snakemake.output[0]).write_text(text, encoding="utf-8", newline="\n")

"""Write one table of a study that checks the engine."""

from pathlib import Path

from damper.analysis.open_cubes import read_results
from damper.tables import make_of_results

settings = dict(snakemake.params.settings)
results = [read_results(Path(path)) for path in snakemake.input]
texts = make_of_results(settings.pop("kind"), *results, **settings)
for path, text in zip((snakemake.output.csv, snakemake.output.md), texts, strict=True):
    Path(path).write_text(text, encoding="utf-8", newline="\n")

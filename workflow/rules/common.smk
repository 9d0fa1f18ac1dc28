"""Read and check the configuration; the functions that rules ask for inputs and parameters."""

import re
import sys
import time
from pathlib import Path

from snakemake.exceptions import WorkflowError

try:
    from damper.parameters.quantities import MODEL_NAMES
    from damper.study.config import ConfigError, load_config
    from damper.study.digest import code_digest
    from damper.verification.base import Verification
except ImportError as error:
    raise WorkflowError(
        f"damper or one of its packages is missing ({error}): install them with "
        "`pip install -e '.[fast,workflow]'` into the environment that runs snakemake."
    )

STARTED = time.time()
HOME = Path(workflow.basedir)
SCRIPTS = HOME / "workflow/scripts"

try:
    CONFIG = load_config(config, HOME)
except ConfigError as error:
    # Just the message (file, key, value, what is allowed, nearest name); a WorkflowError would add
    # the line of this file that found the mistake.
    sys.exit(str(error))

# Studies that check the engine have rules of their own; STUDIES are those that make a cube.
VERIFICATIONS = {n: study for n, study in CONFIG.studies.items() if isinstance(study, Verification)}
STUDIES = {n: study for n, study in CONFIG.studies.items() if n not in VERIFICATIONS}
# What is made without being asked for; verdicts and the page speak of these.
DEFAULT = {name: CONFIG.studies[name] for name in CONFIG.default}
RESULTS = CONFIG.results
# What a job takes that must be alone. `workflow.cores` refuses commands that start no job (--unlock,
# --summary, --rulegraph), and executors of clusters, which know no such number.
ALL_CORES = workflow.resource_settings.cores or 1
ENGINE = {"accuracy": CONFIG.engine.accuracy, "max_events": CONFIG.engine.max_events}


def one_of(names):
    """Return a regular expression for just these names, so that a wrong target is refused at once."""
    return "|".join(re.escape(name) for name in sorted(names)) or "(?!)"


def everything_of(study):
    """Cube, figures and tables of a study."""
    return [f"{RESULTS}/{study.name}/{path}" for path in study.outputs()]


def stems(studies, folder):
    """Names of the files of these studies in a folder, such as ``timed/figures``."""
    section = folder.rpartition("/")[2]
    paths = [path for study in studies.values() for path in study.files(section)]
    return one_of({path.rpartition("/")[2] for path in paths if path.rpartition("/")[0] == folder})


wildcard_constraints:
    study=one_of(STUDIES),
    figure=stems(STUDIES, "figures"),
    table=stems(STUDIES, "tables"),


def cubes_beside(product):
    """Cubes of the other studies that a figure or table needs."""
    return [f"{RESULTS}/{name}/cube.nc" for name in product.beside.values()]


def slices_of(wildcards):
    """Files of all slices of a study."""
    study = STUDIES[wildcards.study]
    return [
        f"{RESULTS}/{study.name}/slices/{study.slice_path(place)}.npz" for place in study.slices()
    ]


def of_papers(wildcards):
    """Priority of a job: what the papers' verdicts need comes first, to be seen early."""
    return int(wildcards.study in JUDGED_BY)


def run_settings(wildcards):
    """Settings of every run of a study."""
    return STUDIES[wildcards.study].run | ENGINE


EVERY_MODEL = [f"damper.models.{name}" for name in ("rigid", *MODEL_NAMES)]


def simulation_modules(study):
    """Modules of the model and the observers of a study: others do not concern its results."""
    # Points of any model that do not ask for it, such as those without modulation, are rigid.
    models = sorted({"damper.models.rigid", f"damper.models.{study.model}"})
    return [
        *models,
        *(f"{model}.response" for model in models if "response" in study.observers),
        *sorted(f"damper.observers.{name}" for name in study.observers),
    ]


def report_cost():
    """Print what the run cost, and keep it beside the page: it is in no other output."""
    text = cost_by_stage()
    if text:
        print(text, file=sys.stderr)
        if Path(RESULTS).is_dir():
            Path(RESULTS, "cost.txt").write_text(f"{text}\n", encoding="utf-8")


def cost_by_stage():
    """Wall seconds of this run's jobs, summed by stage, from Snakemake's benchmark files."""
    folder, seconds = Path("logs/benchmarks"), {}
    for path in sorted(folder.rglob("*.tsv")):
        if path.stat().st_mtime >= STARTED:
            # <study>/<stage>..., or <stage>/... of no study.
            first, second = (*path.relative_to(folder).with_suffix("").parts, "")[:2]
            stage = first if first in ("compile", "claims", "report") else second or first
            numbers = path.read_text(encoding="utf-8").splitlines()[1]
            seconds.setdefault(stage, []).append(float(numbers.split("\t")[0]))
    lines = [
        f"  {stage:<10} {len(each):4d} jobs {sum(each):8.1f} s" for stage, each in seconds.items()
    ]
    return "\n".join(["Cost by stage (wall time, summed over jobs):", *lines]) if lines else ""

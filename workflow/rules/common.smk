"""Read and check the configuration; the functions that rules ask for inputs and parameters."""

import functools
import os
import re
import sys
import time
from inspect import signature
from pathlib import Path

from snakemake.exceptions import WorkflowError

try:
    from damper.parameters.quantities import MODEL_NAMES
    from damper.report.stopped import stopped_lines
    from damper.study.config import ConfigError, load_config
    from damper.study.digest import code_digest
    from damper.study.fingerprint import fingerprint, fingerprint_in
    from damper.study.study_file import SUFFIXES
    from damper.verification.base import Verification
except ImportError as error:
    raise WorkflowError(
        f"damper or one of its packages is missing ({error}): install them with "
        "`pip install -e '.[fast,workflow]'` into the environment that runs snakemake."
    )

STARTED = time.time()
HOME = Path(workflow.basedir)
SCRIPTS = HOME / "workflow/scripts"

# Not by `configfile:`: it names no line, and lets a later key silently replace an earlier one.
CONFIG_FILES = list(workflow.overwrite_configfiles)
if not workflow.config_settings.replace_workflow_config:
    CONFIG_FILES.insert(0, Path("config/config.yaml"))

try:
    CONFIG = load_config(workflow.config_settings.config, HOME, CONFIG_FILES)
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
LOGS, TIMES = f"{RESULTS}/logs", f"{RESULTS}/logs/benchmarks"
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


def products(section):
    """Return every figure or table: path without suffix -> its study, what it is, its settings."""
    return {
        f"{study.name}/{path}": (study, product, settings)
        for study in CONFIG.studies.values()
        for path, (product, settings) in study.files(section).items()
    }


def once(function):
    """Work out a function's value once, whether its arguments come by place or by name."""
    names, kept = signature(function).parameters, functools.cache(function)
    return lambda *values, **named: kept(*values, *(named[name] for name in names if name in named))


@once
def digest(script, *modules):
    """Digest of the code behind a script, and behind the modules that it loads by name."""
    return code_digest(SCRIPTS / script, modules)


def job(settings):
    """Function of wildcards that returns the settings of a job, from their values."""
    return lambda wildcards: settings(**dict(wildcards.items()))


# Snakemake makes a file of results again if it is older than an input. This file is newer than any.
NEWER = ".snakemake/newer"


def changed(settings, *paths, parts=None):
    """Input function: `NEWER` counts where a file carries other settings than those of its job.

    Snakemake compares settings with records of its own, which a clone or a clean-up loses. `parts`
    is an input function: `NEWER` also counts where a file of these is missing.
    """

    def newer(wildcards):
        values = dict(wildcards.items())
        wanted = fingerprint(settings(**values))
        for path in (Path(path.format(**values)) for path in paths):
            if not path.exists():
                continue
            found = fingerprint_in(path)
            if found is None:
                print(f"{path} is damaged, or of an earlier version: made anew", file=sys.stderr)
            if found != wanted or parts and not all(map(os.path.exists, parts(wildcards))):
                _renew(after=path.stat().st_mtime)
                return NEWER
        return ancient(NEWER)

    return newer


def _renew(after):
    # With a content it never had: where that is the same, times do not count for Snakemake.
    now = time.time()
    Path(NEWER).write_text(f"{now}\n")
    os.utime(NEWER, (now, max(now, after + 1)))


Path(NEWER).parent.mkdir(exist_ok=True)
Path(NEWER).touch()


def shown(study, product):
    """Return the files that a figure or table shows: of its study, and of others."""
    beside = getattr(product, "beside", {}).values()
    return {
        "of": [f"{RESULTS}/{study.name}/{path}" for path in product.reads],
        "beside": [f"{RESULTS}/{name}/cube.nc" for name in beside],
    }


# Name of a file of results in a study's folder -> function of the study's name that returns the
# settings of the job which makes it, by the kind of study. Each file of rules adds its own.
SETTINGS = {}


@once
def made_of(path):
    """Return the fingerprint that a file of results is to have."""
    name, _, file = path.removeprefix(f"{RESULTS}/").partition("/")
    kind = getattr(CONFIG.studies[name], "kind", "parameters")
    return fingerprint(SETTINGS[kind, file](name))


def of_papers(priority):
    """Function of wildcards: this priority for a job of a study that the verdicts judge, else none."""
    return lambda wildcards: priority * (next(iter(wildcards)).partition("/")[0] in JUDGED_BY)


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


def report_failed(own_logs):
    """List the logs of failed jobs, as Snakemake's own name them, and say what to do next."""
    text = "".join(Path(path).read_text(encoding="utf-8") for path in own_logs)
    logs = dict.fromkeys(re.findall(r"log: (.+) \(check log file", text))
    print(
        "Some jobs failed; the reason of each is in its log:",
        *(f"  {path}" for path in logs or [f"{LOGS}/"]),
        "What is made stays: the same command goes on from there.",
        sep="\n",
        file=sys.stderr,
    )


def report_cost():
    """Print what the run cost, and keep it beside the page: it is in no other output."""
    text = cost_by_stage()
    if text:
        print(text, file=sys.stderr)
        if Path(RESULTS).is_dir():
            Path(RESULTS, "cost.txt").write_text(f"{text}\n", encoding="utf-8")


def report_stopped():
    """Say which studies have runs that stopped early."""
    for line in stopped_lines(Path(RESULTS), CONFIG.studies):
        print(line, file=sys.stderr)


def cost_by_stage():
    """Wall seconds of this run's jobs, summed by stage, from Snakemake's benchmark files."""
    folder, seconds = Path(TIMES), {}
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

"""Read and check the configuration; the functions that rules ask for inputs and parameters."""

import functools
import math
import os
import re
import sys
import tempfile
import time
from functools import partial
from pathlib import Path

from snakemake.exceptions import WorkflowError

try:
    from damper.papers.statements import STATEMENTS
    from damper.parameters.names import unknown_name
    from damper.parameters.quantities import MODEL_NAMES
    from damper.report.stopped import stopped_lines
    from damper.report.workflow import JobSettings, cost_by_stage, failed_lines, left_over, redate
    from damper.study.config import ConfigError, load_config
    from damper.study.digest import code_digest
    from damper.study.fingerprint import Checked
    from damper.study.jobs import file_digest
    from damper.study.model import Study
    from damper.study.parts import simulation_modules
    from damper.study.study_file import SUFFIXES
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
    # A process that makes one job of a run, such as on a cluster, reads no record but its own.
    CONFIG = load_config(
        workflow.config_settings.config, HOME, CONFIG_FILES, not workflow.is_main_process
    )
except ConfigError as error:
    # Just the message (file, key, value, what is allowed, nearest name); a WorkflowError would add
    # the line of this file that found the mistake.
    sys.exit(str(error))

# Those that simulate: other kinds check the engine.
STUDIES = {name: study for name, study in CONFIG.studies.items() if isinstance(study, Study)}
# What is made without being asked for; verdicts and the page speak of these.
DEFAULT = {name: CONFIG.studies[name] for name in CONFIG.default}
JUDGED_BY = sorted({name for statement in STATEMENTS for name in statement.studies})
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


@functools.cache
def digest(script, *modules):
    """Digest of the code behind a script, and behind the modules that it loads by name."""
    return code_digest(SCRIPTS / script, modules)


# Path of a file of results -> function that returns the settings of the job which makes it. Each
# file of rules adds its own.
MADE = JobSettings()


def job(wildcards, output):
    """The settings of a job, as its script finds them."""
    return MADE.settings_of(output[-1])


# Snakemake makes a file of results again if it is older than an input. This file is newer than any.
RERUN_MARK = ".snakemake/rerun"
# What is known of the bytes of results; `damper verify` reads them all.
RECORD = Path(".snakemake/checked")
VERIFY = os.environ.get("DAMPER_VERIFY")  # the names of studies; all of them where it is empty


# Not in a process that makes one job of a run, such as on a cluster.
if workflow.is_main_process:
    RECORD.parent.mkdir(exist_ok=True)
    Path(RERUN_MARK).touch()
    if VERIFY is not None:
        RECORD.unlink(missing_ok=True)
    elif text := redate(RESULTS, STARTED):
        print(text, file=sys.stderr)
CHECKED = Checked(RECORD)


def rerun_if_changed(*patterns, needs=None):
    """Input function: `RERUN_MARK` counts where a file is damaged, or of other settings than its job's.

    Snakemake compares settings with records of its own, which a clone or a clean-up loses. The mark
    also counts where a file of `needs`, an input function, is missing.
    """

    def mark(wildcards):
        if not workflow.is_main_process:  # which has decided
            return ancient(RERUN_MARK)
        for path in (Path(pattern.format(**dict(wildcards.items()))) for pattern in patterns):
            if not path.exists():
                continue
            mistake = MADE.mistake_in(str(path), CHECKED)
            if mistake == "damaged":
                print(f"{path} is damaged, or of an earlier version: made anew", file=sys.stderr)
            if mistake or needs and not all(map(os.path.exists, needs(wildcards))):
                # With a content it never had: where that is the same, times do not count for
                # Snakemake.
                Path(RERUN_MARK).write_text(f"{time.time()}\n")
                return RERUN_MARK
        return ancient(RERUN_MARK)

    return mark


def begun():
    """Return the names of the studies of the default run, and of all that was begun."""
    return [n for n in CONFIG.studies if n in DEFAULT or Path(RESULTS, n).is_dir()]


def verify(names):
    """Print which results are not as they should be, and return the status of `damper verify`.

    `names` are those of the studies it is asked for; none are all, with verdicts and page. Those may
    be of another selection of studies.
    """
    for name in names:
        if name not in CONFIG.studies:
            return f"damper verify: {unknown_name('study', name, CONFIG.studies)}"
    page = [*claims_if_complete(), *PAGE_FILES] if COMPLETE and not names else []
    expected = [path for n in names or begun() for path in everything_of(CONFIG.studies[n])] + page

    def skip(path):
        first, *below = Path(path).relative_to(RESULTS).parts
        return first not in names if names else not below and not COMPLETE

    lines, wrong = MADE.verify(CHECKED, expected, skip)
    print(*lines, sep="\n")
    return wrong


def shown(study, product):
    """Return the files of its study that a figure or table shows, by name."""
    return {Path(path).stem: f"{RESULTS}/{study.name}/{path}" for path in product.reads}


def of_papers(priority):
    """Function of wildcards: this priority for a job of a study that the verdicts judge, else none."""
    return lambda wildcards: priority * (next(iter(wildcards)).partition("/")[0] in JUDGED_BY)


def report_failed(own_logs):
    """List the logs of failed jobs, and say what to do next."""
    text = "".join(Path(path).read_text(encoding="utf-8") for path in own_logs)
    folders = map(Path, (tempfile.gettempdir(), ".", RESULTS))
    print(*failed_lines(text, folders), sep="\n", file=sys.stderr)


def report_cache():
    """Say why jobs cannot keep what they compile; each of them says it in its own log only."""
    from damper.engine.compiled import COMPILED, cache_trouble

    trouble = COMPILED and cache_trouble()
    if trouble:
        print(
            f"the cache of compiled code: {trouble}; each job compiles for itself", file=sys.stderr
        )


def report_cost():
    """Print what the run cost, and keep it beside the page: it is in no other output."""
    text = cost_by_stage(Path(TIMES), STARTED)
    if text:
        print(text, file=sys.stderr)
        if Path(RESULTS).is_dir():
            Path(RESULTS, "cost.txt").write_text(f"{text}\n", encoding="utf-8")


def report_stopped():
    """Say which studies have runs that stopped early."""
    for line in stopped_lines(Path(RESULTS), CONFIG.studies):
        print(line, file=sys.stderr)

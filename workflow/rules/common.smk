"""Read and check the configuration; the functions that rules ask for inputs and parameters."""

import sys
from pathlib import Path

from snakemake.exceptions import WorkflowError

try:
    from damper.study.config import ConfigError, load_config
    from damper.study.digest import code_digest
except ImportError as error:
    raise WorkflowError(
        f"damper or one of its packages is missing ({error}): install them with "
        "`pip install -e '.[fast,workflow]'` into the environment that runs snakemake."
    )

HOME = Path(workflow.basedir)
SCRIPTS = HOME / "workflow/scripts"

try:
    CONFIG = load_config(config, HOME)
except ConfigError as error:
    # Not a traceback: the message says file, key, value, what is allowed and the nearest name.
    raise WorkflowError(str(error))

STUDIES = CONFIG.studies
RESULTS = CONFIG.results
ENGINE = {"accuracy": CONFIG.engine.accuracy, "max_events": CONFIG.engine.max_events}


wildcard_constraints:
    study="|".join(STUDIES),
    figure="[^/]+",
    table="[^/]+",


def everything_of(study):
    """Cube, figures and tables of a study."""
    folder = f"{RESULTS}/{study.name}"
    return [
        f"{folder}/cube.nc",
        *(
            f"{folder}/figures/{name}.{end}"
            for name in study.figure_files()
            for end in ("svg", "png")
        ),
        *(f"{folder}/tables/{name}.{end}" for name in study.tables for end in ("csv", "md")),
    ]


def slices_of(wildcards):
    """Files of all slices of a study."""
    study = STUDIES[wildcards.study]
    return [
        f"{RESULTS}/{study.name}/slices/{study.slice_path(place)}.npz" for place in study.slices()
    ]


def observers_of(study):
    """Each observer's settings as plain values."""
    return {
        name: settings.model_dump(exclude_none=True) for name, settings in study.observers.items()
    }


def observer_modules(studies):
    """Modules of the observers that studies ask for: others do not concern their results."""
    return sorted({f"damper.observers.{name}" for study in studies for name in study.observers})

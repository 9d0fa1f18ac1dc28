"""What the parts of a run cost: all of it times, so none of it in files of the same bytes."""

import os

from damper.verification.comparison.solvers import SOLVERS, module_of
from damper.observers import OBSERVERS

COSTS = {name: study for name, study in VERIFICATIONS.items() if study.kind == "cost"}
EVERY_OBSERVER = [f"damper.observers.{name}" for name in OBSERVERS]
EVERY_SOLVER = sorted({module_of(name) for name in SOLVERS})
SCRIPT = "workflow/scripts/{}.py".format
# Kind of job -> its script, and what it loads by name or where it is first needed.
DRAWING = ["matplotlib.figure", "netCDF4", "xarray"]
READING = ["netCDF4", "xarray"]
STARTS = {
    "compile": ("compile", ["damper.models.rigid"]),
    "simulate": ("simulate", ["damper.models.rigid", "damper.observers.stroboscopic_section"]),
    "gather": ("gather", ["netCDF4"]),
    "figure: map": ("figure", ["damper.figures.map", *DRAWING]),
    "figure: schematic": ("figure", ["damper.figures.schematic", "matplotlib.figure"]),
    "table: intervals": ("table", ["damper.tables.intervals", *READING]),
    "table: performance": ("table", ["damper.tables.performance", *READING]),
    "reference": ("reference", []),
    "errors": ("errors", EVERY_SOLVER),
    "timings": ("timings", ["netCDF4", *EVERY_SOLVER]),
    "comparison": ("comparison", ["netCDF4", *EVERY_SOLVER]),
    "checks": ("checks", EVERY_MODEL),
    "twins": ("twins", EVERY_MODEL),
    "stress": ("stress", ["netCDF4"]),
    "cost": ("cost", []),
    "claims": ("claims", ["damper.tables.performance", "damper.papers.ranges", "netCDF4"]),
    "report": ("report", ["jinja2", "docutils.core"]),
}


def _cost_settings(wildcards):
    jobs = {
        name: {"script": SCRIPT(script), "modules": modules}
        for name, (script, modules) in STARTS.items()
    }
    settings = COSTS[wildcards.study].settings()
    repeats = max(settings["ladder"]["repeats"] // 10, 1)
    return settings | {"startup": {"jobs": jobs, "repeats": repeats}}


# It takes all cores, so that nothing else runs beside it.
rule cost:
    output:
        f"{RESULTS}/{{study}}/timed/cost.json",
    log:
        "logs/{study}/cost.log",
    benchmark:
        "logs/benchmarks/{study}/cost.tsv"
    wildcard_constraints:
        study=one_of(COSTS),
    # Late, so that the other jobs' times are there.
    priority: -1
    threads: ALL_CORES
    params:
        settings=_cost_settings,
        title=lambda wildcards: COSTS[wildcards.study].title,
        # From the folder of the project: it may lie elsewhere tomorrow.
        config_files=[os.path.relpath(path, HOME) for path in workflow.configfiles],
        code=code_digest(SCRIPTS / "cost.py", EVERY_MODEL + EVERY_OBSERVER),
    message:
        "Measure what the parts of a run cost, alone on this machine"
    script:
        "../scripts/cost.py"

"""What each kind of job loads before it starts to work, and how long its jobs take.

A job's imports are those of its script, read from its source and made in a fresh interpreter, and
the modules that it loads by name, such as the one kind of figure that it draws.
"""

import ast
import statistics
import sys
import time
from collections.abc import Mapping, Sequence
from importlib import import_module
from pathlib import Path
from typing import Any

from damper.verification.cost.benchmarks import seconds_by_stage
from damper.verification.cost.process import fresh

#: Packages whose loading is felt.
HEAVY = (
    "numpy",
    "numba",
    "scipy",
    "xarray",
    "pandas",
    "netCDF4",
    "matplotlib",
    "pydantic",
    "yaml",
    "mpmath",
    "jinja2",
    "docutils",
)


def start_up(jobs: Mapping[str, Mapping[str, Any]], folder: Path, repeats: int) -> dict[str, Any]:
    """Measure the imports of every kind of job.

    Parameters
    ----------
    jobs : mapping of str to mapping
        Name -> ``script``, a path below `folder`, and ``modules`` that it loads by name.
    folder : Path
        The project.
    repeats : int
        Fresh interpreters for each; the times are medians.

    Returns
    -------
    dict
        Name -> ``seconds`` of the imports, ``interpreter`` (seconds to start Python at all),
        ``modules``: how many are loaded, and ``loaded``: those of `HEAVY`.
    """
    found = {}
    for name, job in jobs.items():
        statements = imports_of(folder / job["script"])
        runs = []
        for _ in range(repeats):
            started = time.perf_counter()
            run = fresh(
                f"{__name__}:load", statements=statements, modules=list(job.get("modules", ()))
            )
            runs.append(run | {"whole": time.perf_counter() - started})
        found[name] = {
            "seconds": statistics.median(run["seconds"] for run in runs),
            "interpreter": statistics.median(run["whole"] - run["seconds"] for run in runs),
            "modules": runs[0]["modules"],
            "loaded": runs[0]["loaded"],
        }
    return found


def imports_of(script: Path) -> list[str]:
    """Import statements of a Python file, in order."""
    tree = ast.parse(script.read_text(encoding="utf-8"))
    found = [node for node in ast.walk(tree) if isinstance(node, ast.Import | ast.ImportFrom)]
    return [ast.unparse(node) for node in sorted(found, key=lambda node: node.lineno)]


def load(statements: Sequence[str], modules: Sequence[str]) -> dict[str, Any]:
    """Make imports in this process; return seconds and what is loaded then."""
    started = time.perf_counter()
    for statement in statements:
        exec(statement, {})
    for module in modules:
        import_module(module)
    seconds = time.perf_counter() - started
    return {
        "seconds": seconds,
        "modules": len(sys.modules),
        "loaded": [name for name in HEAVY if _is_loaded(name)],
    }


def _is_loaded(package: str) -> bool:
    """Whether a package is loaded: of scipy more than the shell of it that numba looks at."""
    if package == "scipy":
        parts = (name.split(".")[1] for name in list(sys.modules) if name.startswith("scipy."))
        return any(not part.startswith("_") and part != "version" for part in parts)
    return package in sys.modules


def job_times(folder: Path) -> dict[str, dict[str, float]]:
    """Wall time of jobs that have run, from Snakemake's benchmark files.

    Parameters
    ----------
    folder : Path
        Usually ``logs/benchmarks``; a folder that is not there has no jobs.

    Returns
    -------
    dict
        Stage -> ``jobs``, ``median`` and ``total`` seconds.
    """
    return {
        stage: {"jobs": len(each), "median": statistics.median(each), "total": sum(each)}
        for stage, each in seconds_by_stage(folder).items()
    }

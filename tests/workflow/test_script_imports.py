"""Jobs import what they need and no more: with hundreds of jobs, each import counts."""

import ast
from pathlib import Path

import pytest
from new_process import modules_after

SCRIPTS = Path(__file__).parents[2] / "workflow/scripts"
HEAVY = {"numba", "scipy", "xarray", "pandas", "netCDF4", "matplotlib", "pydantic"}
HEAVY |= {"mpmath", "jinja2", "docutils"}
# Script -> what it imports by name or in functions, and all that may be heavy of what is loaded.
JOBS = {
    "part": (
        ["damper.sweep.slices", "damper.models.masses", "damper.observers.impacts"],
        {"numba"},
    ),
    "gather": (["damper.sweep.cube", "xarray"], {"xarray", "pandas", "netCDF4"}),
    "figure": (
        ["damper.figures.map", "matplotlib.figure", "xarray"],
        {"xarray", "pandas", "netCDF4", "matplotlib", "pydantic"},
    ),
    "interactive": (
        ["damper.observers.bursts", "damper.figures.map", "xarray"],
        {"numba", "xarray", "pandas", "netCDF4", "pydantic"},
    ),
    "report": ([], {"jinja2", "docutils"}),
}


def imports(script: Path) -> list[str]:
    tree = ast.parse(script.read_text(encoding="utf-8"))
    found = [node for node in ast.walk(tree) if isinstance(node, ast.Import | ast.ImportFrom)]
    return [ast.unparse(node) for node in found]


@pytest.mark.parametrize("job", JOBS)
def test_a_job_imports_what_it_needs_and_no_more(job: str) -> None:
    modules, allowed = JOBS[job]
    statements = imports(SCRIPTS / f"{job}.py") + [f"import {name}" for name in modules]
    loaded = modules_after("\n".join(statements)) - {"scipy"}
    public = [name for name in loaded if not name.startswith(("scipy._", "scipy.version"))]
    assert {name.split(".")[0] for name in public} & HEAVY <= allowed

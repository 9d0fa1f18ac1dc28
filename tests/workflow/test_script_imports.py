"""Jobs import what they need and no more: with hundreds of jobs, each import counts."""

import ast
import json
from pathlib import Path

import pytest
from new_process import in_new_process

SCRIPTS = Path(__file__).parents[2] / "workflow/scripts"
HEAVY = {"numba", "scipy", "xarray", "pandas", "netCDF4", "matplotlib", "pydantic"}
HEAVY |= {"mpmath", "jinja2", "docutils"}
# Script -> what it imports by name or in functions, and all that may be heavy of what is loaded.
JOBS = {
    "part": (
        ["damper.sweep.slices", "damper.models.rigid", "damper.observers.impacts"],
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
CODE = """
import json, sys
for statement in {statements}:
    exec(statement)
public = [name for name in sys.modules if not name.startswith(("scipy._", "scipy.version"))]
print(json.dumps(sorted({{name.split(".")[0] for name in public if name != "scipy"}})))
"""


def imports(script: Path) -> list[str]:
    tree = ast.parse(script.read_text(encoding="utf-8"))
    found = [node for node in ast.walk(tree) if isinstance(node, ast.Import | ast.ImportFrom)]
    return [ast.unparse(node) for node in found]


@pytest.mark.parametrize("job", JOBS)
def test_a_job_imports_what_it_needs_and_no_more(job: str) -> None:
    modules, allowed = JOBS[job]
    statements = imports(SCRIPTS / f"{job}.py") + [f"import {name}" for name in modules]
    loaded = set(in_new_process(CODE.format(statements=json.dumps(statements))))
    assert loaded & HEAVY <= allowed

"""Jobs import what they need and no more: with hundreds of jobs, each import counts."""

import ast
from pathlib import Path

import pytest
from new_process import modules_after

SCRIPTS = Path(__file__).parents[2] / "workflow/scripts"
HEAVY = {"numba", "scipy", "xarray", "pandas", "netCDF4", "matplotlib", "pydantic"}
HEAVY |= {"mpmath", "jinja2", "docutils"}
CUBES = {"xarray", "pandas", "netCDF4"}
TABLES = CUBES | {"matplotlib", "pydantic"}
COMPARED = "damper.verification.comparison"
# Script -> what it imports by name or in functions, and all that may be heavy of what is loaded.
JOBS = {
    "part": (
        ["damper.sweep.slices", "damper.models.masses", "damper.observers.impacts"],
        {"numba"},
    ),
    "gather": (["damper.sweep.cube", f"{COMPARED}.runs", "xarray"], CUBES),
    "figure": (["damper.figures.map", "damper.figures.laws", "xarray"], TABLES),
    "table": (
        ["damper.tables.laws", f"{COMPARED}.tables.solver_errors", f"{COMPARED}.runs"],
        TABLES,
    ),
    "interactive": (
        ["damper.observers.bursts", "damper.figures.map", "xarray"],
        CUBES | {"numba", "pydantic"},
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
    if "numba" not in allowed:
        assert "damper.engine.trajectory" not in loaded


def test_settings_of_all_kinds_load_nothing_that_draws() -> None:
    """The Snakefile reads them each time, also where nothing is left to do."""
    code = """
from damper.study import kinds
read = [dict(found) for found in (kinds.FIGURES, kinds.TABLES, kinds.STUDIES)]
for study in kinds.STUDIES.values():
    read += [dict(study.figure_kinds), dict(study.table_kinds)]
assert all(read)
"""
    assert not modules_after(code) & HEAVY - {"pydantic"}
    assert "numpy" not in modules_after("import damper.study.config")

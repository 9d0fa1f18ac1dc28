"""Imports of jobs, and the times of those that have run."""

from pathlib import Path

import pytest

from damper.verification.cost.startup import imports_of, job_times, start_up

ROOT = Path(__file__).parents[3]
SCRIPTS = "workflow/scripts"


def test_imports_of_a_script_are_its_statements(tmp_path):
    script = tmp_path / "script.py"
    script.write_text(
        '"""import nothing"""\nimport csv\nfrom math import (\n    pi,\n    tau as turn,\n)\n'
        "if snakemake:\n    import json\n"
    )
    assert imports_of(script) == ["import csv", "from math import pi, tau as turn", "import json"]


@pytest.mark.parametrize(
    ("job", "modules", "needed", "useless"),
    [
        (
            "simulate",
            ("damper.models.rigid", "damper.observers.impacts"),
            {"numpy"},
            {"xarray", "pandas", "netCDF4", "matplotlib", "scipy", "pydantic", "mpmath", "jinja2"},
        ),
        ("gather", (), {"numpy", "xarray"}, {"numba", "matplotlib", "scipy", "pydantic", "jinja2"}),
        (
            "figure",
            ("damper.figures.map", "matplotlib.figure", "xarray"),
            {"matplotlib", "xarray"},
            {"numba", "scipy", "mpmath", "jinja2"},
        ),
        ("report", (), set(), {"numpy", "numba", "xarray", "matplotlib", "pydantic"}),
    ],
)
def test_a_job_loads_what_it_needs_and_no_more(job, modules, needed, useless):
    asked = {job: {"script": f"{SCRIPTS}/{job}.py", "modules": modules}}
    found = start_up(asked, ROOT, 1)[job]
    assert needed <= set(found["loaded"])
    assert not useless & set(found["loaded"])
    assert found["seconds"] > 0.0


def test_times_of_jobs_are_summed_by_stage(tmp_path):
    for path, seconds in {
        "burst/simulate/all.tsv": 1.0,
        "other/simulate/x~1/y~2.tsv": 3.0,
        "other/simulate/x~1/y~3.tsv": 8.0,
        "burst/gather.tsv": 0.5,
        "burst/figures/history.tsv": 2.0,
        "compile/rigid/impacts.tsv": 4.0,
        "report/report.tsv": 5.0,
    }.items():
        file = tmp_path / path
        file.parent.mkdir(parents=True, exist_ok=True)
        file.write_text(f"s\th:m:s\tmax_rss\n{seconds}\t0:00:01\t-\n")
    assert job_times(tmp_path) == {
        "simulate": {"jobs": 3, "median": 3.0, "total": 12.0},
        "gather": {"jobs": 1, "median": 0.5, "total": 0.5},
        "figure": {"jobs": 1, "median": 2.0, "total": 2.0},
        "compile": {"jobs": 1, "median": 4.0, "total": 4.0},
        "report": {"jobs": 1, "median": 5.0, "total": 5.0},
    }
    assert job_times(tmp_path / "nowhere") == {}

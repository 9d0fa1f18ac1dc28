"""Jobs of a target, counted by Snakemake itself."""

import shutil
from pathlib import Path

import pytest

from damper.verification.cost.jobs import count_jobs, jobs_of

ROOT = Path(__file__).parents[3]


@pytest.fixture(scope="module")
def project(tmp_path_factory):
    folder = tmp_path_factory.mktemp("project")
    for part in ("workflow", "config", "profiles"):
        shutil.copytree(ROOT / part, folder / part)
    shutil.copy(ROOT / "Snakefile", folder)
    return folder


def test_a_schematic_is_one_job_and_a_history_those_behind_its_cube(project):
    targets = {
        "schematic": ["restitution/figures/paper_b_fig_1.svg"],
        "history": ["burst/figures/history.png"],
    }
    found = jobs_of(targets, project, [project / "config/ci.yaml"])
    assert found["schematic"] == {"figure": 1}
    assert found["history"] == {"compile": 2, "simulate": 1, "gather": 1, "figure": 1}


def test_what_snakemake_refuses_is_an_error_in_its_words(project):
    with pytest.raises(RuntimeError, match=r"burst/figures/none\.png"):
        count_jobs(["burst/figures/none.png"], project)

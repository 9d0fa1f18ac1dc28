"""The workflow on a Slurm cluster of one node, on this machine."""

import importlib.util
import re
import shutil
import subprocess
import sys
from pathlib import Path

import pytest
from project_copy import MODEL, REDUCED, copy_project, digests, snakemake, write_small

SLURM = Path(__file__).with_name("slurm.sh")

#: What the test on Slurm needs and this machine lacks.
MISSING = [
    *(name for name in ("munged", "slurmctld", "slurmd") if not shutil.which(name)),
    *(["slurm"] if not importlib.util.find_spec("snakemake_executor_plugin_slurm") else []),
]


@pytest.mark.exhaustive
@pytest.mark.skipif(bool(MISSING), reason=f"needs {', '.join(MISSING)}: see docs/cluster.md")
def test_a_slurm_cluster_makes_the_same_bytes(tmp_path):
    """A real one, of one node on this machine, by profiles/slurm."""
    axes = {
        "mass_ratio": {"start": 0.1, "stop": 0.3, "num": 4, "fan": True},
        "frequency_ratio": {"values": [1.3]},
        "restitution": {"values": [0.3, 0.6]},
    }
    for name in ("local", "slurm"):
        (tmp_path / name).mkdir()
        write_small(copy_project(tmp_path / name), axes=axes, figures={"model": MODEL})
    arguments = (*REDUCED, "--config", "studies=[small, solvers]")
    snakemake(tmp_path / "local", *arguments)
    quick = ("--slurm-init-seconds-before-status-checks", "1", "--group-components", "parts=3")
    run = [sys.executable, "-m", "snakemake", "--profile", "profiles/slurm", *arguments, *quick]
    done = subprocess.run(
        [SLURM, "bash", "-c", '"$@" && scontrol --oneliner show jobs', "-", *run],
        cwd=tmp_path / "slurm",
        text=True,
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT,
    )
    assert done.returncode == 0, done.stdout
    made = digests(tmp_path / "slurm/results")
    assert made == digests(tmp_path / "local/results")

    # Four parts are two jobs, of one processor each; run times have the node's two to themselves.
    jobs_of = {}
    for job in re.findall("^JobId=.*", done.stdout, re.MULTILINE):
        rule = re.search(r"slurm_logs/(?:group|rule)_(\w+)", job)[1]
        jobs_of.setdefault(rule, []).append(int(re.search(r" NumCPUs=(\d+)", job)[1]))
    assert jobs_of["parts_part"] == [1, 1]
    assert jobs_of["gather"] == [1, 1, 1]  # the cube, the reference's states, the errors
    assert jobs_of["timed"] == [2]

"""The example of docs/extending.md: one entry in a copy of the package makes a statement."""

import os
import re
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
CODE = """
import numpy as np, xarray as xr
from damper.papers.tables.scores import scores_of
from damper.papers.statements import STATEMENTS
from damper.papers.verdicts import judge, table
from damper.study.reference import files

chatter = ("clearance", "restitution"), [[2, 0], [2, 2]]
cube = xr.Dataset({"chatter": chatter}, {"clearance": [0.1, 0.2], "restitution": [0.9, 1.0]})
found = [one for one in judge({"restitution": cube}) if one.statement.name == "B7"]
print(table(found).markdown())
print(table(found).csv())
print([one.name for one in STATEMENTS][-2:])
print(scores_of(cube, ["B7"])["B7"].values.tolist())
print("`B7`" in files()["docs/reference.md"])
"""


@pytest.fixture(scope="module")
def printed(tmp_path_factory: pytest.TempPathFactory) -> str:
    text = (ROOT / "docs/extending.md").read_text()
    (entry,) = re.findall(r"(?m)^    Statement\((?:\n    .*)+\n    \),\n", text)
    package = tmp_path_factory.mktemp("copy") / "damper"
    shutil.copytree(ROOT / "src/damper", package, ignore=shutil.ignore_patterns("__pycache__"))
    path = package / "papers/paper_b.py"
    before, mark, after = path.read_text().partition('    Statement(\n        "B6",')
    path.write_text(before + entry + mark + after)
    environment = {**os.environ, "PYTHONPATH": str(package.parent), "DAMPER_COMPILE": "0"}
    command = [sys.executable, "-c", CODE]
    done = subprocess.run(
        command, capture_output=True, text=True, env=environment, cwd=package.parent
    )
    assert done.returncode == 0, done.stderr
    return done.stdout


def test_one_entry_stands_on_the_page(printed: str) -> None:
    assert "## B7: without losses at impacts no chatter completes" in printed
    assert "\n- Found: complete chatter at restitution 1\n" in printed
    assert "\n- Verdict: **does not hold**: chatter counts as complete" in printed
    assert "\nB7,without losses" in printed
    assert "['B7', 'B6']" in printed


def test_the_calibration_scores_it(printed: str) -> None:
    *_, scores, in_reference = printed.splitlines()
    assert scores == "[1.0, 0.0]"
    assert in_reference == "True"

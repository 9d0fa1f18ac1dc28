"""What `damper.analysis` offers is there, documented, and loaded late."""

import inspect
import subprocess
import sys
from pathlib import Path

import damper
from damper.analysis import HOME

STUDIES = Path(__file__).parents[2] / "docs/studies.md"


def test_every_function_is_there_and_in_the_documents() -> None:
    text = STUDIES.read_text()
    for name in HOME:
        assert inspect.isfunction(getattr(damper.analysis, name))
        assert f"`{name}`" in text


def test_names_load_nothing_until_they_are_used() -> None:
    code = (
        "import sys, damper; assert 'best_clearance' in dir(damper.analysis);"
        "print(sorted({'numpy', 'pandas', 'xarray'} & set(sys.modules)))"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout == "[]\n"

"""Jobs that gather, tabulate or draw results load no engine: they would wait for it."""

import pytest
from new_process import in_new_process

LIGHT = [
    "damper.sweep.cube",
    "damper.study.comparison_cube",
    "damper.study.comparison_table",
    "damper.study.stress_cube",
    "damper.study.stress_table",
    "damper.study.twins_cube",
    "damper.study.twins_table",
    "damper.study.cost_table",
    "damper.figures.work_precision",
    "damper.figures.solver_summary",
    "damper.figures.stress",
    "damper.figures.twins",
    "damper.figures.cost",
]
HEAVY = ("numba", "mpmath", "damper.engine.trajectory", "scipy.integrate")
CODE = f"""
import json, sys
from importlib import import_module
found = {{}}
for name in {LIGHT}:
    import_module(name)
    found[name] = [module for module in {HEAVY} if module in sys.modules]
print(json.dumps(found))
"""


@pytest.fixture(scope="module")
def loaded() -> dict[str, list[str]]:
    return in_new_process(CODE)


@pytest.mark.parametrize("module", LIGHT)
def test_no_engine_is_loaded(loaded: dict[str, list[str]], module: str) -> None:
    """All in one process, one after the other: the first that loads it is the one to look at."""
    assert loaded[module] == []

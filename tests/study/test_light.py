"""Jobs that gather, tabulate or draw results load no engine: they would wait for it."""

import pytest
from new_process import in_new_process, modules_after

LIGHT = [
    "damper.sweep.cube",
    "damper.verification.comparison.runs",
    "damper.verification.comparison.tables.solver_errors",
    "damper.verification.comparison.tables.solver_speed",
    "damper.tables.laws",
    "damper.verification.comparison.figures.work_precision",
    "damper.figures.laws",
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


def test_settings_of_all_kinds_load_nothing_that_draws() -> None:
    """The Snakefile reads them each time, also where nothing is left to do."""
    code = """
from damper.study import kinds
read = [dict(found) for found in (kinds.FIGURES, kinds.TABLES, kinds.STUDIES)]
for study in kinds.STUDIES.values():
    read += [dict(study.figure_kinds), dict(study.table_kinds)]
assert all(read)
"""
    heavy = {"matplotlib", "xarray", "pandas", "netCDF4", "numba", "scipy"}
    assert not modules_after(code) & heavy

"""Settings of all tests: the same examples everywhere, no timing of single ones, the order."""

from collections.abc import Iterator
from types import SimpleNamespace

import pytest
from hypothesis import settings

from damper.engine import compiled

settings.register_profile("damper", deadline=None, derandomize=True)
settings.load_profile("damper")


#: What takes longest, so that no worker is left alone with it at the end; then what runs little of
#: the engine. All else finds its code in the cache once the workflow has compiled it.
FIRST = (
    "tests/workflow/",
    "tests/sizing/test_masses.py",
    "tests/test_quantities.py",
    "tests/sweep/test_orbit_branches.py",
    "tests/test_project.py",
    "tests/parameters/",
    "tests/study/",
    "tests/shell/",
)
#: Tests of these rooms and files run plain Python, with all of their fixtures: to compile takes
#: longer than short runs, and the bytes are the same (tests/engine/test_compiled.py). A test of
#: long runs is marked `compiled`; those that are `exhaustive` are all long.
PLAIN = (
    "src/",
    *("tests/analysis/", "tests/engine/", "tests/figures/", "tests/identification/"),
    *("tests/models/", "tests/notebook/", "tests/study/", "tests/sweep/", "tests/theory/"),
    *(f"tests/observers/test_{name}.py" for name in ("bodies", "decay", "laws", "lyapunov")),
    *(f"tests/observers/test_{name}.py" for name in ("motion", "statistics")),
    *(f"tests/sizing/test_design.py::test_a_{name}" for name in ("machine_that", "record_is")),
    "tests/sizing/test_machine.py::test_records",
    "tests/sizing/test_search.py::test_no_place",
    "tests/sizing/test_structures.py",
    "tests/test_quantities.py",
)


def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """Start with what takes longest; end with what the workflow compiles code for."""

    def place(item: pytest.Item) -> int:
        known = (k for k, start in enumerate(FIRST) if item.nodeid.startswith(start))
        return next(known, len(FIRST))

    items.sort(key=place)


class PlainRooms:
    """Runs the tests of the plain rooms as plain Python, in all threads; examples of src, too."""

    @pytest.hookimpl(wrapper=True)
    def pytest_runtest_protocol(self, item: pytest.Item) -> Iterator[None]:
        before = compiled._plain
        long = any(map(item.get_closest_marker, ("compiled", "exhaustive")))
        if item.nodeid.startswith(PLAIN) and not long:
            compiled._plain = SimpleNamespace(running=True)
        try:
            return (yield)
        finally:
            compiled._plain = before


def pytest_configure(config: pytest.Config) -> None:
    config.pluginmanager.register(PlainRooms())

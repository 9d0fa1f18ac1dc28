"""Settings of all tests: the same examples everywhere, no timing of single ones, the order."""

import pytest
from hypothesis import settings

settings.register_profile("damper", deadline=None, derandomize=True)
settings.load_profile("damper")


#: What runs little of the engine. All else finds its code in the cache once the workflow, which
#: comes before, has compiled it.
PLAIN = ("tests/test_project.py", "tests/parameters/", "tests/study/", "tests/shell/")


def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """Start with the workflow, which takes longest; end with what it compiles code for."""
    items.sort(
        key=lambda item: (
            not item.nodeid.startswith("tests/workflow/"),
            not item.nodeid.startswith(PLAIN),
        )
    )

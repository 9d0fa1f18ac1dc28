"""Settings of all tests: the same examples everywhere, no timing of single ones, the order."""

import pytest
from hypothesis import settings

settings.register_profile("damper", deadline=None, derandomize=True)
settings.load_profile("damper")


#: What runs most of the engine. Its code is in the cache once the workflow has compiled it.
COMPILES = tuple(
    f"tests/{name}/"
    for name in ("engine", "models", "observers", "sweep", "theory", "verification")
)


def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """Start with the workflow, which takes longest; end with what it compiles code for."""
    items.sort(
        key=lambda item: (
            not item.nodeid.startswith("tests/workflow/"),
            item.nodeid.startswith(COMPILES),
        )
    )

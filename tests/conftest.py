"""Settings of all tests: the same examples everywhere, no timing of single ones, the order."""

import pytest
from hypothesis import settings

settings.register_profile("damper", deadline=None, derandomize=True)
settings.load_profile("damper")


def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """Start with the workflow, which takes longest: a file's tests all run in one worker."""
    items.sort(key=lambda item: not item.nodeid.startswith("tests/workflow/"))

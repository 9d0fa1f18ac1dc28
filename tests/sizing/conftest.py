"""What the tests of sizing share."""

from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

import pytest

from damper.sizing import study

#: Of starts of any damper, near its worst case, at its frequency, in the check and in its rounds;
#: places of the free mass and gaps within the tolerance; frequencies in the band and beyond.
FEW: dict[str, Any] = {
    "_RANDOM": 10,
    "_NEARBY": 4,
    "STARTS": 12,
    "_FRESH": 12,
    "_MORE": 5,
    "_FINE_PLACES": 3,
    "_FINE_GAPS": 3,
    "PLACES": [-1.0, 0.0, 1.0],
    "_LEAST": 5,
    "_BEYOND": 2,
}


@contextmanager
def _few() -> Iterator[None]:
    with pytest.MonkeyPatch.context() as patch:
        for name, count in FEW.items():
            patch.setattr(study, name, count)
        yield


@pytest.fixture
def few_starts() -> Iterator[None]:
    """A small worst case, for what holds with any number of starts and frequencies."""
    with _few():
        yield


@pytest.fixture(scope="module")
def few_starts_throughout() -> Iterator[None]:
    """A small worst case in all tests of a module."""
    with _few():
        yield

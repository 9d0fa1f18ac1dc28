"""Cases of parametrised tests, of which all but some are left to `pytest -m exhaustive`."""

from collections.abc import Callable, Iterable
from typing import Any

import pytest


def thinned(cases: Iterable[Any], kept: Callable[[Any], bool]) -> list[Any]:
    """Mark the cases that are not `kept` as exhaustive."""
    return [
        case if kept(case) else pytest.param(*_values(case), marks=pytest.mark.exhaustive)
        for case in cases
    ]


def _values(case: Any) -> tuple[Any, ...]:
    return case if isinstance(case, tuple) else (case,)

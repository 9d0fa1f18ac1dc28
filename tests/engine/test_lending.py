"""Lent arrays are read and written as others are, and freed once by whoever owns them."""

from typing import Any, NamedTuple

import numpy as np
import pytest

from damper.engine.compiled import COMPILED, _load_numba, compiled_apart
from damper.engine.lending import lent


class Pair(NamedTuple):
    array: np.ndarray
    rest: tuple[np.ndarray, float]


def _doubled(owned: Any) -> float:
    pair, total = lent(owned), owned.rest[1]
    for i in range(len(pair.array)):
        pair.array[i] *= 2.0
        total += pair.array[i] + pair.rest[0][i]
    return float(total)


def _many(count: int) -> float:
    total = 0.0
    for _ in range(count):
        total += doubled(Pair(np.ones(3), (np.full(3, 4.0), 2.0)))
    return total


doubled = compiled_apart(_doubled)


def test_plain() -> None:
    pair = Pair(np.ones(3), (np.zeros(3), 0.0))
    assert lent(pair) is pair


@pytest.mark.skipif(not COMPILED, reason="numba is off")
def test_compiled() -> None:
    numba = _load_numba()
    from numba.core.runtime import _nrt_python, rtsys

    many = numba.njit(_many)
    assert many(1) == _many(1) == 20.0
    _nrt_python.memsys_enable_stats()
    before = rtsys.get_allocation_stats()
    assert many(1000) == 20000.0
    after = rtsys.get_allocation_stats()
    assert after.alloc - before.alloc == after.free - before.free

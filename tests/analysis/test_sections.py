"""Number of section points: maps whose periods are known, and sequences made to order."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from damper.analysis.sections import first_lasting_change, period_of


@pytest.mark.parametrize(("rate", "period"), [(2.8, 1), (3.55, 8), (3.83, 3), (3.9, 0)])
def test_logistic_map(rate: float, period: int) -> None:
    x, points = 0.4, []
    for n in range(5200):
        x = rate * x * (1.0 - x)
        if n >= 5000:
            points.append([x])
    assert period_of(np.array(points)) == period


@pytest.mark.parametrize(("p", "q"), [(1, 3), (2, 7), (5, 12)])
def test_rotation(p: int, q: int) -> None:
    angles = 2.0 * math.pi * p / q * np.arange(60)
    assert period_of(np.column_stack([np.cos(angles), np.sin(angles)])) == q
    golden = np.arange(60) * math.pi * (math.sqrt(5.0) - 1.0)
    assert period_of(np.column_stack([np.cos(golden), np.sin(golden)])) == 0


@given(st.permutations(range(1, 9)), st.integers(1, 8), st.integers(2, 5), st.integers(0, 3))
def test_distinct_points_again_and_again(
    order: list[int], period: int, times: int, more: int
) -> None:
    cycle = [[float(k), -0.5 * k] for k in order[:period]]
    points = np.array((cycle * (times + 1))[: period * times + min(more, period)])
    assert period_of(points) == period


def test_what_is_left_of_the_transient_does_not_count() -> None:
    decay = 1e-6 * 0.9 ** np.arange(50)
    points = np.column_stack([1.0 + decay, -2.0 - decay])
    assert period_of(points) == 1
    assert period_of(points, same=1e-8) == 0


@pytest.mark.parametrize(
    ("periods", "index"),
    [
        ([1, 1, 1, 2, 2, 2], 3),
        ([1, 1, 1, 0, 3, 0], 3),
        ([1, 1, 1, 0, 1, 0, 0, 0], None),
        ([1, 1, 1, 0, 1, 1, 1, 0, 2, 0], 7),
        ([0, 0, 0, 1, 1, 1], None),
        ([1, 1, 1], None),
        ([1, 1, 0, 0, 0], None),
        ([2, 2, 2, 1, 1, 1, 3, 3, 3], 3),
        ([], None),
    ],
)
def test_first_lasting_change(periods: list[int], index: int | None) -> None:
    assert first_lasting_change(periods, least=3) == index

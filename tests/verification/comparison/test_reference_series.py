"""First roots of polynomials: against polynomials made from known roots."""

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from mpmath import mp, mpf

from damper.verification.comparison.reference_series import first_root


def polynomial(roots: list[mpf], factor: mpf) -> list[mpf]:
    """Coefficients of factor (r0 - t) (r1 - t) ..., positive at 0 for roots above it."""
    c = [factor]
    for root in roots:
        c = [root * a - b for a, b in zip([*c, mpf(0)], [mpf(0), *c], strict=True)]
    return c


@settings(deadline=None, max_examples=40)
@given(
    st.lists(st.floats(0.01, 3), min_size=1, max_size=5), st.floats(1e-6, 1e6), st.floats(0.5, 2)
)
def test_first_of_known_roots(roots, factor, end):
    """Double and clustered roots too: none is passed by more than its own uncertainty."""
    with mp.workdps(50):
        first = min(roots)
        q = polynomial([mpf(root) for root in roots], mpf(factor))
        found = first_root(q, mpf(end), absolute=True)
        isolated = sum(abs(root - first) < 0.01 for root in roots) == 1
        if first > end:
            assert found is None
        elif first == end and found is None:
            pass  # the last step may round to beyond the end, where the next panel begins
        elif isolated:
            assert abs(found - first) < mpf("1e-38")
        elif found is not None:  # roots that touch are uncertain by a part of their digits
            assert found < first + mpf("1e-6")


@pytest.mark.parametrize("roots", [[0.01] * 5, [0.7] * 4])
def test_a_multiple_root_is_reached(roots: list[float]) -> None:
    """Steps with one bound for the whole panel would take 1e8 for three roots, 1e15 for five."""
    with mp.workdps(50):
        q = polynomial([mpf(root) for root in roots], mpf("0.01"))
        found = first_root(q, mpf(1), absolute=True)
        if found is None:  # even ones may be missed by rounding, which lifts the polynomial
            assert len(roots) % 2 == 0
        else:
            assert abs(found - min(roots)) < mpf("1e-9")


@pytest.mark.parametrize("gap", ["1e-22"])
def test_two_roots_close_together(gap):
    """A dip below zero that no grid would see, and a near miss."""
    with mp.workdps(65):
        middle, half = mpf("0.7"), mpf(gap)
        dip = polynomial([middle - half, middle + half], mpf(1))
        assert abs(first_root(dip, mpf(1), absolute=True) - (middle - half)) < mpf("1e-40")
        dip[0] += 2 * half**2
        assert first_root(dip, mpf(1), absolute=True) is None


def test_root_relative_to_itself():
    """A tiny root keeps all its digits where they are asked for."""
    with mp.workdps(50):
        root = mpf("1e-40") / 3
        found = first_root(polynomial([root, mpf(2)], mpf(1)), mpf(1), absolute=False)
        assert abs(found / root - 1) < mpf("1e-46")

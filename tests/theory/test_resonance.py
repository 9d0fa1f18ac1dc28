"""Least amplitude at resonance against the engine and the law of free decay."""

import math

import pytest

from damper import Parameters
from damper.theory.free_decay import largest_damping
from damper.theory.resonance import best_clearance, largest_amplitude, least_amplitude


@pytest.mark.parametrize(("damping", "restitution"), [(0.0, 0.0), (0.02, 0.3), (1e-3, 0.7)])
def test_the_power_balances_with_the_largest_damping(damping: float, restitution: float) -> None:
    """At resonance A = 1 / (2 zeta_eq), with the largest zeta_eq of the law of free decay."""
    d = best_clearance(1e-2, damping, restitution)
    p = Parameters(1e-2, damping, 1.0, d, restitution, force_amplitude=0.0)
    amplitude, ratio = largest_damping(p)
    least = least_amplitude(1e-2, damping, restitution)
    assert math.isclose(least, 1.0 / (2.0 * ratio), rel_tol=1e-12)
    assert math.isclose(least, amplitude, rel_tol=1e-12)


def test_a_small_clearance_leaves_the_primary_to_its_dashpot() -> None:
    assert math.isclose(largest_amplitude(1e-4, 0.1, 0.3, 1e-3), 5.0, rel_tol=2e-3)


@pytest.mark.parametrize(("restitution", "alone"), [(0.0, True), (0.2, True), (0.6, False)])
def test_with_a_high_restitution_a_large_motion_coexists(restitution: float, alone: bool) -> None:
    given = 1e-2, 1e-3, restitution
    largest = largest_amplitude(*given, best_clearance(*given))
    assert math.isclose(largest, least_amplitude(*given), rel_tol=1e-4) == alone

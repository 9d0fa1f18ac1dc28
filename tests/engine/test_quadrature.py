"""Gauss-Legendre rules, and the steps for which each is exact to roundoff."""

import math

import numpy as np
import pytest
from mpmath import mp, mpf

from damper.engine.quadrature import FEWEST, MOST, NODES, REACH, WEIGHTS, nodes_for


@pytest.mark.parametrize("n", range(FEWEST, MOST + 1))
def test_nodes_and_weights_to_full_relative_precision(n: int) -> None:
    """The first nodes, too: all that a mode that decays within the step meets."""
    row = n - FEWEST
    with mp.workdps(40):
        for node, weight in zip(NODES[row, :n].tolist(), WEIGHTS[row, :n].tolist(), strict=True):
            z = mp.findroot(lambda z: mp.legendre(n, z), 1 - 2 * mpf(node))
            slope = n * (mp.legendre(n - 1, z) - z * mp.legendre(n, z)) / (1 - z * z)
            assert abs(node / ((1 - z) / 2) - 1) < 1e-15
            assert abs(weight * (1 - z * z) * slope**2 - 1) < 1e-14
    assert not NODES[row, n:].any()


@pytest.mark.parametrize("rate", [1.0, -1.0, 1j, 0.6 - 0.8j])
def test_each_rule_holds_as_far_as_it_is_used(rate: complex) -> None:
    """On exp(K t) with K times the step up to the rule's reach."""
    for n in range(FEWEST, MOST + 1):
        reach = float(REACH[n - FEWEST])
        assert nodes_for(reach * (1 - 1e-12)) == n
        k = reach * rate
        row = n - FEWEST
        values = np.exp(k * NODES[row, :n])
        exact = complex(mp.expm1(k) / mp.mpc(k))
        scale = max(1.0, math.exp(k.real))
        assert abs(WEIGHTS[row, :n] @ values - exact) < 1e-15 * scale * (1 + abs(k))

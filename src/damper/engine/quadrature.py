"""Gauss-Legendre rules, and how long a step each of them integrates to roundoff.

For an integrand of exponential type K (bounded by exp(K |z|) at complex time z) the classical
bound on the Bernstein ellipse of parameter rho = 8 n / (K h) gives n nodes on a step h an error of

    (e K h / (8 n))^(2 n)

relative to the integrand's scale, up to a factor below ten.
"""

import math

import numpy as np

from damper.engine.compiled import compiled

#: Nodes of the smallest and of the largest rule.
FEWEST, MOST = 3, 20
#: Error of one sum relative to the scale of its integrand.
_TOLERANCE = 1e-17
#: K h up to which each rule holds.
REACH = np.array([8.0 * n / math.e * _TOLERANCE ** (0.5 / n) for n in range(FEWEST, MOST + 1)])
LONGEST_REACH = float(REACH[-1])


def gauss_rule(n: int) -> tuple[np.ndarray, np.ndarray]:
    """Gauss-Legendre nodes and weights on [0, 1], both to full relative precision.

    NumPy's are good to roundoff of the interval. A mode that decays within the step meets only
    the first nodes, where that leaves 1e-14. Here Newton's iteration is done in the distance t
    from the end, on P_n(1 - 2 t), whose recurrence is taken in differences of P_k.

    Parameters
    ----------
    n : int
        Number of nodes, >= 2.

    Returns
    -------
    nodes, weights : ndarray (n,)
    """
    t = 0.5 + 0.5 * np.polynomial.legendre.leggauss(n)[0][: (n + 1) // 2]
    for _ in range(2):
        value = 1.0 - 2.0 * t
        difference = -2.0 * t
        for k in range(1, n):
            difference = (k * difference - 2.0 * (2 * k + 1) * t * value) / (k + 1)
            value = value + difference
        slope = n * (2.0 * t * value - difference)  # (1 - z^2) P_n'(z) at z = 1 - 2 t
        weights = 4.0 * t * (1.0 - t) / (slope * slope)
        t = t + 2.0 * t * (1.0 - t) * value / slope
    half = n // 2
    return np.append(t, 1.0 - t[:half][::-1]), np.append(weights, weights[:half][::-1])


#: Nodes and weights on [0, 1], one row per rule.
NODES = np.zeros((len(REACH), MOST))
WEIGHTS = np.zeros((len(REACH), MOST))
for _row, _n in enumerate(range(FEWEST, MOST + 1)):
    NODES[_row, :_n], WEIGHTS[_row, :_n] = gauss_rule(_n)


@compiled
def nodes_for(reach: float) -> int:
    """Fewest nodes that integrate to roundoff over a step of this K h."""
    n = FEWEST
    while n < MOST and REACH[n - FEWEST] < reach:
        n += 1
    return n

"""Resonance: how far a light free mass with two impacts per cycle holds the primary down.

Where the force does most, dashpot and impacts (`damper.theory.free_decay`) take its power,
A (2 zeta + (8 mu rho / pi^2) (theta / xi)^2) = 1 with A = xi d in units of F0/K. The least
amplitude that a clearance can give is that at theta = 1, where A = rho d:

    1/A = 2 zeta + (4 mu / pi) (1 + r) / (1 - r)

With larger clearances the free mass falls out of step. With little damping and a restitution above
0.3 the power balances at a large amplitude as well, in which a primary that comes from there stays.
The error is of the order of the mass ratio.
"""

import math

import numpy as np

from damper.parameters.quantity import in_range
from damper.theory.slow_manifold import amplitude, slope


def least_amplitude(mass_ratio: float, damping_ratio: float, restitution: float) -> float:
    """Least amplitude at resonance that a clearance can give, in units of F0/K.

    ValueError for what is out of range; restitution 1 loses nothing.

    Examples
    --------
    >>> round(least_amplitude(0.01, 0.0, 0.0), 9)
    78.539816339
    """
    in_range("restitution", restitution, minimum=0.0, maximum=1.0, below=True)
    impacts = 4.0 * mass_ratio / math.pi * (1.0 + restitution) / (1.0 - restitution)
    return 1.0 / (2.0 * damping_ratio + impacts)


def best_clearance(mass_ratio: float, damping_ratio: float, restitution: float) -> float:
    """Clearance that gives the least amplitude at resonance, in units of F0/K."""
    return least_amplitude(mass_ratio, damping_ratio, restitution) / slope(restitution)


def largest_amplitude(
    mass_ratio: float, damping_ratio: float, restitution: float, clearance: float
) -> float:
    """Largest amplitude at which the power balances at resonance, in units of F0/K.

    For a clearance no larger than the best one; to four digits.

    Examples
    --------
    >>> best = best_clearance(0.1, 0.02, 0.6)
    >>> [round(largest_amplitude(0.1, 0.02, 0.6, part * best), 1) for part in (0.01, 1.0)]
    [19.0, 11.0]
    """
    best = best_clearance(mass_ratio, damping_ratio, restitution)
    in_range("clearance", clearance, minimum=0.0, maximum=best, above=True)
    rho = slope(restitution)
    theta = 1.0 + np.geomspace(1e-9, 10.0 / (damping_ratio + 1e-9) / clearance + 10.0, 100_000)
    xi = amplitude(theta, restitution)
    loss = 2.0 * damping_ratio * xi + 8.0 * mass_ratio * rho / math.pi**2 * theta**2 / xi
    lacks = np.flatnonzero(clearance * loss < 1.0)
    return clearance * float(xi[lacks[-1]] if lacks.size else rho)

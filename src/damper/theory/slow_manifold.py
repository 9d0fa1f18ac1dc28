"""Slow invariant manifold: amplitude of the walls against that of the free mass, as mu -> 0.

Where the free mass is light it settles to two impacts per cycle while the primary's amplitude
slowly moves along (Gendelman, J. Sound Vib. 331, 2012, 4599-4608)

    xi^2 = (theta - 1)^2 + rho^2 theta^2,      rho = (2/pi) (1 - r)/(1 + r)

`xi` is the primary's amplitude over the clearance d, `theta` the peak of the free mass's triangle
wave over d, reached at the impacts. It is stable for 1/(1 + rho^2) < theta < 1/(1 - 4/pi^2): below
is the fold, where xi is least; above, the motion is not symmetric. Derivation: docs/theory.md.
"""

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

#: Theta up to which the upper branch is stable.
SYMMETRIC_LIMIT = 1.0 / (1.0 - 4.0 / math.pi**2)


class ManifoldPoint(NamedTuple):
    """A point of the manifold."""

    theta: float
    xi: float


def amplitude(theta: ArrayLike, restitution: float) -> np.ndarray:
    """Amplitude xi of the primary on the manifold, over the clearance, in the shape of `theta`.

    `theta` >= 0 is the peak of the free mass's triangle wave over the clearance. ValueError for
    what is out of range.
    """
    theta = _not_negative("theta", theta)
    return np.hypot(theta - 1.0, slope(restitution) * theta)


def branches(xi: ArrayLike, restitution: float) -> tuple[np.ndarray, np.ndarray]:
    """Both theta of an amplitude xi >= 0: on the branch above the fold and on the one below.

    NaN below the fold. The lower one is NaN as well where it would be negative, for xi > 1: there
    is none. ValueError for what is out of range.
    """
    xi = _not_negative("xi", xi)
    rho = slope(restitution)
    square = 1.0 + rho * rho
    # xi^2 (1 + rho^2) - rho^2 as a product, which keeps the digits next to the fold.
    scaled = xi * math.sqrt(square)
    rest = (scaled - rho) * (scaled + rho)
    spread = np.sqrt(np.where(rest >= 0.0, rest, np.nan))
    upper = (1.0 + spread) / square
    # The product of both is (1 - xi^2) / (1 + rho^2): their difference would cancel.
    lower = (1.0 - xi) * (1.0 + xi) / (1.0 + spread)
    return upper, np.where(lower >= 0.0, lower, np.nan)


def fold(restitution: float) -> ManifoldPoint:
    """Least amplitude of the manifold: below it the free mass falls out of step.

    ValueError unless 0 <= restitution <= 1.
    """
    rho = slope(restitution)
    return ManifoldPoint(1.0 / (1.0 + rho * rho), rho / math.hypot(1.0, rho))


def stable(theta: ArrayLike, restitution: float) -> np.ndarray:
    """Whether the motion at `theta` >= 0 is stable while the amplitude stands still, in its shape.

    Never with r = 1, where the map keeps areas and deviations neither die out nor grow. ValueError
    for what is out of range.
    """
    theta = _not_negative("theta", theta)
    inside = (theta > fold(restitution).theta) & (theta < SYMMETRIC_LIMIT)
    return inside & (restitution < 1.0)


def slope(restitution: float) -> float:
    """Return rho = (2/pi) (1 - r)/(1 + r); ValueError unless 0 <= r <= 1."""
    if not 0.0 <= restitution <= 1.0:
        raise ValueError(f"restitution = {restitution!r}: must be a number from 0 to 1")
    return 2.0 / math.pi * (1.0 - restitution) / (1.0 + restitution)


def _not_negative(name: str, values: ArrayLike) -> np.ndarray:
    array = np.asarray(values, dtype=float)
    if not (array >= 0.0).all():
        raise ValueError(f"{name} = {values!r}: must be numbers >= 0")
    return array

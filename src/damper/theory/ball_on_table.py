"""A ball on an oscillating table that does not feel it: motions with one impact in n periods.

A free mass under gravity hits the wall below it alone; with Gamma the largest acceleration of
that wall over gravity, the motion exists from Gamma = n pi (1 - r)/(1 + r) on, and its period
doubles at Gamma^2 = [n pi (1 - r)/(1 + r)]^2 + [2 (1 + r^2)/(1 + r)^2]^2. Derivation:
docs/theory.md.
"""

import math
from typing import NamedTuple

from damper.parameters import Parameters
from damper.parameters.dampers import BASIC, require_known
from damper.theory import require_basic
from damper.theory.steady import steady_amplitude

#: Quantities that act.
KNOWN = (*BASIC, "force_amplitude", "gravity", "walls", "carrier")


class BouncingBall(NamedTuple):
    """The motion with one impact in n periods."""

    acceleration: float
    """Gamma, of the table that is given."""
    onset: float
    """The least one with which the motion exists."""
    doubling: float
    """That at which its period doubles: in between it is stable."""
    approach_speed: float
    """Of its impacts, whatever Gamma is."""

    @property
    def stable(self) -> bool:
        """Whether it exists and is stable on the table that is given."""
        return self.onset < self.acceleration < self.doubling


def bounce(parameters: Parameters, periods: int) -> BouncingBall:
    """The motion with one impact in so many periods, on a prescribed box or on the primary.

    ValueError without gravity, and where another quantity than these acts.

    Examples
    --------
    >>> table = Parameters(0, 0, 1.0, 0, 0.5, gravity=0.8, walls="left", carrier="prescribed")
    >>> bounce(table, 1)[:2]
    (1.25, 1.0471975511965976)
    """
    p = parameters
    if "prescribed" in p.features:
        require_known(p, KNOWN, "the closed form")
    else:
        require_basic(p, *KNOWN)
    if not p.gravity:
        raise ValueError("gravity = 0.0: no ball comes back to the table; must not be 0")
    r, gamma, omega = p.restitution, abs(p.gravity), p.frequency_ratio
    amplitude = p.force_amplitude
    if not p.carrier:
        amplitude *= steady_amplitude(p.damping_ratio, omega)
    onset = periods * math.pi * (1.0 - r) / (1.0 + r)
    return BouncingBall(
        amplitude * omega**2 / gamma,
        onset,
        math.hypot(onset, 2.0 * (1.0 + r * r) / (1.0 + r) ** 2),
        periods * gamma * p.cycle / (1.0 + r),
    )

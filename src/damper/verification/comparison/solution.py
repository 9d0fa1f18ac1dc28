"""What every solver of a comparison gives back."""

from dataclasses import dataclass, field
from math import nan

import numpy as np

#: How a run can end. All but the first are failures that a solver itself has noticed.
FINISHED = "finished"
STALLED = "stalled"  # infinitely many impacts ahead, and time no longer moves
CAPPED = "capped"  # more evaluations than it was given
FAILED = "failed"  # the underlying integrator failed, or values are not finite
OUTCOMES = (FINISHED, STALLED, CAPPED, FAILED)


def _none() -> np.ndarray:
    return np.empty(0)


@dataclass
class Solution:
    """A run as one solver sees it; everything absolute and dimensionless.

    Impacts are contacts that begin: with compliant contact, the times at which the gap closes.
    """

    impact_times: np.ndarray = field(default_factory=_none)
    impact_sides: np.ndarray = field(default_factory=_none)
    """-1 left wall, +1 right wall."""
    approach_speeds: np.ndarray = field(default_factory=_none)
    stick_times: np.ndarray = field(default_factory=_none)
    """When sticking begins: accumulation times of complete bursts."""
    release_times: np.ndarray = field(default_factory=_none)
    states: np.ndarray = field(default_factory=lambda: np.empty((0, 4)))
    """Shape (times asked for, 4): x, v, y, u there; nan after `reached`."""
    penetration: float = nan
    """Largest |y - x| - d over all states the solver itself computed, 0 if never beyond a wall."""
    energy_residual: float = nan
    """Energy at the end less energy at the start, less the work of the force, plus what dashpot and
    impacts took, over the sum of the sizes of these; nan if not asked for, or not finished."""
    evaluations: int = 0
    """Of the acceleration, or of the closed-form flow."""
    outcome: str = FINISHED
    reached: float = nan
    """Time at which it ended; `until` if it finished."""

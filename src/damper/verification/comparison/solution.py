"""The solution that every solver of a comparison returns."""

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
    """A run as one solver sees it; everything absolute and dimensionless."""

    impact_times: np.ndarray = field(default_factory=_none)
    impact_sides: np.ndarray = field(default_factory=_none)
    """-1 left wall, +1 right wall."""
    approach_speeds: np.ndarray = field(default_factory=_none)
    stick_times: np.ndarray = field(default_factory=_none)
    """When sticking begins: accumulation times of complete bursts."""
    release_times: np.ndarray = field(default_factory=_none)
    end_state: np.ndarray = field(default_factory=lambda: np.full(4, nan))
    """x, v, y, u at the end of the scene; nan if it did not come so far."""
    penetration: float = nan
    """Largest |y - x| - d over all states the solver itself computed, 0 if never beyond a wall."""
    evaluations: int = 0
    """Of the acceleration, or of the closed-form flow."""
    outcome: str = FINISHED
    reached: float = nan
    """Time at which it ended; `until` if it finished."""

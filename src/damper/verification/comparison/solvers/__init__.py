"""The solvers of a comparison: scenes, solutions, and how to load one."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from importlib import import_module
from math import nan

import numpy as np

from damper.parameters import Parameters, State

#: How a run can end. All but the first are failures that a solver itself has noticed.
FINISHED = "finished"
STALLED = "stalled"  # infinitely many impacts ahead, and time no longer moves
CAPPED = "capped"  # more evaluations than it was given
FAILED = "failed"  # the underlying integrator failed, or values are not finite


@dataclass(frozen=True)
class Scene:
    """One run to compare solvers on."""

    parameters: Parameters
    state: State
    """Start in flight: displacements and velocities of primary and free mass, and the time."""
    until: float
    """End, in units of sqrt(M/K); before chaos takes over, where there is chaos."""

    @property
    def periods(self) -> float:
        """Forcing periods from start to end."""
        return (self.until - self.state.time) / self.parameters.cycle


def read_scene(values: Mapping[str, float], until: float) -> Scene:
    """Make a scene of dimensionless parameters by name, and initial quantities that are not zero.

    It ends at `until`, above 0. ValueError or TypeError for names and values that are not valid.
    """
    # Not above: a job that gathers or draws results does without the engine.
    from damper.sweep.points import read_point

    point = read_point(values)
    start = point.start() or State(0.0, 0.0, 0.0, 0.0)
    return Scene(point.parameters, start, float(until))


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

    def list_events(self, rows: np.ndarray) -> Solution:
        """Take events from rows of time, kind (as in `damper.events`), side and approach speed."""
        impacts, sticks, releases = (rows[rows[:, 1] == kind] for kind in range(3))
        self.impact_times, self.impact_sides, self.approach_speeds = impacts[:, (0, 2, 3)].T.copy()
        self.stick_times, self.release_times = sticks[:, 0], releases[:, 0]
        return self


@dataclass(frozen=True)
class Solver:
    """One way to simulate the damper."""

    evaluations_per_second: float
    """How fast it is, roughly; see `most_evaluations`."""
    solve: Callable[[Scene, float, int], Solution]
    """Runs a scene with a setting and a limit on the evaluations, after which it is given up.

    A failure is an outcome of the solution, not an error.
    """

    def most_evaluations(self, cap: float) -> int:
        """Evaluations that a cap in seconds is kept as, so that the machine's load is no matter."""
        return max(int(cap * self.evaluations_per_second), 1)


def load(name: str) -> Solver:
    """Return a solver; no other one is imported."""
    solver: Solver = import_module(f"{__name__}.{name}").SOLVER
    return solver

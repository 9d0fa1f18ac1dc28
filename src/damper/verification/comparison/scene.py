"""A scene of a comparison: parameters, start and end of a run of all solvers."""

from collections.abc import Mapping
from dataclasses import dataclass

from damper.parameters import Parameters, State
from damper.sweep.points import read_point


@dataclass(frozen=True)
class Scene:
    """One run to compare solvers on."""

    parameters: Parameters
    state: State
    """Start: primary displacement and velocity, free mass displacement and velocity, time 0."""
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
    point = read_point(values)
    start = point.start() or State(0.0, 0.0, 0.0, 0.0)
    return Scene(point.parameters, start, float(until))

"""Harvest: the electrical output of a harvester whose walls take energy at each impact."""

import math

import numpy as np

from damper.engine.compiled import compiled
from damper.engine.model import read_segment, speeds_in_tail
from damper.engine.segment import IMPACT, TAIL
from damper.engine.trajectory import Trajectory
from damper.observers.common.base import Observer, Window, read_record, record_type, since
from damper.observers.common.settings import BODIES, Setting
from damper.parameters.models import MODELS
from damper.parameters.units import SI_UNITS
from damper.parameters.variables import ENERGY, SPEED, Variable

#: Of a run: the output of all impacts, and the largest of an impact.
_TOTALS = record_type("total", "largest")


class Harvest(Observer):
    """Energy that a harvester gives at impacts, per cycle.

    The output of an impact is a coefficient times the approach speed squared, or a table of it over
    the approach speed, which is linear between its rows and from 0 at speed 0 to its first row. A
    run with an impact faster than the table has no value. The output follows from the motion, and
    the motion does not feel it: the restitution has all that an impact takes.
    """

    models = (*MODELS, "structure")
    bodies = BODIES
    coefficient = Setting(
        1.0,
        "Output of an impact over its approach speed squared, without a table.",
        "M, kg",
        ge=0,
    )
    speeds = Setting(
        (),
        "Approach speeds of the table, rising; its other column is `energies`.",
        f"{SPEED}, {SI_UNITS[SPEED]}",
        gt=0,
    )
    energies = Setting((), "Output at each of these speeds.", f"{ENERGY}, {SI_UNITS[ENERGY]}", ge=0)
    variables = (
        Variable("harvested_per_cycle", "energy harvested per cycle", ENERGY),
        Variable("largest_harvest", "largest energy harvested at an impact", ENERGY),
    )

    def check_together(self) -> None:
        """Refuse half of a table, and a coefficient beside one."""
        speeds, energies = self.speeds, self.energies
        if len(speeds) != len(energies):
            raise ValueError(
                f"harvest: speeds has {len(speeds)} values and energies has {len(energies)}: must "
                "be as many of both"
            )
        if list(speeds) != sorted(speeds):
            raise ValueError(f"harvest: speeds = {list(speeds)}: must rise")
        if speeds and self.coefficient != 1.0:
            raise ValueError("harvest: coefficient and a table are both given: must be one of them")

    def begin(self, run: int, trajectory: Trajectory, window: Window) -> None:
        """Start on a run."""
        super().begin(run, trajectory, window)
        units = trajectory.units
        self._totals = np.zeros(1, _TOTALS)
        self._factor = self.coefficient * units.speed**2 / units.energy
        self._table = np.zeros((2, len(self.speeds) + 1))
        self._table[0, 1:] = np.array(self.speeds) / units.speed
        self._table[1, 1:] = np.array(self.energies) / units.energy

    def observe(self, log: np.ndarray) -> None:
        """Read the next piece of the log."""
        _add(self._model, log, self._window, self._factor, self._table, self._totals)

    def finish(self, finished: bool) -> None:
        """Write the run's results; they stay missing where the run stopped early."""
        found = read_record(self._totals)
        if finished:
            per_cycle = found.total / self._window.length
            self._put({"harvested_per_cycle": per_cycle, "largest_harvest": found.largest})


@compiled
def _add(model, log, window, factor, table, totals):
    total = totals[0]
    for index in range(len(log)):
        s = read_segment(model, log[index])
        if s.cause != IMPACT or since(s, model.cycle, window.periods, window.time) < 0.0:
            continue
        output = _output(factor, table, s.speed)
        total.total += output
        total.largest = max(total.largest, output)
        if s.mode == TAIL:
            speed, ratio = speeds_in_tail(model, s)
            total.total += _rest(factor, table, speed, ratio)


@compiled
def _output(factor, table, speed):
    """Output of an impact; NaN beyond the table."""
    speeds, energies = table[0], table[1]
    last = len(speeds) - 1
    if last == 0:
        return factor * speed * speed
    if speed > speeds[last]:
        return math.nan
    k = 1
    while speed > speeds[k]:
        k += 1
    part = (speed - speeds[k - 1]) / (speeds[k] - speeds[k - 1])
    return energies[k - 1] + part * (energies[k] - energies[k - 1])


@compiled
def _rest(factor, table, speed, ratio):
    """Output of infinitely many impacts whose approach speeds fall by a ratio."""
    if table.shape[1] == 1:
        return factor * speed * speed / (1.0 - ratio * ratio)
    found = 0.0
    while speed > table[0, 1]:
        found += _output(factor, table, speed)
        speed *= ratio
    # Below the first row it is proportional to the speed.
    return found + _output(factor, table, speed) / (1.0 - ratio)

"""Response of the primary: its rms and peak displacement, and where the energy goes.

Every value is exact to roundoff over the window; nothing is sampled. A segment that the window's
ends cut counts with its part inside. `damper.models.response` has the integrals and the peak; a
model's own terms are in the module `response` beside it.
"""

import math
from typing import Any

import numpy as np

from damper.engine.compiled import compiled, plain
from damper.engine.forcing.harmonic import HarmonicForce
from damper.engine.loop import FINISHED
from damper.engine.model import read_segment
from damper.engine.trajectory import Trajectory
from damper.models.extremes import primary_extremes
from damper.models.response import (
    drag_of,
    integrate_segment,
    lost_at_start,
    prepare_tables,
    stored_energy,
)
from damper.observers.common.base import (
    LEAVE_ALONE,
    Observer,
    Window,
    part_within,
    primary_alone,
    read_record,
    record_type,
)
from damper.observers.common.settings import Setting
from damper.parameters.forcing import Base
from damper.parameters.models import ON_PRIMARY
from damper.parameters.variables import ACCELERATION, ENERGY, LENGTH, SPRING_FORCE, Variable
from damper.theory.steady import steady_amplitude

#: What the fields of `damper.models.response.ResponseIntegrals` come to; whether the window has
#: begun; the energy stored at its start and at the end of what has been read.
TOTALS = record_type(
    "square",
    "speed_square",
    "work",
    "loss",
    "support",
    "friction",
    "modulation",
    "peak",
    "begun",
    "stored",
    "stored_last",
)

_MODULATION_WORK = Variable(
    "modulation_work",
    "energy that the free mass gains by its variation per cycle",
    ENERGY,
    comment="mean of half the mass ratio's rate of change times the free velocity squared",
)


_FRICTION_LOSS = Variable(
    "friction_loss",
    "energy lost in dry friction of the free mass per cycle",
    ENERGY,
    comment="of a burst's closed rest, where both losses end, its part to first order",
)

_EXTREMES = (
    Variable(
        "peak_force",
        "largest force in spring and dashpot, either way",
        SPRING_FORCE,
        comment="what a primary on the ground or a base passes on to it",
    ),
    Variable(
        "peak_acceleration",
        "largest acceleration of the primary between impacts, either way",
        ACCELERATION,
        comment="not relative to a base that moves; impacts on rigid walls are left out",
    ),
)
_MOST = record_type("force", "acceleration")

_RELATIVE = "relative to the base in runs in its frame"


class Response(Observer):
    """How strongly the primary moves, and where the energy goes.

    The steady linear response without the damper has the amplitude
    A = force_amplitude / sqrt((1 - omega^2)^2 + (2 zeta omega)^2) under one harmonic; the two
    ratios compare with it, are zero where it is infinite, and missing under any other force, but
    where a run `without_damper` is asked for.
    Energies are means per cycle, in units of F0^2/K. In the frame of a moving base, all quantities
    are relative to the base, and the work is done by inertia on both masses. An impact of approach
    speed s loses (1/2) mu / (1 + mu) (1 - r^2) s^2; an impact at the start of the window counts.
    The stored energy, of which the residual takes the change, is (1/2) (v^2 + x^2 + mu u^2). A free
    mass that varies takes mu at the moment, and the residual counts the work of its modulation as
    input.

    With compliant contact, an impact's loss is that of the contact's dashpot, lasting contacts
    included, and the energy in the contact's spring is stored energy.

    Everything stays missing where the run stopped early.
    """

    models = ON_PRIMARY
    modulation_work = Setting(
        False,
        "Write what a time-varying free mass gains by its variation as well; zero in every other "
        "model.",
    )
    friction_loss = Setting(
        False,
        "Write what the free mass loses in dry friction as well; zero in every other model. The "
        "residual counts it as a loss, asked for or not.",
    )
    extremes = Setting(
        False,
        "Write the largest force in spring and dashpot, and the largest acceleration of the "
        "primary, as well.",
        models=("rigid", "grounded", "sliding", "several"),
    )
    without_damper = Setting(
        False,
        "Form the ratios under every force, with a run of the primary alone from the same start; "
        "under one harmonic they compare with the steady response all the same.",
        models=LEAVE_ALONE,
    )
    _always = (
        Variable(
            "rms_displacement",
            "root mean square of the primary displacement",
            LENGTH,
            comment=_RELATIVE,
        ),
        Variable(
            "peak_displacement",
            "largest primary displacement, either way",
            LENGTH,
            comment=_RELATIVE,
        ),
        Variable(
            "amplitude_ratio",
            "peak displacement over the steady amplitude without damper",
            "1",
            comment="0 where that is infinite; of more than one harmonic see without_damper",
        ),
        Variable(
            "rms_ratio",
            "rms displacement over that of the steady response without damper",
            "1",
            comment="0 where that is infinite; of more than one harmonic see without_damper",
        ),
        Variable(
            "energy_input",
            "work of the force per cycle",
            ENERGY,
            comment="in the frame of a base that of inertia, on both masses",
        ),
        Variable("dashpot_loss", "energy lost in the dashpot per cycle", ENERGY),
        Variable(
            "impact_loss",
            "energy lost in impacts per cycle",
            ENERGY,
            comment="all impacts, those of closed bursts included",
        ),
        Variable(
            "energy_residual",
            "input less losses and change of the stored energy, per cycle",
            ENERGY,
            comment="zero in exact arithmetic: shows how well the balance closes",
        ),
    )

    @property
    def variables(self) -> tuple[Variable, ...]:
        """What it writes."""
        made: tuple[Variable, ...] = self._always
        if self.modulation_work:
            made = (*made, _MODULATION_WORK)
        if self.extremes:
            made = (*made, *_EXTREMES)
        return (*made, _FRICTION_LOSS) if self.friction_loss else made

    def begin(self, run: int, trajectory: Trajectory, window: Window) -> None:
        """Start on a run."""
        super().begin(run, trajectory, window)
        self._tables = prepare_tables(self._model)
        self._totals = np.zeros(1, TOTALS)
        self._most = np.zeros(1, _MOST)
        self._trajectory = trajectory

    def observe(self, log: np.ndarray) -> None:
        """Read the next piece of the log."""
        follow(self._model, self._tables, log, self._window, self._totals)
        if self.extremes:
            force = getattr(self._trajectory.parameters, "forcing", None)
            shaken = isinstance(force, Base) and force.frame == "ground"
            _follow_extremes(self._model, log, self._window, float(shaken), self._most)

    def finish(self, finished: bool) -> None:
        """Write the run's results."""
        if not finished:
            return
        total = read_record(self._totals)
        free = self._model.free
        length = self._window.length
        dashpot, friction = lost_between_impacts(self._model, total)
        gained = total.stored_last - total.stored - total.modulation
        rms = math.sqrt(total.square / (length * self._model.cycle))
        undamped = math.nan, math.nan
        if isinstance(free.forcing, HarmonicForce):
            amplitude = free.strength * steady_amplitude(free.damping, free.forcing.omega)
            undamped = amplitude, amplitude
        elif self.without_damper:
            undamped = self._alone()
        self._put(
            {
                "rms_displacement": rms,
                "peak_displacement": total.peak,
                "amplitude_ratio": total.peak / undamped[0] if undamped[0] else math.nan,
                "rms_ratio": math.sqrt(2.0) * rms / undamped[1] if undamped[1] else math.nan,
                "energy_input": total.work / length,
                "dashpot_loss": dashpot / length,
                "impact_loss": total.loss / length,
                "energy_residual": (total.work - dashpot - friction - total.loss - gained) / length,
            }
        )
        if self.modulation_work:
            self._put({"modulation_work": total.modulation / length})
        if self.extremes:
            most = read_record(self._most)
            self._put({"peak_force": most.force, "peak_acceleration": most.acceleration})
        if self.friction_loss:
            self._put({"friction_loss": friction / length})

    def _alone(self) -> tuple[float, float]:
        """Peak and sqrt(2) rms of the primary alone, with the walls out of reach."""
        alone = primary_alone(self._trajectory)
        totals, window = np.zeros(1, TOTALS), self._window
        for log in alone.segments(*window.end(alone.cycle)):
            follow(alone.model, self._tables, log, window, totals)
        total = read_record(totals)
        rms = math.sqrt(total.square / (window.length * alone.cycle))
        return (
            (total.peak, math.sqrt(2.0) * rms) if alone.status == FINISHED else (math.nan, math.nan)
        )


def lost_between_impacts(model: Any, total: Any) -> tuple[float, float]:
    """Energy lost in dashpots and in dry friction, by the fields of `TOTALS`."""
    return plain(drag_of)(model) * total.speed_square + total.support, total.friction


@compiled
def _follow_extremes(
    model: Any, log: np.ndarray, window: Window, through: float, most: Any
) -> None:
    for index in range(len(log)):
        s = read_segment(model, log[index])
        _, low, high = part_within(s, model.cycle, window)
        if high >= low:
            primary_extremes(model, s, low, high, through, most[0])


@compiled
def follow(model: Any, tables: tuple, log: np.ndarray, window: Window, totals: np.ndarray) -> None:
    """Add a piece of the log to `TOTALS`."""
    total = totals[0]
    # Segments of this piece in which the window begins, and the last one in it.
    first = last = -1
    first_tau = last_tau = 0.0
    for index in range(len(log)):
        s = read_segment(model, log[index])
        start, low, high = part_within(s, model.cycle, window)
        if high < low:
            continue
        last = index
        last_tau = high
        lost = lost_at_start(model, s) if start >= 0.0 else 0.0
        if start < 0.0 or total.begun == 0.0:
            first = index
            first_tau = low
            total.begun = 1.0
            # With an impact at exactly the window's start, the energy just before it.
            total.stored = lost
        part = integrate_segment(model, tables, s, low, high, total.peak)
        total.square += part.square
        total.speed_square += part.speed_square
        total.work += part.work
        total.loss += lost + part.loss
        total.support += part.support
        total.friction += part.friction
        total.modulation += part.modulation
        total.peak = part.peak
    for at_end in range(2):
        index = last if at_end else first
        if index >= 0:
            tau = last_tau if at_end else first_tau
            energy = stored_energy(model, read_segment(model, log[index]), tau)
            if at_end:
                total.stored_last = energy
            else:
                total.stored += energy

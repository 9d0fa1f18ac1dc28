"""The impact damper with a time-varying free mass: rigid but for mu(t) at impacts and in contact.

A free mass that consists of several bodies counts with its mean and one subharmonic of the
clock's cycle. Flight does not feel it. Impacts take mu at their instant, and sticking obeys
(1 + mu(t)) x'' + 2 zeta x' + x = force; docs/models.md has the derivations.
"""

import math
from typing import Any, NamedTuple

from damper.engine import model as declared
from damper.engine.compiled import plain
from damper.engine.forcing import phase_at
from damper.engine.oscillator import Oscillator
from damper.engine.segment import centre_velocity
from damper.models import masses, tangent, walls
from damper.models.flights import End, completes, relative_rates
from damper.models.forces import drive_of, weighed
from damper.models.time_varying.motion import (
    MassLaw,
    advance_together,
    mass_law,
    modulation,
    step_together,
)
from damper.parameters import Parameters


class TimeVarying(NamedTuple):
    """Constants of one run; the first eight are those of `damper.models.masses.Rigid`."""

    mass_ratio: float
    clearance: float
    law: Any
    cycle: float
    tolerance: float
    free: Oscillator
    stuck: Oscillator
    """Both masses together, with the mean mass."""
    mass: Any
    variation: MassLaw
    """How the free mass varies."""


@plain
def prepare(parameters: Parameters, law: Any, accuracy: float) -> TimeVarying:
    """Constants of one run."""
    p = parameters
    made = masses.prepare(p, law, accuracy)
    if p.pull:
        # A weight that varies does work on the way, not by the speed at impacts alone.
        drive = drive_of(p)
        strength = drive.share * drive.amplitude
        made = made._replace(mass=weighed(0.0, 0.0, strength, drive.forcing, -p.pull))
    return TimeVarying(
        *made[:8],
        mass_law(
            p.mass_ratio,
            p.modulation_depth,
            p.modulation_order,
            p.modulation_phase,
            p.frequency_ratio,
        ),
    )


walls.have_rigid_walls(TimeVarying)
tangent.have_rigid_walls(TimeVarying)


@walls.stick.of(TimeVarying)
def _stick(model, segment):
    s = segment
    phase = phase_at(model.free.forcing, s.periods, s.time)
    tau, released, dx, v = step_together(model, s.periods, s.time, s.side, s.x, s.v, phase)
    return End(tau, released, 0.0, s.x + dx, v, 0.0, 0.0, 1)


@walls.time_to_accumulation.of(TimeVarying)
def _time_to_accumulation(model, segment, start):
    mass_ratio, sin, _ = modulation(model.variation, segment.periods, segment.time)
    duration, error = completes(model, mass_ratio, segment, start)
    if 0.0 < error < math.inf:
        # The mass ratio's change enters the time only with its third order.
        swing = model.variation.mean * model.variation.depth / (1.0 + mass_ratio)
        angle = model.variation.frequency * duration
        change = swing * angle * (abs(sin) + angle)
        a, j, _, _ = relative_rates(start, model)
        lag = (abs(j / a) + 2.0 * model.free.damping) * duration
        if not change < 0.5:
            return 0.0, math.inf
        error += duration * (2.0 * lag * change + change * change + swing * angle * angle)
    return duration, error


@walls.centre.of(TimeVarying)
def _centre(model, segment, tau):
    s = segment
    phase = phase_at(model.free.forcing, s.periods, s.time)
    mass_ratio, _, _ = modulation(model.variation, s.periods, s.time)
    common = centre_velocity(s, mass_ratio)
    return advance_together(model, s.periods, s.time, s.x, common, phase, tau)


@declared.mass_ratio_at.of(TimeVarying)
def _mass_ratio_at(model, periods, time):
    mass_ratio, _, _ = modulation(model.variation, periods, time)
    return mass_ratio


@tangent.mass_ratio_rate.of(TimeVarying)
def _mass_ratio_rate(model, periods, time):
    _, sin, _ = modulation(model.variation, periods, time)
    return -model.variation.mean * model.variation.depth * model.variation.frequency * sin


@tangent.contact_flow.of(TimeVarying)
def _contact_flow(model, periods, time, tau):
    phase = phase_at(model.free.forcing, periods, time)
    # It is linear in the state: differences are exact but for roundoff.
    x0, v0 = advance_together(model, periods, time, 0.0, 0.0, phase, tau)
    x1, v1 = advance_together(model, periods, time, 1.0, 0.0, phase, tau)
    x2, v2 = advance_together(model, periods, time, 0.0, 1.0, phase, tau)
    return tangent.Flow(1.0 + (x1 - x0), x2 - x0, v1 - v0, v2 - v0)

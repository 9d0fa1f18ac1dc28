"""The impact damper with a time-variant free mass: rigid but for mu(t) at impacts and in contact.

A free mass that consists of several bodies counts with its mean and one subharmonic of the
forcing. Flight does not feel it. Impacts take mu at their instant, and sticking obeys
(1 + mu(t)) x'' + 2 zeta x' + x = sin(omega t + phase); docs/models.md has the derivations.
"""

import math
from typing import NamedTuple

from damper import models
from damper.engine.compiled import compiled
from damper.engine.oscillator import (
    Oscillator,
    acceleration,
    increments,
    sine_cosine,
)
from damper.engine.search import tail_bounce, tail_duration
from damper.engine.segment import CAUSE, FLIGHT, GAP, MODE, PERIOD, RATE, SIDE, TAIL, TIME, V, X
from damper.models import (
    cut_flight,
    flight,
    mass_ratio_at,
    rests,
    rigid,
    settle,
    sticking,
    time_to_sticking,
)
from damper.models.time_varying.motion import (
    MassLaw,
    advance_together,
    mass_law,
    modulation,
    step_together,
)
from damper.parameters import Parameters


class TimeVarying(NamedTuple):
    """Constants of one run; `stuck` is that of the mean mass."""

    mass_ratio: float
    clearance: float
    restitution: float
    phase: float
    period: float
    tolerance: float
    free: Oscillator
    stuck: Oscillator
    law: MassLaw
    """How the free mass varies."""


def prepare(parameters: Parameters, accuracy: float) -> TimeVarying:
    """Constants of one run."""
    p = parameters
    return TimeVarying(
        *rigid.prepare(p, accuracy),
        mass_law(
            p.mass_ratio,
            p.modulation_depth,
            p.modulation_order,
            p.modulation_phase,
            p.frequency_ratio,
        ),
    )


# A flight does not feel the mass, and the first derivative of x that is not zero has the same sign
# in flight and in contact.
for declaration in (flight, cut_flight, rests):
    declaration.share(TimeVarying, rigid.Rigid)


@sticking.of(TimeVarying)
def _sticking(model, periods, time, side, x, v, sin, cos):
    return step_together(model.free, model.law, periods, time, side, x, v, sin, cos)


@time_to_sticking.of(TimeVarying)
def _time_to_sticking(model, periods, time, side, x, v, rate, a, j, sin, cos):
    return _tail(model, periods, time, side, a, j, sin, rate)


@compiled
def _tail(model, periods, time, side, a, j, sin, rate):
    """As `tail_duration`: the mass ratio's change enters the time only with its third order."""
    free = model.free
    mass_ratio, sin_m, _ = modulation(model.law, periods, time)
    duration, error = tail_duration(free, mass_ratio, model.restitution, side, a, j, sin, rate)
    if 0.0 < error < math.inf:
        mean, depth, frequency, _, _ = model.law
        angle = frequency * duration
        change = mean * depth / (1.0 + mass_ratio) * angle * (abs(sin_m) + angle)
        bend = mean * depth / (1.0 + mass_ratio) * angle * angle
        lag = (abs(j / a) + 2.0 * free[0]) * duration
        if not change < 0.5:
            return 0.0, math.inf
        error += duration * (2.0 * lag * change + change * change + bend)
    return duration, error


@settle.of(TimeVarying)
def _settle(model, periods, time, side, x, v, rate, sin, cos, duration):
    mass_ratio, _, _ = modulation(model.law, periods, time)
    common = v - side * mass_ratio / (1.0 + mass_ratio) * rate
    return advance_together(model.free, model.law, periods, time, x, common, sin, cos, duration)


@mass_ratio_at.of(TimeVarying)
def _mass_ratio_at(model, periods, time):
    mass_ratio, _, _ = modulation(model.law, periods, time)
    return mass_ratio


@models.motion.of(TimeVarying)
def _motion(model, row, tau):
    free = model.free
    x = float(row[X])
    v = float(row[V])
    gap = float(row[GAP])
    rate = float(row[RATE])
    side = float(row[SIDE])
    periods = float(row[PERIOD])
    time = float(row[TIME])
    sin0, cos0, _ = sine_cosine(free[3] * time + model.phase)
    if float(row[MODE]) == FLIGHT:
        a, j = rigid.flight_start(free, float(row[CAUSE]), x, v, sin0, cos0)
        dx, dv, _, _ = increments(free, x, v, a, j, sin0, cos0, tau)
        gap = max(gap + rate * tau + side * dx, 0.0)
        gap = min(gap, 2.0 * model.clearance)
        return x + (v * tau + dx), v + dv, gap, rate + side * dv
    gap = 0.0
    bounce = 0.0
    mass_ratio, _, _ = modulation(model.law, periods, time)
    common = v - side * mass_ratio / (1.0 + mass_ratio) * rate
    if float(row[MODE]) == TAIL and rate > 0.0:
        # The pair's centre follows the sticking flow; the bounces go on about it.
        a, j = acceleration(free, x, v, sin0, cos0)
        duration, _ = _tail(model, periods, time, side, a, j, sin0, rate)
        gap, bounce = tail_bounce(model.restitution, duration, rate, tau)
    dx, v = advance_together(free, model.law, periods, time, x, common, sin0, cos0, tau)
    mass_ratio, _, _ = modulation(model.law, periods, time + tau)
    share = side * mass_ratio / (1.0 + mass_ratio)
    return x + dx + share * gap, v + share * bounce, gap, bounce

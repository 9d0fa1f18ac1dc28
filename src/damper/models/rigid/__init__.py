"""The rigid impact damper: a free mass that flies, rigid walls, Newton's restitution."""

import math
from typing import NamedTuple

from damper.engine.compiled import compiled
from damper.engine.oscillator import (
    OVERDAMPED,
    Oscillator,
    acceleration,
    advance,
    arrive,
    coasting_jerk,
    higher_derivatives,
    increments,
    oscillator,
    relax,
    sine_cosine,
)
from damper.engine.search import find_impact, find_release, stays, tail_bounce, tail_duration
from damper.engine.segment import CAUSE, FLIGHT, GAP, MODE, RATE, RELEASE, SIDE, TAIL, TIME, V, X
from damper.models import (
    cut_flight,
    flight,
    motion,
    rests,
    settle,
    sticking,
    time_to_sticking,
)
from damper.parameters import Parameters


class Rigid(NamedTuple):
    """Constants of one run; the fields with which every model starts."""

    mass_ratio: float
    clearance: float
    restitution: float
    phase: float
    """Forcing phase at time 0, in (-pi, pi]."""
    period: float
    """Forcing period."""
    tolerance: float
    """Error in time to which tails are closed."""
    free: Oscillator
    """The primary in flight."""
    stuck: Oscillator
    """Both masses together."""


def prepare(parameters: Parameters, accuracy: float) -> Rigid:
    """Constants of one run."""
    p = parameters
    return Rigid(
        *_prepare(
            p.mass_ratio,
            p.damping_ratio,
            p.frequency_ratio,
            p.clearance,
            p.restitution,
            p.phase,
            float(accuracy),
        )
    )


@compiled
def _prepare(mass_ratio, damping_ratio, frequency_ratio, clearance, restitution, phase, accuracy):
    heavier = 1.0 + mass_ratio
    return (
        mass_ratio,
        clearance,
        restitution,
        math.atan2(math.sin(phase), math.cos(phase)),
        2.0 * math.pi / frequency_ratio,
        accuracy / max(1.0, frequency_ratio),
        oscillator(damping_ratio, 1.0, 1.0, frequency_ratio),
        oscillator(damping_ratio / heavier, 1.0 / heavier, 1.0 / heavier, frequency_ratio),
    )


@flight.of(Rigid)
def _flight(model, cause, side, x, v, gap, rate, a, j, sin, cos):
    if cause == RELEASE:
        a = 0.0  # by definition, see flight_start
        j = coasting_jerk(model.free, v, cos)
    duration, hit, dx, end_v, end_rate, steps = find_impact(
        model.free, model.clearance, side, x, v, gap, rate, a, j, sin, cos
    )
    if model.free[4] == OVERDAMPED and hit != 0.0 and -model.free[7] * duration > 1.0:
        # As increments x and v would keep a rounding of the velocity that the damping has eaten.
        dx, end_v = relax(model.free, x, v, sin, cos, duration)
    return duration, hit, dx, end_v, end_rate, steps


@compiled
def flight_start(
    free: Oscillator, cause: float, x: float, v: float, sin: float, cos: float
) -> tuple[float, ...]:
    """Second and third derivative of the primary at the start of a flight that `cause` began.

    At a release x'' = 0 by definition. As it rounds, heavy damping would drown the third derivative
    in it, and a velocity of 1e14, to which a varying mass can drive, what the flight begins with.
    """
    a, j = acceleration(free, x, v, sin, cos)
    if cause == RELEASE:
        a = 0.0
        j = coasting_jerk(free, v, cos)
    return a, j


@cut_flight.of(Rigid)
def _cut_flight(model, side, x, v, gap, rate, sin, cos, duration):
    # How the errors of many such segments add up is all that matters.
    if model.free[4] == OVERDAMPED:
        dx, end_v = relax(model.free, x, v, sin, cos, duration)
    else:
        end_x, end_v = arrive(model.free, x, v, sin, cos, duration)
        dx = end_x - x
    end_gap = gap + ((rate * duration) + side * (dx - v * duration))
    return dx, end_v, end_gap, rate + side * (end_v - v)


@sticking.of(Rigid)
def _sticking(model, periods, time, side, x, v, sin, cos):
    return find_release(model.stuck, side, x, v, sin, cos)


@rests.of(Rigid)
def _rests(model, periods, time, side, x, v, a, j, sin, cos):
    snap, crackle = higher_derivatives(model.free, a, j, sin, cos)
    return stays(side, a, j, snap, crackle)


@time_to_sticking.of(Rigid)
def _time_to_sticking(model, periods, time, side, x, v, rate, a, j, sin, cos):
    return tail_duration(model.free, model.mass_ratio, model.restitution, side, a, j, sin, rate)


@settle.of(Rigid)
def _settle(model, periods, time, side, x, v, rate, sin, cos, duration):
    common = v - side * model.mass_ratio / (1.0 + model.mass_ratio) * rate
    return advance(model.stuck, x, common, sin, cos, duration)


@motion.of(Rigid)
def _motion(model, row, tau):
    mass_ratio = model.mass_ratio
    restitution = model.restitution
    free = model.free
    x = float(row[X])
    v = float(row[V])
    gap = float(row[GAP])
    rate = float(row[RATE])
    side = float(row[SIDE])
    sin0, cos0, _ = sine_cosine(free[3] * float(row[TIME]) + model.phase)
    if float(row[MODE]) == FLIGHT:
        a, j = flight_start(free, float(row[CAUSE]), x, v, sin0, cos0)
        dx, dv, _, _ = increments(free, x, v, a, j, sin0, cos0, tau)
        gap = max(gap + rate * tau + side * dx, 0.0)
        gap = min(gap, 2.0 * model.clearance)
        return x + (v * tau + dx), v + dv, gap, rate + side * dv
    gap = 0.0
    bounce = 0.0
    share = mass_ratio / (1.0 + mass_ratio) * side
    if float(row[MODE]) == TAIL and rate > 0.0:
        # The pair's centre follows the sticking flow; the bounces go on about it.
        a, j = acceleration(free, x, v, sin0, cos0)
        duration, _ = tail_duration(free, mass_ratio, restitution, side, a, j, sin0, rate)
        gap, bounce = tail_bounce(restitution, duration, rate, tau)
    dx, v = advance(model.stuck, x, v - share * rate, sin0, cos0, tau)
    return x + dx + share * gap, v + share * bounce, gap, bounce

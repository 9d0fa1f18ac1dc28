"""The grounded free mass: a spring and a dashpot tie it to ground; the walls are rigid.

Its equations, the tail formula and what bounds the search: docs/models.md.
"""

import math
from typing import NamedTuple

from damper.engine.compiled import compiled
from damper.engine.oscillator import (
    Oscillator,
    acceleration,
    advance,
    arrive,
    higher_derivatives,
    oscillator,
    sine_cosine,
)
from damper.engine.search import HORIZON, stays, tail_bounce
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
from damper.models.grounded.search import first_contact, move_apart
from damper.parameters import Parameters

#: Initial slope of the thrust times the time to a release, over the sizes of the thrust's terms,
#: above which that time is found anew from half of it on.
_STEEP = 16.0


class Grounded(NamedTuple):
    """Constants of one run."""

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
    """Both masses together, about their place of rest."""
    support: Oscillator
    """The free mass in flight."""
    thrust: Oscillator
    """Thrust of the wall in sticking, about its mean; its force leads by an angle."""
    lead_cos: float
    lead_sin: float
    """Cosine and sine of that angle."""
    pull: float
    """By how much the mean thrust is below zero."""
    stiffness: float
    """Stiffness of the support over that of the primary."""
    damping: float
    """Its damping ratio, with mass and stiffness of the primary."""
    still: Oscillator
    """An oscillator that is kept at rest."""


def prepare(parameters: Parameters, accuracy: float) -> Grounded:
    """Constants of one run."""
    p = parameters
    return Grounded(
        *_prepare(
            p.mass_ratio,
            p.damping_ratio,
            p.frequency_ratio,
            p.clearance,
            p.restitution,
            p.phase,
            p.support_stiffness_ratio,
            p.support_damping,
            float(accuracy),
        )
    )


@compiled
def _prepare(
    mass_ratio,
    damping_ratio,
    frequency_ratio,
    clearance,
    restitution,
    phase,
    stiffness,
    damping,
    accuracy,
):
    heavier = 1.0 + mass_ratio
    beta = damping / mass_ratio
    kappa = stiffness / mass_ratio
    if kappa == 0.0:
        # A support this weak is below all rounding, but not nothing: that is another model.
        beta = max(beta, 1e-100)
    stuck_beta = (damping_ratio + damping) / heavier
    stuck_kappa = (1.0 + stiffness) / heavier
    root = math.sqrt(kappa)
    # The thrust obeys the equation of sticking; this is what drives it.
    even = (root - frequency_ratio) * (root + frequency_ratio)
    odd = 2.0 * beta * frequency_ratio
    size = math.hypot(even, odd)
    return (
        mass_ratio,
        clearance,
        restitution,
        math.atan2(math.sin(phase), math.cos(phase)),
        2.0 * math.pi / frequency_ratio,
        accuracy / max(1.0, frequency_ratio, 2.0 * beta + root),
        oscillator(damping_ratio, 1.0, 1.0, frequency_ratio),
        oscillator(stuck_beta, stuck_kappa, 1.0 / heavier, frequency_ratio),
        oscillator(beta, kappa, 0.0, frequency_ratio),
        oscillator(stuck_beta, stuck_kappa, size, frequency_ratio),
        even / size if size > 0.0 else 1.0,
        odd / size if size > 0.0 else 0.0,
        kappa * clearance * heavier / (1.0 + stiffness),
        stiffness,
        damping,
        oscillator(0.0, 1.0, 0.0, 1.0),
    )


@compiled
def both_motions(
    model: Grounded,
    released: bool,
    side: float,
    x: float,
    v: float,
    gap: float,
    rate: float,
    a: float,
    j: float,
    cos: float,
) -> tuple[float, ...]:
    """Second and third derivative of the primary in flight; of the free mass the first three too.

    At a release no thrust is left and both masses have the same acceleration, exactly: the one
    whose terms are the smaller, for what either rounds to a long flight would multiply.
    """
    free = model.free
    support = model.support
    y = x + side * (model.clearance - gap)
    u = v - side * rate
    b, k = acceleration(support, y, u, 0.0, 0.0)
    if released:
        # v is a sum itself, which near zero has lost the digits of its terms; so is y.
        speed = abs(v) + (1.0 + abs(x)) / (1.0 + 2.0 * model.stuck[0])
        size = 1.0 + 2.0 * free[0] * speed + abs(x)
        if size > 2.0 * support[0] * speed + support[1] * (abs(x) + model.clearance):
            a = b
            j = free[2] * free[3] * cos - 2.0 * free[0] * a - free[1] * v
        else:
            b = a
            k = -2.0 * support[0] * b - support[1] * u
    return a, j, y, u, b, k


@flight.of(Grounded)
def _flight(model, cause, side, x, v, gap, rate, a, j, sin, cos):
    released = cause == RELEASE
    a, j, y, u, b, k = both_motions(model, released, side, x, v, gap, rate, a, j, cos)
    tau, wall, dx, v, rate, steps = first_contact(
        model.free,
        x,
        v,
        a,
        j,
        sin,
        cos,
        model.support,
        y,
        u,
        b,
        k,
        side,
        2.0 * model.clearance,
        gap,
        rate,
        gap == 0.0 and rate == 0.0 and a == b,
    )
    return tau, wall if abs(wall) > 1.0 else wall * side, dx, v, rate, steps


@cut_flight.of(Grounded)
def _cut_flight(model, side, x, v, gap, rate, sin, cos, duration):
    y = x + side * (model.clearance - gap)
    u = v - side * rate
    end_x, end_v = arrive(model.free, x, v, sin, cos, duration)
    end_y, end_u = arrive(model.support, y, u, 0.0, 0.0, duration)
    dx = end_x - x
    return dx, end_v, gap + side * (dx - (end_y - y)), side * (end_v - end_u)


@sticking.of(Grounded)
def _sticking(model, periods, time, side, x, v, sin, cos):
    centred = x + rest_shift(model, side)
    if side == 0.0:
        dx, v = advance(model.stuck, centred, v, sin, cos, HORIZON)
        return HORIZON, 0.0, dx, v, 1
    # The thrust over what it takes to part the masses: -g'' of the flight that would begin now.
    free = model.free
    support = model.support
    a, _ = acceleration(free, x, v, sin, cos)
    b, _ = acceleration(support, x + side * model.clearance, v, 0.0, 0.0)
    mean = (a + model.mass_ratio * b) / (1.0 + model.mass_ratio)
    # Together they have one acceleration. Third derivatives in flight hold the square of a heavy
    # damping, which would have to cancel here.
    slope = -side * (
        (free[2] * free[3] * cos - 2.0 * free[0] * mean - free[1] * v)
        + (2.0 * support[0] * mean + support[1] * v)
    )
    thrust = max(-side * (a - b), 0.0)
    z = thrust + model.pull
    turned_sin = -side * (sin * model.lead_cos + cos * model.lead_sin)
    turned_cos = -side * (cos * model.lead_cos - sin * model.lead_sin)
    second, third = acceleration(model.thrust, z, slope, turned_sin, turned_cos)
    tau, released, _, _, _, steps = first_contact(
        model.thrust,
        z,
        slope,
        second,
        third,
        turned_sin,
        turned_cos,
        model.still,
        0.0,
        0.0,
        0.0,
        0.0,
        1.0,
        math.inf,
        thrust,
        slope,
        thrust == 0.0 and slope == 0.0 and second == 0.0,
    )
    if released == 1.0:
        # A release is known to the rounding of |slope| tau. Where a fast mode that has died makes
        # that large, half of the way is sure, and the rest is looked at from there.
        size = 1.0 + abs(x) + support[1] * (abs(x) + model.clearance)
        if abs(slope) * tau > _STEEP * (size + 2.0 * (free[0] + support[0]) * abs(v)):
            tau *= 0.5
            released = 0.0
    dx, v = advance(model.stuck, centred, v, sin, cos, tau)
    return tau, released, dx, v, steps + 1


@rests.of(Grounded)
def _rests(model, periods, time, side, x, v, a, j, sin, cos):
    b, k = acceleration(model.support, x + side * model.clearance, v, 0.0, 0.0)
    snap, crackle = higher_derivatives(model.free, a, j, sin, cos)
    free_snap, free_crackle = higher_derivatives(model.support, b, k, 0.0, 0.0)
    return stays(side, a - b, j - k, snap - free_snap, crackle - free_crackle)


@time_to_sticking.of(Grounded)
def _time_to_sticking(model, periods, time, side, x, v, rate, a, j, sin, cos):
    b, k = acceleration(model.support, x + side * model.clearance, v - side * rate, 0.0, 0.0)
    return _tail(model, side, a, j, b, k, sin, rate)


@compiled
def _tail(model, side, a, j, b, k, sin, rate):
    """Remaining time of a complete burst and an estimate of its error; docs/models.md."""
    push = -side * (a - b)
    loss = 1.0 - model.restitution
    if not (push > 0.0 and loss > 0.0):
        return 0.0, math.inf
    if rate == 0.0:
        return 0.0, 0.0
    free = model.free
    support = model.support
    first = 2.0 * rate / (push * loss)
    bend = side * (j - k) / push * first / 3.0
    damped = (free[0] * model.mass_ratio + support[0]) / (1.0 + model.mass_ratio)
    duration = first * (1.0 + bend - damped * model.restitution * first)
    coupling = 2.0 * (free[0] + support[0])
    lag = (abs(j - k) / push + coupling) * first
    # Sizes, not the fourth derivatives themselves: their parts need not cancel along the burst.
    snap = (
        free[2] * free[3] * free[3] * abs(sin)
        + 2.0 * free[0] * abs(j)
        + abs(a)
        + 2.0 * support[0] * abs(k)
        + support[1] * abs(b)
        + (free[1] + support[1]) * push
    )
    error = first * (lag * lag + snap / push * first * first)
    if not duration > 0.0 or not lag < 0.5:
        return 0.0, math.inf
    return duration, error


@settle.of(Grounded)
def _settle(model, periods, time, side, x, v, rate, sin, cos, duration):
    common = v - side * model.mass_ratio / (1.0 + model.mass_ratio) * rate
    return advance(model.stuck, x + rest_shift(model, side), common, sin, cos, duration)


@motion.of(Grounded)
def _motion(model, row, tau):
    x = float(row[X])
    v = float(row[V])
    gap = float(row[GAP])
    rate = float(row[RATE])
    side = float(row[SIDE])
    free = model.free
    sin, cos, _ = sine_cosine(free[3] * float(row[TIME]) + model.phase)
    a, j = acceleration(free, x, v, sin, cos)
    if float(row[MODE]) == FLIGHT:
        released = row[CAUSE] == RELEASE
        a, j, y, u, b, k = both_motions(model, released, side, x, v, gap, rate, a, j, cos)
        gap, rate, dx, v = move_apart(
            free, x, v, a, j, sin, cos, model.support, y, u, b, k, side, gap, rate, tau
        )
        return x + dx, v, min(max(gap, 0.0), 2.0 * model.clearance), rate
    gap = 0.0
    bounce = 0.0
    share = model.mass_ratio / (1.0 + model.mass_ratio) * side
    if float(row[MODE]) == TAIL and rate > 0.0:
        # The pair's centre follows the sticking flow; the bounces go on about it.
        duration, _ = time_to_sticking(model, 0.0, 0.0, side, x, v, rate, a, j, sin, cos)
        gap, bounce = tail_bounce(model.restitution, duration, rate, tau)
    centred = x + rest_shift(model, side)
    dx, v = advance(model.stuck, centred, v - share * rate, sin, cos, tau)
    return x + dx + share * gap, v + share * bounce, gap, bounce


@compiled
def rest_shift(model: Grounded, side: float) -> float:
    """What to add to the primary's displacement to get that of the oscillator `stuck`.

    That one moves about the masses' place of rest.
    """
    return model.stiffness / (1.0 + model.stiffness) * side * model.clearance

"""What the checks need to know of a free mass that is tied to ground."""

import math

from damper.engine.oscillator import acceleration, sine_cosine
from damper.engine.segment import CAUSE, GAP, RATE, RELEASE, SIDE, TIME, V, X
from damper.models.grounded import Grounded, both_motions
from damper.models.grounded.search import move_apart
from damper.stress.checks import (
    flight_at,
    flight_start,
    own_jerk,
    support_speed,
    support_stiffness,
    thrust,
)


@flight_start.of(Grounded)
def _flight_start(model, row):
    free = model.free
    x = float(row[X])
    v = float(row[V])
    sin, cos, _ = sine_cosine(free[3] * float(row[TIME]) + model.phase)
    a, j = acceleration(free, x, v, sin, cos)
    a, j, y, u, b, k = both_motions(
        model,
        row[CAUSE] == RELEASE,
        float(row[SIDE]),
        x,
        v,
        float(row[GAP]),
        float(row[RATE]),
        a,
        j,
        cos,
    )
    return a, j, sin, cos, y, u, b, k


@flight_at.of(Grounded)
def _flight_at(model, row, start, tau):
    x = float(row[X])
    v = float(row[V])
    gap = float(row[GAP])
    rate = float(row[RATE])
    a, j, sin, cos, y, u, b, k = start
    size = gap + (abs(rate) + abs(v) + abs(u)) * tau + abs(y)
    gap, rate, dx, v = move_apart(
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
        float(row[SIDE]),
        gap,
        rate,
        tau,
    )
    return x + dx, v, gap, rate, size


@own_jerk.of(Grounded)
def _own_jerk(model, start, duration):
    # As the primary's, of a motion that nothing drives.
    b, k = start[6], start[7]
    return math.sqrt(model.support[1] * b * b + k * k)


@thrust.of(Grounded)
def _thrust(model, row, tau, x, v, gap, rate):
    # What parts the masses: the difference of their accelerations in the flight that would begin.
    side = float(row[SIDE])
    y = x + side * model.clearance
    sin, _, _ = sine_cosine(model.free[3] * (float(row[TIME]) + tau) + model.phase)
    a, _ = acceleration(model.free, x, v, sin, 0.0)
    b, _ = acceleration(model.support, y, v, 0.0, 0.0)
    # What the velocity is made of: itself, and what spring and force add.
    x0 = abs(float(row[X])) + model.clearance
    drag = max(2.0 * model.stuck[0], 1.0)
    speed = abs(v) + abs(float(row[V])) + (1.0 + x0) * min(tau, 1.0 / drag)
    size = 1.0 + 2.0 * (model.free[0] + model.support[0]) * speed
    size += (1.0 + model.support[1]) * (abs(x) + x0 + speed * min(tau, 1.0))
    return -side * (a - b), size


@support_stiffness.of(Grounded)
def _support_stiffness(model):
    return model.stiffness


@support_speed.of(Grounded)
def _support_speed(model, x, v, duration):
    drag = 2.0 * model.support[0]
    stiffness = model.support[1]
    # What the spring gives and takes back, all swings added up until the dashpot has eaten them:
    # the end of a flight is a double, and many swings magnify its rounding.
    swings = stiffness * (duration if drag * duration < 1.0 else 1.0 / drag)
    return swings * (x + model.clearance) + v * min(drag * duration, 1.0)

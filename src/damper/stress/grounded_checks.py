"""What the checks need to know of a free mass that is tied to ground."""

import math

from damper.flow import acceleration, increments, sine_cosine
from damper.models.grounded import Grounded, both_motions
from damper.segment import CAUSE, GAP, RATE, RELEASE, SIDE, TIME, V, X
from damper.stress.checks import (
    flight_start,
    own_jerk,
    own_motion,
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


@own_motion.of(Grounded)
def _own_motion(model, start, tau):
    _, _, _, _, y, u, b, k = start
    dy, du, _, _ = increments(model.support, y, u, b, k, 0.0, 0.0, tau)
    return dy, du, abs(y) + abs(u) * tau


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
    swing = stiffness * min(duration, 1.0 / max(math.sqrt(stiffness), drag))
    return swing * (x + model.clearance) + v * min(drag * duration, 1.0)

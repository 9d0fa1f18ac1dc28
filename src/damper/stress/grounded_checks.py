"""What the checks need to know of a free mass that is tied to ground."""

from damper.flow import acceleration, sine_cosine
from damper.models import motion
from damper.models.grounded import Grounded, both_motions
from damper.segment import CAUSE, GAP, RATE, RELEASE, SIDE, TIME, V, X
from damper.stress.checks import flight_gap, support_speed, support_stiffness, thrust
from damper.two_oscillators import move_apart


@flight_gap.of(Grounded)
def _flight_gap(model, row, tau):
    free = model.free
    x = float(row[X])
    v = float(row[V])
    gap = float(row[GAP])
    rate = float(row[RATE])
    side = float(row[SIDE])
    sin, cos, _ = sine_cosine(free[3] * float(row[TIME]) + model.phase)
    a, j = acceleration(free, x, v, sin, cos)
    released = row[CAUSE] == RELEASE
    a, j, y, u, b, k = both_motions(model, released, side, x, v, gap, rate, a, j, cos)
    size = gap + (abs(rate) + abs(v) + abs(u)) * tau + abs(y)
    gap, rate, dx, _ = move_apart(
        free, x, v, a, j, sin, cos, model.support, y, u, b, k, side, gap, rate, tau
    )
    return gap, rate, x + dx, size


@thrust.of(Grounded)
def _thrust(model, row, tau):
    # What parts the masses: the difference of their accelerations in the flight that would begin.
    side = float(row[SIDE])
    x, v, _, _ = motion(model, row, tau)
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

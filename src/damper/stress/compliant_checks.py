"""What the checks need to know of walls that give."""

import math

from damper.engine.oscillator import acceleration, sine_cosine
from damper.engine.segment import GAP, RATE, TIME, V, X
from damper.models.compliant import Compliant
from damper.stress.checks import flight_start, thrust


@flight_start.of(Compliant)
def _flight_start(model, row):
    # A wall that gives has its own end of contact: x'' need not vanish at a release.
    free = model.free
    sin, cos, _ = sine_cosine(free[3] * float(row[TIME]) + model.phase)
    a, j = acceleration(free, float(row[X]), float(row[V]), sin, cos)
    return a, j, sin, cos, 0.0, 0.0, 0.0, 0.0


@thrust.of(Compliant)
def _thrust(model, row, tau, x, v, gap, rate):
    if model.tension != 0.0:
        return 0.0, 1.0
    k = model.touch.stiffness
    c = model.touch.damping
    # Terms of the rate: what the contact's own oscillation makes of the depth at its start.
    speed = abs(rate) + abs(float(row[RATE])) + math.sqrt(k) * abs(float(row[GAP]))
    # What the rest of the masses' forces comes to at the wall.
    free = model.free
    other = 1.0 + abs(x) + abs(float(row[X])) + 2.0 * free[0] * (abs(v) + abs(float(row[V])))
    size = k * (abs(gap) + abs(float(row[GAP]))) + c * speed + model.touch.reduced * other
    return -(k * gap + c * rate), size

"""What the checks need to know of walls that give."""

import math

from damper.models import motion
from damper.models.compliant import Compliant
from damper.segment import GAP, RATE, V, X
from damper.stress.checks import has_rigid_walls, thrust


@has_rigid_walls.of(Compliant)
def _has_rigid_walls(model):
    return False


@thrust.of(Compliant)
def _thrust(model, row, tau):
    x, v, gap, rate = motion(model, row, tau)
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

"""What the checks need to know of walls that give."""

import math

from damper.models import motion
from damper.models.compliant import Compliant
from damper.segment import GAP, RATE
from damper.stress.checks import thrust


@thrust.of(Compliant)
def _thrust(model, row, tau):
    _, _, gap, rate = motion(model, row, tau)
    if model.tension != 0.0:
        return 0.0, 1.0
    k = model.touch.stiffness
    c = model.touch.damping
    # Terms of the rate: what the contact's own oscillation makes of the depth at its start.
    speed = abs(rate) + abs(float(row[RATE])) + math.sqrt(k) * abs(float(row[GAP]))
    return -(k * gap + c * rate), k * (abs(gap) + abs(float(row[GAP]))) + c * speed

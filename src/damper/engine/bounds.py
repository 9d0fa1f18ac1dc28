"""Closed-form bounds on the derivatives of an oscillator's motion.

sqrt(stiffness x^2 + v^2) of a damped oscillator grows by at most strength |force| tau over a time
tau, and every derivative of the motion obeys the same equation with that derivative of the force.
So on [0, span]

    |x^(n+1)| <= energy_norm(osc, x^(n), x^(n+1)) + strength bound_ahead(forcing, n) span

The bounds stay sharp at resonance: no large amplitudes that cancel stand in them.
"""

import math

from damper.engine.compiled import compiled
from damper.engine.forcing import bound_ahead
from damper.engine.oscillator import Motion, Oscillator


@compiled
def energy_norm(osc: Oscillator, lower: float, upper: float) -> float:
    """Bound on a derivative of the displacement, from it (`upper`) and the one below it."""
    return math.sqrt(osc.stiffness * lower * lower + upper * upper)


@compiled
def bounds_ahead(osc: Oscillator, motion: Motion, span: float) -> tuple[float, float]:
    """Bounds on |x''| and |x'''| over the coming time `span`.

    The smaller of two each: the energy norm of the derivative itself, and what the equation of
    motion makes of the norm below it. A motion that damping has slowed down has the latter.
    """
    forcing, phase = osc.forcing, motion.phase
    force1 = osc.strength * bound_ahead(forcing, phase, 1, span)
    force2 = osc.strength * bound_ahead(forcing, phase, 2, span)
    force = osc.strength * bound_ahead(forcing, phase, 0, span)
    norm0 = energy_norm(osc, motion.x, motion.v) + force * span
    norm1 = energy_norm(osc, motion.v, motion.a) + force1 * span
    norm2 = energy_norm(osc, motion.a, motion.j) + force2 * span
    return min(norm1, force + osc.coupling * norm0), min(norm2, force1 + osc.coupling * norm1)

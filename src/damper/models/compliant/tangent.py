"""Tangent dynamics of compliant walls.

The state does not jump, but the contact force may: by c w where a contact begins with the approach
speed w, and where one that pulls lets go, c being the wall's damping. A deviated motion touches
later by tau, so it lacks the impulse c w tau, which is c times the deviation of the gap: no speed
divides it. Derivation: docs/orbits.md.
"""

from typing import Any

import numpy as np

from damper.engine.compiled import compiled
from damper.engine.segment import FLIGHT, IMPACT, RELEASE, SEPARATION, Segment
from damper.models.compliant.flow import NOWHERE, advance_about


@compiled
def joins(model: Any, s: Segment) -> bool:
    """Whether two directions vanish: never, for the walls yield."""
    return False


@compiled
def shrunk_by(model: Any, s: Segment) -> float:
    """Factor of a volume of (x, v, y, u) at a touch: 1."""
    return 1.0


@compiled
def velocities_after(model: Any, s: Segment, time: float) -> tuple[float, float]:
    """Velocities of both masses after a touch: those before it."""
    return s.v_before, s.v_before + s.side * s.speed


@compiled
def damping_in(model: Any, s: Segment) -> float:
    """Rate at which volumes of (x, v, y, u) shrink in a segment."""
    return model.contact.drag + (0.0 if s.mode == FLIGHT else model.contact.relative_damping)


@compiled
def over_event(model: Any, s: Segment, deviations: np.ndarray) -> None:
    """Take deviations, the columns of a (4, n) array, over what begins a segment."""
    if s.cause == IMPACT:
        _push(model, -model.contact.damping, deviations)
    elif model.tension != 0.0 and s.mode == FLIGHT and s.cause in (RELEASE, SEPARATION):
        # Without tension the force has vanished by itself.
        _push(model, model.contact.damping, deviations)


@compiled
def _push(model, strength, deviations):
    """Give both masses an impulse in proportion to what their distance deviates by."""
    for k in range(deviations.shape[1]):
        impulse = strength * (deviations[0, k] - deviations[2, k])
        deviations[1, k] += impulse
        deviations[3, k] -= impulse / model.mass_ratio


@compiled
def stay_on(model: Any, s: Segment, low: float, tau: float, deviations: np.ndarray) -> None:
    """Take deviations over a time of contact, which is linear: they are a motion without force."""
    beta = model.contact.reduced
    for k in range(deviations.shape[1]):
        gap, rate = deviations[0, k] - deviations[2, k], deviations[1, k] - deviations[3, k]
        z = deviations[0, k] - beta * gap, deviations[1, k] - beta * rate, gap, rate, 0.0, 0.0
        z = advance_about(NOWHERE, model.contact, model.table, z, tau)
        x, v = z[0] + beta * z[2], z[1] + beta * z[3]
        deviations[0, k], deviations[1, k] = x, v
        deviations[2, k], deviations[3, k] = x - z[2], v - z[3]

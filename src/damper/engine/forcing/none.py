"""No force: free motion."""

import math
from typing import Any, NamedTuple

import numpy as np

from damper.engine import forcing as declared


class ZeroForce(NamedTuple):
    """No force at all."""

    value: float


@declared.second_derivative.register
def _second_derivative(forcing: ZeroForce, amplitude: float) -> tuple[float, Any]:
    return 0.0, forcing


@declared.repeats.of(ZeroForce)
def _repeats(forcing):
    return True


declared.is_odd.of(ZeroForce)(_repeats)


@declared.horizon.of(ZeroForce)
def _horizon(forcing, phase):
    return math.inf


@declared.may_jump.of(ZeroForce)
def _may_jump(forcing):
    return False


@declared.rate_of.of(ZeroForce)
def _rate_of(forcing):
    return 0.0


@declared.bound_of.of(ZeroForce)
def _bound_of(forcing, order):
    return 0.0


@declared.phase_at.of(ZeroForce)
def _phase_at(forcing, cycles, time):
    return 0.0


@declared.turn_over.of(ZeroForce)
def _turn_over(forcing, tau):
    return 0.0


declared.long_turn.of(ZeroForce)(_turn_over)


@declared.turned.of(ZeroForce)
def _turned(forcing, phase, turn):
    return 0.0


@declared.force_rates.of(ZeroForce)
def _force_rates(forcing, phase):
    return 0.0, 0.0, 0.0, 0.0, 0.0


@declared.derivative_of.of(ZeroForce)
def _derivative_of(forcing, phase, order):
    return 0.0


@declared.tones_of.of(ZeroForce)
def _tones_of(forcing, phase):
    return np.empty((0, 3))


@declared.gain_of.of(ZeroForce)
def _gain_of(forcing, damping, stiffness, split):
    return 0.0


@declared.driven.of(ZeroForce)
def _driven(forcing, gain, osc, flow, phase, turn, tau):
    return 0.0, 0.0

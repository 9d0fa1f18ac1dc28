"""No force: free motion."""

import math
from typing import NamedTuple

from damper.engine.forcing import (
    bound_of,
    derivative_of,
    driven,
    filtered,
    force_rates,
    gain_of,
    horizon,
    is_odd,
    long_turn,
    may_jump,
    phase_at,
    rate_of,
    repeats,
    turn_over,
    turned,
)


class ZeroForce(NamedTuple):
    """No force at all."""

    value: float


@repeats.of(ZeroForce)
def _repeats(forcing):
    return True


is_odd.of(ZeroForce)(_repeats)


@horizon.of(ZeroForce)
def _horizon(forcing, phase):
    return math.inf


@may_jump.of(ZeroForce)
def _may_jump(forcing):
    return False


@rate_of.of(ZeroForce)
def _rate_of(forcing):
    return 0.0


@bound_of.of(ZeroForce)
def _bound_of(forcing, order):
    return 0.0


@phase_at.of(ZeroForce)
def _phase_at(forcing, cycles, time):
    return 0.0


@turn_over.of(ZeroForce)
def _turn_over(forcing, tau):
    return 0.0


long_turn.of(ZeroForce)(_turn_over)


@turned.of(ZeroForce)
def _turned(forcing, phase, turn):
    return 0.0


@force_rates.of(ZeroForce)
def _force_rates(forcing, phase):
    return 0.0, 0.0, 0.0, 0.0, 0.0


@derivative_of.of(ZeroForce)
def _derivative_of(forcing, phase, order):
    return 0.0


@gain_of.of(ZeroForce)
def _gain_of(forcing, damping, stiffness, split):
    return 0.0


@driven.of(ZeroForce)
def _driven(forcing, gain, osc, flow, phase, turn, tau):
    return 0.0, 0.0


@filtered.of(ZeroForce)
def _filtered(forcing, second, first, zeroth):
    return forcing, 0.0

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


class NoForce(NamedTuple):
    """No force at all."""

    value: float


@repeats.of(NoForce)
def _repeats(forcing):
    return True


@is_odd.of(NoForce)
def _is_odd(forcing):
    return True


@horizon.of(NoForce)
def _horizon(forcing, phase):
    return math.inf


@may_jump.of(NoForce)
def _may_jump(forcing):
    return False


@rate_of.of(NoForce)
def _rate_of(forcing):
    return 0.0


@bound_of.of(NoForce)
def _bound_of(forcing, order):
    return 0.0


@phase_at.of(NoForce)
def _phase_at(forcing, cycles, time):
    return 0.0


@turn_over.of(NoForce)
def _turn_over(forcing, tau):
    return 0.0


@long_turn.of(NoForce)
def _long_turn(forcing, tau):
    return 0.0


@turned.of(NoForce)
def _turned(forcing, phase, turn):
    return 0.0


@force_rates.of(NoForce)
def _force_rates(forcing, phase):
    return 0.0, 0.0, 0.0, 0.0, 0.0


@derivative_of.of(NoForce)
def _derivative_of(forcing, phase, order):
    return 0.0


@gain_of.of(NoForce)
def _gain_of(forcing, damping, stiffness, split):
    return 0.0


@driven.of(NoForce)
def _driven(forcing, gain, osc, flow, phase, turn, tau):
    return 0.0, 0.0


@filtered.of(NoForce)
def _filtered(forcing, second, first, zeroth):
    return forcing, 0.0

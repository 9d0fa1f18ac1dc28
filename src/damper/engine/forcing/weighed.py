"""A force and a weight: a share of a force that others have as well, and a constant beside it.

Its phase is that of the force, so oscillators with and without a weight can follow from one.
"""

from typing import Any, NamedTuple

from damper.engine.forcing import (
    bound_ahead,
    bound_of,
    common,
    derivative_of,
    driven,
    force_rates,
    gain_of,
    horizon,
    is_odd,
    long_turn,
    may_jump,
    phase_at,
    rate_of,
    repeats,
    strength_of,
    turn_over,
    turned,
    weight_of,
)
from damper.engine.forcing.record import held


class WeighedForce(NamedTuple):
    """The force share times another one, plus a constant; that of an oscillator of strength 1."""

    forcing: Any
    share: float
    weight: float


@repeats.of(WeighedForce)
def _repeats(forcing):
    return repeats(forcing.forcing)


@is_odd.of(WeighedForce)
def _is_odd(forcing):
    return False


@rate_of.of(WeighedForce)
def _rate_of(forcing):
    return rate_of(forcing.forcing)


@bound_of.of(WeighedForce)
def _bound_of(forcing, order):
    bound = abs(forcing.share) * bound_of(forcing.forcing, order)
    return bound + abs(forcing.weight) if order == 0 else bound


@bound_ahead.of(WeighedForce)
def _bound_ahead(forcing, phase, order, span):
    bound = abs(forcing.share) * bound_ahead(forcing.forcing, phase, order, span)
    return bound + abs(forcing.weight) if order == 0 else bound


@horizon.of(WeighedForce)
def _horizon(forcing, phase):
    return horizon(forcing.forcing, phase)


@may_jump.of(WeighedForce)
def _may_jump(forcing):
    return may_jump(forcing.forcing)


@phase_at.of(WeighedForce)
def _phase_at(forcing, cycles, time):
    return phase_at(forcing.forcing, cycles, time)


@turn_over.of(WeighedForce)
def _turn_over(forcing, tau):
    return turn_over(forcing.forcing, tau)


@long_turn.of(WeighedForce)
def _long_turn(forcing, tau):
    return long_turn(forcing.forcing, tau)


@turned.of(WeighedForce)
def _turned(forcing, phase, turn):
    return turned(forcing.forcing, phase, turn)


@force_rates.of(WeighedForce)
def _force_rates(forcing, phase):
    k = forcing.share
    force, force1, force2, force3, force4 = force_rates(forcing.forcing, phase)
    return k * force + forcing.weight, k * force1, k * force2, k * force3, k * force4


@derivative_of.of(WeighedForce)
def _derivative_of(forcing, phase, order):
    value = forcing.share * derivative_of(forcing.forcing, phase, order)
    return value + forcing.weight if order == 0 else value


@gain_of.of(WeighedForce)
def _gain_of(forcing, damping, stiffness, split):
    return gain_of(forcing.forcing, damping, stiffness, split)


@driven.of(WeighedForce)
def _driven(forcing, gain, osc, flow, phase, turn, tau):
    x, v = driven(forcing.forcing, gain, osc, flow, phase, turn, tau)
    step, _ = held(osc, flow, tau)
    return forcing.share * x + forcing.weight * step, forcing.share * v + forcing.weight * flow.s


@common.of(WeighedForce)
def _common(forcing):
    return forcing.forcing


@strength_of.of(WeighedForce)
def _strength_of(forcing, strength):
    return forcing.share


@weight_of.of(WeighedForce)
def _weight_of(forcing):
    return forcing.weight

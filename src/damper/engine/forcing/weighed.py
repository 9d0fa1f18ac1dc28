"""A force and a weight: a share of a force that others have as well, and a constant beside it.

Its phase is that of the force, so oscillators with and without a weight can follow from one.
"""

from typing import Any, NamedTuple

import numpy as np

from damper.engine import forcing as declared
from damper.engine.forcing.record import held


class WeighedForce(NamedTuple):
    """The force share times another one, plus a constant; that of an oscillator of strength 1."""

    forcing: Any
    share: float
    weight: float


@declared.repeats.of(WeighedForce)
def _repeats(forcing):
    return declared.repeats(forcing.forcing)


@declared.is_odd.of(WeighedForce)
def _is_odd(forcing):
    return False


@declared.rate_of.of(WeighedForce)
def _rate_of(forcing):
    return declared.rate_of(forcing.forcing)


@declared.bound_of.of(WeighedForce)
def _bound_of(forcing, order):
    bound = abs(forcing.share) * declared.bound_of(forcing.forcing, order)
    return bound + abs(forcing.weight) if order == 0 else bound


@declared.bound_ahead.of(WeighedForce)
def _bound_ahead(forcing, phase, order, span):
    bound = abs(forcing.share) * declared.bound_ahead(forcing.forcing, phase, order, span)
    return bound + abs(forcing.weight) if order == 0 else bound


@declared.horizon.of(WeighedForce)
def _horizon(forcing, phase):
    return declared.horizon(forcing.forcing, phase)


@declared.may_jump.of(WeighedForce)
def _may_jump(forcing):
    return declared.may_jump(forcing.forcing)


@declared.phase_at.of(WeighedForce)
def _phase_at(forcing, cycles, time):
    return declared.phase_at(forcing.forcing, cycles, time)


@declared.turn_over.of(WeighedForce)
def _turn_over(forcing, tau):
    return declared.turn_over(forcing.forcing, tau)


@declared.long_turn.of(WeighedForce)
def _long_turn(forcing, tau):
    return declared.long_turn(forcing.forcing, tau)


@declared.turned.of(WeighedForce)
def _turned(forcing, phase, turn):
    return declared.turned(forcing.forcing, phase, turn)


@declared.force_rates.of(WeighedForce)
def _force_rates(forcing, phase):
    k = forcing.share
    force, force1, force2, force3, force4 = declared.force_rates(forcing.forcing, phase)
    return k * force + forcing.weight, k * force1, k * force2, k * force3, k * force4


@declared.derivative_of.of(WeighedForce)
def _derivative_of(forcing, phase, order):
    value = forcing.share * declared.derivative_of(forcing.forcing, phase, order)
    return value + forcing.weight if order == 0 else value


@declared.tones_of.of(WeighedForce)
def _tones_of(forcing, phase):
    inner = declared.tones_of(forcing.forcing, phase)
    found = np.zeros((len(inner) + 1, 3))
    for k in range(len(inner)):
        found[k, 0] = inner[k, 0]
        found[k, 1], found[k, 2] = forcing.share * inner[k, 1], forcing.share * inner[k, 2]
    found[len(inner), 1] = forcing.weight
    return found


@declared.gain_of.of(WeighedForce)
def _gain_of(forcing, damping, stiffness, split):
    return declared.gain_of(forcing.forcing, damping, stiffness, split)


@declared.driven.of(WeighedForce)
def _driven(forcing, gain, osc, flow, phase, turn, tau):
    x, v = declared.driven(forcing.forcing, gain, osc, flow, phase, turn, tau)
    step, _ = held(osc, flow, tau)
    return forcing.share * x + forcing.weight * step, forcing.share * v + forcing.weight * flow.s


@declared.common.of(WeighedForce)
def _common(forcing):
    return forcing.forcing


@declared.strength_of.of(WeighedForce)
def _strength_of(forcing, strength):
    return forcing.share


@declared.weight_of.of(WeighedForce)
def _weight_of(forcing):
    return forcing.weight

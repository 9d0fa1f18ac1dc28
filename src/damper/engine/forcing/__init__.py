"""Forces on the primary: declarations of the functions that every force implements.

A force is a NamedTuple of constants, and an implementation of these functions for its class, a file
each. It is a shape; an oscillator's `strength` is what that is multiplied by. Another force is
another such file: docs/extending.md adds one.
"""

from functools import singledispatch
from typing import Any, NamedTuple

import numpy as np

from damper.engine.dispatch import by_class, by_class_or_default

#: A Taylor series stops where its remainder is below this part of its scale.
TAYLOR_REMAINDER = 1e-18
#: Longest segment without an event, in units of sqrt(M/K): phases lose digits with time. Many of
#: them do not add up one roundoff: the sine and cosine of this length are doubles to 4e-21, and it
#: is a multiple of 2**-40, the last bit of the longest period, so the clock adds it exactly.
HORIZON = 25.294542550239385


class FreeFlow(NamedTuple):
    """Free motion over a time tau: x0 C + v0 S, in forms that do not cancel as tau -> 0."""

    c_less_1: float
    s: float
    s_less_tau: float
    s_dot_less_1: float


@singledispatch
def second_derivative(forcing: Any, amplitude: float) -> tuple[float, Any]:
    """Return strength and force that are the second derivative of an amplitude times a force.

    A box whose motion is the force's function has it as acceleration. Never compiled.
    """
    raise TypeError(f"second_derivative is not implemented for {type(forcing).__name__}")


@by_class
def repeats(forcing: Any) -> bool:
    """Whether it is the same again a cycle of the clock later."""


@by_class
def is_odd(forcing: Any) -> bool:
    """Whether half a cycle of the clock later it is its own opposite."""


@by_class
def rate_of(forcing: Any) -> float:
    """Its fastest rate; 0 where a polynomial is all that it is."""


@by_class
def bound_of(forcing: Any, order: int) -> float:
    """Bound on the size of its derivative of this order, 0 to 5, at all times."""


@by_class_or_default
def bound_ahead(forcing: Any, phase: Any, order: int, span: float) -> float:
    """As `bound_of`, over a time from a phase for which it is smooth."""
    return float(bound_of(forcing, order))


@by_class
def horizon(forcing: Any, phase: Any) -> float:
    """Time from a phase for which it is smooth; no segment and no tail is longer than this."""


@by_class
def may_jump(forcing: Any) -> bool:
    """Whether there are times at which its value jumps."""


@by_class
def phase_at(forcing: Any, cycles: float, time: float) -> Any:
    """Phase of the force at whole cycles and a local time; it determines the force from then on."""


@by_class
def turn_over(forcing: Any, tau: float) -> Any:
    """How its phase changes in a time `tau`."""


@by_class
def long_turn(forcing: Any, tau: float) -> Any:
    """As `turn_over`, with the digits that its product with a long time would lose."""


@by_class
def turned(forcing: Any, phase: Any, turn: Any) -> Any:
    """Phase after a turn."""


@by_class
def force_rates(forcing: Any, phase: Any) -> tuple[float, ...]:
    """Value and first four derivatives of the force."""


@by_class
def derivative_of(forcing: Any, phase: Any, order: int) -> float:
    """Derivative of any order."""


@by_class
def tones_of(forcing: Any, phase: Any) -> np.ndarray:
    """(n, 3) parts of the force at a phase: c, f and f' of each, where f'' = -c f."""


@by_class
def gain_of(forcing: Any, damping: float, stiffness: float, split: float) -> Any:
    """Constants of an oscillator's answer to the force, which `driven` uses."""


@by_class
def driven(
    forcing: Any, gain: Any, osc: Any, flow: FreeFlow, phase: Any, turn: Any, tau: float
) -> tuple[float, float]:
    """Displacement and velocity of an oscillator after a time `tau` under the force, from rest."""


@by_class_or_default
def common(forcing: Any) -> Any:
    """What all masses have of it: itself, but for the weight of one of them."""
    return forcing


@by_class_or_default
def strength_of(forcing: Any, strength: float) -> float:
    """Factor of `common` for a force of the given `strength`."""
    return strength


@by_class_or_default
def weight_of(forcing: Any) -> float:
    """The constant beside `common`."""
    return 0.0


@by_class_or_default
def taylor(
    forcing: Any, osc: Any, a: float, j: float, phase: Any, tau: float
) -> tuple[float, float]:
    """x - x0 - v0 tau and v - v0 by their Taylor series: relative accuracy as tau -> 0."""
    # A polynomial may be all that moves: its first term counts even so.
    reach = max(max(osc.rate, rate_of(forcing)) * tau, 1e-30)
    lower = a
    upper = j
    power = 0.5 * tau  # tau**(n-1) / n! of the n-th derivative
    dv = a * tau
    dx = a * power
    remainder = 0.5 * reach
    order = 2
    n = 3.0
    # Relative to the second term, since the first one may be zero.
    while remainder > TAYLOR_REMAINDER * reach:
        dv += upper * power * tau
        power *= tau / n
        dx += upper * power
        force = osc.strength * derivative_of(forcing, phase, order)
        following = (force - osc.stiffness * lower) - 2.0 * osc.damping * upper
        lower = upper
        upper = following
        remainder *= reach / n
        order += 1
        n += 1.0
    return dx * tau, dv

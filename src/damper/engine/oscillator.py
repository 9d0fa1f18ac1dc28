"""Exact flow of a forced linear oscillator.

    x'' + 2 damping x' + stiffness x = strength force(t)

Flight of the primary has stiffness 1, the damping ratio as damping, and strength 1; in sticking
all three are divided by 1 + mass_ratio. The motion from (x0, v0) is x0 C(tau) + v0 S(tau) plus
what the force does from rest: C and S solve the free equation from (1, 0) and (0, 1). Each is
evaluated in the form that does not cancel for the regime at hand; see docs/method.md.
"""

import math
from typing import Any, NamedTuple

from damper.engine import forcing as forces
from damper.engine.compiled import compiled
from damper.engine.trigonometry import sine_cosine

#: Regimes of the free motion.
UNDERDAMPED, NEARLY_CRITICAL, OVERDAMPED = 0.0, 1.0, 2.0
#: Below this product of fastest rate and time the Taylor series is used: it keeps *relative*
#: accuracy in the increments as the time shrinks, where differences of closed forms lose it.
TAYLOR_RANGE = 0.5


class Oscillator(NamedTuple):
    """Constants of one oscillator."""

    damping: float
    """Half the damping coefficient over the mass, >= 0."""
    stiffness: float
    """Stiffness over mass, >= 0."""
    strength: float
    """What the force's shape is multiplied by: its amplitude over mass."""
    regime: float
    split: float
    """Damped frequency, or half the difference of the real roots."""
    slow: float
    fast: float
    """The real roots; 0 where they are complex."""
    rate: float
    """Bound on the rate of the free motion, 2 damping + sqrt(stiffness)."""
    coupling: float
    """sqrt(4 damping^2 + stiffness): of a derivative to the two below it."""
    forcing: Any
    """NamedTuple of `damper.engine.forcing`."""
    gain: Any
    """Its constants for this oscillator."""


class Motion(NamedTuple):
    """State of an oscillator: x, its first three derivatives, forcing phase."""

    x: float
    v: float
    a: float
    j: float
    phase: Any


@compiled
def oscillator(damping: float, stiffness: float, strength: float, forcing: Any) -> Oscillator:
    """Make an oscillator; see its fields."""
    root = math.sqrt(stiffness)
    difference = (root - damping) * (root + damping)
    split = math.sqrt(abs(difference))
    slow = 0.0
    fast = 0.0
    regime = UNDERDAMPED
    if difference <= 0.0 and damping > 0.0:
        fast = -(damping + split)
        slow = stiffness / fast  # not split - damping, which cancels
        regime = NEARLY_CRITICAL if damping * damping < 2.0 * stiffness else OVERDAMPED
    return Oscillator(
        damping,
        stiffness,
        strength,
        regime,
        split,
        slow,
        fast,
        2.0 * damping + root,
        math.sqrt(4.0 * damping * damping + stiffness),
        forcing,
        forces.gain_of(forcing, damping, stiffness, split),
    )


@compiled
def motion_from(osc: Oscillator, x: float, v: float, phase: Any) -> Motion:
    """Complete a state by the second and third derivative that the equation of motion gives."""
    force, force1, _, _, _ = forces.force_rates(osc.forcing, phase)
    a = osc.strength * force - 2.0 * osc.damping * v - osc.stiffness * x
    j = osc.strength * force1 - 2.0 * osc.damping * a - osc.stiffness * v
    return Motion(x, v, a, j, phase)


@compiled
def motion_at_release(osc: Oscillator, x: float, v: float, a: float, phase: Any) -> Motion:
    """As `motion_from` where x'' is `a` by definition, and not as it rounds."""
    _, force1, _, _, _ = forces.force_rates(osc.forcing, phase)
    return Motion(x, v, a, osc.strength * force1 - 2.0 * osc.damping * a - osc.stiffness * v, phase)


@compiled
def higher_derivatives(osc: Oscillator, motion: Motion) -> tuple[float, float, float]:
    """Fourth, fifth and sixth derivative of the displacement."""
    _, _, force2, force3, force4 = forces.force_rates(osc.forcing, motion.phase)
    snap = osc.strength * force2 - 2.0 * osc.damping * motion.j - osc.stiffness * motion.a
    crackle = osc.strength * force3 - 2.0 * osc.damping * snap - osc.stiffness * motion.j
    return snap, crackle, osc.strength * force4 - 2.0 * osc.damping * crackle - osc.stiffness * snap


@compiled
def increments(osc: Oscillator, start: Motion, tau: float) -> tuple[float, float, Any]:
    """Exact motion over a time `tau` >= 0, as increments.

    Returns
    -------
    dx, dv, phase
        x(tau) - x0 - v0 tau, accurate relative to itself as tau -> 0; v(tau) - v0; the forcing
        phase at `tau`.
    """
    turn = forces.turn_over(osc.forcing, tau)
    dx, dv = moved(osc, start, turn, tau)
    return dx, dv, forces.turned(osc.forcing, start.phase, turn)


@compiled
def moved(osc: Oscillator, start: Motion, turn: Any, tau: float) -> tuple[float, float]:
    """The `increments` of displacement and velocity, where the force's turn is known."""
    if max(osc.rate, forces.rate_of(osc.forcing)) * tau <= TAYLOR_RANGE:
        dx, dv = forces.taylor(osc.forcing, osc, start.a, start.j, start.phase, tau)
        return dx, dv
    flow = free_flow(osc, tau)
    forced, forced_v = forces.driven(osc.forcing, osc.gain, osc, flow, start.phase, turn, tau)
    dx = start.x * flow.c_less_1 + start.v * flow.s_less_tau + osc.strength * forced
    dv = start.v * flow.s_dot_less_1 - osc.stiffness * flow.s * start.x + osc.strength * forced_v
    return dx, dv


@compiled
def displaced(osc: Oscillator, start: Motion, turn: Any, tau: float) -> tuple[float, float, float]:
    """Change of the displacement and the velocity after a time, and the size of the way's terms."""
    flow = free_flow(osc, tau)
    forced, forced_v = forces.driven(osc.forcing, osc.gain, osc, flow, start.phase, turn, tau)
    own = start.x * flow.c_less_1
    carried = start.v * flow.s
    pushed = osc.strength * forced
    v = start.v * (1.0 + flow.s_dot_less_1) - osc.stiffness * flow.s * start.x
    size = abs(own) + abs(carried) + abs(pushed)
    return own + carried + pushed, v + osc.strength * forced_v, size


@compiled
def advance(osc: Oscillator, start: Motion, tau: float) -> tuple[float, float]:
    """Change of the displacement over a time `tau`, and the velocity then."""
    dx, dv, _ = increments(osc, start, tau)
    return start.v * tau + dx, start.v + dv


@compiled
def arrive(osc: Oscillator, start: Motion, tau: float) -> tuple[float, float]:
    """State after a long time, formed as such: increments round in units of v tau.

    Returns
    -------
    x, v : float
    """
    turn = forces.long_turn(osc.forcing, tau)
    flow = free_flow(osc, tau)
    forced, forced_v = forces.driven(osc.forcing, osc.gain, osc, flow, start.phase, turn, tau)
    c = 1.0 + flow.c_less_1
    s_dot = 1.0 + flow.s_dot_less_1
    return (
        start.x * c + start.v * flow.s + osc.strength * forced,
        start.v * s_dot - osc.stiffness * flow.s * start.x + osc.strength * forced_v,
    )


@compiled
def free_flow(osc: Oscillator, tau: float) -> forces.FreeFlow:
    """C and S of the free motion over a time `tau`."""
    damping = osc.damping
    if osc.rate * tau <= TAYLOR_RANGE:
        # Only the force is fast: the free motion still needs its series.
        return _free_taylor(osc, tau)
    if osc.regime == OVERDAMPED:
        grow_fast = math.expm1(osc.fast * tau)
        grow_slow = math.expm1(osc.slow * tau)
        width = osc.fast - osc.slow
        s = (grow_fast - grow_slow) / width
        return forces.FreeFlow(
            (osc.fast * grow_slow - osc.slow * grow_fast) / width,
            s,
            s - tau,
            (osc.fast * grow_fast - osc.slow * grow_slow) / width,
        )
    if osc.regime == NEARLY_CRITICAL:
        decay = math.exp(osc.slow * tau)
        drop = math.expm1(-2.0 * osc.split * tau)
        c = decay * (1.0 + 0.5 * drop)
        s = decay * (-0.5 * drop / osc.split if osc.split > 0.0 else tau)
    else:
        decay = math.exp(-damping * tau) if damping > 0.0 else 1.0
        sine, cosine, _ = sine_cosine(osc.split * tau)
        c = decay * cosine
        s = decay / osc.split * sine
    return forces.FreeFlow(c + damping * s - 1.0, s, s - tau, c - damping * s - 1.0)


@compiled
def _free_taylor(osc, tau):
    """C and S by their Taylor series."""
    c_less_1 = 0.0
    s_less_tau = 0.0
    # n-th derivatives at zero of C and S, from the equation of motion.
    c_lower, c_upper = 0.0, -osc.stiffness
    s_lower, s_upper = 1.0, -2.0 * osc.damping
    power = 0.5 * tau * tau
    remainder = 1.0
    n = 2.0
    while remainder > forces.TAYLOR_REMAINDER:
        c_less_1 += c_upper * power
        s_less_tau += s_upper * power
        c_lower, c_upper = c_upper, -2.0 * osc.damping * c_upper - osc.stiffness * c_lower
        s_lower, s_upper = s_upper, -2.0 * osc.damping * s_upper - osc.stiffness * s_lower
        n += 1.0
        power *= tau / n
        remainder *= TAYLOR_RANGE / n
    s = tau + s_less_tau
    return forces.FreeFlow(c_less_1, s, s_less_tau, c_less_1 - 2.0 * osc.damping * s)

"""Backward error of a run: does each segment obey the equations, from where it starts?

A chaotic run cannot be compared with another one for long. But its log holds the start of each
segment as exact doubles, so each can be computed again by itself, in more digits and by formulas of
its own: flight and sticking as divided differences of the exponential. What is left over, relative
to the sizes of the terms that were added, is a change of the problem that would make the run exact;
some units of roundoff mean that the method is sound.

Rigid damper only, and only where `numpy.longdouble` has digits to spare.
"""

import math
from collections.abc import Callable
from typing import Any, NamedTuple

import numpy as np

from damper.engine.segment import (
    CAUSE,
    DURATION,
    FLIGHT,
    GAP,
    IMPACT,
    MODE,
    RATE,
    RELEASE,
    SIDE,
    SPEED,
    TAIL,
    TIME,
    V,
    X,
)
from damper.parameters import Parameters
from damper.verification.stress.verdicts import EPS

#: Whether `numpy.longdouble` has digits to spare.
LONG = bool(np.finfo(np.longdouble).eps < 1e-18)
#: Terms of the series where they go furthest, and what they leave over then.
_TERMS = 26
_REMAINDER = 1.0 / math.factorial(_TERMS - 1)


class Oscillators(NamedTuple):
    """x'' + 2 beta x' + kappa x = force sin(theta + omega tau), one entry for each segment."""

    beta: Any
    kappa: Any
    force: Any
    omega: Any


def residuals(p: Parameters, log: np.ndarray) -> dict[str, np.ndarray]:
    """Residuals of all segments of a rigid run but the last, and of the events that end them.

    In units of roundoff (2^-52), an array (segments - 1,) each, zero where a check does not apply:

    - ``motion``: displacement and velocity (and gap and its rate in a flight that is cut)
      against the next start, over the terms that are added;
    - ``contact``: gap at an impact, and approach speed;
    - ``release``: contact force at a release, over the forces.
    """
    rows, after = log[:-1], log[1:]
    mu, zeta, omega = (np.longdouble(v) for v in (p.mass_ratio, p.damping_ratio, p.frequency_ratio))
    x, v, gap, rate, tau = (rows[:, c].astype(np.longdouble) for c in (X, V, GAP, RATE, DURATION))
    side, mode = rows[:, SIDE], rows[:, MODE]
    flies = mode == FLIGHT
    share = mu / (1 + mu)
    # In a tail the pair moves with its common velocity.
    v = np.where(mode == TAIL, v - side * share * rate, v)
    heavier = np.where(flies, np.longdouble(1), 1 + mu)
    osc = Oscillators(zeta / heavier, 1 / heavier, 1 / heavier, omega)
    theta = np.longdouble(p.phase) + omega * rows[:, TIME].astype(np.longdouble)
    released = rows[:, CAUSE] == RELEASE
    bend, dv, a = _motion(osc, *_released(zeta, x, v, theta, released), theta, tau)

    position, velocity, near, speed, force = _sizes(p, x, v, gap, rate, tau, bend, dv)
    hits = flies & (after[:, CAUSE] == IMPACT)
    wall = after[:, SIDE]
    approach = after[:, SPEED].astype(np.longdouble)
    kick = wall * share * (1 + _restitution(p, approach)) * approach
    # The engine adds v0 tau and the rest; where damping is heavy the two all but cancel.
    off = _part(after[:, X] - (x + (v * tau + bend)), position + _double(abs(v * tau)))
    # The impact's change of velocity is a term of its own, and may cancel the rest.
    lost = after[:, V] - (v + dv + np.where(hits, kick, 0))
    lost = _part(lost, velocity + np.where(hits, _double(abs(kick)), 0.0))
    gap1, rate1 = gap + (rate * tau + side * bend), rate + side * dv
    free = np.maximum(_part(after[:, GAP] - gap1, near), _part(after[:, RATE] - rate1, speed))
    # At the wall from which it came the gap itself vanishes, at the other one what is left.
    across = wall != side
    left = np.where(across, 2 * np.longdouble(p.clearance) - gap1, gap1)
    contact = np.maximum(
        _part(left, near + np.where(across, 2.0 * p.clearance, 0.0)),
        _part(approach - np.where(across, rate1, -rate1), speed),
    )
    release = _part(a, force / (1.0 + p.mass_ratio))
    found = {
        "motion": np.maximum.reduce([off, lost, np.where(flies & ~hits, free, 0.0)]),
        "contact": np.where(hits, contact, 0.0),
        "release": np.where(after[:, CAUSE] == RELEASE, release, 0.0),
    }
    return {name: values / EPS for name, values in found.items()}


def _released(zeta: Any, x: Any, v: Any, theta: Any, of: np.ndarray) -> tuple[Any, Any]:
    """Put each start after a release where x'' is zero, by the least change of x and v.

    That is what a release means; the roundoff of the stored state, multiplied by the damping, is
    the residual of the release itself.
    """
    left = np.where(of, (np.sin(theta) - 2 * zeta * v - x) / (1 + 4 * zeta * zeta), 0)
    return x + left, v + 2 * zeta * left


def _restitution(p: Parameters, approach: Any) -> Any:
    """Coefficient of restitution at some approach speeds."""
    r = np.longdouble(p.restitution)
    if p.yield_speed == math.inf:
        return r
    yields = np.longdouble(p.yield_speed)
    return r * (yields / np.maximum(approach, yields)) ** np.longdouble(0.25)


def _sizes(p: Parameters, *motion: Any) -> tuple[np.ndarray, ...]:
    """Sizes of the terms of displacement, velocity, gap, its rate, and of the forces."""
    x, v, gap, rate, tau, bend, dv = map(_double, motion)
    slow = np.maximum(np.abs(v), np.abs(v + dv))
    far = np.maximum(np.abs(x), np.abs(x + (v * tau + bend)))
    damped = 2.0 * p.damping_ratio + 1.0
    # What forcing and spring add until they change or the damping holds them, and the damping.
    driven = np.minimum(tau, 1.0 / (damped + p.frequency_ratio))
    driven = driven + far * np.minimum(tau, 1.0 / damped)
    moved = np.minimum(0.5 * driven * tau, 1.0 + far)
    at_ends = np.abs(x) + np.abs(x + (v * tau + bend))
    position = at_ends + slow * np.minimum(tau, 1.0 / damped) + moved
    velocity = np.abs(v) + np.abs(v + dv) + driven
    near = gap + np.abs(rate) * tau
    near = near + moved + slow * tau * np.minimum(p.damping_ratio * tau, 1.0)
    force = 1.0 + 2.0 * p.damping_ratio * slow + far
    return position, velocity, near, np.abs(rate) + np.minimum(force * tau, velocity), force


def _double(values: Any) -> np.ndarray:
    return np.asarray(values, dtype=float)


def _part(left: Any, size: np.ndarray) -> np.ndarray:
    """What is left over in units of its terms; where all is zero nothing is left over either."""
    return _double(abs(left)) / np.where(size > 0.0, size, 1.0)


def _motion(osc: Oscillators, x0: Any, v0: Any, theta: Any, tau: Any) -> tuple[Any, Any, Any]:
    """x - x0 - v0 tau, v - v0 and x'' a time tau after each start."""
    sin, cos = np.sin(theta), np.cos(theta)
    a0 = osc.force * sin - 2 * osc.beta * v0 - osc.kappa * x0
    j0 = osc.force * osc.omega * cos - 2 * osc.beta * a0 - osc.kappa * v0
    reach = np.maximum(osc.omega, 2 * osc.beta + np.sqrt(osc.kappa)) * tau
    soon = reach <= 1.0
    bend, dv = np.empty_like(tau), np.empty_like(tau)
    forms: tuple[tuple[np.ndarray, Callable], ...] = ((soon, _series), (~soon, _divided))
    for mask, form in forms:
        if mask.any():
            beta, kappa, force = (value[mask] for value in osc[:3])
            given = (value[mask] for value in (x0, v0, a0, j0, sin, cos, tau))
            some = Oscillators(beta, kappa, force, osc.omega)
            bend[mask], dv[mask] = form(some, *given, float(reach[mask].max()))
    turned = theta + osc.omega * tau
    x1 = x0 + (v0 * tau + bend)
    return bend, dv, osc.force * np.sin(turned) - 2 * osc.beta * (v0 + dv) - osc.kappa * x1


def _terms(reach):
    """Terms of a series in powers of at most `reach` <= 1, as good as `_TERMS` are at 1."""
    left, terms = 1.0, 1
    while terms < _TERMS and left > _REMAINDER:
        left *= reach / terms
        terms += 1
    # Third derivatives may be all that there is.
    return max(terms, 4)


def _series(osc, x0, v0, a0, j0, sin, cos, tau, reach):
    """Taylor series of x - x0 - v0 tau and v - v0, for times short against all rates."""
    lower, upper = a0, j0
    drive = (-osc.force * osc.omega**2 * sin, -osc.force * osc.omega**3 * cos)
    power = tau
    dv = a0 * tau
    bend = a0 * tau * tau / 2
    for n in range(2, _terms(reach)):
        power = power * tau / n
        dv = dv + upper * power
        bend = bend + upper * power * tau / (n + 1)
        lower, upper = upper, drive[0] - 2 * osc.beta * upper - osc.kappa * lower
        drive = drive[1], -drive[0] * osc.omega**2
    return bend, dv


def _divided(osc, x0, v0, a0, j0, sin, cos, tau, reach):
    """Closed form by divided differences of exp at the two roots and i omega, all times tau.

    S = tau exp[z1, z2] and Q = tau^2 exp[z1, z2, z3] solve the equation from (0, 1), and forced by
    exp(i omega tau) from rest. No case is special: equal roots and resonance are close points.
    """
    root = np.sqrt(osc.kappa)
    square = (osc.beta - root) * (osc.beta + root)
    split = np.sqrt(np.abs(square))
    fast = np.where(square >= 0.0, -(osc.beta + split) + 0j, -osc.beta - 1j * split)
    slow = np.where(square >= 0.0, osc.kappa / fast, -osc.beta + 1j * split)
    z1, z2, z3 = slow * tau, fast * tau, 1j * osc.omega * tau
    s = tau * _exp2(z1, z2)
    q = tau * tau * _exp3(z1, z2, z3)
    q_dot = slow * q + tau * _exp2(z2, z3)
    turn = cos + 1j * sin
    c_less_1 = (np.expm1(z1) - slow * s).real
    s_dot_less_1 = (np.expm1(z2) + slow * s).real
    s = s.real
    bend = x0 * c_less_1 + v0 * (s - tau) + osc.force * (turn * q).imag
    dv = v0 * s_dot_less_1 - osc.kappa * s * x0 + osc.force * (turn * q_dot).imag
    return bend, dv


def _exp2(a, b):
    """First divided difference of the exponential."""
    swap = b.real > a.real
    a, b = np.where(swap, b, a), np.where(swap, a, b)
    width = b - a
    same = width == 0.0
    width = np.where(same, 1.0, width)
    return np.exp(a) * np.where(same, 1.0, np.expm1(width) / width)


def _exp3(a, b, c):
    """Second divided difference of the exponential."""
    a, b, c = np.broadcast_arrays(a, b, c)
    widths = np.abs(np.stack((a - b, b - c, c - a)))
    close = widths.max(axis=0) <= 1.0
    found = np.empty_like(a)
    # The widest pair goes outside, so the division multiplies no error.
    widest = widths.argmax(axis=0)
    for mask, form in ((close, _exp3_close), (~close, _exp3_wide)):
        if mask.any():
            found[mask] = form(a[mask], b[mask], c[mask], widest[mask])
    return found


def _exp3_close(a, b, c, widest):
    """Series: complete homogeneous symmetric polynomials of the distances from the mean."""
    mean = (a + b + c) / 3
    u, v, w = a - mean, b - mean, c - mean
    one = np.ones_like(mean)
    h1, h2, h3 = one, one, one
    total = one / 2
    factor = np.longdouble(2.0)
    for n in range(3, _TERMS):
        h1 = h1 * u
        h2 = h1 + v * h2
        h3 = h2 + w * h3
        factor = factor * n
        total = total + h3 / factor
    return np.exp(mean) * total


def _exp3_wide(a, b, c, widest):
    first = np.choose(widest, (a, b, c))
    last = np.choose(widest, (b, c, a))
    between = np.choose(widest, (c, a, b))
    return (_exp2(between, last) - _exp2(first, between)) / (last - first)

"""Backward error of a run: does each segment obey the equations, from where it starts?

A chaotic run cannot be compared with another one for long. But its log holds the start of each
segment as exact doubles, so each can be computed again by itself, in more digits and in a way of
its own: short Taylor series, doubled. What is left over, relative to the sizes of the terms that
were added, is a change of the problem that would make the run exact; some units of roundoff mean
that the method is sound.

Rigid damper without gravity only, and only where `numpy.longdouble` has digits to spare.
"""

import math
from typing import Any, NamedTuple

import numpy as np

from damper.engine import segment
from damper.engine.roundoff import EPSILON
from damper.parameters import Parameters

#: Whether `numpy.longdouble` has digits to spare.
LONG = bool(np.finfo(np.longdouble).eps < 1e-18)
#: A short time in units of the fastest rate, and the terms of a series over it.
_SHORT, _TERMS = 0.25, 14


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
    mu, zeta, omega, amplitude = (
        np.longdouble(getattr(p, name))
        for name in ("mass_ratio", "damping_ratio", "frequency_ratio", "force_amplitude")
    )
    x, v, gap, rate, tau = (
        rows[:, c].astype(np.longdouble)
        for c in (segment.X, segment.V, segment.GAP, segment.GAP_RATE, segment.DURATION)
    )
    side, mode = rows[:, segment.SIDE], rows[:, segment.MODE]
    flies = mode == segment.FLIGHT
    share = mu / (1 + mu)
    # In a tail the pair moves with its common velocity.
    v = np.where(mode == segment.TAIL, v - side * share * rate, v)
    heavier = np.where(flies, np.longdouble(1), 1 + mu)
    osc = Oscillators(zeta / heavier, 1 / heavier, amplitude / heavier, omega)
    theta = np.longdouble(p.phase) + omega * rows[:, segment.TIME].astype(np.longdouble)
    released = rows[:, segment.CAUSE] == segment.RELEASE
    starts = _released(zeta, x, v, amplitude * np.sin(theta), released)
    bend, dv, a = _motion(osc, *starts, theta, tau)

    position, velocity, near, speed, force = _sizes(p, x, v, gap, rate, tau, bend, dv)
    hits = flies & (after[:, segment.CAUSE] == segment.IMPACT)
    wall = after[:, segment.SIDE]
    approach = after[:, segment.SPEED].astype(np.longdouble)
    kick = wall * share * (1 + _restitution(p, wall, approach)) * approach
    # The engine adds v0 tau and the rest; where damping is heavy the two all but cancel.
    off = _part(after[:, segment.X] - (x + (v * tau + bend)), position + _double(abs(v * tau)))
    # The impact's change of velocity is a term of its own, and may cancel the rest.
    lost = after[:, segment.V] - (v + dv + np.where(hits, kick, 0))
    lost = _part(lost, velocity + np.where(hits, _double(abs(kick)), 0.0))
    gap1, rate1 = gap + (rate * tau + side * bend), rate + side * dv
    free = np.maximum(
        _part(after[:, segment.GAP] - gap1, near), _part(after[:, segment.GAP_RATE] - rate1, speed)
    )
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
        "release": np.where(after[:, segment.CAUSE] == segment.RELEASE, release, 0.0),
    }
    return {name: values / EPSILON for name, values in found.items()}


def _released(zeta: Any, x: Any, v: Any, force: Any, of: np.ndarray) -> tuple[Any, Any]:
    """Put each start after a release where x'' is zero, by the least change of x and v.

    That is what a release means; the roundoff of the stored state, multiplied by the damping, is
    the residual of the release itself.
    """
    left = np.where(of, (force - 2 * zeta * v - x) / (1 + 4 * zeta * zeta), 0)
    return x + left, v + 2 * zeta * left


def _restitution(p: Parameters, wall: np.ndarray, approach: Any) -> Any:
    """Coefficient of restitution at some walls and approach speeds."""
    left, right = map(np.longdouble, p.restitutions)
    r = np.where(wall < 0.0, left, right)
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
    driven = p.force_amplitude * np.minimum(tau, 1.0 / (damped + p.frequency_ratio))
    driven = driven + far * np.minimum(tau, 1.0 / damped)
    moved = np.minimum(0.5 * driven * tau, p.force_amplitude + far)
    at_ends = np.abs(x) + np.abs(x + (v * tau + bend))
    position = at_ends + slow * np.minimum(tau, 1.0 / damped) + moved
    velocity = np.abs(v) + np.abs(v + dv) + driven
    near = gap + np.abs(rate) * tau
    near = near + moved + slow * tau * np.minimum(p.damping_ratio * tau, 1.0)
    force = p.force_amplitude + 2.0 * p.damping_ratio * slow + far
    return position, velocity, near, np.abs(rate) + np.minimum(force * tau, velocity), force


def _double(values: Any) -> np.ndarray:
    return np.asarray(values, dtype=float)


def _part(left: Any, size: np.ndarray) -> np.ndarray:
    """What is left over in units of its terms; where all is zero nothing is left over either."""
    return _double(abs(left)) / np.where(size > 0.0, size, 1.0)


def _motion(osc: Oscillators, x0: Any, v0: Any, theta: Any, tau: Any) -> tuple[Any, Any, Any]:
    """x - x0 - v0 tau, v - v0 and x'' a time tau after each start.

    The motions from displacement 1, from velocity 1 and under exp(i omega t) from rest are Taylor
    series over a short part of tau, and doubled until it is whole: no damping is special, and no
    resonance. What follows from a start of its own is not formed as a difference.
    """
    reach = np.maximum(osc.omega, 2 * osc.beta + np.sqrt(osc.kappa)) * tau
    doublings = np.ceil(np.log2(np.maximum(reach / _SHORT, 1)))
    h = tau / 2**doublings
    (c, s, q), (_, s1, q1) = _series(osc, h)
    c, s, s1 = c.real, s.real, s1.real
    turn = np.exp(1j * osc.omega * h)
    for done in range(int(doublings.max(initial=0))):
        whole = h + s  # and -kappa of it is the velocity from displacement 1
        square, both = osc.kappa * whole * whole, 1 + turn
        twice = (
            *(2 * c + c * c - square, 2 * s + whole * (c + s1), 2 * s1 + s1 * s1 - square),
            *(q * (both + c) + whole * q1, q1 * (both + s1) - osc.kappa * whole * q),
            *(turn * turn, 2 * h),
        )
        old = c, s, s1, q, q1, turn, h
        pairs = zip(twice, old, strict=True)
        c, s, s1, q, q1, turn, h = (np.where(doublings > done, *pair) for pair in pairs)
    start = np.cos(theta) + 1j * np.sin(theta)
    bend = x0 * c + v0 * s + (start * q).imag
    dv = v0 * s1 - osc.kappa * (h + s) * x0 + (start * q1).imag
    x1 = x0 + (v0 * tau + bend)
    push = osc.force * np.sin(theta + osc.omega * tau)
    return bend, dv, push - 2 * osc.beta * (v0 + dv) - osc.kappa * x1


def _series(osc: Oscillators, h: Any) -> tuple[Any, Any]:
    """Displacements less 1, h, 0 and velocities less 0, 1, 0 of the three motions after h."""
    lower, upper, drive = np.eye(3, dtype=np.clongdouble)[:, :, None] * np.ones_like(h)
    drive, bend, dv, power = osc.force * drive, 0, 0, 1
    for n in range(_TERMS):
        pull = 2 * osc.beta * (n + 1) * upper + osc.kappa * lower
        lower, upper, power = upper, (drive - pull) / ((n + 1) * (n + 2)), power * h
        dv = dv + (n + 2) * upper * power
        bend = bend + upper * power * h
        drive = drive * (1j * osc.omega / (n + 1))
    return bend, dv

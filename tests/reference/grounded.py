"""Grounded free mass in many digits: Taylor series of both masses, event by event.

A solver of its own: no burst is closed by a formula of higher order, no flow is in closed form.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

from mpmath import mp, mpf

from damper.verification.comparison.reference_rigid import Event
from damper.verification.comparison.reference_series import (
    first_root,
    horner,
    lowest_order,
    term_count,
)

#: Length of one Taylor panel over the fastest time constant.
PANEL = 1.0


class Scene(NamedTuple):
    """Parameters as ``mpf``; `stiffness` and `damping` are those of the support."""

    mu: mpf
    zeta: mpf
    omega: mpf
    d: mpf
    r: mpf
    phase: mpf
    stiffness: mpf
    damping: mpf


def _forced(p: Scene, inertia: mpf, damping: mpf, stiffness: mpf, constant: mpf, start, count):
    """Taylor coefficients of inertia x'' + 2 damping x' + stiffness x + constant = sin(...)."""
    t, x, v = start
    angle = p.omega * t + p.phase
    cycle = (mp.sin(angle), mp.cos(angle), -mp.sin(angle), -mp.cos(angle))
    c = [x, v]
    scale = mpf(1)
    for n in range(count - 2):
        rest = scale * cycle[n % 4] - 2 * damping * (n + 1) * c[n + 1] - stiffness * c[n]
        if n == 0:
            rest -= constant
        c.append(rest / (inertia * (n + 1) * (n + 2)))
        scale *= p.omega / (n + 1)
    return c


def _free(p: Scene, y: mpf, u: mpf, count: int) -> list[mpf]:
    """Taylor coefficients of mu y'' + 2 damping y' + stiffness y = 0."""
    c = [y, u]
    for n in range(count - 2):
        rest = -2 * p.damping * (n + 1) * c[n + 1] - p.stiffness * c[n]
        c.append(rest / (p.mu * (n + 1) * (n + 2)))
    return c


def _rate(inertia: mpf, damping: mpf, stiffness: mpf) -> mpf:
    """Bound on the modulus of an oscillator's rates."""
    return 2 * damping / inertia + mp.sqrt(stiffness / inertia)


def events(
    parameters: Sequence[float],
    state: Sequence[float] = (0, 0, 0, 0),
    *,
    until: float,
    dps: int = 40,
    burst_floor: float = 1e-25,
    max_events: int = 10**6,
) -> list[Event]:
    """Every event up to a time.

    Parameters
    ----------
    parameters : sequence
        As `Scene`: mass ratio, damping ratio, frequency ratio, clearance, restitution, phase,
        stiffness and damping ratio of the support.
    state : sequence
        ``(x, v, y, u)`` at time 0.
    until : float
        Events later than this are left out.
    dps : int
        Decimal digits wanted.
    burst_floor : float
        Bounces are resolved one by one down to this rebound speed; the rest takes 2 w / (a (1-r)).
    max_events : int
        Stop after this many.
    """
    with mp.workdps(dps + 15):
        return _run(
            Scene(*(mpf(value) for value in parameters)),
            state,
            mpf(until),
            mpf(burst_floor),
            max_events,
        )


def _run(p, state, until, burst_floor, max_events):
    x, v, y, u = (mpf(value) for value in state)
    t = mpf(0)
    side = 1 if y >= x else -1
    gap, rate = p.d - side * (y - x), side * (v - u)
    found: list[Event] = []
    fast = max(_rate(mpf(1), p.zeta, mpf(1)), _rate(p.mu, p.damping, p.stiffness), p.omega)
    fresh, order = gap == 0, 0
    while t <= until and len(found) < max_events:
        if fresh and rate >= 0:
            a = _forced(p, mpf(1), p.zeta, mpf(1), 0, (t, x, v), 12)
            b = _free(p, x + side * p.d, u, 12)
            own = [side * (m - n) for m, n in zip(a, b, strict=True)]
            push = -2 * own[2]
            if rate > 0:
                order = 1
                sticks = rate < burst_floor and p.r < 1 and push > 0
                sticks = sticks and 6000 * abs(own[3]) * rate <= push**2 * (1 - p.r)
            else:
                order = 2 + lowest_order(own[2:])
                sticks = own[order] < 0
            if sticks:
                v = (v + p.mu * u) / (1 + p.mu)
                span = 2 * rate / (push * (1 - p.r)) if rate > 0 else mpf(0)
                t, x, v = _stuck(p, t, x, v, side, span)
                if t > until:
                    break
                found.append(Event(t, "stick", side, mpf(0), x, v))
                ended = _release(p, t, x, v, side, until)
                if ended is None:
                    break
                t, x, v = ended
                found.append(Event(t, "release", side, mpf(0), x, v))
                gap, rate, u, order, fresh = mpf(0), mpf(0), v, 3, False
                continue
        step = PANEL / fast
        if order == 1 and push > 0:
            step = min(step, 4 * rate / push)
        count = term_count(step * fast)
        a = _forced(p, mpf(1), p.zeta, mpf(1), 0, (t, x, v), count)
        b = _free(p, x + side * (p.d - gap), u, count)
        own = [gap, rate] + [side * (m - n) for m, n in zip(a[2:], b[2:], strict=True)]
        own[:order] = [mpf(0)] * order
        other = [2 * p.d - own[0]] + [-value for value in own[1:]]
        hit_own = first_root(own[order:], step, absolute=order == 0)
        hit_other = first_root(other, step if hit_own is None else hit_own, absolute=True)
        tau = hit_other if hit_other is not None else hit_own
        span = step if tau is None else tau
        x, v = horner(a, span)
        gap, rate = horner(own, span)
        u = v - side * rate
        t, order, fresh = t + span, 0, False
        if tau is None or t > until:
            continue
        if hit_other is not None:
            side, rate = -side, -rate
        speed = max(-rate, mpf(0))
        v += p.mu * (1 + p.r) / (1 + p.mu) * side * speed
        gap, rate = mpf(0), p.r * speed
        u = v - side * rate
        fresh = True
        found.append(Event(t, "impact", side, speed, x, v))
    return found


def _sticking(p, start, side, count):
    return _forced(
        p,
        1 + p.mu,
        p.zeta + p.damping,
        1 + p.stiffness,
        p.stiffness * side * p.d,
        start,
        count,
    )


def _stuck(p, t, x, v, side, span):
    fast = max(_rate(1 + p.mu, p.zeta + p.damping, 1 + p.stiffness), p.omega)
    c = _sticking(p, (t, x, v), side, term_count(span * fast) + 4)
    return (t + span, *horner(c, span))


def _release(p, t, x, v, side, until):
    fast = max(_rate(1 + p.mu, p.zeta + p.damping, 1 + p.stiffness), p.omega)
    step = PANEL / fast
    count = term_count(mpf(PANEL)) + 4
    fresh = True
    while t <= until:
        c = _sticking(p, (t, x, v), side, count)
        # The wall's force, from the equation of the free mass.
        force = [
            -side
            * (
                p.mu * (n + 2) * (n + 1) * c[n + 2]
                + 2 * p.damping * (n + 1) * c[n + 1]
                + p.stiffness * (c[n] + (side * p.d if n == 0 else 0))
            )
            for n in range(count - 2)
        ]
        order = lowest_order(force) if fresh else 0
        if order == 0 and fresh and force[0] < 0:
            return t, x, v
        tau = first_root(force[order:], step, absolute=True)
        span = step if tau is None else tau
        x, v = horner(c, span)
        t += span
        if tau is not None:
            return (t, x, v) if t <= until else None
        fresh = False
    return None

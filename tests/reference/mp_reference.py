"""Events of the rigid impact damper in arbitrary precision.

The primary obeys ``m x'' + 2 zeta x' + x = sin(omega t + phase)`` with ``m = 1`` in flight and
``m = 1 + mu`` while the masses stick. On each short panel the solution is its Taylor series (it is
entire, so one code serves every damping ratio, resonance included). The gap to the wall that was
touched last is carried as a quantity of its own, ``g`` and ``g'``, and its series is taken relative
to that wall; a bounce of height 1e-50 therefore loses no digits. Impacts are found by steps that a
bound on the second derivative over the panel proves unable to pass a root.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import NamedTuple

from mpmath import mp, mpf

GUARD_DIGITS = 15
PANEL = 3  # panel length times the fastest rate


class Event(NamedTuple):
    """One event; ``x`` and ``v`` are those of the primary just after it.

    ``side`` is +1 (right wall) or -1 (left wall); ``approach_speed`` is 0 unless ``kind`` is
    ``"impact"``. The other kinds are ``"stick"`` and ``"release"``.
    """

    time: mpf
    kind: str
    side: int
    approach_speed: mpf
    x: mpf
    v: mpf


class Parameters(NamedTuple):
    """Parameters of the rigid model as ``mpf``."""

    mu: mpf
    zeta: mpf
    omega: mpf
    d: mpf
    r: mpf
    phase: mpf


class Hit(NamedTuple):
    """End of a flight: the state just before an impact."""

    time: mpf
    side: int
    approach_speed: mpf
    x: mpf
    v: mpf


def fastest_rate(p: Parameters, inertia: mpf) -> mpf:
    """Return the largest modulus of the rates of the flow (free roots and forcing)."""
    disc = p.zeta**2 - inertia
    free = (p.zeta + mp.sqrt(disc)) / inertia if disc > 0 else 1 / mp.sqrt(inertia)
    return max(free, p.omega)


def term_count(rate_times_step: mpf) -> int:
    """Return how many Taylor terms bring the remainder below the working precision."""
    term, n = mpf(1), 0
    while term > mp.eps:
        n += 1
        term *= rate_times_step / n
    return n + 6


def taylor(p: Parameters, inertia: mpf, t: mpf, x: mpf, v: mpf, count: int) -> list[mpf]:
    """Return the Taylor coefficients of the primary's position about time ``t``.

    Parameters
    ----------
    p : Parameters
        The model.
    inertia : mpf
        1 in flight, ``1 + mu`` in sticking.
    t, x, v : mpf
        Time, position and velocity at the expansion point.
    count : int
        Number of coefficients.

    Returns
    -------
    list of mpf
        ``c[n]`` with ``x(t + tau) = sum c[n] tau**n``.
    """
    angle = p.omega * t + p.phase
    cycle = (mp.sin(angle), mp.cos(angle), -mp.sin(angle), -mp.cos(angle))
    c = [x, v]
    scale = mpf(1)  # omega**n / n!
    for n in range(count - 2):
        rest = scale * cycle[n % 4] - 2 * p.zeta * (n + 1) * c[n + 1] - c[n]
        c.append(rest / (inertia * (n + 1) * (n + 2)))
        scale *= p.omega / (n + 1)
    return c


def horner(c: Sequence[mpf], tau: mpf) -> tuple[mpf, mpf]:
    """Return value and first derivative of the polynomial with coefficients ``c``."""
    value, slope = mpf(0), mpf(0)
    for coefficient in reversed(c):
        slope = slope * tau + value
        value = value * tau + coefficient
    return value, slope


def skip_ahead(q: Sequence[mpf], end: mpf) -> mpf | None:
    """Return a point of ``[0, end]`` that no root precedes, or None if there is none at all.

    The same steps as in `first_root`, in double precision on coefficients scaled to ``[0, 1]``;
    each value is lowered by more than its rounding error, so the result is just as certain.
    """
    scaled, power = [], mpf(1)
    for value in q:
        scaled.append(value * power)
        power *= end
    size = max(abs(value) for value in scaled)
    if size == 0:
        return mpf(0)
    b = [float(value / size) for value in scaled]
    error = 1e-13 * sum((n + 1) * abs(value) for n, value in enumerate(b))
    bound = 1.0001 * sum(n * (n - 1) * abs(value) for n, value in enumerate(b)) + 1e-12
    tau = 0.0
    while tau < 1:
        value = slope = 0.0
        for coefficient in reversed(b):
            slope = slope * tau + value
            value = value * tau + coefficient
        value, slope = value - error, slope - error
        if value < 1e-4:
            return tau * end
        root = math.sqrt(slope**2 + 2 * bound * value)
        step = (root + slope) / bound if slope > 0 else 2 * value / (root - slope)
        tau += 0.999 * step
    return None


def first_root(q: Sequence[mpf], end: mpf, absolute: bool) -> mpf | None:
    """Return the first root of a polynomial in ``(0, end]``, or None.

    ``q`` is positive at 0 (or zero and about to leave the positive side). With ``|q''| <= B`` on
    the panel, ``q(tau + s) >= q + q' s - B s**2 / 2``; the step to the zero of that parabola cannot
    pass a root and converges quadratically to a simple one.

    Parameters
    ----------
    q : sequence of mpf
        Coefficients.
    end : mpf
        End of the search.
    absolute : bool
        Also accept an error that is small against ``end`` (not only against the root).
    """
    start = skip_ahead(q, end)
    if start is None:
        return None
    bound = mpf(0)
    for n in range(len(q) - 1, 1, -1):
        bound = bound * end + n * (n - 1) * abs(q[n])
    tolerance = 1000 * mp.eps
    tau = start
    while True:
        value, slope = horner(q, tau)
        if value <= 0 and slope <= 0:
            return tau
        value = max(value, mpf(0))
        root = mp.sqrt(slope**2 + 2 * bound * value)
        if slope > 0:
            if bound == 0:
                return None
            step = (root + slope) / bound
        elif root == slope:  # a positive constant
            return None
        else:
            step = 2 * value / (root - slope)
        if tau + step > end:
            return None
        tau += step
        if step <= tolerance * (end if absolute else tau):
            return tau


def lowest_order(c: Sequence[mpf]) -> int:
    """Return the index of the first coefficient that is not zero."""
    return next((n for n, value in enumerate(c) if value != 0), len(c))


def fly(
    p: Parameters,
    state: tuple[mpf, mpf, mpf],
    side: int,
    gap: tuple[mpf, mpf],
    until: mpf,
    order: int = 0,
) -> Hit | None:
    """Follow one flight up to the next impact on either wall.

    Parameters
    ----------
    p : Parameters
        The model.
    state : tuple
        Time, position and velocity of the primary.
    side : int
        Wall that ``gap`` refers to.
    gap : tuple
        Gap and its rate.
    until : mpf
        Give up when a panel starts after this time.
    order : int
        The gap and its derivatives below this order are exactly zero at the start.

    Returns
    -------
    Hit or None
        None when ``until`` is passed.
    """
    t, x, v = state
    g, rate = gap
    longest = PANEL / fastest_rate(p, mpf(1))
    while t <= until:
        step = longest
        if order == 1:  # a bounce: panel of about twice the flight time, if that is short
            inwards = -side * (mp.sin(p.omega * t + p.phase) - 2 * p.zeta * v - x)
            if inwards > 0:
                step = min(step, 4 * rate / inwards)
        c = taylor(p, mpf(1), t, x, v, term_count(PANEL * step / longest))
        own = [g, rate] + [side * value for value in c[2:]]
        own[:order] = [mpf(0)] * order
        other = [2 * p.d - own[0]] + [-value for value in own[1:]]
        hit_own = first_root(own[order:], step, absolute=order == 0)
        hit_other = first_root(other, step if hit_own is None else hit_own, absolute=True)
        tau = hit_other if hit_other is not None else hit_own
        span = step if tau is None else tau
        x, v = horner(c, span)
        g, rate = horner(own, span)
        t, order = t + span, 0
        if tau is not None:
            hit = -side if hit_other is not None else side
            speed = max(-rate if hit == side else rate, mpf(0))
            return Hit(t, hit, speed, x, v) if t <= until else None
    return None


def stick_flow(p: Parameters, t: mpf, x: mpf, v: mpf, span: mpf) -> tuple[mpf, mpf]:
    """Return position and velocity after ``span`` of sticking (``span`` short)."""
    inertia = 1 + p.mu
    c = taylor(p, inertia, t, x, v, term_count(span * fastest_rate(p, inertia)))
    return horner(c, span)


def stick_until_release(
    p: Parameters, t: mpf, x: mpf, v: mpf, side: int, until: mpf
) -> tuple[mpf, mpf, mpf] | None:
    """Return time, position and velocity where ``x'' = 0`` ends sticking, or None if too late."""
    inertia = 1 + p.mu
    step = PANEL / fastest_rate(p, inertia)
    count = term_count(mpf(PANEL))
    fresh = True
    while t <= until:
        c = taylor(p, inertia, t, x, v, count)
        thrust = [-side * n * (n - 1) * c[n] for n in range(2, count)]
        order = lowest_order(thrust) if fresh else 0
        tau = first_root(thrust[order:], step, absolute=True)
        span = step if tau is None else tau
        x, v = horner(c, span)
        t += span
        if tau is not None:
            return (t, x, v) if t <= until else None
        fresh = False
    return None


def events(
    mass_ratio: float,
    damping_ratio: float,
    frequency_ratio: float,
    clearance: float,
    restitution: float,
    phase: float = 0.0,
    state: Sequence[float] = (0, 0, 0, 0),
    *,
    until: float,
    dps: int = 50,
    max_impacts: int | None = None,
    burst_floor: float = 1e-25,
    start_time: float = 0.0,
) -> list[Event]:
    """Return every event of the rigid impact damper up to a time.

    Parameters
    ----------
    mass_ratio, damping_ratio, frequency_ratio, clearance, restitution, phase : float or mpf
        The model; floats count as the exact binary values they are.
    state : sequence
        ``(x, v, y, u)``: position and velocity of the primary, then of the free mass.
    until : float
        Events later than this are left out.
    dps : int
        Decimal digits wanted.
    max_impacts : int, optional
        Stop after this many impacts.
    burst_floor : float
        Bounces are resolved one by one until the rebound speed is below this; the rest of the
        burst then takes ``2 w / (a (1 - r))``, with an error of the order of ``burst_floor**2``.
    start_time : float
        Time of ``state``.

    Returns
    -------
    list of Event
        In order of time. A start at rest relative to a wall that sticks gives a ``"stick"`` event
        at once, but no impact. With no clearance there are no events.
    """
    with mp.workdps(dps + GUARD_DIGITS):
        p = Parameters(
            *(
                mpf(value)
                for value in (
                    mass_ratio,
                    damping_ratio,
                    frequency_ratio,
                    clearance,
                    restitution,
                    phase,
                )
            )
        )
        if p.d == 0:
            return []
        return _run(p, state, mpf(start_time), mpf(until), max_impacts, mpf(burst_floor))


def _run(
    p: Parameters,
    state: Sequence[float],
    t: mpf,
    until: mpf,
    max_impacts: int | None,
    burst_floor: mpf,
) -> list[Event]:
    """Do the work of `events` at the precision that is set."""
    x, v, y, u = (mpf(value) for value in state)
    side = 1 if y >= x else -1
    g, w = p.d - side * (y - x), side * (v - u)
    if g < 0:
        raise ValueError("the free mass starts outside its box")
    found: list[Event] = []
    hits = 0
    limit = float("inf") if max_impacts is None else max_impacts
    hit: Hit | None
    if g > 0:
        hit = fly(p, (t, x, v), side, (g, w), until)
    elif w < 0:
        hit = Hit(t, side, -w, x, v)
    else:
        hit = None

    on_wall = g == 0 and w >= 0  # just after contact on `side`, rate of the gap w >= 0
    while hits < limit and (on_wall or hit is not None):
        if hit is not None:
            t, side, speed, x, v = hit
            v += p.mu * (1 + p.r) / (1 + p.mu) * side * speed
            w = p.r * speed
            found.append(Event(t, "impact", side, speed, x, v))
            hits += 1
            if hits >= limit:
                break
        hit, on_wall = None, False

        ahead = taylor(p, mpf(1), t, x, v, 12)
        a, j = -2 * side * ahead[2], 6 * side * ahead[3]
        if w > 0:
            sticks = w < burst_floor and p.r < 1 and a > 0 and 1000 * abs(j) * w <= a**2 * (1 - p.r)
            order = 1
        else:
            order = 2 + lowest_order(ahead[2:])
            sticks = order < len(ahead) and side * ahead[order] < 0
        if not sticks:
            hit = fly(p, (t, x, v), side, (mpf(0), w), until, order)
            continue

        span = 2 * w / (a * (1 - p.r)) if w > 0 else mpf(0)
        v -= p.mu / (1 + p.mu) * side * w  # common velocity (x' + mu y') / (1 + mu)
        if span > 0:
            x, v = stick_flow(p, t, x, v, span)
        t += span
        if t > until:
            break
        found.append(Event(t, "stick", side, mpf(0), x, v))
        released = stick_until_release(p, t, x, v, side, until)
        if released is None:
            break
        t, x, v = released
        found.append(Event(t, "release", side, mpf(0), x, v))
        hit = fly(p, (t, x, v), side, (mpf(0), mpf(0)), until, order=3)
    return found

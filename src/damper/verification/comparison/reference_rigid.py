"""Motion of the rigid impact damper in arbitrary precision.

The primary obeys ``m x'' + 2 zeta x' + x = sin(omega t + phase)`` with ``m = 1`` in flight and
``m = 1 + mu`` while the masses stick. On each short panel the solution is its Taylor series (it is
entire, so one code serves every damping ratio, resonance included). The gap to the wall that was
touched last is carried as a quantity of its own, ``g`` and ``g'``, and its series is taken relative
to that wall; a bounce of height 1e-50 therefore loses no digits. Impacts are found by steps that a
bound on the second derivative over the panel proves unable to pass a root.
"""

import math
from collections.abc import Sequence
from typing import Any, NamedTuple

from mpmath import mp, mpf

from damper.verification.comparison.reference_series import (
    first_root,
    horner,
    lowest_order,
    term_count,
)

GUARD_DIGITS = 15
PANEL = 3  # panel length times the fastest rate
#: Digits beyond those asked for to which the tail of a burst is closed.
TAIL_DIGITS = 10


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


class PreciseParameters(NamedTuple):
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


class FlightState(NamedTuple):
    """Where a flight is: the primary, and the gap to one wall with its rate."""

    x: mpf
    v: mpf
    side: int
    gap: mpf
    rate: mpf


class ReferenceRun(NamedTuple):
    """Events in order of time, and ``(x, v, y, u)`` at the end."""

    events: list[Event]
    final: tuple[mpf, ...]


def events(
    mass_ratio: float,
    damping_ratio: float,
    frequency_ratio: float,
    clearance: float,
    restitution: float,
    phase: float = 0.0,
    state: Sequence[float] = (0, 0, 0, 0),
    **settings: Any,
) -> list[Event]:
    """Return every event that `run` finds, of a damper and state ``(x, v, y, u)``.

    A start at rest relative to a wall that sticks gives a ``"stick"`` event at once, but no impact.
    With no clearance there are no events.
    """
    numbers = (mass_ratio, damping_ratio, frequency_ratio, clearance, restitution, phase)
    return run(numbers, state, **settings).events


def run(
    numbers: Sequence[float],
    state: Sequence[float],
    *,
    until: float,
    dps: int = 50,
    max_impacts: int | None = None,
    burst_floor: float = math.inf,
    start_time: float = 0.0,
) -> ReferenceRun:
    """Return every event up to a time, and the state then; ValueError for a start outside the box.

    `numbers` are mu, zeta, omega, d, r, phase, exact as they are; the state is ``(x, v, y, u)``.
    After `max_impacts` the final state is the one after the last of these. Bounces are resolved one
    by one at least until the rebound speed is below `burst_floor`, and until the formula that
    closes the rest is exact to the digits wanted; see `_tail`.
    """
    with mp.workdps(dps + GUARD_DIGITS):
        p = PreciseParameters(*(mpf(value) for value in numbers))
        x, v, y, u = (mpf(value) for value in state)
        walk = _RigidSolution(p, mpf(start_time), mpf(until), dps, mpf(burst_floor))
        return walk.run(x, v, y, u, max_impacts)


class _RigidSolution:
    """One run at the precision that is set."""

    def __init__(self, p: PreciseParameters, t: mpf, until: mpf, dps: int, floor: mpf) -> None:
        self.p, self.t, self.until, self.dps, self.floor = p, t, until, dps, floor
        self.found: list[Event] = []

    def run(self, x: mpf, v: mpf, y: mpf, u: mpf, max_impacts: int | None) -> ReferenceRun:
        """Go from event to event."""
        p = self.p
        side = 1 if y >= x else -1
        gap, rate = p.d - side * (y - x), side * (v - u)
        if gap < 0:
            raise ValueError("the free mass starts outside its box")
        if p.d == 0:
            common = (v + p.mu * u) / (1 + p.mu)
            _, _, x, v = _slide(p, self.t, x, common, 0, self.until)
            return ReferenceRun([], (x, v, x, v))
        hits, order = 0, 0
        pair = FlightState(x, v, side, gap, rate)
        hit = Hit(self.t, side, -rate, x, v) if gap == 0 and rate < 0 else None
        settled = gap > 0
        while True:
            if hit is not None:
                pair = self._bounce(hit)
                hits += 1
                settled = False
            if hits == max_impacts:
                break
            if not settled:  # on the wall: does it stay there?
                order, span = self._tail(pair)
                if span is not None:
                    pair, released = self._stick(pair, span)
                    if not released:
                        break
                    order = 3
            settled = True
            hit, pair = advance_flight(p, self.t, pair, self.until, order)
            if hit is None:
                break
            self.t, order = hit.time, 0
        x, v, side = pair.x, pair.v, pair.side
        final = (x, v, x + side * (p.d - pair.gap), v - side * pair.rate)
        return ReferenceRun(self.found, final)

    def _bounce(self, hit: Hit) -> FlightState:
        """Impact: the state just after it."""
        p, (t, side, speed, x, v) = self.p, hit
        v += p.mu * (1 + p.r) / (1 + p.mu) * side * speed
        self.found.append(Event(t, "impact", side, speed, x, v))
        return FlightState(x, v, side, mpf(0), p.r * speed)

    def _tail(self, pair: FlightState) -> tuple[int, mpf | None]:
        """Order of the gap's first term after an impact, and the time to sticking if that is near.

        With the rebound speed w, a = -g'' and j = g''' the bounces that are left last

            T + (4/3) j w**2 / (a**3 (1-r)**2) - 4 zeta mu r w**2 / ((1+mu) a**2 (1-r)**2),

        T = 2 w / (a (1-r)), up to terms of the order T (rho T)**2, where rho is the rate at which
        things change. Up to the same order the pair then is where it would be had it stuck at once
        with its common velocity. So the tail is closed where that order is below the last digit.
        Right at `until` it is not, as long as there is anything left of it.
        """
        p, (x, v, side, _, w) = self.p, pair
        ahead = taylor(p, mpf(1), self.t, x, v, 12)
        a, j = -2 * side * ahead[2], 6 * side * ahead[3]
        if w == 0:
            order, falls = first_order(p, self.t, pair)
            return order, mpf(0) if falls else None
        if not (p.r < 1 and a > 0 and w < self.floor):
            return 1, None
        first = 2 * w / (a * (1 - p.r))
        rate = max(mpf(1), p.omega, 2 * p.zeta)
        for n in range(3, 7):
            rate = max(rate, (mp.factorial(n) * abs(ahead[n]) / a) ** (mpf(1) / (n - 2)))
        last = mpf(10) ** -(self.dps + TAIL_DIGITS)
        if not max(1, a) * first * (rate * first) ** 2 < last:
            return 1, None
        span = first + first**2 * (j / (3 * a) - p.zeta * p.mu * p.r / (1 + p.mu))
        if self.t + span > self.until and w > mpf(10) ** -self.dps:
            return 1, None
        return 1, span

    def _stick(self, pair: FlightState, span: mpf) -> tuple[FlightState, bool]:
        """Follow the end of a burst, and sticking; whether it ends in time."""
        p, (x, v, side, _, w) = self.p, pair
        v -= p.mu / (1 + p.mu) * side * w  # common velocity (x' + mu y') / (1 + mu)
        released = False
        if self.t + span <= self.until:
            if span > 0:
                x, v = stick_flow(p, self.t, x, v, span)
            self.t += span
            self.found.append(Event(self.t, "stick", side, mpf(0), x, v))
            released, self.t, x, v = _slide(p, self.t, x, v, side, self.until)
            if released:
                self.found.append(Event(self.t, "release", side, mpf(0), x, v))
        return FlightState(x, v, side, mpf(0), mpf(0)), released


def first_order(p: PreciseParameters, t: mpf, pair: FlightState) -> tuple[int, bool]:
    """Order of the first term of the gap that is not zero in a flight from a wall at rest on it.

    And whether that term is negative, so that there can be no such flight.
    """
    ahead = taylor(p, mpf(1), t, pair.x, pair.v, 12)
    order = 2 + lowest_order(ahead[2:])
    return order, order < len(ahead) and pair.side * ahead[order] < 0


def fastest_rate(p: PreciseParameters, inertia: mpf) -> mpf:
    """Return the largest modulus of the rates of the flow (free roots and forcing)."""
    disc = p.zeta**2 - inertia
    free = (p.zeta + mp.sqrt(disc)) / inertia if disc > 0 else 1 / mp.sqrt(inertia)
    return max(free, p.omega)


def taylor(p: PreciseParameters, inertia: mpf, t: mpf, x: mpf, v: mpf, count: int) -> list[mpf]:
    """Return c[n] in ``x(t + tau) = sum c[n] tau**n`` of the primary; inertia 1, or 1 + mu."""
    angle = p.omega * t + p.phase
    cycle = (mp.sin(angle), mp.cos(angle), -mp.sin(angle), -mp.cos(angle))
    c = [x, v]
    scale = mpf(1)  # omega**n / n!
    for n in range(count - 2):
        rest = scale * cycle[n % 4] - 2 * p.zeta * (n + 1) * c[n + 1] - c[n]
        c.append(rest / (inertia * (n + 1) * (n + 2)))
        scale *= p.omega / (n + 1)
    return c


def fly(
    p: PreciseParameters,
    state: tuple[mpf, mpf, mpf],
    side: int,
    gap: tuple[mpf, mpf],
    until: mpf,
    order: int = 0,
) -> Hit | None:
    """Follow one flight from (time, x, v) up to the next impact on either wall, if before `until`.

    `gap` is that to the wall `side`, and its rate; its derivatives below `order` are exactly zero.
    """
    t, x, v = state
    return advance_flight(p, t, FlightState(x, v, side, *gap), until, order)[0]


def advance_flight(
    p: PreciseParameters, t: mpf, pair: FlightState, until: mpf, order: int
) -> tuple[Hit | None, FlightState]:
    """Return what `fly` does, and the state at the impact or at ``until``."""
    x, v, side, g, rate = pair
    longest = PANEL / fastest_rate(p, mpf(1))
    while t < until:
        step = min(longest, until - t)
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
        t = until if span == until - t else t + span
        order = 0
        if tau is not None:
            hit = -side if hit_other is not None else side
            speed = max(-rate if hit == side else rate, mpf(0))
            return Hit(t, hit, speed, x, v), FlightState(x, v, side, g, rate)
    return None, FlightState(x, v, side, g, rate)


def stick_flow(p: PreciseParameters, t: mpf, x: mpf, v: mpf, span: mpf) -> tuple[mpf, mpf]:
    """Return position and velocity after ``span`` of sticking (``span`` short)."""
    inertia = 1 + p.mu
    c = taylor(p, inertia, t, x, v, term_count(span * fastest_rate(p, inertia)))
    return horner(c, span)


def _slide(
    p: PreciseParameters, t: mpf, x: mpf, v: mpf, side: int, until: mpf
) -> tuple[bool, mpf, mpf, mpf]:
    """Sticking up to the release or to ``until``; no side, no release."""
    inertia = 1 + p.mu
    longest = PANEL / fastest_rate(p, inertia)
    count = term_count(mpf(PANEL))
    fresh = True
    while t < until:
        step = min(longest, until - t)
        c = taylor(p, inertia, t, x, v, count)
        tau = None
        if side:
            force = [-side * n * (n - 1) * c[n] for n in range(2, count)]
            order = lowest_order(force) if fresh else 0
            tau = first_root(force[order:], step, absolute=True)
        span = step if tau is None else tau
        x, v = horner(c, span)
        t = until if span == until - t else t + span
        if tau is not None:
            return True, t, x, v
        fresh = False
    return False, t, x, v

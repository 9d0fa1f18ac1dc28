"""The rigid damper a second time in many digits: exponentials, brackets, extrapolation.

Nothing is shared with `damper.verification.comparison.reference_rigid`. The motion between events
is a sum of exponentials in absolute coordinates; events are bracketed on a grid (double crossings
by the rate's change of sign) and found by `mpmath.findroot`; a complete burst is followed for some
bounces and its end extrapolated: after n bounces time, place and common velocity differ from their
limits by a power series in r**n, of which Richardson's scheme removes term by term.
"""

from __future__ import annotations

from collections.abc import Callable
from itertools import pairwise
from typing import NamedTuple

from mpmath import mp, mpf

#: Grid of the search for brackets, over the fastest rate.
GRID = mpf("0.04")
#: Bounces that an extrapolation uses, and the reach of the first (time left times fastest rate).
BOUNCES, REACH = 17, mpf("1e-4")


class Found(NamedTuple):
    """One event, as in the implementation under test."""

    time: mpf
    kind: str
    side: int
    speed: mpf


class Flow:
    """m x'' + 2 zeta x' + x = sin(omega t + phase) from (t, x, v)."""

    def __init__(self, numbers: tuple, inertia: mpf, t: mpf, x: mpf, v: mpf) -> None:
        _, self.zeta, self.omega, _, _, self.phase = numbers
        self.m, self.t, self.x, self.v = inertia, t, x, v
        root = mp.sqrt(mp.mpc(self.zeta**2 - inertia))
        self.rates = (-self.zeta - root) / inertia, (-self.zeta + root) / inertia
        s = 1j * self.omega
        self.impedance = inertia * s**2 + 2 * self.zeta * s + 1
        p, p1 = self._steady(mpf(0))
        self.h, self.h1 = x - p, v - p1

    def _steady(self, tau: mpf) -> tuple[mpf, mpf]:
        angle = self.omega * (self.t + tau) + self.phase
        if self.impedance == 0:  # resonance without damping
            ratio = self.omega / 2
            x = -ratio * tau * mp.cos(angle)
            return x, ratio * (self.omega * tau * mp.sin(angle) - mp.cos(angle))
        z = mp.expj(angle) / self.impedance
        return mp.im(z), mp.im(1j * self.omega * z)

    def at(self, tau: mpf) -> tuple[mpf, mpf]:
        """Place and velocity after a time."""
        a, b = self.rates
        p, p1 = self._steady(tau)
        if a == b:
            slope = self.h1 - a * self.h
            both = mp.exp(a * tau)
            x = both * (self.h + slope * tau)
            return p + mp.re(x), p1 + mp.re(a * x + both * slope)
        first = (self.h1 - b * self.h) / (a - b) * mp.exp(a * tau)
        second = (self.h1 - a * self.h) / (b - a) * mp.exp(b * tau)
        return p + mp.re(first + second), p1 + mp.re(a * first + b * second)

    def push(self, tau: mpf) -> mpf:
        """Acceleration."""
        x, v = self.at(tau)
        force = mp.sin(self.omega * (self.t + tau) + self.phase)
        return (force - 2 * self.zeta * v - x) / self.m

    def jerk(self, tau: mpf) -> mpf:
        """Its rate."""
        force = self.omega * mp.cos(self.omega * (self.t + tau) + self.phase)
        return (force - 2 * self.zeta * self.push(tau) - self.at(tau)[1]) / self.m

    @property
    def fastest(self) -> mpf:
        """Fastest rate."""
        return max(abs(self.rates[0]), self.omega)


class Gap(NamedTuple):
    """Gap to a wall in a flight."""

    flow: Flow
    wall: int
    d: mpf
    y: mpf
    u: mpf

    def value(self, tau: mpf) -> mpf:
        """The gap."""
        return self.d - self.wall * (self.y + self.u * tau - self.flow.at(tau)[0])

    def rate(self, tau: mpf) -> mpf:
        """Its rate."""
        return self.wall * (self.flow.at(tau)[1] - self.u)


class Thrust(NamedTuple):
    """What the wall pushes with in sticking, over mu."""

    flow: Flow
    wall: int

    def value(self, tau: mpf) -> mpf:
        """The thrust."""
        return -self.wall * self.flow.push(tau)

    def rate(self, tau: mpf) -> mpf:
        """Its rate."""
        return -self.wall * self.flow.jerk(tau)


def first_crossing(
    watched: Gap | Thrust, begin: mpf, step: mpf, widest: mpf, end: mpf
) -> mpf | None:
    """First zero of a function that is positive after 0, on a grid that widens."""
    value, rate = watched.value, watched.rate
    low, steps = begin, 0
    while low < end:
        high = min(low + step, end)
        with mp.workdps(40):
            crossed = value(high) <= 0
            turned = not crossed and rate(low) < 0 < rate(high)
        if turned:
            lowest = mp.findroot(rate, (low, high), solver="anderson", verify=False)
            crossed = value(lowest) <= 0
            high = lowest if crossed else high
        if crossed:
            return mp.findroot(value, (low, high), solver="anderson", verify=False)
        low = high
        steps += 1
        if steps > 12:
            step = min(2 * step, widest)
    return None


def extrapolate(values: list, ratio: mpf) -> mpf:
    """Limit of a sequence whose n-th member is a power series in ratio**n."""
    row = list(values)
    for order in range(1, len(row)):
        q = ratio**order
        row = [(b - q * a) / (1 - q) for a, b in pairwise(row)]
    return row[0]


def run(
    numbers: tuple,
    state: tuple,
    until: float,
    digits: int = 50,
    restitution: Callable[[mpf], mpf] | None = None,
) -> tuple[list, tuple]:
    """Return all events but the last bounces of bursts, and the state at the end.

    Parameters
    ----------
    numbers : tuple
        mu, zeta, omega, d, r, phase.
    state : tuple
        x, v, y, u at time 0; the free mass may be on a wall and approach it or leave it.
    restitution : callable, optional
        Restitution at an approach speed; r for small ones.
    """
    with mp.workdps(2 * digits + 30):
        law = restitution or (lambda speed: mpf(numbers[4]))
        return _run(tuple(map(mpf, numbers)), tuple(map(mpf, state)), mpf(until), law)


def _run(numbers: tuple, state: tuple, until: mpf, law: Callable[[mpf], mpf]) -> tuple[list, tuple]:
    mu, _, _, d, r, _ = numbers
    x, v, y, u = state
    t, found, burst = mpf(0), [], []
    while True:
        flow = Flow(numbers, mpf(1), t, x, v)
        widest = GRID / flow.fastest
        crossings = []
        for wall in (1, -1):
            gap, rate = d - wall * (y - x), wall * (v - u)
            if abs(gap) < mpf(10) ** (20 - mp.dps):  # on it
                if rate < 0:
                    crossings = [(mpf(0), wall)]
                    break
                close = -wall * flow.push(0)
                begin = rate / close if close > 0 else widest
                begin = min(begin, widest) / 4
            else:
                begin = mpf(0)
            step = begin if begin > 0 else widest
            horizon = crossings[0][0] if crossings else until - t
            tau = first_crossing(Gap(flow, wall, d, y, u), begin, step, widest, horizon)
            if tau is not None:
                crossings = [(tau, wall)]
        if not crossings:
            x, v = flow.at(until - t)
            return found, (x, v, y + u * (until - t), u)
        tau, wall = crossings[0]
        t += tau
        x, v = flow.at(tau)
        y = x + wall * d
        speed = wall * (u - v)
        found.append(Found(t, "impact", wall, speed))
        bounce = law(speed)
        v, u = (
            ((1 - mu * bounce) * v + mu * (1 + bounce) * u) / (1 + mu),
            ((1 + bounce) * v + (mu - bounce) * u) / (1 + mu),
        )

        # Is this the tail of a burst?
        here = Flow(numbers, mpf(1), t, x, v)
        a, j = -wall * here.push(0), wall * here.jerk(0)
        left = 2 * bounce * speed / (a * (1 - r)) if r < 1 and a > 0 else mp.inf
        reach = left * max(here.fastest, abs(j) / a if a > 0 else 0)
        same = bool(burst) and burst[-1][3] == wall
        burst = burst if same else []
        common = (v + mu * u) / (1 + mu)
        if reach < REACH and t + left < until:
            burst.append((t, x, common, wall))
        if len(burst) < (1 if r == 0 else BOUNCES):
            continue
        t, x, v = (
            burst[0][:3] if r == 0 else (extrapolate([b[i] for b in burst], r) for i in range(3))
        )
        burst = []
        found.append(Found(t, "stick", wall, mpf(0)))
        flow = Flow(numbers, 1 + mu, t, x, v)
        widest = GRID / flow.fastest
        tau = first_crossing(Thrust(flow, wall), mpf(0), widest, widest, until - t)
        span = until - t if tau is None else tau
        x, v = flow.at(span)
        y, u, t = x + wall * d, v, t + span
        if tau is None:
            return found, (x, v, y, u)
        found.append(Found(t, "release", wall, mpf(0)))
        # Lift-off is of third order: on the wall until the gap has opened for certain.
        flow = Flow(numbers, mpf(1), t, x, v)
        tau = widest / 8
        x, v = flow.at(tau)
        y += u * tau
        t += tau

"""Events of the impact damper with a time-variant free mass in arbitrary precision.

Flights are those of the rigid damper (`damper.verification.comparison.reference_rigid`). While the
masses stick, x and v are Taylor series in panels of a fixed, short length, found by dividing
series: x'' = F / (1 + mu).
"""

from __future__ import annotations

from typing import NamedTuple

from mpmath import mp, mpf

from damper.verification.comparison.reference_rigid import (
    GUARD_DIGITS,
    Event,
    Hit,
    PreciseParameters,
    fly,
    taylor,
)
from damper.verification.comparison.reference_series import first_root, horner, lowest_order


class Mass(NamedTuple):
    """mu(t) = mean (1 + depth cos(omega t / order + phase))."""

    mean: mpf
    depth: mpf
    rate: mpf
    phase: mpf

    def at(self, t: mpf) -> mpf:
        return self.mean * (1 + self.depth * mp.cos(self.rate * t + self.phase))


def panel(p: PreciseParameters, mass: Mass) -> mpf:
    """Length of a panel: a small part of every time there is."""
    least = 1 + mass.mean * (1 - mass.depth)
    pole = mp.acosh((1 + 1 / mass.mean) / mass.depth) / mass.rate
    return min(1 / (2 * p.zeta / least + 1 / mp.sqrt(least) + p.omega), pole / 8)


def together(p: PreciseParameters, mass: Mass, t: mpf, x: mpf, v: mpf, count: int) -> list[mpf]:
    """Taylor coefficients of x about t."""
    angle, force = mass.rate * t + mass.phase, p.omega * t + p.phase
    inertia, drive, size, scale = [], [], mass.mean * mass.depth, mpf(1)
    for n in range(count):
        inertia.append(size * mp.cos(angle + n * mp.pi / 2))
        drive.append(scale * mp.sin(force + n * mp.pi / 2))
        size *= mass.rate / (n + 1)
        scale *= p.omega / (n + 1)
    inertia[0] += 1 + mass.mean
    c, second = [x, v], []
    for n in range(count - 2):
        rest = drive[n] - 2 * p.zeta * (n + 1) * c[n + 1] - c[n]
        rest -= mp.fdot(inertia[1 : n + 1], second[::-1])
        second.append(rest / inertia[0])
        c.append(second[n] / ((n + 1) * (n + 2)))
    return c


def stick(
    p: PreciseParameters, mass: Mass, t: mpf, x: mpf, v: mpf, side: int, until: mpf
) -> tuple[mpf, mpf, mpf, bool]:
    """Time, position and velocity at the release, or at `until`, and whether released."""
    step, fresh = panel(p, mass), True
    count = int(1.3 * mp.dps) + 10
    while True:
        c = together(p, mass, t, x, v, count)
        span = min(step, until - t)
        tau = None
        if side:
            thrust = [-side * n * (n - 1) * c[n] for n in range(2, count)]
            order = lowest_order(thrust) if fresh else 0
            tau = first_root(thrust[order:], span, absolute=True)
        x, v = horner(c, span if tau is None else tau)
        t += span if tau is None else tau
        fresh = False
        if tau is not None or t >= until:
            return t, x, v, tau is not None


def events(
    values: dict[str, float],
    state: tuple[float, ...] = (0, 0, 0, 0),
    *,
    until: float,
    dps: int = 40,
    max_events: int = 10**6,
    floor: float = 1e-20,
) -> list[Event]:
    """Every event up to a time, each impact of a burst down to the rebound speed `floor`."""
    with mp.workdps(dps + GUARD_DIGITS):
        p, mass = model(values)
        until = mpf(until)
        t, (x, v, y, u) = mpf(0), (mpf(value) for value in state)
        side = 1 if y >= x else -1
        hit = fly(p, (t, x, v), side, (p.d - side * (y - x), side * (v - u)), until)
        found: list[Event] = []
        while hit is not None and len(found) < max_events:
            t, side, speed, x, v = hit
            mu = mass.at(t)
            v += mu * (1 + p.r) / (1 + mu) * side * speed
            w = p.r * speed
            found.append(Event(t, "impact", side, speed, x, v))
            ahead = taylor(p, mpf(1), t, x, v, 4)
            push = -2 * side * ahead[2]
            if not (push > 0 and w < floor):
                hit = fly(p, (t, x, v), side, (mpf(0), w), until, 1)
                continue
            span = 2 * w / (push * (1 - p.r))
            v -= mu / (1 + mu) * side * w
            if span > 0:
                t, x, v, _ = stick(p, mass, t, x, v, 0, t + span)
            found.append(Event(t, "stick", side, mpf(0), x, v))
            t, x, v, released = stick(p, mass, t, x, v, side, until)
            if not released:
                break
            found.append(Event(t, "release", side, mpf(0), x, v))
            hit = fly(p, (t, x, v), side, (mpf(0), mpf(0)), until, order=3)
        return found[:max_events]


def burst(values: dict[str, float], start: Hit, rebound: float, dps: int = 40) -> tuple[mpf, ...]:
    """Duration of a burst after an impact, and x and v at its end, bounce by bounce.

    `start` is the state just after the impact on its wall, with the rebound speed `rebound`.
    """
    with mp.workdps(dps + GUARD_DIGITS):
        p, mass = model(values)
        p = p._replace(d=mpf(10) ** 9)
        t, x, v, w = mpf(start.time), mpf(start.x), mpf(start.v), mpf(rebound)
        side = start.side
        while w > mpf(10) ** -22:
            hit = fly(p, (t, x, v), side, (mpf(0), w), mp.inf, 1)
            t, _, speed, x, v = hit
            mu = mass.at(t)
            v += mu * (1 + p.r) / (1 + mu) * side * speed
            w = p.r * speed
        push = -2 * side * taylor(p, mpf(1), t, x, v, 4)[2]
        mu = mass.at(t)
        v -= mu / (1 + mu) * side * w
        span = 2 * w / (push * (1 - p.r))
        t, x, v, _ = stick(p, mass, t, x, v, 0, t + span)
        return t - mpf(start.time), x, v


def model(values: dict[str, float]) -> tuple[PreciseParameters, Mass]:
    """The parameters of `damper.Parameters` as exact numbers."""
    mean, zeta, omega, d, r = (
        mpf(values[name])
        for name in (
            "mass_ratio",
            "damping_ratio",
            "frequency_ratio",
            "clearance",
            "restitution",
        )
    )
    mass = Mass(
        mean,
        mpf(values["modulation_depth"]),
        omega / mpf(values.get("modulation_order", 1)),
        mpf(values.get("modulation_phase", 0)),
    )
    return PreciseParameters(mean, zeta, omega, d, r, mpf(values.get("phase", 0))), mass

"""Events of the damper with walls that give, by an independent solver in absolute coordinates.

`exact_events` steps the linear equations of each regime in arbitrary precision: Taylor series over
steps that are short against the fastest rate, and, in contacts whose oscillation has died, the
matrix exponential over longer ones. It looks for changes of sign at the ends of steps and then
bisects or interpolates; it is not certified.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import NamedTuple

from mpmath import mp, mpf


class Scene(NamedTuple):
    """Parameters; the contact is given by its damping ratio, not by the restitution."""

    mu: float
    zeta: float
    omega: float
    d: float
    k: float
    z: float
    tension: bool
    phase: float = 0.0


class Change(NamedTuple):
    """Start (``"touch"``) or end (``"part"``) of a force between the masses."""

    time: mpf
    kind: str
    side: int
    speed: mpf
    x: mpf
    v: mpf


def contact_numbers(p: Scene, number: Callable) -> tuple:
    """Return damping c and angular frequency of the contact."""
    mu, k = number(p.mu), number(p.k)
    root = mp.sqrt if number is mpf else math.sqrt
    return 2 * number(p.z) * root(k * mu / (1 + mu)), root(k * (1 + mu) / mu)


def exact_events(p: Scene, state: tuple, until: float, digits: int = 40) -> list[Change]:
    """Return all changes of regime up to a time, from ``(x, v, y, u)`` at time 0."""
    return exact_run(p, state, until, digits)[0]


def exact_run(
    p: Scene, state: tuple, until: float, digits: int = 40
) -> tuple[list[Change], list[mpf]]:
    """Return them, and ``(x, v, y, u)`` at the end."""
    with mp.workdps(digits):
        return _exact(p, [mpf(value) for value in state], mpf(until))


def _exact(p: Scene, z: list, until: mpf) -> tuple[list[Change], list[mpf]]:
    mu, zeta, omega, d, k = (mpf(value) for value in p[:5])
    c, frequency = contact_numbers(p, mpf)
    fast = frequency * (1 + 2 * mpf(p.z)) + 2 * zeta + omega + 1
    slow = 1 + 2 * zeta + omega

    def rates(w: list, side: int) -> list:
        x, v, y, u, s, co = w
        force = side * (k * (y - x) + c * (u - v)) if side else 0
        # s (y - x) = d - g: the constant part of the spring is added apart.
        return [
            v,
            s - 2 * zeta * v - x + side * force,
            u,
            -side * force / mu,
            omega * co,
            -omega * s,
        ]

    def flow(w: list, side: int, h: mpf) -> list:
        total, term, n = list(w), list(w), 0
        first = True
        while True:
            n += 1
            term = [h / n * value for value in rates(term, side)]
            if first and side:
                # N = k (s (y - x) - d) + ...: the wall's place enters the first derivative only.
                term[1] += h * side * (-k * d)
                term[3] -= h * side * (-k * d) / mu
            first = False
            total = [a + b for a, b in zip(total, term, strict=True)]
            if n > 4 and max(abs(value) for value in term) < mp.eps * mpf("1e-12"):
                return total

    def gap(w: list, side: int) -> mpf:
        return d - side * (w[2] - w[0])

    def gap_rate(w: list, side: int) -> mpf:
        return -side * (w[3] - w[1])

    def force(w: list, side: int) -> mpf:
        return -(k * gap(w, side) + c * gap_rate(w, side))

    def long_step(w: list, side: int, h: mpf) -> list:
        matrix = mp.matrix(7, 7)
        for j in range(6):
            unit = [mpf(0)] * 6
            unit[j] = mpf(1)
            for i, value in enumerate(rates(unit, side)):
                matrix[i, j] = value
        matrix[1, 6] = -side * k * d
        matrix[3, 6] = side * k * d / mu
        halvings = max(int(mp.log(fast * h, 2)) + 3, 0)
        with mp.extradps(20):
            part = matrix * h / mpf(2) ** halvings
            total, term = mp.eye(7), mp.eye(7)
            for n in range(1, 60):
                term = term * part / n
                total += term
            for _ in range(halvings):
                total = total * total
            out = total * mp.matrix([*w, 1])
        return [out[i] for i in range(6)]

    def locate(w: list, side: int, h: mpf, value: Callable) -> tuple[mpf, list]:
        move = flow if fast * h < 8 or side == 0 else long_step
        low, high = mpf(0), h
        f_low, f_high = value(w), value(move(w, side, h))
        for _ in range(300):
            # Illinois would do; bisection mixed with secants is safe enough here.
            middle = (low * f_high - high * f_low) / (f_high - f_low)
            if not low < middle < high:
                middle = (low + high) / 2
            for point in (middle, (low + high) / 2):
                if not low < point < high:
                    continue
                f = value(move(w, side, point))
                if (f > 0) == (f_low > 0):
                    low, f_low = point, f
                else:
                    high, f_high = point, f
            if high - low < mpf(10) ** (8 - mp.dps) * (1 + high):
                break
        return high, move(w, side, high)

    time = mpf(0)
    w = [*z, mp.sin(mpf(p.phase)), mp.cos(mpf(p.phase))]
    side = 0  # the wall in contact
    below = 0  # the wall below whose surface the free mass flies
    began = parted = time
    changes: list[Change] = []
    while time < until:
        if side == 0:
            # Hops in a burst are short: steps that grow from the end of the last contact on.
            h = min(mpf("0.02") / slow, until - time, max(mpf("0.2") / fast, (time - parted) / 3))
            if below:
                h = min(h, mpf("0.2") / fast)
            after = flow(w, 0, h)
            options = []
            if below:
                wall = below
                if gap(after, wall) > 0:
                    options.append((*locate(w, 0, h, lambda s, q=wall: gap(s, q)), wall, "open"))
                if force(after, wall) > 0:
                    options.append(
                        (*locate(w, 0, h, lambda s, q=wall: -force(s, q)), wall, "again")
                    )
            else:
                for wall in (1, -1):
                    if gap(after, wall) < 0:
                        found = locate(w, 0, h, lambda s, q=wall: gap(s, q))
                        options.append((*found, wall, "touch"))
            if not options:
                time, w = time + h, after
                continue
            late, w, wall, kind = min(options, key=lambda option: option[0])
            time += late
            if kind == "open":
                below = 0
                continue
            side, below, began = wall, 0, time
            changes.append(Change(time, kind, wall, -gap_rate(w, wall), w[0], w[1]))
            continue
        if p.tension:

            def inside(s: list, wall: int = side) -> mpf:
                return -gap(s, wall)
        else:

            def inside(s: list, wall: int = side) -> mpf:
                return force(s, wall)

        rest = p.z * frequency * (time - began) > 200
        h = min(mpf("0.1") / slow if rest else mpf("0.2") / fast, until - time)
        after = (long_step if rest else flow)(w, side, h)
        if inside(after) >= 0:
            time, w = time + h, after
            continue
        late, w = locate(w, side, h, inside)
        time += late
        changes.append(Change(time, "part", side, mpf(0), w[0], w[1]))
        below = side if gap(w, side) < 0 and not p.tension else 0
        side, parted = 0, time
    return changes, w[:4]

"""Brute force in double precision: tiny fixed steps of the exact flow, bisection at the walls.

The flight is one linear system in ``(x, x', y, y', sin, cos)``; a step is its matrix exponential.
Impacts are seen only by the sign of a gap at the ends of the steps, so the step must be small
against every flight: no chatter, no sticking.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from scipy.linalg import expm


class WallHit(NamedTuple):
    """An impact: time, side (+1 right, -1 left) and approach speed."""

    time: float
    side: int
    approach_speed: float


class ChatterError(RuntimeError):
    """The scene chatters, and a brute-force solver has no business there."""


def flight_matrix(damping_ratio: float, frequency_ratio: float) -> np.ndarray:
    """Return the matrix of the flight in ``(x, x', y, y', sin, cos)``."""
    m = np.zeros((6, 6))
    m[0, 1] = 1.0
    m[1, [0, 1, 4]] = -1.0, -2.0 * damping_ratio, 1.0
    m[2, 3] = 1.0
    m[4, 5], m[5, 4] = frequency_ratio, -frequency_ratio
    return m


def collide(v: float, u: float, mass_ratio: float, restitution: float) -> tuple[float, float]:
    """Return both velocities after an impact (momentum kept, relative velocity times -r)."""
    centre = (v + mass_ratio * u) / (1.0 + mass_ratio)
    rebound = -restitution * (u - v)
    share = rebound / (1.0 + mass_ratio)
    return centre - mass_ratio * share, centre + share


def impacts(
    mass_ratio: float,
    damping_ratio: float,
    frequency_ratio: float,
    clearance: float,
    restitution: float,
    phase: float = 0.0,
    state: Sequence[float] = (0.0, 0.0, 0.0, 0.0),
    *,
    until: float,
    step: float = 1e-3,
    block: int = 256,
) -> list[WallHit]:
    """Return the impacts of a scene without chatter.

    Parameters
    ----------
    mass_ratio, damping_ratio, frequency_ratio, clearance, restitution, phase : float
        The model.
    state : sequence of float
        ``(x, v, y, u)`` at time 0, with the free mass inside the box.
    until : float
        Last time of interest.
    step : float
        The fixed step.
    block : int
        Steps taken at a time (for speed only).

    Raises
    ------
    ChatterError
        If a rebound is too slow for the step.
    """
    matrix = flight_matrix(damping_ratio, frequency_ratio)
    one = expm(step * matrix)
    powers = np.empty((block + 1, 6, 6))
    powers[0] = np.eye(6)
    for k in range(block):
        powers[k + 1] = powers[k] @ one

    def full(t: float, x: float, v: float, y: float, u: float) -> np.ndarray:
        angle = frequency_ratio * t + phase
        return np.array([x, v, y, u, np.sin(angle), np.cos(angle)])

    t, z, found = 0.0, full(0.0, *state), []
    while t < until:
        path = powers @ z
        outside = np.abs(path[1:, 2] - path[1:, 0]) > clearance
        if not outside.any():
            t += block * step
            z = full(t, *path[-1, :4])
            continue
        k = int(np.argmax(outside))  # path[k] is inside, path[k + 1] outside
        side = 1 if path[k + 1, 2] > path[k + 1, 0] else -1
        low, high = 0.0, step
        for _ in range(60):
            middle = 0.5 * (low + high)
            trial = expm(middle * matrix) @ path[k]
            if side * (trial[2] - trial[0]) > clearance:
                high = middle
            else:
                low = middle
        x, v, _, u = (expm(low * matrix) @ path[k])[:4]
        t += k * step + low
        if t > until:
            break
        speed = side * (u - v)
        if restitution * speed < 20.0 * step:
            raise ChatterError(f"rebound too slow for the step at t = {t}")
        found.append(WallHit(t, side, speed))
        v, u = collide(v, u, mass_ratio, restitution)
        z = full(t, x, v, x + side * clearance * (1.0 - 1e-15), u)
    return found

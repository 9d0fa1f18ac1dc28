"""``scipy.integrate.solve_ivp`` (DOP853) with events, restarted at each impact; no chatter."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from scipy.integrate import solve_ivp

from .fine_step import ChatterError, WallHit, collide


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
    tolerance: float = 1e-12,
    max_step: float = 0.1,
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
    tolerance : float
        Relative and absolute tolerance.
    max_step : float
        Longest step; events are looked for at the ends of steps.

    Raises
    ------
    ChatterError
        If a rebound is too slow for the longest step.
    """

    def slope(t: float, z: np.ndarray) -> list[float]:
        x, v, _, u = z
        force = np.sin(frequency_ratio * t + phase)
        return [v, force - 2.0 * damping_ratio * v - x, u, 0.0]

    def right(_: float, z: np.ndarray) -> float:
        return clearance - (z[2] - z[0])

    def left(_: float, z: np.ndarray) -> float:
        return clearance + (z[2] - z[0])

    for wall in (right, left):
        wall.terminal = True
        wall.direction = -1

    t, z, found = 0.0, np.array(state, dtype=float), []
    while True:
        run = solve_ivp(
            slope,
            (t, until),
            z,
            method="DOP853",
            rtol=tolerance,
            atol=tolerance,
            events=(right, left),
            max_step=max_step,
        )
        if run.status != 1:
            return found
        side = 1 if run.t_events[0].size else -1
        t, (x, v, _, u) = run.t[-1], run.y[:, -1]
        speed = side * (u - v)
        if restitution * speed < 0.1 * max_step:
            raise ChatterError(f"rebound too slow for the step at t = {t}")
        found.append(WallHit(t, side, speed))
        v, u = collide(v, u, mass_ratio, restitution)
        z = np.array([x, v, x + side * clearance * (1.0 - 1e-15), u])

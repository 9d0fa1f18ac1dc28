"""Closed form of the symmetric orbit with two impacts per forcing cycle.

Just after the right-wall impact the primary is at ``(x0, u+)`` and the free mass leaves with speed
``V`` to the left. Half a period later everything repeats with its sign changed, so the homogeneous
part obeys ``(I + E) h+ = (0, u+ - u-)`` with ``u+ - u- = 2 mu V``.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from scipy.linalg import expm
from scipy.optimize import brentq


def flight_matrix(damping_ratio: float, frequency_ratio: float) -> np.ndarray:
    """Return the matrix of the flight in ``(x, x', y, y', sin, cos)``."""
    m = np.zeros((6, 6))
    m[0, 1] = 1.0
    m[1, [0, 1, 4]] = -1.0, -2.0 * damping_ratio, 1.0
    m[2, 3] = 1.0
    m[4, 5], m[5, 4] = frequency_ratio, -frequency_ratio
    return m


class Coefficients(NamedTuple):
    """Coefficients of ``(s^2 + c^2) V^2 - 2 s d V + d^2 - A^2 = 0``."""

    amplitude: float
    p: float
    q: float
    s: float
    c: float


class TwoImpactOrbit(NamedTuple):
    """One orbit; all values hold at the right-wall impact.

    ``state`` is ``(x, v, y, u)`` just after the impact and ``forcing_phase`` (in ``[0, 2 pi)``) the
    argument of the sine there; a run with ``phase=forcing_phase`` from ``state`` at time 0 is on
    the orbit. ``peak`` is the largest ``|x|``, ``multipliers`` are those of the half cycle.
    """

    speed: float
    x0: float
    velocity_before: float
    velocity_after: float
    approach_speed: float
    response_phase: float
    forcing_phase: float
    state: tuple[float, float, float, float]
    time: float
    peak: float
    admissible: bool
    multipliers: np.ndarray


def coefficients(
    mass_ratio: float, damping_ratio: float, frequency_ratio: float, restitution: float
) -> Coefficients:
    """Return ``A, p, q, s, c``.

    Raises
    ------
    ValueError
        Where ``E + I`` is singular (undamped, ``1 / omega`` odd).
    """
    mu, zeta, omega, r = mass_ratio, damping_ratio, frequency_ratio, restitution
    half = expm(np.pi / omega * np.array([[0.0, 1.0], [-1.0, -2.0 * zeta]]))
    lhs = half + np.eye(2)
    if abs(np.linalg.det(lhs)) < 1e-12:
        raise ValueError("E + I is singular")
    p, q = np.linalg.solve(lhs, [0.0, 1.0])
    amplitude = 1.0 / np.hypot(1.0 - omega**2, 2.0 * zeta * omega)
    s = np.pi / (2.0 * omega) - 2.0 * mu * p
    c = ((2.0 * mu * r - 1.0 + r) / (1.0 + r) - 2.0 * mu * q) / omega
    return Coefficients(float(amplitude), float(p), float(q), float(s), float(c))


def speeds(co: Coefficients, clearance: float) -> list[float]:
    """Return the positive real roots ``V``, largest first."""
    square = co.s**2 + co.c**2
    disc = co.amplitude**2 * square - clearance**2 * co.c**2
    if disc < 0:
        return []
    base, spread = co.s * clearance, np.sqrt(disc)
    roots = {float((base + spread) / square), float((base - spread) / square)}
    return sorted((v for v in roots if v > 0), reverse=True)


def two_impacts(
    mass_ratio: float,
    damping_ratio: float,
    frequency_ratio: float,
    clearance: float,
    restitution: float,
) -> list[TwoImpactOrbit]:
    """Return the orbits with two symmetric impacts per cycle, the faster one first.

    Parameters
    ----------
    mass_ratio, damping_ratio, frequency_ratio, clearance, restitution : float
        The rigid model.

    Returns
    -------
    list of TwoImpactOrbit
        None, one or two; ``admissible`` says whether the free mass stays in its box.
    """
    co = coefficients(mass_ratio, damping_ratio, frequency_ratio, restitution)
    return [
        _orbit(co, speed, mass_ratio, damping_ratio, frequency_ratio, clearance, restitution)
        for speed in speeds(co, clearance)
    ]


def _orbit(
    co: Coefficients, speed: float, mu: float, zeta: float, omega: float, d: float, r: float
) -> TwoImpactOrbit:
    """Return everything about the orbit with free-mass speed ``speed``."""
    x0 = np.pi * speed / (2.0 * omega) - d
    before = -speed * (1.0 - r + 2.0 * mu) / (1.0 + r)
    after = speed * (2.0 * mu * r - 1.0 + r) / (1.0 + r)
    response = float(np.arctan2(co.s * speed - d, co.c * speed))
    forcing = (response + float(np.arctan2(2.0 * zeta * omega, 1.0 - omega**2))) % (2.0 * np.pi)
    state = (x0, after, x0 + d, -speed)
    matrix = flight_matrix(zeta, omega)
    start = np.array([*state, np.sin(forcing), np.cos(forcing)])
    count = 4000
    step = np.pi / omega / count
    one = expm(step * matrix)
    path = [start]
    for _ in range(count):
        path.append(one @ path[-1])
    path = np.array(path)

    def velocity(tau: float, k: int) -> float:
        return float((expm(tau * matrix) @ path[k])[1])

    peak = float(np.max(np.abs(path[:, 0])))
    for k in np.flatnonzero(path[:-1, 1] * path[1:, 1] < 0):
        tau = brentq(velocity, 0.0, step, args=(k,), xtol=1e-15)
        peak = max(peak, abs(float((expm(tau * matrix) @ path[k])[0])))
    inside = np.abs(path[1:-1, 2] - path[1:-1, 0]) <= d * (1.0 + 1e-12)
    return TwoImpactOrbit(
        speed,
        x0,
        before,
        after,
        speed - before,
        response,
        forcing,
        state,
        0.0,
        peak,
        bool(inside.all()) and speed > before,
        _multipliers(path[-1], matrix, mu, r),
    )


def _multipliers(end: np.ndarray, matrix: np.ndarray, mu: float, r: float) -> np.ndarray:
    """Return the half-cycle multipliers from the state just before the left-wall impact."""
    omega = matrix[4, 5]
    jump = np.eye(4)  # (x, v, y, u) over an impact
    jump[1, [1, 3]] = np.array([1.0 - mu * r, mu * (1.0 + r)]) / (1.0 + mu)
    jump[3, [1, 3]] = np.array([1.0 + r, mu - r]) / (1.0 + mu)
    normal = np.array([1.0, 0.0, -1.0, 0.0])  # proportional to the gradient of the gap

    def slope(z: np.ndarray) -> np.ndarray:
        return matrix[:4, :4] @ z + np.array([0.0, end[4], 0.0, 0.0])

    incoming = slope(end[:4])
    outgoing = slope(jump @ end[:4])
    saltation = jump + np.outer(outgoing - jump @ incoming, normal) / (normal @ incoming)
    flow = expm(np.pi / omega * matrix[:4, :4])
    return np.linalg.eigvals(-saltation @ flow)

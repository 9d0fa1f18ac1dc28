"""Accumulation (completion) time of a burst, by brute force in arbitrary precision."""

from __future__ import annotations

from mpmath import mp, mpf

from damper.verification.comparison.reference_rigid import GUARD_DIGITS, PreciseParameters, fly


def accumulation_time(
    mass_ratio: float,
    damping_ratio: float,
    frequency_ratio: float,
    restitution: float,
    *,
    time: float,
    position: float,
    velocity: float,
    rebound_speed: float,
    phase: float = 0.0,
    dps: int = 50,
    burst_floor: float = 1e-25,
) -> mpf:
    """Return the time from an impact on the right wall to sticking, bounce by bounce.

    Parameters
    ----------
    mass_ratio, damping_ratio, frequency_ratio, restitution, phase : float or mpf
        The model. The clearance plays no part.
    time, position, velocity : float or mpf
        Time, position and velocity of the primary just after the impact.
    rebound_speed : float or mpf
        Rate of the gap just after the impact.
    dps, burst_floor
        As in `reference_rigid.run`.

    Returns
    -------
    mpf
        Total duration of the infinitely many flights.

    Raises
    ------
    ValueError
        If the burst does not complete within 10 periods of the forcing or leaves the wall.
    """
    with mp.workdps(dps + GUARD_DIGITS):
        far = mpf(10) ** 9  # the other wall is out of reach
        p = PreciseParameters(
            mpf(mass_ratio),
            mpf(damping_ratio),
            mpf(frequency_ratio),
            far,
            mpf(restitution),
            mpf(phase),
        )
        start, x, v, w = (mpf(value) for value in (time, position, velocity, rebound_speed))
        until = start + 20 * mp.pi / p.omega
        t = start
        while True:
            a = -(mp.sin(p.omega * t + p.phase) - 2 * p.zeta * v - x)
            j = p.omega * mp.cos(p.omega * t + p.phase) + 2 * p.zeta * a - v
            if w < burst_floor and a > 0 and 1000 * abs(j) * w < a**2 * (1 - p.r):
                return t + 2 * w / (a * (1 - p.r)) - start
            hit = fly(p, (t, x, v), 1, (mpf(0), w), until, order=1)
            if hit is None or hit.side != 1:
                raise ValueError("the burst does not complete")
            t, x = hit.time, hit.x
            momentum = hit.v + p.mu * (hit.v + hit.approach_speed)
            w = p.r * hit.approach_speed
            v = (momentum + p.mu * w) / (1 + p.mu)  # free mass at v - w, momentum kept

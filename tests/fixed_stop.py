"""The classical impact oscillator, as a damper whose free mass is a fixed stop.

Closed form of its motions with one impact in n forcing periods:
x'' + x = sin(omega t + phase) hits a fixed stop at x = sigma, which sends it back at r times its
speed. Between impacts at the times 0 and tau = 2 pi n / omega, with g = 1 / (1 - omega^2),

    x = a cos t + b sin t + g sin(omega t + phase).

x(0) = x(tau) = sigma gives a = b cot(tau / 2); the speeds w before and r w after the impact give
b = -(1 + r) w / 2 and g omega cos(phase) = (1 - r) w / 2. So g sin(phase) = sigma + C w and
g cos(phase) = D w, with C = (1 + r) / 2 cot(tau / 2) and D = (1 - r) / (2 omega): the squares add
up to g^2.
"""

from __future__ import annotations

import math

import numpy as np
from scipy.optimize import brentq

import damper
from damper import Parameters, PeriodicOrbit, State


class ImpactOscillator:
    """Motions with one impact in `periods` forcing periods, by their impact speed w."""

    def __init__(self, frequency_ratio: float, restitution: float, periods: int = 1) -> None:
        self.r, self.frequency_ratio = restitution, frequency_ratio
        self.tau = math.tau * periods / frequency_ratio
        self.g = 1.0 / (1.0 - frequency_ratio**2)
        self.c = 0.5 * (1.0 + restitution) / math.tan(0.5 * self.tau)
        self.d = 0.5 * (1.0 - restitution) / frequency_ratio

    def stop(self, speed: float, way: float) -> float:
        """Place sigma of the stop; `way` is -1 or 1 for the two motions of that speed."""
        return -self.c * speed + way * math.sqrt(self.g**2 - (self.d * speed) ** 2)

    def trace(self, speed: float, way: float) -> float:
        """Sum of the two multipliers; their product is r^2.

        A motion that is dx nearer to the stop hits dx / w earlier, so the saltation matrix is
        [[-r, 0], [(1 + r) a / w, -r]], a the acceleration at the impact.
        """
        sigma = self.stop(speed, way)
        a = (sigma + self.c * speed) / self.g - sigma
        turn = (1.0 + self.r) * a / speed
        return -2.0 * self.r * math.cos(self.tau) + turn * math.sin(self.tau)

    def after_impact(self, speed: float, way: float) -> tuple[float, float, float]:
        """Displacement and velocity just after the impact, and its time where the phase is 0."""
        sigma = self.stop(speed, way)
        phase = math.atan2((sigma + self.c * speed) / self.g, self.d * speed / self.g)
        return sigma, -self.r * speed, phase % math.tau / self.frequency_ratio

    @property
    def fold_speed(self) -> float:
        """Impact speed where both motions of a place of the stop meet."""
        return self.fold * abs(self.c) / (self.c**2 + self.d**2)

    @property
    def fold(self) -> float:
        """Largest |sigma| at which the motion exists."""
        return abs(self.g) * math.hypot(1.0, self.c / self.d)

    def period_doubling(self, way: float) -> float:
        """Place of the stop at which a multiplier is -1, of the slowest such motion."""
        speeds = np.linspace(1e-3, 1.0, 1000) * abs(self.g) / self.d
        lacking = [self.trace(speed, way) + 1.0 + self.r**2 for speed in speeds]
        k = int(np.flatnonzero(np.diff(np.sign(lacking)))[0])
        speed = brentq(
            lambda speed: self.trace(speed, way) + 1.0 + self.r**2,
            speeds[k],
            speeds[k + 1],
            xtol=1e-15,
        )
        return self.stop(speed, way)


#: The free mass rests at REST, so x meets it at sigma = REST + clearance.
REST = -10.0
OSCILLATOR = ImpactOscillator(2.8, 0.8)


def beside_a_stop(sigma: float) -> Parameters:
    return Parameters(math.inf, 0.0, 2.8, sigma - REST, 0.8)


def one_impact(speed: float) -> PeriodicOrbit:
    """The closed-form motion with one impact a period, of this impact speed."""
    x, v, time = OSCILLATOR.after_impact(speed, -1.0)
    guess = State(x, v, REST, 0.0, time)
    return damper.periodic_orbit(beside_a_stop(x), state=guess)

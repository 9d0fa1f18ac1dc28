"""An impact of a ball on a flat stop by Hertz: how long it takes, and how hard it presses."""

from __future__ import annotations

import math
from typing import NamedTuple


class Solid(NamedTuple):
    """A material of a ball or a stop."""

    modulus: float
    """Young's modulus in Pa."""
    poisson: float
    density: float
    """In kg/m3."""


#: Usual values, as tables of materials have them.
STEEL = Solid(210e9, 0.30, 7850.0)
BALLS = {
    "steel": STEEL,
    "lead": Solid(16e9, 0.44, 11340.0),
    "tungsten": Solid(405e9, 0.28, 19300.0),
}
#: Yield strength of hard steel in Pa.
HARD_STEEL = 1e9


class Contact(NamedTuple):
    """Largest force, duration and depth of an impact of a ball on a flat stop."""

    force: float
    """The largest, in N."""
    time: float
    """From touch to parting, in s."""
    depth: float
    """How far ball and stop approach each other at most, in m."""


def ball_diameter(mass: float, density: float) -> float:
    """Diameter in m of a ball of a mass in kg and a density in kg/m3: (6 m / (pi rho))^(1/3)."""
    return float(math.cbrt(6.0 * mass / (math.pi * density)))


def contact_modulus(one: Solid, other: Solid) -> float:
    """Modulus E* in Pa of two bodies in contact.

    1/E* = (1 - nu1^2)/E1 + (1 - nu2^2)/E2 (Johnson, Contact Mechanics, 1985, section 4.2).
    """
    return 1.0 / sum((1.0 - body.poisson**2) / body.modulus for body in (one, other))


def hertz_impact(mass: float, speed: float, radius: float, modulus: float) -> Contact:
    """Impact of a ball on a flat stop, elastic and slow against the waves in it.

    Force (4/3) E* sqrt(R) delta^(3/2), so with the energy of the approach

        delta = (15 m V^2 / (16 E* sqrt(R)))^(2/5)    the largest
        T = 2.94 delta / V                            2 sqrt(pi) Gamma(7/5)/Gamma(9/10) = 2.9433

    (Johnson, Contact Mechanics, 1985, section 11.4; Hertz 1882).

    Parameters
    ----------
    mass : float
        Of the two bodies, m M / (m + M), in kg.
    speed : float
        Of approach, in m/s, > 0.
    radius : float
        Of the ball, in m.
    modulus : float
        `contact_modulus`, in Pa.

    Examples
    --------
    >>> found = hertz_impact(1.0, 1.0, 0.03, 115e9)
    >>> f"{found.force:.3g} N, {found.time:.3g} s"
    '1.69e+04 N, 0.000218 s'
    """
    depth = (15.0 * mass * speed**2 / (16.0 * modulus * math.sqrt(radius))) ** 0.4
    force = 4.0 / 3.0 * modulus * math.sqrt(radius) * depth**1.5
    factor = 2.0 * math.sqrt(math.pi) * math.gamma(1.4) / math.gamma(0.9)
    return Contact(force, factor * depth / speed, depth)


def yield_speed(modulus: float, strength: float, density: float) -> float:
    """Speed of approach in m/s at which a ball on a flat stop begins to yield.

    rho V^2 / Y = 26 (Y / E*)^4 (Johnson, Contact Mechanics, 1985, section 11.5), with the yield
    strength Y in Pa of the softer body and the density of the ball.
    """
    return math.sqrt(26.0 * strength / density) * (strength / modulus) ** 2

"""Noise: the power that it brings, and the equilibrium of a damper whose impacts lose nothing.

White noise whose one-sided spectral density over the angular frequency is S brings a primary the
power D = pi S / 2, whatever else moves it. Impacts with a restitution of 1 keep the energy, so that
primary and free mass come to the temperature T = D / (2 zeta) at which the dashpot takes as much:

    <x^2> = <v^2> = mu <u^2> = T,   y anywhere between the walls,
    impacts per time sqrt(T (1 + 1/mu) / (2 pi)) / d,   mean square approach speed 2 T (1 + 1/mu)

Noise in a band up to omega_h brings less by the part (2/pi) gamma / omega_h, to first order, gamma
the rate at which a push of the primary is forgotten just after it. Where impacts lose nothing, the
free mass lacks more: its speed w relative to the walls has the density

    exp(-integral of w dw / (s^2 (1 - w/w_h))),   s^2 = T (1 + 1/mu),   w_h = (pi/2) d omega_h

Derivation: docs/theory.md.
"""

import math

from damper.parameters import Parameters
from damper.parameters.forcing import Noise
from damper.theory import require_basic

#: Intervals of the integrals over the speed.
_STEPS = 2000


def intensity(parameters: Parameters) -> float:
    """Power D of white noise as dense as a damper's noise is at the primary's frequency.

    In units of F0^2/K over sqrt(M/K).

    Raises
    ------
    ValueError
        For all but a rigid damper with a constant restitution under a noise, a force on the
        primary, in whose band its frequency lies.

    Examples
    --------
    >>> noise = Noise(seed=1, step=0.1, duration=600.0, band=(0.0, 6.0))
    >>> p = Parameters(0.1, 0.05, 1.0, clearance=3.0, restitution=1.0, forcing=noise)
    >>> round(intensity(p), 4), round(means(p)["mean_kinetic_energy"], 4)
    (0.2618, 1.309)
    """
    require_basic(parameters, "force_amplitude", "forcing")
    noise = parameters.forcing
    if not isinstance(noise, Noise) or noise.of != "force" or not noise.band[0] < 1 < noise.band[1]:
        raise ValueError(
            f"forcing = {noise!r}: the closed forms are for a damper.Noise of='force' in "
            "whose band the primary's frequency 1 lies"
        )
    # Linear interpolation between samples lowers amplitudes by `between` squared.
    between = math.sin(0.5 * noise.step) / (0.5 * noise.step)
    density = noise.duration / (2.0 * math.pi * noise.lines) * between**4
    return 0.5 * math.pi * density * parameters.force_amplitude**2


def missing_part(parameters: Parameters, impact_rate: float) -> float:
    """Part of the power of white noise that is missing above the band, to first order.

    `impact_rate` is the number of impacts per unit time. Errors are those of `intensity`.
    """
    intensity(parameters)
    p = parameters
    forgets = 2.0 * (1.0 + p.restitution) * impact_rate * p.mass_ratio / (1.0 + p.mass_ratio)
    return 2.0 / math.pi * (2.0 * p.damping_ratio + forgets) / p.forcing.band[1]


def speeds_in_band(parameters: Parameters) -> tuple[float, float, float]:
    """Shares that a band leaves of means of the free mass, where impacts lose nothing.

    Of the mean square of its speed relative to the walls, of the number of impacts, and of the mean
    square approach speed. Errors are those of `intensity`.

    Examples
    --------
    >>> noise = Noise(seed=1, step=0.05, duration=600.0, band=(0.0, 12.0))
    >>> p = Parameters(0.1, 0.05, 1.0, clearance=2.0, restitution=1.0, forcing=noise)
    >>> [round(share, 3) for share in speeds_in_band(p)]
    [0.851, 0.929, 0.827]
    """
    p = parameters
    temperature = intensity(p) / (2.0 * p.damping_ratio)
    size = 0.5 * math.pi * p.clearance * p.forcing.band[1]
    if not size:
        return 1.0, 1.0, 1.0
    ratio = math.sqrt(temperature * (1.0 + 1.0 / p.mass_ratio)) / size
    # Speeds in units of s; the density is 0 from w_h on.
    step = min(1.0 / ratio, 10.0) / _STEPS
    speeds = [(k + 0.5) * step for k in range(_STEPS)]
    density = [math.exp(_exponent(speed, ratio)) for speed in speeds]
    moments = [sum(w**k * p for w, p in zip(speeds, density, strict=True)) for k in range(4)]
    rate = moments[1] / moments[0] * math.sqrt(0.5 * math.pi)
    return moments[2] / moments[0], rate, 0.5 * moments[3] / moments[1]


def _exponent(speed: float, ratio: float) -> float:
    """Logarithm of the density of speeds, without cancellation for a small ratio."""
    if ratio < 1e-3:
        return -(speed**2) / 2.0 - ratio * speed**3 / 3.0
    return speed / ratio + math.log1p(-ratio * speed) / ratio**2


def means(parameters: Parameters, missing: float = 0.0) -> dict[str, float]:
    """Means of the observer `statistics` under white noise, in its units.

    With a restitution below 1 only power in and losses are known. `missing` is the part of the
    power by which a band lowers them; then means of the free mass are those in the band. Errors are
    those of `intensity`, and an undamped primary whose impacts lose nothing, which has no
    equilibrium.
    """
    p = parameters
    left = 1.0 - missing
    power = intensity(p) * p.cycle * left
    found = {"mean_input": power, "mean_loss": power}
    if p.restitution == 1.0:
        if p.damping_ratio == 0.0:
            raise ValueError("damping_ratio = 0.0 with restitution = 1.0: nothing takes the power")
        temperature = intensity(p) / (2.0 * p.damping_ratio)
        square, rate, approach = speeds_in_band(p) if missing else (1.0, 1.0, 1.0)
        names = "mean_potential_energy", "mean_kinetic_energy"
        found |= dict.fromkeys(names, 0.5 * temperature * left)
        free = (p.mass_ratio * left + square) / (1.0 + p.mass_ratio)
        found["mean_free_mass_energy"] = 0.5 * temperature * free
        found["mean_approach_energy"] = temperature * approach
        found["mean_square_place"] = 1.0 / 3.0
        flux = math.sqrt(temperature * (1.0 + 1.0 / p.mass_ratio) / (2.0 * math.pi)) * rate
        found["impact_rate"] = flux / p.clearance * p.cycle if p.clearance else math.nan
    return found

"""Noise: the power that it brings, and the equilibrium of a damper whose impacts lose nothing.

White noise whose one-sided spectral density over the angular frequency is S brings a primary the
power D = pi S / 2, whatever else moves it. Impacts with a restitution of 1 keep the energy, so that
primary and free mass come to the temperature T = D / (2 zeta) at which the dashpot takes as much:

    <x^2> = <v^2> = mu <u^2> = T,   y anywhere between the walls,
    impacts per time sqrt(T (1 + 1/mu) / (2 pi)) / d,   mean square approach speed 2 T (1 + 1/mu)

Noise in a band up to omega_h brings less by the part (2/pi) gamma / omega_h, to first order, gamma
the rate at which a push of the primary is forgotten just after it. Derivation: docs/theory.md.
"""

import math

from damper.parameters import Parameters
from damper.parameters.forcing import Noise
from damper.theory import need_basic

#: Means that do not depend on how much energy there is, and how others do: as a power of it.
_POWERS = {"mean_square_place": 0.0, "impact_rate": 0.5}


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
    >>> round(intensity(p), 4), round(laws(p)["mean_kinetic_energy"], 4)
    (0.2618, 1.309)
    """
    need_basic(parameters, "force_amplitude", "forcing")
    noise = parameters.forcing
    if not isinstance(noise, Noise) or noise.of != "force" or not noise.band[0] < 1 < noise.band[1]:
        raise ValueError(
            f"forcing = {noise!r}: the laws are those of a damper.Noise of='force' in whose band "
            "the primary's frequency 1 lies"
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


def laws(parameters: Parameters, missing: float = 0.0) -> dict[str, float]:
    """Means of the observer `statistics` under white noise, in its units.

    With a restitution below 1 only power in and losses are known. `missing` is the part of the
    power by which they are lowered. Errors are those of `intensity`, and an undamped primary whose
    impacts lose nothing, which has no equilibrium.
    """
    p = parameters
    power = intensity(p) * p.cycle
    found = {"mean_input": power, "mean_loss": power}
    if p.restitution == 1.0:
        if p.damping_ratio == 0.0:
            raise ValueError("damping_ratio = 0.0 with restitution = 1.0: nothing takes the power")
        temperature = intensity(p) / (2.0 * p.damping_ratio)
        names = "mean_potential_energy", "mean_kinetic_energy", "mean_free_mass_energy"
        found |= dict.fromkeys(names, 0.5 * temperature)
        found["mean_approach_energy"] = temperature
        found["mean_square_place"] = 1.0 / 3.0
        flux = math.sqrt(temperature * (1.0 + 1.0 / p.mass_ratio) / (2.0 * math.pi))
        found["impact_rate"] = flux / p.clearance * p.cycle if p.clearance else math.nan
    return {n: value * (1.0 - missing) ** _POWERS.get(n, 1.0) for n, value in found.items()}

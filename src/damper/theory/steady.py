"""The primary alone: its steady response to the force, without a damper."""

import cmath
import math

from damper.parameters import Parameters
from damper.parameters.dampers import require_known
from damper.parameters.tables import WALL_TABLES

#: Quantities of the steady response; quantities that act on the free mass only.
PRIMARY = ("damping_ratio", "frequency_ratio", "phase", "force_amplitude")
FREE_MASS = (
    "mass_ratio",
    "clearance",
    "restitution",
    "restitution_left",
    *WALL_TABLES,
    "yield_speed",
    "yield_exponent",
    "support_stiffness_ratio",
    "support_damping_ratio",
    "contact_stiffness_ratio",
    "contact_tension",
    "modulation_depth",
    "modulation_order",
    "modulation_phase",
    "friction",
    "mass_share",
    "clearance_factor",
    "masses",
    "walls",
)


def steady_gain(damping_ratio: float, frequency_ratio: float) -> complex:
    """Complex amplitude of the steady response to exp(i frequency_ratio t).

    1 / (1 - omega^2 + 2 i zeta omega), with the digits that 1 - omega^2 would lose near resonance.

    Raises
    ------
    ValueError
        Undamped and at resonance: the response grows for ever.
    """
    stiffness = complex(
        (1.0 - frequency_ratio) * (1.0 + frequency_ratio), 2.0 * damping_ratio * frequency_ratio
    )
    if stiffness == 0.0:
        raise ValueError(
            "damping_ratio = 0 with frequency_ratio = 1: there is no steady linear response"
        )
    return 1.0 / stiffness


def steady_amplitude(damping_ratio: float, frequency_ratio: float) -> float:
    """Amplitude of the steady response in units of F0/K; infinite where it grows for ever."""
    try:
        return abs(steady_gain(damping_ratio, frequency_ratio))
    except ValueError:
        return math.inf


def require_steady(parameters: Parameters) -> None:
    """Raise ValueError for a quantity that may act on the primary alone, and is not known here."""
    require_known(parameters, (*PRIMARY, *FREE_MASS), "the steady response")


def steady_state(parameters: Parameters) -> tuple[float, float]:
    """Displacement and velocity of the steady response at time 0.

    Raises
    ------
    ValueError
        As `steady_gain` and `require_steady`.

    Examples
    --------
    >>> steady_state(Parameters(0.1, 0.0, 0.5, 1.0, 0.6))  # sin(t/2) / (1 - 1/4)
    (0.0, 0.6666666666666666)
    """
    require_steady(parameters)
    gain = steady_gain(parameters.damping_ratio, parameters.frequency_ratio)
    turning = gain * cmath.exp(1j * parameters.phase)
    size = parameters.force_amplitude
    return size * turning.imag, size * parameters.frequency_ratio * turning.real

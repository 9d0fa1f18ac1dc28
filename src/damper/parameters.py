"""What a run is: the parameters of the damper and the state it starts from.

Lengths are scaled by F0/K and times by sqrt(M/K), so the primary obeys
``x'' + 2 zeta x' + x = sin(omega t + phase)`` and the free mass flies between two walls that
move with it, ``|y - x| <= clearance``.
"""

import math
from dataclasses import dataclass, fields


@dataclass(frozen=True)
class Parameters:
    """Dimensionless parameters of a rigid impact damper.

    Parameters
    ----------
    mass_ratio : float
        Free mass over primary mass, m / M; > 0.
    damping_ratio : float
        C / (2 sqrt(K M)); >= 0. Under-, critically and overdamped primaries are all exact.
    frequency_ratio : float
        Forcing frequency over the natural frequency, Omega / sqrt(K / M); > 0.
    clearance : float
        Distance from the centre to *each* wall (the half gap) times K / F0; >= 0.
        The total free travel is twice this.
    restitution : float
        Newton's coefficient of restitution; 0 <= restitution <= 1.
    phase : float, default 0
        Phase of the force sin(frequency_ratio t + phase) in radians; pi/2 gives a cosine.

    Raises
    ------
    ValueError
        Names the field, the value and the range when a value is not finite or out of range.
    TypeError
        When a value is not a real number.

    Examples
    --------
    >>> Parameters(mass_ratio=0.1, damping_ratio=0.05, frequency_ratio=0.8,
    ...            clearance=1.0, restitution=0.6).period
    7.853981633974483
    >>> Parameters(0.1, 0.05, 0.8, 1.0, restitution=1.2)
    Traceback (most recent call last):
    ...
    ValueError: restitution = 1.2: must be a finite number with 0 <= restitution <= 1
    """

    mass_ratio: float
    damping_ratio: float
    frequency_ratio: float
    clearance: float
    restitution: float
    phase: float = 0.0

    def __post_init__(self) -> None:
        for name in PARAMETER_NAMES:
            object.__setattr__(self, name, check_parameter(name, getattr(self, name)))

    @property
    def period(self) -> float:
        """Forcing period 2 pi / frequency_ratio, in units of sqrt(M/K)."""
        return 2.0 * math.pi / self.frequency_ratio


@dataclass(frozen=True)
class State:
    """Positions and velocities at one time.

    Parameters
    ----------
    x, v : float
        Displacement (units of F0/K) and velocity of the primary.
    y, u : float
        Displacement and velocity of the free mass, in the same frame (not relative).
    time : float, default 0
        Time at which the state holds, in units of sqrt(M/K).

    Raises
    ------
    ValueError
        When a value is not finite.
    TypeError
        When a value is not a real number.
    """

    x: float
    v: float
    y: float
    u: float
    time: float = 0.0

    def __post_init__(self) -> None:
        for field in fields(self):
            value = _real(field.name, getattr(self, field.name))
            if not math.isfinite(value):
                raise ValueError(f"{field.name} = {value!r}: must be a finite number")
            object.__setattr__(self, field.name, value)


@dataclass(frozen=True)
class Quantity:
    """Name, meaning and range of one parameter: the single source for checks and labels."""

    name: str
    symbol: str
    long_name: str
    allowed: str
    units: str = "1"
    default: float | None = None


#: Every parameter in the order of `Parameters`; symbols are matplotlib mathtext.
QUANTITIES = (
    Quantity("mass_ratio", r"$\mu$", "mass ratio m/M", "mass_ratio > 0"),
    Quantity("damping_ratio", r"$\zeta$", "damping ratio of the primary", "damping_ratio >= 0"),
    Quantity("frequency_ratio", r"$\omega$", "frequency ratio", "frequency_ratio > 0"),
    Quantity("clearance", r"$d$", "clearance to each wall", "clearance >= 0", "F0/K"),
    Quantity("restitution", r"$r$", "coefficient of restitution", "0 <= restitution <= 1"),
    Quantity("phase", r"$\varphi$", "forcing phase", "any phase in radians", "rad", 0.0),
)
PARAMETER_NAMES = tuple(quantity.name for quantity in QUANTITIES)

_ALLOWED = {
    "mass_ratio": lambda value: value > 0.0,
    "damping_ratio": lambda value: value >= 0.0,
    "frequency_ratio": lambda value: value > 0.0,
    "clearance": lambda value: value >= 0.0,
    "restitution": lambda value: 0.0 <= value <= 1.0,
    "phase": lambda value: True,
}


def check_parameter(name: str, value: float) -> float:
    """Return `value` as a float if parameter `name` may have it.

    Raises
    ------
    ValueError
        Not finite or out of range; the message names field, value and range.
    TypeError
        Not a real number.
    """
    number = _real(name, value)
    if not math.isfinite(number) or not _ALLOWED[name](number):
        allowed = next(quantity.allowed for quantity in QUANTITIES if quantity.name == name)
        raise ValueError(f"{name} = {value!r}: must be a finite number with {allowed}")
    return number


def _real(name: str, value: float) -> float:
    # bool is an int to Python, but restitution=True is a slip, not a number.
    if isinstance(value, bool | str | bytes):
        raise TypeError(f"{name} = {value!r}: must be a real number")
    try:
        return float(value)
    except (TypeError, ValueError, OverflowError):
        raise TypeError(f"{name} = {value!r}: must be a real number") from None

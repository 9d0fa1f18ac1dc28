"""Every quantity that a study may give: name, symbol, meaning, units, range.

The single source for checks, labels, the study language and its reference. There are three kinds:
the dimensionless parameters, the same damper in SI units, and the state that a run starts from.
"""

import math
from collections.abc import Iterable
from dataclasses import dataclass

from damper.variables import LENGTH, SPEED


@dataclass(frozen=True)
class Quantity:
    """One quantity; `symbol` is matplotlib mathtext, `default` is None where it must be given."""

    name: str
    symbol: str
    long_name: str
    units: str = "1"
    minimum: float = -math.inf
    maximum: float = math.inf
    above: bool = False
    """Whether the minimum itself is excluded."""
    default: float | None = None
    note: str = ""
    """What a reader of an error should know beside the range."""

    @property
    def allowed(self) -> str:
        """The range in words."""
        if self.maximum < math.inf:
            words = f"{self.minimum:g} <= {self.name} <= {self.maximum:g}"
        elif self.minimum > -math.inf:
            words = f"{self.name} {'>' if self.above else '>='} {self.minimum:g}"
        else:
            # In an SI study units of F0/K are metres, so they are not named here.
            words = f"any {self.name}" + (f" in {self.units}" if self.units == "rad" else "")
        return f"{words} ({self.note})" if self.note else words

    def holds(self, value: float) -> bool:
        """Whether a finite number is in the range."""
        low = value > self.minimum if self.above else value >= self.minimum
        return low and value <= self.maximum


RESTITUTION = Quantity(
    "restitution", r"$r$", "coefficient of restitution", minimum=0.0, maximum=1.0
)
PHASE = Quantity("phase", r"$\varphi$", "forcing phase", "rad", default=0.0)

#: The parameters of `damper.Parameters`, in its order.
QUANTITIES = (
    Quantity("mass_ratio", r"$\mu$", "mass ratio m/M", minimum=0.0, above=True),
    Quantity("damping_ratio", r"$\zeta$", "damping ratio of the primary", minimum=0.0),
    Quantity("frequency_ratio", r"$\omega$", "frequency ratio", minimum=0.0, above=True),
    Quantity("clearance", r"$d$", "clearance to each wall", LENGTH, minimum=0.0),
    RESTITUTION,
    PHASE,
)

#: The parameters of `damper.SIParameters`, in its order.
SI_QUANTITIES = (
    Quantity("primary_mass", "$M$", "mass of the primary", "kg", minimum=0.0, above=True),
    Quantity("damping", "$C$", "damping coefficient of the primary", "N s/m", minimum=0.0),
    Quantity("stiffness", "$K$", "stiffness of the primary", "N/m", minimum=0.0, above=True),
    Quantity(
        "force_amplitude",
        "$F_0$",
        "amplitude of the force",
        "N",
        minimum=0.0,
        above=True,
        note="lengths are scaled by F0/K, so free vibration has no place here",
    ),
    Quantity(
        "forcing_frequency",
        r"$\Omega$",
        "angular forcing frequency",
        "rad/s",
        minimum=0.0,
        above=True,
    ),
    Quantity("free_mass", "$m$", "free mass", "kg", minimum=0.0, above=True),
    Quantity("gap", "$2D$", "gap, the free mass's whole travel", "m", minimum=0.0),
    RESTITUTION,
    PHASE,
)

#: The state at the start of a run; in an SI study lengths are in m and speeds in m/s.
INITIAL_QUANTITIES = (
    Quantity(
        "initial_displacement", "$x_0$", "initial displacement of the primary", LENGTH, default=0.0
    ),
    Quantity(
        "initial_velocity", r"$\dot x_0$", "initial velocity of the primary", SPEED, default=0.0
    ),
    Quantity(
        "initial_position",
        "$p_0$",
        "initial place of the free mass between the walls",
        minimum=-1.0,
        maximum=1.0,
        default=0.0,
        note="-1 at the left wall, +1 at the right one",
    ),
    Quantity(
        "initial_relative_velocity",
        r"$\dot y_0 - \dot x_0$",
        "initial velocity of the free mass relative to the primary",
        SPEED,
        default=0.0,
    ),
)

PARAMETER_NAMES = tuple(quantity.name for quantity in QUANTITIES)
SI_NAMES = tuple(quantity.name for quantity in SI_QUANTITIES)
INITIAL_NAMES = tuple(quantity.name for quantity in INITIAL_QUANTITIES)

#: Names that tell which system of units a damper is given in.
DIMENSIONLESS_ONLY = frozenset(PARAMETER_NAMES) - frozenset(SI_NAMES)
SI_ONLY = frozenset(SI_NAMES) - frozenset(PARAMETER_NAMES)

#: Name -> quantity, for every name that a study may use.
ALL = {quantity.name: quantity for quantity in (*QUANTITIES, *SI_QUANTITIES, *INITIAL_QUANTITIES)}


def check_quantity(name: str, value: float) -> float:
    """Return `value` as a float if the quantity `name` may have it.

    Raises
    ------
    ValueError
        Not finite or out of range; the message names quantity, value and range.
    TypeError
        Not a real number.
    """
    number = real(name, value)
    quantity = ALL[name]
    if not math.isfinite(number) or not quantity.holds(number):
        raise ValueError(f"{name} = {value!r}: must be a finite number with {quantity.allowed}")
    return number


def is_si(names: Iterable[str]) -> bool:
    """Whether these names give a damper in SI units.

    Raises
    ------
    ValueError
        When they mix both systems, with the names of each.

    Examples
    --------
    >>> is_si(["stiffness", "restitution"]), is_si(["clearance", "restitution"])
    (True, False)
    """
    names = list(names)
    si = [name for name in names if name in SI_ONLY]
    ratios = [name for name in names if name in DIMENSIONLESS_ONLY]
    if si and ratios:
        raise ValueError(
            f"{', '.join(si)} (SI units) and {', '.join(ratios)} (dimensionless) are mixed: "
            "give all parameters in SI units or none"
        )
    return bool(si)


def real(name: str, value: float) -> float:
    """Return a real number as float; TypeError with name and value for anything else."""
    # bool is an int to Python, but restitution=True is a slip, not a number.
    if isinstance(value, bool | str | bytes):
        raise TypeError(f"{name} = {value!r}: must be a real number")
    try:
        return float(value)
    except (TypeError, ValueError, OverflowError):
        raise TypeError(f"{name} = {value!r}: must be a real number") from None

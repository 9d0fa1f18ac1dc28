"""Every quantity that a study may give: name, symbol, meaning, units, range.

The single source for checks, labels, the study language and its reference. There are three kinds:
the dimensionless parameters, the same damper in SI units, and the state that a run starts from.
"""

import math
from collections.abc import Iterable, Mapping
from dataclasses import dataclass

from damper.parameters.variables import LENGTH, SPEED


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
    below: bool = False
    """Whether the maximum itself is excluded."""
    whole: bool = False
    """Whether only whole numbers will do."""
    default: float | None = None
    note: str = ""
    """What a reader of an error should know beside the range."""

    @property
    def allowed(self) -> str:
        """The range in words."""
        if self.maximum < math.inf:
            words = (
                f"{self.minimum:g} <= {self.name} {'<' if self.below else '<='} {self.maximum:g}"
            )
        elif self.minimum > -math.inf:
            words = f"{self.name} {'>' if self.above else '>='} {self.minimum:g}"
        else:
            # In an SI study units of F0/K are metres, so they are not named here.
            words = f"any {self.name}" + (f" in {self.units}" if self.units == "rad" else "")
        if self.whole:
            words = f"{words}, whole"
        return f"{words} ({self.note})" if self.note else words

    def holds(self, value: float) -> bool:
        """Whether a finite number is in the range."""
        low = value > self.minimum if self.above else value >= self.minimum
        high = value < self.maximum if self.below else value <= self.maximum
        return low and high and (not self.whole or value == math.floor(value))


RESTITUTION = Quantity(
    "restitution", r"$r$", "coefficient of restitution", minimum=0.0, maximum=1.0
)
PHASE = Quantity("phase", r"$\varphi$", "forcing phase", "rad", default=0.0)

#: What the models beside the rigid one add, the same in both systems of units. Without them the
#: damper is rigid.
SUPPORT_DAMPING_FACTOR = Quantity(
    "support_damping_factor",
    "$C_2/C_1$",
    "damping of the free mass's support over that of the primary",
    minimum=0.0,
    default=0.0,
)
CONTACT_TENSION = Quantity(
    "contact_tension",
    r"$\chi$",
    "whether the contact pulls",
    minimum=0.0,
    maximum=1.0,
    whole=True,
    default=0.0,
    note="0: it lets go when its force vanishes, 1: it holds until the gap reopens",
)
MODULATION = (
    Quantity(
        "modulation_depth",
        r"$\mu_1/\mu$",
        "modulation of the free mass over its mean",
        minimum=0.0,
        maximum=1.0,
        below=True,
        default=0.0,
    ),
    Quantity(
        "modulation_order",
        "$n$",
        "forcing periods in one period of the modulation",
        minimum=1.0,
        whole=True,
        default=1.0,
    ),
    Quantity("modulation_phase", r"$\varphi_\mu$", "phase of the modulation", "rad", default=0.0),
)

#: The parameters of `damper.Parameters`, in its order.
QUANTITIES = (
    Quantity("mass_ratio", r"$\mu$", "mass ratio m/M", minimum=0.0, above=True),
    Quantity("damping_ratio", r"$\zeta$", "damping ratio of the primary", minimum=0.0),
    Quantity("frequency_ratio", r"$\omega$", "frequency ratio", minimum=0.0, above=True),
    Quantity("clearance", r"$d$", "clearance to each wall", LENGTH, minimum=0.0),
    RESTITUTION,
    PHASE,
    Quantity(
        "support_stiffness_ratio",
        r"$\kappa$",
        "stiffness of the free mass's support over that of the primary",
        minimum=0.0,
        default=0.0,
    ),
    Quantity(
        "support_damping_ratio",
        r"$\zeta_2$",
        "damping ratio of the free mass's support",
        minimum=0.0,
        default=0.0,
        note="C2 / (2 sqrt(K M)), with K and M of the primary",
    ),
    SUPPORT_DAMPING_FACTOR,
    Quantity(
        "contact_stiffness_ratio",
        r"$k_\mathrm{c}$",
        "stiffness of the contact over that of the primary",
        minimum=0.0,
        above=True,
        default=math.inf,
        note="leave it out for a rigid wall",
    ),
    CONTACT_TENSION,
    *MODULATION,
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
    Quantity(
        "support_stiffness",
        "$K_2$",
        "stiffness of the free mass's support",
        "N/m",
        minimum=0.0,
        default=0.0,
    ),
    Quantity(
        "support_damping",
        "$C_2$",
        "damping coefficient of the free mass's support",
        "N s/m",
        minimum=0.0,
        default=0.0,
    ),
    SUPPORT_DAMPING_FACTOR,
    Quantity(
        "contact_stiffness",
        r"$K_\mathrm{c}$",
        "stiffness of the contact",
        "N/m",
        minimum=0.0,
        above=True,
        default=math.inf,
        note="leave it out for a rigid wall",
    ),
    CONTACT_TENSION,
    *MODULATION,
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

#: Model of `damper.models` beside the rigid one -> the names that ask for it.
MODEL_NAMES = {
    "grounded": (
        "support_stiffness_ratio",
        "support_stiffness",
        "support_damping_ratio",
        "support_damping",
        "support_damping_factor",
    ),
    "compliant": ("contact_stiffness_ratio", "contact_stiffness", "contact_tension"),
    "time_varying": tuple(quantity.name for quantity in MODULATION),
}

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
    if number == quantity.default:
        return number
    if not math.isfinite(number) or not quantity.holds(number):
        raise ValueError(f"{name} = {value!r}: must be a finite number with {quantity.allowed}")
    return number


def check_model(values: Mapping[str, float]) -> None:
    """Raise ValueError unless these values (or ranges' ends, one at a time) ask for one model.

    Parameters
    ----------
    values : mapping of str to float
        Quantities of one damper; those left out have their defaults.
    """
    given = {
        model: [name for name in names if values.get(name, ALL[name].default) != ALL[name].default]
        for model, names in MODEL_NAMES.items()
    }
    # A varying mass is one whose modulation has a depth; a contact gives that has a stiffness.
    if "modulation_depth" not in given["time_varying"]:
        given["time_varying"] = []
    if given["compliant"] == ["contact_tension"]:
        raise ValueError(
            "contact_tension = 1: a rigid wall cannot pull; give a contact stiffness with it"
        )
    asked = {model: names for model, names in given.items() if names}
    if len(asked) > 1:
        words = " and ".join(f"{', '.join(names)} ({model})" for model, names in asked.items())
        raise ValueError(f"{words} ask for different models: give those of one")
    support = given["grounded"]
    if "support_damping_factor" in support and len(set(support) & set(_SUPPORT_DAMPINGS)):
        name = next(name for name in _SUPPORT_DAMPINGS if name in support)
        raise ValueError(
            f"support_damping_factor and {name} both give the damping of the support: "
            "one of the two must go"
        )
    if given["compliant"] and not values.get("contact_tension") and values["restitution"] == 0.0:
        raise ValueError(
            "restitution = 0: a contact that cannot pull always rebounds; must be > 0, "
            "or contact_tension = 1"
        )


_SUPPORT_DAMPINGS = ("support_damping_ratio", "support_damping")


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

"""Every quantity that a study may give, by name, and the names that belong together."""

import re
from collections.abc import Callable, Iterable, Mapping
from dataclasses import replace
from typing import Any, TypeVar

from damper.parameters.dampers import SI_NAME, Parameters, SIParameters
from damper.parameters.names import NAMES_BY_SYMBOL, OF_ANY_MASS, common_name, split
from damper.parameters.quantity import Quantity as Quantity
from damper.parameters.quantity import real as real
from damper.parameters.state import INITIAL_QUANTITIES as INITIAL_QUANTITIES
from damper.parameters.unit_text import number_in
from damper.parameters.units import AMPLITUDES, SI_UNITS

#: The parameters of `damper.Parameters` and of `damper.SIParameters`, in their order.
QUANTITIES = Parameters.quantities
SI_QUANTITIES = SIParameters.quantities

PARAMETER_NAMES = tuple(quantity.name for quantity in QUANTITIES)
SI_NAMES = tuple(quantity.name for quantity in SI_QUANTITIES)
INITIAL_NAMES = tuple(quantity.name for quantity in INITIAL_QUANTITIES)
#: What a dimensionless run may be given.
DIMENSIONLESS_NAMES = (*PARAMETER_NAMES, *INITIAL_NAMES)

#: Names that show which system of units a damper is given in.
DIMENSIONLESS_ONLY = frozenset(PARAMETER_NAMES) - frozenset(SI_NAMES)
SI_ONLY = frozenset(SI_NAMES) - frozenset(PARAMETER_NAMES)

#: Model of `damper.models` beside the rigid one -> the names that belong to it, in both systems.
MODEL_NAMES: dict[str, tuple[str, ...]] = {
    model: tuple(
        dict.fromkeys(
            name for q in QUANTITIES if q.model == model for name in (q.name, SI_NAME[q.name])
        )
    )
    for model in dict.fromkeys(quantity.model for quantity in QUANTITIES if quantity.model)
}

T = TypeVar("T")


class OfQuantities(dict[str, T]):
    """A mapping from quantities that has those of single masses, too, such as `clearance_1`.

    They are as many as there may be masses, so they are not listed.
    """

    def __init__(self, quantities: Mapping[str, Quantity], of: Callable[[Quantity], T]) -> None:
        super().__init__({name: of(quantity) for name, quantity in quantities.items()})
        self._quantities, self._of = dict(quantities), of

    def __contains__(self, name: object) -> bool:
        return super().__contains__(name) or split(name) is not None

    def __missing__(self, name: str) -> T:
        found = split(name)
        if found is None:
            raise KeyError(name)
        return self._of(of_a_mass(self._quantities[found[0]], found[1]))

    def get(self, name: str, default: Any = None) -> Any:
        return self[name] if name in self else default  # noqa: SIM401 - it is that


def of_a_mass(quantity: Quantity, k: int) -> Quantity:
    """What a quantity is of one mass; without a value of its own it has that of all."""
    letter, _, index = quantity.symbol[1:-1].partition("_")
    index = f"{index},{k}" if index else f"{k}"
    return replace(
        quantity,
        name=f"{quantity.name}_{k}",
        symbol=f"${letter}_{{{index}}}$",
        long_name=f"{quantity.long_name}, mass {k}",
        default=None,
    )


#: Name -> quantity, for every name that a study may use. A quantity of both systems has the units
#: of the dimensionless one, which `damper.parameters.units.SI_UNITS` translates.
ALL = OfQuantities(
    {
        quantity.name: quantity
        for quantity in (
            *QUANTITIES,
            *(quantity for quantity in SI_QUANTITIES if quantity.name in SI_ONLY),
            *INITIAL_QUANTITIES,
        )
    },
    lambda quantity: quantity,
)

for _quantity in (*ALL.values(), *SI_QUANTITIES):
    _symbol = re.sub(r"[$\\{}_ ]|var|mathrm", "", _quantity.symbol)
    NAMES_BY_SYMBOL[_symbol] = _quantity.name


def check_quantity(name: str, value: float) -> float:
    """Return `value` as a float if the quantity `name` may have it; see `Quantity.check`."""
    return ALL[name].check(value)


def check_initial(name: str, value: float, si: bool) -> float:
    """As `check_quantity` of an initial quantity, which text may give in SI units."""
    unit = ALL[name].units
    return check_quantity(name, number_in(name, value, [SI_UNITS.get(unit, unit) if si else unit]))


def is_si(names: Iterable[str]) -> bool:
    """Whether these names give a damper in SI units; ValueError where they mix both systems."""
    names = list(names)
    common = [common_name(name) for name in names]
    si = [name for name, of in zip(names, common, strict=True) if of in SI_ONLY]
    ratios = [name for name, of in zip(names, common, strict=True) if of in DIMENSIONLESS_ONLY]
    if si and ratios:
        raise ValueError(
            f"{', '.join(si)} (SI units) and {', '.join(ratios)} (dimensionless) are mixed: "
            "give all parameters in SI units or none"
        )
    return bool(si)


def ordered(names: Iterable[str]) -> list[str]:
    """Sort names as the fields of their class are, then the initial quantities.

    Examples
    --------
    >>> ordered(["phase", "initial_velocity", "stiffness", "restitution"])
    ['stiffness', 'restitution', 'phase', 'initial_velocity']
    """
    names = set(names)
    own = SI_NAMES if names & SI_ONLY else PARAMETER_NAMES
    found = quantities_in(names)
    return [name for name in dict.fromkeys((*own, *found)) if name in names]


def quantities_in(names: Iterable[Any]) -> list[str]:
    """Return those of some names that are quantities, in the order of `ALL`, then by mass.

    Examples
    --------
    >>> quantities_in(["draw", "clearance_1", "restitution", "mass_ratio_1"])
    ['restitution', 'mass_ratio_1', 'clearance_1']
    """
    names = set(names)
    own = [(k, OF_ANY_MASS.index(of), n) for n in names for of, k in filter(None, [split(n)])]
    return [*(name for name in ALL if name in names), *(name for _, _, name in sorted(own))]


def si_units(quantity: Quantity) -> list[str]:
    """Return the SI units that a quantity may be in; none of what is dimensionless only."""
    if quantity.name == "force_amplitude":
        return list(dict.fromkeys(unit for _, unit in AMPLITUDES.values()))
    if (split(quantity.name) or (quantity.name,))[0] in DIMENSIONLESS_ONLY:
        return ["1"] if quantity.units == "1" else []
    return [SI_UNITS.get(quantity.units, quantity.units)]

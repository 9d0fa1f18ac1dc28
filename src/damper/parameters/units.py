"""Units: what lengths, times, speeds and energies are scaled by, and their sizes in SI units."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

LENGTH = "F0/K"
SPEED = "F0/sqrt(K M)"
TIME = "sqrt(M/K)"
ENERGY = "F0^2/K"
FORCE = "F0"
IMPULSE = "F0 sqrt(M/K)"
ACCELERATION = "F0/M"
#: What these units are called where the damper is given in SI units.
SI_UNITS = {
    LENGTH: "m",
    SPEED: "m/s",
    TIME: "s",
    ENERGY: "J",
    FORCE: "N",
    ACCELERATION: "m/s2",
    IMPULSE: "N s",
}


def attributes_of(units: str) -> dict[str, str]:
    """Return a variable's attributes for its units: as CF asks, ones that UDUNITS reads.

    Examples
    --------
    >>> attributes_of("rad"), attributes_of("F0/K"), attributes_of("")
    ({'units': 'rad'}, {'units': '1', 'scaled_by': 'F0/K'}, {})
    """
    if not units:
        return {}
    return {"units": "1", "scaled_by": units} if units in SI_UNITS else {"units": units}


def units_of(attributes: Mapping[str, Any]) -> str:
    """Return what a variable with these attributes is scaled by, or else its units.

    Examples
    --------
    >>> units_of(attributes_of("F0/K")), units_of({})
    ('F0/K', '1')
    """
    return attributes.get("scaled_by", attributes.get("units", "1"))


@dataclass(frozen=True)
class Units:
    """Sizes of the dimensionless units of one damper: F0/K in m, sqrt(M/K) in s, F0^2/K in J."""

    length: float
    time: float
    energy: float

    @property
    def speed(self) -> float:
        """Size of the unit of speed in m/s."""
        return self.length / self.time

    @property
    def acceleration(self) -> float:
        """Size of the unit of acceleration in m/s2."""
        return self.speed / self.time

    @property
    def force(self) -> float:
        """Size of the unit of force in N."""
        return self.energy / self.length

    @property
    def impulse(self) -> float:
        """Size of the unit of impulse in N s."""
        return self.force * self.time

    def size(self, unit: str) -> float:
        """SI size of one of `SI_UNITS`; 1 for anything else."""
        name = _NAMES.get(unit)
        return 1.0 if name is None else getattr(self, name)


_NAMES = {
    LENGTH: "length",
    SPEED: "speed",
    TIME: "time",
    ENERGY: "energy",
    ACCELERATION: "acceleration",
    FORCE: "force",
    IMPULSE: "impulse",
}

#: Units of a dimensionless run.
NO_UNITS = Units(1.0, 1.0, 1.0)

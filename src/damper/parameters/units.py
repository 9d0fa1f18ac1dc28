"""Units of lengths, times, speeds and energies, and their sizes in SI units."""

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

LENGTH = "F0/K"
SPEED = "F0/sqrt(K M)"
TIME = "sqrt(M/K)"
ENERGY = "F0^2/K"
FORCE = "F0"
IMPULSE = "F0 sqrt(M/K)"
#: A force in a spring: that by a unit of length, whatever the amplitude of the force is.
SPRING_FORCE = "K F0/K"
ACCELERATION = "F0/M"
#: Names of these units for a damper in SI units.
SI_UNITS = {
    LENGTH: "m",
    SPEED: "m/s",
    TIME: "s",
    ENERGY: "J",
    FORCE: "N",
    ACCELERATION: "m/s2",
    IMPULSE: "N s",
    SPRING_FORCE: "N",
}


#: Unit other than its own that a quantity may be given in: a frequency, in rad/s by itself.
HERTZ = "Hz"

#: Of a force that is not there: lengths are in any unit L.
FREE = "K L"
#: Name of a force's amplitude -> the unit of length, and the amplitude's SI unit: a force F0; no
#: force, with any length L; a base's motion B; an unbalance U, mass times eccentricity; a base's
#: acceleration A.
AMPLITUDES = {
    FORCE: (LENGTH, "N"),
    FREE: ("L", "N"),
    "B": ("B", "m"),
    "U": ("U/M", "kg m"),
    "A": ("A M/K", "m/s2"),
}


def name_of(unit: str, amplitude: str = FORCE) -> str:
    """Return what a dimensionless unit is called, from the name of the force's amplitude.

    Examples
    --------
    >>> [name_of(unit, "U") for unit in (LENGTH, SPEED, ENERGY, FORCE, TIME)]
    ['U/M', '(U/M) sqrt(K/M)', 'K (U/M)^2', 'U', 'sqrt(M/K)']
    """
    if amplitude == FORCE or unit == TIME:
        return FORCE if unit == SPRING_FORCE else unit
    length, _ = AMPLITUDES[amplitude]
    part = f"({length})" if len(length) > 1 else length
    names = {SPEED: f"{part} sqrt(K/M)", ENERGY: f"K {part}^2", ACCELERATION: f"{part} K/M"}
    names |= {SPRING_FORCE: f"K {part}", IMPULSE: f"{part} sqrt(K M)"}
    return {LENGTH: length, FORCE: amplitude, **names}.get(unit, unit)


#: Least size of a multiple of a unit, the multiple, and its prefix: large ones, itself, small ones.
_LARGE = [(1e9, 1e9, "G"), (1e6, 1e6, "M"), (1e4, 1e3, "k")]
_SMALL = [(0.1, 1.0, ""), (1e-4, 1e-3, "m"), (0.0, 1e-6, "µ")]
#: SI unit -> for sizes from a least one on: how many times larger a unit is, and that unit.
_HANDY = {
    "m": [(1.0, 1.0, "m"), (1e-5, 1e-3, "mm"), (1e-7, 1e-6, "µm"), (0.0, 1e-9, "nm")],
    "kg": [(1e4, 1e3, "t"), (0.1, 1.0, "kg"), (1e-4, 1e-3, "g"), (0.0, 1e-6, "mg")],
    "kg m": [(1.0, 1.0, "kg m"), (0.0, 1e-3, "kg mm")],
    **{
        unit: [(least, size, prefix + unit) for least, size, prefix in prefixes]
        for units, prefixes in (
            (("N/m", "N s/m", "Hz"), [*_LARGE, (0.0, 1.0, "")]),
            (("Pa",), [*_LARGE, (0.0, 1.0, "")]),
            (("N", "J", "N s", "W"), [*_LARGE, *_SMALL]),
            (("s", "m/s", "m/s2"), _SMALL),
        )
        for unit in units
    },
}


def handy(size: float, unit: str) -> tuple[float, str]:
    """Return how many times larger the unit is in which a size is written, and that unit.

    Examples
    --------
    >>> handy(0.002, "m"), handy(2e7, "N/m"), handy(0.03, "1")
    ((0.001, 'mm'), (1000000.0, 'MN/m'), (1.0, '1'))
    """
    scale = _HANDY.get(unit, []) if size else []
    return next((one[1:] for one in scale if not abs(size) < one[0]), (1.0, unit))


def own_number(value: Any, units: str | None) -> Any:
    """Return a value in the own unit of its quantity: rad/s for a frequency given in Hz."""
    return 2.0 * math.pi * value if units == HERTZ else value


def shown_unit(units: str, si: bool, amplitude: str = FORCE) -> str:
    """Return what people read for the units that a quantity is declared with; nothing for 1.

    `amplitude` is what that of the force is called, which decides on the unit of its own.

    Examples
    --------
    >>> shown_unit("F0", True, "A"), shown_unit("F0/K", True), shown_unit("F0/K", False, "B")
    ('m/s2', 'm', 'B')
    """
    if si and units in (FORCE, "N"):
        return AMPLITUDES[amplitude][1]
    units = SI_UNITS.get(units, units) if si else name_of(units, amplitude)
    return "" if units == "1" else units


def attributes_of(units: str, amplitude: str = FORCE) -> dict[str, str]:
    """Return a variable's attributes for its units: as CF asks, ones that UDUNITS reads.

    Examples
    --------
    >>> attributes_of("rad"), attributes_of("F0/K"), attributes_of("")
    ({'units': 'rad'}, {'units': '1', 'scaled_by': 'F0/K'}, {})
    """
    if not units:
        return {}
    if units in SI_UNITS:
        return {"units": "1", "scaled_by": name_of(units, amplitude)}
    return {"units": units}


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
    SPRING_FORCE: "force",
    IMPULSE: "impulse",
}

#: Units of a dimensionless run.
NO_UNITS = Units(1.0, 1.0, 1.0)

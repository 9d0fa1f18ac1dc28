"""Numbers with a unit, as people type them: "20 mm", "12 Hz", "1.2 t", "1e4 rpm", "0.3 g"."""

import math
import re
from collections.abc import Callable, Sequence
from fractions import Fraction
from typing import Any

#: Unit of a quantity -> the units that its numbers may have -> their sizes in it, as fractions: so
#: "20 mm" is the same number as 0.02.
SIZES: dict[str, dict[str, str]] = {
    "m": {"m": "1", "mm": "1e-3", "cm": "1e-2", "um": "1e-6", "km": "1e3", "in": "0.0254"},
    "kg": {"kg": "1", "g": "1e-3", "t": "1e3", "mg": "1e-6", "lb": "0.45359237"},
    "s": {"s": "1", "ms": "1e-3", "us": "1e-6", "min": "60"},
    "N": {"N": "1", "kN": "1e3", "MN": "1e6", "mN": "1e-3"},
    "N/m": {"N/m": "1", "kN/m": "1e3", "MN/m": "1e6", "N/mm": "1e3", "kN/mm": "1e6"},
    "N s/m": {"N s/m": "1", "kN s/m": "1e3", "N s/mm": "1e3", "kg/s": "1"},
    "m/s": {"m/s": "1", "mm/s": "1e-3", "cm/s": "1e-2"},
    "m/s2": {"m/s2": "1", "mm/s2": "1e-3", "cm/s2": "1e-2", "g": "9.80665"},
    "kg m": {"kg m": "1", "kg mm": "1e-3", "g m": "1e-3", "g mm": "1e-6"},
    "Hz": {"Hz": "1", "kHz": "1e3", "rpm": "1/60", "r/min": "1/60"},
    "rad/s": {"rad/s": "1"},
    "Pa": {"Pa": "1", "kPa": "1e3", "MPa": "1e6", "GPa": "1e9"},
    "degree": {"degree": "1", "degrees": "1", "deg": "1"},
    "rad": {"rad": "1"},
    "1": {"%": "1e-2"},
}
#: Other spellings.
_SPELT = {
    "²": "2",
    "^2": "2",
    "**2": "2",
    "Ns": "N s",
    "µ": "u",
    "μ": "u",
    "°": "degree",
    "*": " ",
    "·": " ",
}
_NUMBER = re.compile(r"\s*([-+]?(?:\d+\.?\d*|\.\d+)(?:[eE][-+]?\d{1,3})?+)\s*([A-Za-zµμ°%].*?)\s*")
#: A number with a decimal comma, and a unit or none.
_COMMA = re.compile(r"\s*[-+]?\d*,\d+(?:[eE][-+]?\d{1,3})?+\s*(?:[A-Za-zµμ°%].{0,20})?")


def split_unit(value: Any) -> tuple[str, str] | None:
    """Return the number and the unit of a text that is a number with a unit, else None.

    Examples
    --------
    >>> split_unit("9.81 m/s²"), split_unit("3 kNs/m"), split_unit("12"), split_unit("fast")
    (('9.81', 'm/s2'), ('3', 'kN s/m'), None, None)
    """
    found = _NUMBER.fullmatch(value) if isinstance(value, str) and len(value) < 100 else None
    if not found:
        return None
    number, unit = found.groups()
    for text, usual in _SPELT.items():
        unit = unit.replace(text, usual)
    return number, " ".join(unit.split())


def number_in(name: str, value: Any, units: Sequence[str]) -> Any:
    """Return the number of a text with a unit; anything else as it is.

    An array of xarray or pandas may name its unit in its attributes: that of the quantity.

    Parameters
    ----------
    name : str
        The quantity, for messages.
    value : object
    units : sequence of str
        Units of the quantity; more than one for the amplitude of a force. The number is in the
        first of them that goes with the unit of the text.

    Raises
    ------
    ValueError
        When the unit does not go with the quantity, an array has another unit than the quantity,
        or the number has a decimal comma.

    Examples
    --------
    >>> number_in("gap", "20 mm", ["m"]), number_in("free_mass", "1.2 t", ["kg"])
    (0.02, 1200.0)
    >>> number_in("forcing_frequency", "600 rpm", ["rad/s"]) == 2 * math.pi * 10
    True
    >>> number_in("gap", "20 mn", ["m"])
    Traceback (most recent call last):
    ...
    ValueError: gap = '20 mn': has the unit 'mn': must be a number in m, or with one of the units \
m, mm, cm, um, km, in
    """
    said = getattr(value, "attrs", {}).get("units", "1")
    if said != "1" and not any(said == own or SIZES.get(own, {}).get(said) == "1" for own in units):
        known = [own for own in units if own in SIZES and own != "1"]
        raise ValueError(
            f"{name}: has the attribute units = {said!r}: must be "
            f"{f'in {known[0]}' if known else 'without a unit'}; convert it, and drop the attribute"
        )
    if isinstance(value, str) and _COMMA.fullmatch(value):
        point = value.replace(",", ".")
        raise ValueError(f"{name} = {value!r}: has a decimal comma: must be {point!r}")
    if (parts := split_unit(value)) is None:
        return value
    number, unit = parts
    for own in units:
        if unit in SIZES.get(own, ()):
            return float(Fraction(number) * Fraction(SIZES[own][unit]))
        if own == "rad/s" and unit in SIZES["Hz"]:
            return 2.0 * math.pi * number_in(name, f"{number} {unit}", ["Hz"])
    raise ValueError(f"{name} = {value!r}: has the unit {unit!r}: must be {allowed_units(units)}")


def each_number(value: Any, read: Callable[[Any], Any]) -> Any:
    """Return what is read of a value, or of each item of a list."""
    return [read(item) for item in value] if isinstance(value, list | tuple) else read(value)


def allowed_units(units: Sequence[str]) -> str:
    """Return what a quantity in one of these units may be, in words.

    Examples
    --------
    >>> allowed_units(["rad/s"]), allowed_units(["F0/K"])
    ('a number in rad/s, or with one of the units rad/s, Hz, kHz, rpm, r/min', 'a number')
    """
    turns = list(SIZES["Hz"]) if "rad/s" in units else []
    known = [*(unit for own in units for unit in SIZES.get(own, ())), *turns]
    own = [unit for unit in units if unit in SIZES and unit != "1"]
    words = f"a number in {' or '.join(own)}" if own else "a number"
    return words + (
        f", or with one of the units {', '.join(dict.fromkeys(known))}" if known else ""
    )

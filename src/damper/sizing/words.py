"""Numbers as an engineer writes them."""

#: SI unit -> size below which a smaller unit is used, factor, and that unit.
_SMALL = {"m": (1.0, 1e3, "mm"), "kg": (0.1, 1e3, "g")}


def text_of(value: float, unit: str, digits: int = 3) -> str:
    """Return a number with a unit of suitable size.

    Examples
    --------
    >>> text_of(0.00092, "m"), text_of(12.0, "kg"), text_of(0.1, "1")
    ('0.92 mm', '12 kg', '0.1')
    """
    below, size, small = _SMALL.get(unit, (0.0, 1.0, unit))
    if abs(value) < below:
        value, unit = size * value, small
    form = f".{digits}g" if abs(value) < 1e3 else ".0f"
    return f"{value:{form}}" + ("" if unit == "1" else f" {unit}")

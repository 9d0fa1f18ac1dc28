"""Numbers as an engineer writes them."""

from damper.parameters.units import handy

#: Part of the answer that the rounding of a size may change.
ROUNDING = 0.005


def text_of(value: float, unit: str, digits: int = 3) -> str:
    """Return a number with a unit of suitable size.

    Examples
    --------
    >>> text_of(0.00092, "m"), text_of(12.0, "kg"), text_of(0.1, "1")
    ('0.92 mm', '12 kg', '0.1')
    >>> text_of(2e7, "kg"), text_of(2.0206e7, "N/m", 4), text_of(799.2, "N s/m")
    ('20000 t', '20.21 MN/m', '799 N s/m')
    >>> text_of(600.0, "kg", 2), text_of(523e3, "N", 2)
    ('600 kg', '520 kN')
    """
    # By its digits as they are written: 999.9 kg of three digits is 1000 kg.
    value = float(f"{value:.{digits}g}") if abs(value) < 1e3 else value
    size, unit = handy(value, unit)
    value /= size
    value = float(f"{value:.{digits}g}") if abs(value) < 1e3 else value
    form = f".{max(digits, 3)}g" if abs(value) < 1e3 or abs(value) >= 1e6 else ".0f"
    return f"{value:{form}}" + ("" if unit == "1" else f" {unit}")

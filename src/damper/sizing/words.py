"""Numbers as an engineer writes them."""

#: Part of the answer that the rounding of a size may change.
ROUNDING = 0.005
#: SI unit -> for sizes from a least one on: how many times larger a unit is, and that unit.
_UNITS = {
    "m": [(1.0, 1.0, "m"), (1e-5, 1e-3, "mm"), (1e-7, 1e-6, "µm"), (0.0, 1e-9, "nm")],
    "kg": [(1e4, 1e3, "t"), (0.1, 1.0, "kg"), (1e-4, 1e-3, "g"), (0.0, 1e-6, "mg")],
    "s": [(0.1, 1.0, "s"), (1e-4, 1e-3, "ms"), (0.0, 1e-6, "µs")],
    "kg m": [(1.0, 1.0, "kg m"), (0.0, 1e-3, "kg mm")],
    **{
        unit: [(1e9, 1e9, f"G{unit}"), (1e6, 1e6, f"M{unit}"), (1e4, 1e3, f"k{unit}"), small]
        for unit in ("N", "N/m", "N s/m", "Hz")
        for small in [(0.0, 1.0, unit)]
    },
}


def text_of(value: float, unit: str, digits: int = 3) -> str:
    """Return a number with a unit of suitable size.

    Examples
    --------
    >>> text_of(0.00092, "m"), text_of(12.0, "kg"), text_of(0.1, "1")
    ('0.92 mm', '12 kg', '0.1')
    >>> text_of(2e7, "kg"), text_of(2.0206e7, "N/m", 4), text_of(799.2, "N s/m")
    ('20000 t', '20.21 MN/m', '799 N s/m')
    """
    # By its digits as they are written: 999.9 kg of three digits is 1000 kg.
    value = float(f"{value:.{digits}g}") if abs(value) < 1e3 else value
    scale = _UNITS.get(unit, []) if value else []
    _, size, unit = next((one for one in scale if not abs(value) < one[0]), (0.0, 1.0, unit))
    value /= size
    form = f".{digits}g" if abs(value) < 1e3 or abs(value) >= 1e6 else ".0f"
    return f"{value:{form}}" + ("" if unit == "1" else f" {unit}")

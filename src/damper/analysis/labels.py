"""Labels: words for names, and text for numbers, in figures and tables."""

import math

#: Names of laws, models and solvers that are not their words with underscores.
LABELS = {
    "touch": "gap at impact",
    "energy_balance": "energy",
    "tensile_force": "tensile contact force",
    "time_varying": "time-varying",
    "exact": "exact engine",
    "rk4_step_end": "RK4, impacts at step ends",
    "rk4_located": "RK4 with located impacts",
    "dop853": "scipy DOP853",
    "moreau_jean": "Moreau-Jean",
}


def label_of(name: str) -> str:
    """Return the words for a name in code, a file or a study."""
    return LABELS.get(name, name.replace("_", " "))


def capital(text: str) -> str:
    """Return a text with a capital first letter."""
    return text[:1].upper() + text[1:]


def short(value: float, missing: str = "–") -> str:
    """Two digits, without a power of ten from 0.01 to 100000; a dash for no value.

    Examples
    --------
    >>> short(12345.0), short(0.0123456), short(1.26e-7), short(1e6)
    ('12000', '0.012', '1.3e-7', '1e6')
    """
    if math.isnan(value):
        return missing
    if 1e-2 <= abs(value) < 1e5:
        return f"{float(f'{value:.2g}'):g}"
    power = f"{value:.1e}".replace(".0e", "e").replace("e-0", "e-").replace("e+", "e")
    return power.replace("e0", "e") if value else "0"


def time_text(seconds: float) -> str:
    """Two digits of a time with the unit that suits it.

    Examples
    --------
    >>> time_text(2.0), time_text(9.999e-4), time_text(1.23e-5), time_text(3e-8)
    ('2 s', '1 ms', '12 µs', '30 ns')
    """
    if math.isnan(seconds):
        return "–"
    seconds = float(f"{seconds:.2g}")  # 999.9 µs are 1 ms
    units = ((1.0, "s"), (1e-3, "ms"), (1e-6, "µs"), (1e-9, "ns"))
    size, unit = next((pair for pair in units if seconds >= pair[0]), units[-1])
    return f"{short(seconds / size)} {unit}"

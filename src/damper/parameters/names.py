"""Names of quantities of single masses, and the right name for a wrong one."""

import difflib
from collections.abc import Iterable, Sequence

#: Quantities of a single mass, in the names of `damper.Parameters` and of `SIParameters`.
OF_A_MASS = (
    *("mass_ratio", "clearance", "restitution", "restitution_left", "gravity", "friction"),
    *("yield_speed", "yield_exponent", "support_stiffness_ratio", "support_damping_ratio"),
    *("mass_share", "clearance_factor"),
)
OF_A_MASS_SI = (
    *("free_mass", "gap", *OF_A_MASS[2:5], "friction_coefficient"),
    *("yield_speed", "yield_exponent", "support_stiffness", "support_damping", *OF_A_MASS[-2:]),
)
#: Quantities of a free mass in a box of a structure.
OF_A_MASS_STRUCTURE = (
    *("box", "free_mass", "gap", *OF_A_MASS[2:5], "friction_coefficient"),
    *("yield_speed", "yield_exponent", "tie_stiffness", "tie_damping", "pendulum_length"),
)
#: Most masses of a damper.
MOST_MASSES = 100
#: In either system.
OF_ANY_MASS = tuple(dict.fromkeys((*OF_A_MASS, *OF_A_MASS_SI)))

#: Symbol, as users may type it, or name of an earlier version -> name.
#: `damper.parameters.quantities` adds each quantity.
NAMES_BY_SYMBOL = {"v0": "initial_velocity", "at": "when"}

#: Name of an earlier version -> the setting, field or variable in its place.
REPLACED = dict.fromkeys(
    ("unit_count", "clearance_spread"),
    "masses: {count: 4, clearance_spread: 0.2}, "
    "in Python masses=damper.equal_masses(4, clearance_spread=0.2)",
) | {
    "time_in_period": "time_in_cycle",
    "burst_onset_period": "burst_onset_cycle",
    "burst_onset_time_in_period": "burst_onset_time_in_cycle",
}


def split(name: object, names: Sequence[str] = OF_ANY_MASS) -> tuple[str, int] | None:
    """Return quantity and number of the mass that a name has, none for other names.

    Examples
    --------
    >>> split("restitution_left_1"), split("clearance")
    (('restitution_left', 1), None)
    """
    if not isinstance(name, str):
        return None
    common, _, number = name.rpartition("_")
    is_number = number.isdecimal() and number == str(int(number)) and int(number) < MOST_MASSES
    return (common, int(number)) if is_number and common in names else None


def common_name(name: str) -> str:
    """Return the quantity that a name is of, also where it is that of a single mass.

    Examples
    --------
    >>> common_name("clearance_1"), common_name("clearance")
    ('clearance', 'clearance')
    """
    return (split(name) or (name,))[0]


def counted(count: int, noun: str) -> str:
    """Return a number of things in words.

    Examples
    --------
    >>> counted(1, "impact"), counted(0, "impact"), counted(2, "mass")
    ('1 impact', '0 impacts', '2 masses')
    """
    ending = "" if count == 1 else "es" if noun.endswith("s") else "s"
    return f"{count} {noun}{ending}"


def nearest(name: str, names: Iterable[str]) -> str:
    """Return the one of `names` that `name` was probably meant to be, or nothing.

    Examples
    --------
    >>> from damper.parameters.quantities import ALL
    >>> nearest("clearence", ALL), nearest("mu", ALL), nearest("sharpness", ALL)
    ('clearance', 'mass_ratio', '')
    """
    names = list(names)
    if NAMES_BY_SYMBOL.get(name) in names:
        return NAMES_BY_SYMBOL[name]
    common, _, number = name.rpartition("_")
    if number.isdecimal() and {*OF_ANY_MASS} <= {*names}:
        near = nearest(common, OF_ANY_MASS)
        return near and f"{near}_{number}"
    folded = {right.casefold(): right for right in names}
    close = difflib.get_close_matches(name[:100].casefold(), folded, n=1)
    close += [right for right in folded if name.casefold() in right.split("_")]
    return folded[close[0]] if close else ""


def unknown_name(
    what: str, name: object, names: Iterable[str], others: Iterable[str] = ()
) -> TypeError:
    """Return the error for an unknown `name`, with `names` and the nearest of them or of others."""
    names = list(names)
    if isinstance(name, str) and name in REPLACED:
        return TypeError(f"unknown {what} {name!r}: write {REPLACED[name]}")
    near = nearest(name, [*names, *others]) if isinstance(name, str) else ""
    hint = f" (did you mean {near!r}?)" if near not in ("", name) else ""
    known = f"must be one of {', '.join(names)}" if names else "there are none"
    return TypeError(f"unknown {what} {name!r}{hint}: {known}")

"""Several free masses of one damper: what each has of its own, in place of what all have."""

from collections.abc import Iterable, Mapping
from typing import Any

from damper.parameters.quantity import real

#: What a mass may have of its own, in the names of `damper.Parameters` and of `SIParameters`.
OF_A_MASS = ("mass_ratio", "clearance", "restitution", "restitution_left", "gravity")
OF_A_MASS_SI = ("free_mass", "gap", *OF_A_MASS[2:])
#: Most masses of a damper.
MOST_MASSES = 100


class Mass(tuple[tuple[str, float], ...]):
    """What one of several free masses has of its own: pairs of name and value."""

    def __repr__(self) -> str:
        return repr(dict(self))


def read_masses(given: Any, names: tuple[str, ...] = OF_A_MASS) -> tuple[Mass, ...]:
    """Check a sequence of mappings.

    Raises
    ------
    ValueError, TypeError
        With the number of the mass, from 1, and what is wrong.
    """
    if isinstance(given, str | bytes | Mapping) or not isinstance(given, Iterable):
        raise TypeError(f"masses = {given!r}: must be a sequence of mappings, one for each mass")
    read = tuple(_mass(f"masses[{k}]", one, names) for k, one in enumerate(given))
    if not 1 <= len(read) <= MOST_MASSES:
        raise ValueError(
            f"masses: {len(read)} are given; must be 1 to {MOST_MASSES}, or left out for one"
        )
    return read


def _mass(where: str, given: Any, names: tuple[str, ...]) -> Mass:
    if isinstance(given, Mass):
        return given
    if not isinstance(given, Mapping):
        raise TypeError(
            f"{where} = {given!r}: must be a mapping of what this mass has of its own, as "
            "{'clearance': 1.2}; {} is one like the others"
        )
    for name in given:
        if name not in names:
            from damper.parameters.quantities import unknown_name

            raise TypeError(f"{where}: {unknown_name('quantity of a mass', name, names)}")
    return Mass((name, real(f"{where}.{name}", given[name])) for name in names if name in given)

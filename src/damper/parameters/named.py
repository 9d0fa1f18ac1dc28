"""Numbers of a damper by their names: its quantities, those of single masses and of its force.

`harmonic_2` and `harmonic_2_phase` are amplitude and phase of the harmonic of order 2 of
`damper.Harmonics`. Motions are followed along these as along any quantity.
"""

import sys
from collections.abc import Mapping, Sequence
from functools import lru_cache
from typing import Any, TypeVar

from damper.parameters.dampers import Parameters, SIParameters
from damper.parameters.masses import (
    changed_in,
    own_names,
    refuse_untaken,
    value_in,
    with_own,
)
from damper.parameters.names import OF_ANY_MASS, split, unknown_name
from damper.parameters.quantities import INITIAL_NAMES, SI_ONLY, is_si, of_a_mass
from damper.parameters.quantity import Quantity, check_needs
from damper.parameters.tables import TABLE_SPEED, WALL_TABLES, tables_over

Names = tuple[str, ...]
#: Arguments of what runs a damper, beside its parameters: names that may be meant.
_BESIDE = ("until", "state", "accuracy", "max_events", "samples_per_period")
Damper = TypeVar("Damper", bound=Parameters | SIParameters)


def _of(parameters: Any, *names: str) -> Any:
    """Return parameters that are of such a class of `structural`, else None.

    That module loads numpy: where it is not loaded nothing is of it.
    """
    module = sys.modules.get("damper.parameters.structural")
    if module and isinstance(parameters, tuple(getattr(module, name) for name in names)):
        return parameters
    return None


def named_quantity(parameters: Parameters | SIParameters, name: str) -> Quantity:
    """Return the quantity of a continuous number; TypeError with the nearest name for other
    names."""
    if not isinstance(name, str):
        raise TypeError(f"parameter = {name!r}: must be the name of a parameter")
    if structure := _of(parameters, "StructureParameters"):
        return structure.quantity_of(name)  # type: ignore[no-any-return]
    varied = {q.name: q for q in parameters.quantities if not q.whole}
    varied |= {
        f"{of}_{k}": of_a_mass(varied[of], k)
        for k in range(len(parameters.masses or ()))
        for of in OF_ANY_MASS
        if of in varied
    }
    varied |= {q.name: q for q in parameters.forcing.quantities}
    if name.rstrip("_0123456789") in INITIAL_NAMES:
        raise TypeError(f"{name} is where a run starts, which is no parameter of a periodic motion")
    if name not in varied:
        raise unknown_name("parameter", name, varied)
    refuse_untaken([name], own_names((), parameters.masses))
    return varied[name]


def value_of(parameters: Parameters | SIParameters, name: str) -> float:
    """Value of a number of a damper; a mass without one of its own has that of all."""
    if structure := _of(parameters, "ScaledParameters", "StructureParameters"):
        return float(structure.value_of(name))
    own = parameters.forcing.numbers
    if name == TABLE_SPEED:
        return 1.0
    if name in own:
        return own[name]
    return float(value_in(vars(parameters), name))


def with_values(parameters: Damper, values: Mapping[str, float]) -> Damper:
    """Return the damper with other values of some numbers; on a structure in the same units."""
    if structure := _of(parameters, "ScaledParameters", "StructureParameters"):
        return structure.beside(values)  # type: ignore[no-any-return]
    forcing = parameters.forcing
    of_force = {name: v for name, v in values.items() if name in forcing.numbers}
    others = {name: v for name, v in values.items() if name not in of_force}
    slower = 1.0 / others.pop(TABLE_SPEED, 1.0)
    changed = changed_in(vars(parameters), others)
    if slower != 1.0:
        changed |= tables_over({**vars(parameters), **changed}, slower)
    if of_force:
        changed["forcing"] = forcing.having(of_force)
    return parameters.replaced(**changed)  # type: ignore[return-value]


def rates_of(parameters: Parameters | SIParameters, name: str) -> dict[str, float]:
    """As `SIParameters.rates`; the numbers of a force have no units.

    On a structure parameters are not scaled.
    """
    if _of(parameters, "StructureParameters"):
        return {name: 1.0}
    own = parameters.forcing.numbers
    return {name: 1.0} if name in own else parameters.rates(name)


def completed(values: Mapping[str, Any]) -> dict[str, Any]:
    """Return values by name with those that need not be given under their force.

    Examples
    --------
    >>> completed({"clearance": 1.0, "forcing": "none"})
    {'frequency_ratio': 1.0, 'clearance': 1.0, 'forcing': 'none'}
    """
    if "forcing" not in values:
        return dict(values)
    kind = Parameters if SI_ONLY.isdisjoint(values) else SIParameters
    return {**kind.left_out(values["forcing"]), **values}


def size_of(parameters: Parameters, name: str) -> float:
    """Size of a change of a number that counts as of order 1."""
    structure = _of(parameters, "ScaledParameters")
    return float(structure.size_of(name)) if structure else 1.0


# The points of a study all have the same names.
@lru_cache(maxsize=16)
def language(
    names: Names,
) -> tuple[type[Parameters] | type[SIParameters], Names, Names, Names]:
    """Return the class of the parameters, their names, those of single masses and initial ones."""
    initial = tuple(name for name in INITIAL_NAMES if name in names)
    parameters = tuple(name for name in names if name not in INITIAL_NAMES)
    si = is_si(parameters)
    kind = SIParameters if si else Parameters
    known = {q.name: q for q in kind.quantities}
    for name in parameters:
        if not (name in known or split(name) or name in ("forcing", "masses", *WALL_TABLES)):
            raise unknown_name("parameter", name, known, _BESIDE)
    missing = [
        name
        for name, q in known.items()
        if name not in parameters and q.unless not in parameters and q.default is None
    ]
    if missing and not ("masses" in parameters and {*missing} <= {*OF_ANY_MASS}):
        raise TypeError(f"missing parameters: {', '.join(missing)}")
    # A quantity of single masses may need what only they have: each damper is checked for that.
    every = () if "masses" not in parameters else OF_ANY_MASS
    check_needs((q for q in known.values() if q.name not in every), parameters)
    own = tuple(name for name in parameters if split(name))
    return kind, tuple(name for name in parameters if name not in own), own, initial


def arguments(
    kind: type[Parameters] | type[SIParameters],
    names: Sequence[str],
    own: Sequence[str],
    values: Mapping[str, Any],
) -> dict[str, Any]:
    """Return arguments of a damper, with what single masses have of their own in `masses`."""
    made = {name: values[name] for name in names}
    if not own and made.get("masses") is None:
        return made
    masses = with_own(made.get("masses"), {name: values[name] for name in own})
    return kind.of_masses(masses, made) | made | {"masses": masses}


def damper_of(values: Mapping[str, Any]) -> Parameters | SIParameters:
    """Return the damper of values as for `read_point`, initial quantities aside."""
    kind, names, own, _ = language(tuple(values))
    return kind(**arguments(kind, names, own, values))

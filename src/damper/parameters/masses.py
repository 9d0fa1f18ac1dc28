"""Several free masses of a damper: the values of each mass, in place of the values for all.

The masses are counted from 0, as in the field `body` of events. `clearance_1` is the clearance of
mass 1; by this name it can be an axis, be drawn, or replace a value.
"""

from collections.abc import Collection, Iterable, Mapping, Sequence
from typing import Any

from damper.parameters.names import MOST_MASSES, OF_A_MASS, OF_ANY_MASS, split, unknown_name
from damper.parameters.quantity import QuantityClass, in_range, is_listed, real, whole
from damper.parameters.tables import TABLE_OF, WALL_TABLES, read_table
from damper.parameters.unit_text import number_in

#: Arguments of `equal_masses`.
EQUAL = ("count", "clearance_spread")


class Mass(tuple[tuple[str, Any], ...]):
    """The values of one of several free masses: pairs of name and value."""

    def __repr__(self) -> str:
        return repr(dict(self))


def equal_masses(count: int, clearance_spread: float = 0.0) -> list[dict[str, float]]:
    """Return `masses` that share one free mass equally, and whose clearances are spread.

    Each mass has the whole support of the damper, if there is one.

    Parameters
    ----------
    count : int
        Number of masses, 1 to 100.
    clearance_spread : float, default 0
        The clearances go in even steps from 1 - spread to 1 + spread times the damper's clearance;
        0 <= clearance_spread < 1.

    Examples
    --------
    >>> equal_masses(2, clearance_spread=0.25)
    [{'mass_share': 0.5, 'clearance_factor': 0.75}, {'mass_share': 0.5, 'clearance_factor': 1.25}]
    """
    count = whole("count", count, 1, most=MOST_MASSES)
    spread = in_range("clearance_spread", clearance_spread, minimum=0.0, maximum=1.0, below=True)
    steps = [2.0 * k / (count - 1.0) - 1.0 for k in range(count)] if count > 1 else [0.0]
    return [{"mass_share": 1.0 / count, "clearance_factor": 1.0 + spread * at} for at in steps]


def read_masses(
    given: Any, names: tuple[str, ...] = OF_A_MASS, units: Mapping[str, str] = {}
) -> tuple[Mass, ...]:
    """Check a sequence of mappings; `units` are those of names whose text may have a unit.

    Raises
    ------
    ValueError, TypeError
        With the number of the mass, and what is wrong.
    """

    def read(where: str, name: str, value: Any) -> float:
        return real(where, number_in(where, value, [units.get(name, "")]))

    return tuple(
        Mass(
            (name, read_table(f"masses[{k}].{name}", one[name], units.get("yield_speed", "1")))
            if name in WALL_TABLES
            else (name, read(f"masses[{k}].{name}", name, one[name]))
            for name in (*names, *WALL_TABLES)
            if name in one
        )
        for k, one in enumerate(listed(given, (*names, *WALL_TABLES)))
    )


def listed(given: Any, names: Sequence[str] = (*OF_ANY_MASS, *WALL_TABLES)) -> list[dict[str, Any]]:
    """Check that masses are mappings of known names, whatever their values are.

    A mapping with `count` has the arguments of `equal_masses`.
    """
    if isinstance(given, Mapping) and "count" in given:
        for name in given:
            if name not in EQUAL:
                raise unknown_name("key of masses", name, EQUAL)
        return equal_masses(**given)
    if not is_listed(given):
        raise TypeError(
            f"masses = {given!r}: must be a sequence of mappings, one for each mass, "
            "or {'count': 4, 'clearance_spread': 0.2}"
        )
    read = [_mass(f"masses[{k}]", one, names) for k, one in enumerate(given)]
    if not 1 <= len(read) <= MOST_MASSES:
        raise ValueError(
            f"masses: {len(read)} are given; must be 1 to {MOST_MASSES}, or left out for one"
        )
    return read


def own_values(masses: Iterable[Mapping[str, Any]]) -> dict[str, Any]:
    """Return what masses have of their own, but for tables, under names that `split` takes apart.

    Examples
    --------
    >>> own_values([{}, {"clearance": 1.2}])
    {'clearance_1': 1.2}
    """
    return {
        f"{name}_{k}": value
        for k, one in enumerate(masses)
        for name, value in one.items()
        if name not in WALL_TABLES
    }


def with_own(
    masses: Any, own: Mapping[str, Any], names: Sequence[str] = OF_ANY_MASS
) -> list[dict[str, Any]]:
    """Return masses with other values of their own; `own_values` is the inverse.

    Raises
    ------
    ValueError
        For a value of a mass that there is not.
    """
    made = [] if masses is None else listed(masses, (*names, *WALL_TABLES))
    for name, value in own.items():
        common, k = split(name, names) or (name, 0)
        if not k < len(made):
            raise ValueError(f"{name} = {value!r}: {no_such_mass(k, len(made))}")
        made[k][common] = value
    return made


def no_such_mass(k: int, count: int) -> str:
    """Say that a damper has no mass of this number."""
    there = f"masses has {count}, from 0" if count else "there is no list masses"
    return f"is of mass {k}, and {there}"


def of_first_mass(kind: type[QuantityClass], masses: Any, given: Collection[str]) -> dict[str, Any]:
    """Return what must be given of a damper and only its masses give: the values of the first.

    Raises
    ------
    TypeError
        For a quantity that is missing, of the damper and of one of its masses.
    ValueError, TypeError
        For a value that is not allowed.
    """
    made = [{}] if masses is None else listed(masses)
    lacking = [
        q
        for q in kind.quantities
        if q.default is None and q.name not in given and q.unless not in given
    ]
    if missing := [
        f"{q.name} or {q.unless}" if q.unless else q.name
        for q in lacking
        if any(q.name not in mass and q.unless not in mass for mass in made)
    ]:
        of = "" if masses is None else ", of all masses or of each"
        raise TypeError(f"missing parameters{of}: {', '.join(missing)}")
    try:
        return {q.name: q.check(made[0][q.name]) for q in lacking if q.name in made[0]}
    except (ValueError, TypeError) as error:
        raise type(error)(f"mass 0: {error}") from None


def own_names(given: Collection[str], masses: Sequence[Any] | None) -> list[set[str]]:
    """Names of what each mass has of its own, in `masses` or given as `clearance_1` is.

    Examples
    --------
    >>> own_names(["clearance", "clearance_1"], [{"gravity": 0.1}, {}])
    [{'gravity'}, {'clearance'}]
    """
    return [
        {name for name in OF_ANY_MASS if f"{name}_{k}" in given} | {*dict(one)}
        for k, one in enumerate(masses or ())
    ]


def taken_by_none(name: str, own: Collection[Collection[str]]) -> bool:
    """Whether a value for all masses has no effect, by the names of what each has of its own."""
    return bool(own) and all(name in one or TABLE_OF.get(name) in one for one in own)


def refuse_untaken(names: Iterable[str], own: Collection[Collection[str]]) -> None:
    """Raise ValueError for a name that `taken_by_none`."""
    for name in names:
        if taken_by_none(name, own):
            raise ValueError(
                f"{name}: each of masses has its own, so that for all has no effect: "
                f"give {name}_0, or leave {name} out of masses"
            )


def value_in(values: Mapping[str, Any], name: str) -> Any:
    """Value of a quantity of a damper, or of one of its masses: if not its own, that of all."""
    common, k = split(name) or (name, -1)
    own = {} if k < 0 else dict(values["masses"][k])
    return own.get(common, values[common])


def changed_in(values: Mapping[str, Any], changes: Mapping[str, Any]) -> dict[str, Any]:
    """Arguments of a damper that change where its quantities, or those of its masses, do."""
    own = {name: value for name, value in changes.items() if split(name)}
    made = {name: value for name, value in changes.items() if name not in own}
    return made | ({"masses": with_own(values["masses"], own)} if own else {})


def _mass(where: str, given: Any, names: Sequence[str]) -> dict[str, Any]:
    if isinstance(given, Mass):
        return dict(given)
    if not isinstance(given, Mapping):
        raise TypeError(
            f"{where} = {given!r}: must be a mapping of what this mass has of its own, as "
            "{'clearance': 1.2}; {} is one like the others"
        )
    for name in given:
        if name not in names:
            raise TypeError(f"{where}: {unknown_name('quantity of a mass', name, names)}")
    return dict(given)

"""Observers: passes over the segment log, one file each.

A file has its observer's name, and the first class in it that derives from
`damper.observers.common.base.Observer` is the observer: nothing else names it. An observer that
nobody asks for is neither imported nor compiled. Observers only read the log, so they cannot change
the trajectory.
"""

import pkgutil
from collections.abc import Iterable, Mapping
from importlib import import_module
from types import ModuleType
from typing import TYPE_CHECKING, Any, TypeVar

from damper.parameters.models import unknown_model
from damper.parameters.names import unknown_name
from damper.parameters.quantity import is_listed

if TYPE_CHECKING:
    from damper.observers.common.base import Observer
    from damper.parameters.variables import Variable

Base = TypeVar("Base")

#: Names of all observers, those of the files here.
OBSERVERS = tuple(module.name for module in pkgutil.iter_modules(__path__) if not module.ispkg)


def observer_class(name: str) -> "type[Observer]":
    """Import an observer's class by the observer's name; ValueError with the known ones."""
    if name not in OBSERVERS:
        raise ValueError(str(unknown_name("observer", name, OBSERVERS)))
    from damper.observers.common.base import Observer

    return class_in(import_module(f"{__name__}.{name}"), Observer)


def writable(name: str) -> list[tuple["Variable", str]]:
    """Return every variable that an observer can write, with the setting that asks for it, if any.

    Examples
    --------
    >>> [(variable.name, setting) for variable, setting in writable("impacts")][3:]
    [('approach_speed', 'speeds'), ('max_impulse', 'largest'), ('max_impact_loss', 'largest')]
    """
    cls = observer_class(name)
    more = {key: _unlike(s.default) for key, s in cls.settings.items() if key != "bodies"}
    made = {"": cls()} | {key: cls(**{key: v}) for key, v in more.items() if v is not None}
    found: dict[str, tuple[Variable, str]] = {}
    for key, observer in made.items():
        for variable in observer.variables:
            found.setdefault(variable.name, (variable, key))
    return list(found.values())


def _made(kind: "type[Observer]", given: Mapping[str, Any], boxes: bool) -> "Observer":
    """Make an observer; where it is to observe several free masses, one for each."""
    observer = kind(**given)
    observer.check_together()
    if not observer.bodies or observer.sees_all:
        return observer
    from damper.observers.common.bodies import OfEachBody

    return OfEachBody(kind, given, boxes)


def _unlike(default: Any) -> Any:
    """Return a value that asks for more than the default of a setting; None if none does."""
    if isinstance(default, bool):
        return not default
    if default == ():
        return (0.5,)
    return 1 if isinstance(default, int) and default == 0 else None


def class_in(module: ModuleType, base: type[Base]) -> type[Base]:
    """Return the first class of a module's own that derives from `base`."""
    return next(
        value
        for value in vars(module).values()
        if isinstance(value, type)
        and issubclass(value, base)
        and value.__module__ == module.__name__
    )


def requests(requested: Any) -> list[tuple[Any, Any]]:
    """Return name and settings of each observer; None stands for its default settings.

    `requested` is as for `make_observers`; TypeError where it is neither names nor a mapping.
    """
    if isinstance(requested, Mapping):
        return [*requested.items()]
    named = [requested] if isinstance(requested, str) else requested
    if not is_listed(named):
        raise TypeError(
            f"observers = {requested!r}: must be names, or a mapping from names to settings"
        )
    return [(name, None) for name in named]


def make_observers(
    requested: Iterable[str] | Mapping[str, Mapping[str, Any] | None], boxes: bool = False
) -> list[Any]:
    """Import and construct just the observers that are asked for.

    Parameters
    ----------
    requested : iterable of str, or mapping of str to settings
        Observer names; a mapping gives each one's settings (or None).
    boxes : bool, default False
        Whether the primary of each free mass is its box on a structure.

    Returns
    -------
    list
        One observer object per name, in order.

    Raises
    ------
    ValueError
        For an unknown name or setting (with the known ones), a setting out of range, or two
        observers that write one variable.
    TypeError
        For what are not names or settings.
    """
    made: list[Any] = []
    owner: dict[str, str] = {}
    for name, given in requests(requested):
        if not isinstance({} if given is None else given, Mapping):
            raise TypeError(f"observers: {name} = {given!r}: must be a mapping of settings")
        if not all(isinstance(key, str) for key in given or ()):
            raise TypeError(f"observers: {name} = {given!r}: settings have names")
        observer = _made(observer_class(name), given or {}, boxes)
        for variable in observer.variables:
            if variable.name in owner:
                raise ValueError(
                    f"observers {owner[variable.name]!r} and {name!r} both write "
                    f"{variable.name!r}: ask for one of them"
                )
            owner[variable.name] = name
        for other in made:
            if observer.bodies and other.bodies and observer.bodies != other.bodies:
                raise ValueError(
                    f"observers {other.name!r} and {name!r} observe other masses, "
                    f"{list(other.bodies)} and {list(observer.bodies)}: give both the same"
                )
        made.append(observer)
    return made


def of_all_masses(
    observers: Mapping[str, Mapping[str, Any] | None], count: int
) -> dict[str, dict[str, Any]]:
    """Settings of observers of single masses, which see every one of so many.

    Raises
    ------
    ValueError
        For an observer that knows no structures, and for some of the masses or runs alone.
    """
    every, found = list(range(count)), {}
    for name, given in observers.items():
        settings, models = dict(given or {}), observer_class(name).models
        if "structure" not in models:
            raise ValueError(unknown_model(name, "structure", models))
        if settings.get("at"):
            raise ValueError(f"{name}.at: on a structure every run is observed; leave it out")
        if "bodies" in observer_class(name).settings:
            if list(settings.get("bodies") or every) != every:
                raise ValueError(
                    f"{name}.bodies = {settings['bodies']!r}: on a structure each mass is "
                    "observed; leave it out"
                )
            settings["bodies"] = every
        found[name] = settings
    return found

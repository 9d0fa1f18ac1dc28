"""Observers: passes over the segment log, one file each.

An observer is a class with

- ``variables``: the `Variable` descriptions of what it adds to a cube;
- ``arrays``: name -> array with the run as first axis, allocated by ``allocate(runs, periods)``;
- ``begin(run, trajectory, window)``, ``observe(log)`` for every piece of the log, and
  ``finish(finished)`` with whether the run reached its end.

An observer that is not asked for is neither imported nor compiled. None of them can change the
trajectory: they only read the log.
"""

from collections.abc import Iterable, Mapping
from importlib import import_module
from typing import Any

#: Name in study files -> module and class.
OBSERVERS = {
    "stroboscopic_section": ("damper.observers.stroboscopic_section", "StroboscopicSection"),
    "impact_section": ("damper.observers.impact_section", "ImpactSection"),
    "impacts": ("damper.observers.impacts", "Impacts"),
    "bursts": ("damper.observers.bursts", "Bursts"),
    "burst_at": ("damper.observers.burst_at", "BurstAt"),
    "chatter_bursts": ("damper.observers.chatter_bursts", "ChatterBursts"),
    "response": ("damper.observers.response", "Response"),
    "accumulation": ("damper.observers.accumulation", "Accumulation"),
    "trajectory": ("damper.observers.trajectory", "SampledTrajectory"),
}


def make_observers(
    requested: Iterable[str] | Mapping[str, Mapping[str, Any] | None],
) -> list[Any]:
    """Import and construct just the observers that are asked for.

    Parameters
    ----------
    requested : iterable of str, or mapping of str to settings
        Observer names; a mapping gives each one's keyword arguments (or None).

    Returns
    -------
    list
        One observer object per name, in order.

    Raises
    ------
    ValueError
        For an unknown name (with the known ones) or two observers that write one variable.
    """
    if isinstance(requested, str):
        requested = [requested]
    settings = requested if isinstance(requested, Mapping) else dict.fromkeys(requested)
    made: list[Any] = []
    owner: dict[str, str] = {}
    for name, keywords in settings.items():
        if name not in OBSERVERS:
            raise ValueError(f"unknown observer {name!r}: must be one of {', '.join(OBSERVERS)}")
        module, cls = OBSERVERS[name]
        observer = getattr(import_module(module), cls)(**(keywords or {}))
        for variable in observer.variables:
            if variable.name in owner:
                raise ValueError(
                    f"observers {owner[variable.name]!r} and {name!r} both write "
                    f"{variable.name!r}: ask for one of them"
                )
            owner[variable.name] = name
        made.append(observer)
    return made

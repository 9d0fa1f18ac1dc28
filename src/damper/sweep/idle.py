"""Idle runs, whose free mass touches no wall, and what they say where they start at exact rest."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from typing import Any

from damper.parameters.names import common_name
from damper.parameters.quantities import INITIAL_NAMES

#: Quantities other than 0 that give an idle free mass a velocity, or hold it in its place.
_MOVED = (*INITIAL_NAMES, "gravity", "friction", "support_stiffness_ratio", "support_stiffness")

#: Variables that tell whether the walls are touched.
CONTACT = ("impacts_per_period", "bursts_per_period", "sticking_fraction")


def contact(cube: Any) -> Any:
    """Return whether the walls are touched at each point, NaN where a run stopped.

    Is None if the cube holds no impacts and no bursts.
    """
    known = [cube[name] for name in CONTACT if name in cube]
    if not known:
        return None
    touched = known[0] > 0.0
    for one in known[1:]:
        touched = touched | (one > 0.0)
    return touched.where(known[0].notnull())


def of_any_mass(array: Any) -> Any:
    """Greatest value of all free masses, such as whether one of them touches a wall."""
    return array.max("body") if "body" in array.dims else array


def starts_at_exact_rest(primary: str, values: Mapping[str, Iterable[float]]) -> bool:
    """Whether runs start at exact rest, and nothing but that keeps a free mass from the walls.

    A free mass at rest between its walls may stay there for ever, while any relative velocity takes
    it to a wall. Such runs say nothing about the damper. `values` are those of each quantity.
    """
    moved = (values[name] for name in values if common_name(name) in _MOVED)
    return primary == "rest" and not any(value != 0.0 for along in moved for value in along)


def from_exact_rest(cube: Any) -> bool:
    """Whether all runs of a cube start at exact rest; see `starts_at_exact_rest`."""
    values: dict[str, Any] = {str(name): cube[name].values.flat for name in cube.coords}
    return starts_at_exact_rest(cube.attrs.get("primary_starts", ""), values)


def idle_from_rest(cube: Any) -> dict[str, int]:
    """Attribute of a cube that counts the idle runs from exact rest, if there are any."""
    touched = contact(cube) if from_exact_rest(cube) else None
    count = 0 if touched is None else int((of_any_mass(touched) == 0.0).sum())
    return {"runs_idle_from_rest": count} if count else {}

"""A point of a study: a mapping of names to values -> parameters, units and initial state."""

import math
from collections.abc import Mapping, Sequence
from typing import Any, NamedTuple

from damper.models import box_motion
from damper.models.walls import slack
from damper.parameters import Parameters, SIParameters, State, Units
from damper.parameters.masses import own_names, refuse_untaken, with_own
from damper.parameters.named import arguments, completed, language
from damper.parameters.quantities import ALL, check_initial
from damper.parameters.quantity import check_needs_of
from damper.parameters.state import require_state
from damper.parameters.structural import StructureParameters
from damper.parameters.warned import warn
from damper.theory.steady import steady_state

#: Where the primary may start.
PRIMARY_STARTS = ("rest", "steady")


class Point(NamedTuple):
    """Dimensionless parameters of a run, the sizes of its units, and how it starts."""

    parameters: Parameters
    units: Units
    initial: Mapping[str, float]
    """Initial quantities that are given, dimensionless."""
    primary: str

    def start(self) -> State | None:
        """Return the initial state, or None for rest with the free mass at the centre.

        The free mass is placed between the walls and moves relative to the primary, so every
        combination of initial quantities lies in the box.
        """
        if self.primary == "rest" and not self.initial:
            return None
        x, v = steady_state(self.parameters) if self.primary == "steady" else (0.0, 0.0)
        x = self.initial.get("initial_displacement", x)
        v = self.initial.get("initial_velocity", v)
        if "prescribed" in self.parameters.features:
            x, v = box_motion(self.parameters, State(x, v, x, v))
        place = self.initial.get("initial_position", 0.0)
        if self.parameters.hits_stop:  # which stands still, wherever the primary starts
            return State(x, v, place * self.parameters.clearance, 0.0)
        spacing = self.initial.get("initial_spacing", 0.0)
        places = [thrown_back(place + k * spacing) for k in range(len(self.parameters.each))]
        y = self._placed(x, places)
        return State(x, v, y, v + self.initial.get("initial_relative_velocity", 0.0))

    def _placed(self, x: float, places: Sequence[float]) -> Any:
        """Displacement of the free mass, or of each of several, at parts of their clearances."""
        each = self.parameters.each
        found = tuple(x + place * p.clearance for place, p in zip(places, each, strict=True))
        return found if "several" in self.parameters.features else found[0]

    def carried_over(self, before: "Point", end: State) -> State:
        """Return the end of a neighbour's run as the start of this one."""
        length = before.units.length / self.units.length
        speed = before.units.speed / self.units.speed
        here, there = len(self.parameters.each), before.parameters.each
        if here != len(there):
            raise ValueError(
                f"masses: {here} free masses cannot start from the end of {len(there)}; follow "
                "another axis"
            )
        places = []
        ends, speeds = end.of_each(here)
        for one, y in zip(there, ends, strict=True):
            walls, apart = one.clearance, y - end.x
            place = apart / walls if walls > 0.0 else 0.0
            if walls > 0.0 and walls - abs(apart) <= slack(walls, end.x, y):
                # In contact by the engine's own rule, to stay so however far apart the walls are.
                place = math.copysign(1.0, apart)
            places.append(place)
        x, v = length * end.x, speed * end.v
        # The local time again is a part of the cycle, whatever its length now is.
        time = end.time / before.parameters.cycle * self.parameters.cycle
        if self.parameters.hits_stop:
            # The stop stays where it is; the primary keeps its place between its walls.
            y = length * ends[0]
            return State(y - places[0] * self.parameters.clearance, v, y, 0.0, time)
        us = [v + speed * (u - end.v) for u in speeds]
        u = tuple(us) if isinstance(end.u, tuple) else us[0]
        return State(x, v, self._placed(x, places), u, time)


def read_point(values: Mapping[str, Any], primary: str = "rest") -> Point:
    """Check and scale one point.

    Parameters
    ----------
    values : mapping of str to float
        All parameters of one system of units, and initial quantities that are not zero; `forcing`
        is a force, or its name, and `masses` as for `damper.Parameters`; `clearance_1` is the
        clearance of mass 1. A quantity that every mass gives by itself may be left out for all.
    primary : {"rest", "steady"}
        Where the primary starts.

    Raises
    ------
    ValueError, TypeError
        For unknown, missing or mixed names and for values out of range.
    """
    # A sweep keeps its points; a damper in SI units would take four times the memory.
    return read_damper(values, primary)[0]


def read_damper(
    values: Mapping[str, Any], primary: str = "rest"
) -> tuple[Point, Parameters | SIParameters]:
    """As `read_point`, and the damper in the units in which it is given."""
    if primary not in PRIMARY_STARTS:
        raise ValueError(f"primary = {primary!r}: must be one of {', '.join(PRIMARY_STARTS)}")
    kind, names, own, given = language(tuple(values))
    damper = kind.unchecked(**arguments(kind, names, own, values))
    if damper.masses is not None:
        check_needs_of(damper, names)  # of all others `language` has asked this
    parameters, units = damper.dimensionless, damper.units
    initial = {
        name: check_initial(name, values[name], kind is SIParameters) / units.size(ALL[name].units)
        for name in given
    }
    if initial.get("initial_spacing") and len(parameters.each) == 1:
        raise ValueError(
            f"initial_spacing = {initial['initial_spacing']!r} with one free mass: it is the "
            "distance of each of several from the one before; leave it out, or give masses"
        )
    if "prescribed" in parameters.features and not parameters.forcing.samples:
        for name in ("initial_displacement", "initial_velocity"):
            if name in initial:
                raise ValueError(f"{name} with carrier = 'prescribed': the box has its own motion")
    if parameters.hits_stop and initial.get("initial_relative_velocity"):
        raise ValueError(
            f"initial_relative_velocity = {values['initial_relative_velocity']!r} with "
            f"{'free_mass' if kind is SIParameters else 'mass_ratio'} = inf: a fixed stop does not "
            "move; give initial_velocity, that of the primary"
        )
    if primary == "steady":
        for name in ("initial_displacement", "initial_velocity"):
            if name in initial:
                raise ValueError(
                    f"{name} is given, but the primary starts on its steady response: "
                    "one of the two must go"
                )
        steady_state(parameters)
    return Point(parameters, units, initial, primary), damper


def thrown_back(place: float) -> float:
    """Place between walls at -1 and 1 of what goes on to a place beyond them, each wall a mirror.

    Examples
    --------
    >>> [thrown_back(place) for place in (0.5, 1.5, 3.5, 5.0)]
    [0.5, 0.5, -0.5, 1.0]
    """
    return place if -1.0 <= place <= 1.0 else abs((place - 1.0) % 4.0 - 2.0) - 1.0


def require_parameters(given: object, structures: bool = False) -> None:
    """Raise TypeError unless it is a damper; with `structures` it may be on one."""
    if isinstance(given, StructureParameters):
        if structures:
            return
        raise TypeError(
            "parameters has a structure: only damper.events, damper.start, damper.run, "
            "damper.simulate, damper.periodic_orbit and studies of kind structure follow structures"
        )
    if not isinstance(given, Parameters | SIParameters):
        raise TypeError(
            f"parameters = {given!r}: must be damper.Parameters or SIParameters; or leave it out "
            "and give its values by name"
        )


def one_run(
    parameters: Any, state: State | None, values: Mapping[str, Any], structures: bool = False
) -> tuple[Any, State | None]:
    """Return damper and start of one run: given as objects, or by values that replace theirs.

    With `structures` the damper may be in a box of a structure.

    Examples
    --------
    >>> damper = Parameters(0.1, 0.05, 0.2, clearance=0.25, restitution=0.6)
    >>> one_run(damper, None, {"restitution": 0.3, "initial_position": 1})[1]
    State(x=0.0, v=0.0, y=0.25, u=0.0, time=0.0)
    """
    require_state(state)
    if structures and isinstance(parameters, StructureParameters):
        return (parameters.having(values) if values else parameters), state
    if structures and parameters is None and values.get("structure") is not None:
        return SIParameters(**values), state
    if parameters is not None or not values:
        require_parameters(parameters)
    if not values:
        return _asked_about(parameters), state
    if parameters:
        masses = with_own(values.get("masses", parameters.masses), {})
        refuse_untaken(values, own_names(values, masses))
        values = parameters.given | dict(values)
    values = completed(values)
    _, _, _, initial = language(tuple(values))
    if initial and state:
        raise ValueError("state stands alone: no initial quantities beside it")
    point, damper = read_damper(values)
    start = point.start()
    return _asked_about(damper), start.times(point.units) if start else state


def _asked_about(parameters: Any) -> Any:
    """Return parameters, with a warning for each value that few machines have."""
    for text in parameters.unusual if isinstance(parameters, SIParameters) else ():
        warn(text)
    return parameters

"""The state that a run starts from, and the quantities by which a study gives it."""

from collections.abc import Callable, Mapping, Set
from dataclasses import dataclass
from typing import Any

from damper.parameters.names import counted
from damper.parameters.quantity import Quantity, finite
from damper.parameters.units import LENGTH, NO_UNITS, SPEED, Units


@dataclass(frozen=True)
class State:
    """Positions and velocities at one time.

    Parameters
    ----------
    x, v : float, or sequence of float
        Displacement (units of F0/K) and velocity of the primary. Of a structure a value for each
        coordinate or mode.
    y, u : float, or sequence of float
        Displacement and velocity of the free mass, in the same frame (not relative). Of several
        masses a value for each, or one for all.
    time : float, default 0
        Time at which the state holds, in units of sqrt(M/K).

    With `SIParameters` these are in m, m/s and s.

    Raises
    ------
    ValueError
        When a value is not finite.
    TypeError
        When a value is not a real number.
    """

    x: Any
    v: Any
    y: Any
    u: Any
    time: float = 0.0

    def __post_init__(self) -> None:
        own = self.__dict__
        for name, value in own.items():
            several = name != "time" and hasattr(value, "__len__")
            if several and not isinstance(value, str | bytes | Mapping | Set):
                names = (f"{name}[{k}]" for k in range(len(value)))
                own[name] = tuple(map(finite, names, value))
            else:
                own[name] = finite(name, value)

    def of_each(self, count: int) -> tuple[list[float], list[float]]:
        """Displacements and velocities of so many free masses."""
        found = []
        for name, value in (("y", self.y), ("u", self.u)):
            values = list(value) if isinstance(value, tuple) else [value] * count
            if len(values) != count:
                raise ValueError(
                    f"state: {name} has {len(values)} values for {counted(count, 'free mass')}: "
                    "must be one number, or one for each"
                )
            found.append(values)
        return found[0], found[1]

    def of_coordinates(self, count: int) -> tuple[list[float], list[float]]:
        """Displacements and velocities of so many coordinates of the primary."""
        found = []
        for name, value in (("x", self.x), ("v", self.v)):
            values = list(value) if isinstance(value, tuple) else [value]
            if len(values) != count:
                given = f"{len(values)} values" if isinstance(value, tuple) else "one number"
                wanted = f"{count} values, one for each coordinate" if count > 1 else "one number"
                raise ValueError(f"state: {name} is {given}: must be {wanted}")
            found.append(values)
        return found[0], found[1]

    def over(self, units: Units) -> "State":
        """Return the state in dimensionless units, given in SI units."""
        if units is NO_UNITS:
            return self
        if self.__dict__.get("_units") == units:
            return self.__dict__["_over_units"]
        return State(
            _each(self.x, lambda value: value / units.length),
            _each(self.v, lambda value: value / units.speed),
            _each(self.y, lambda value: value / units.length),
            _each(self.u, lambda value: value / units.speed),
            self.time / units.time,
        )

    def times(self, units: Units) -> "State":
        """Return the state in SI units, given in dimensionless units; `over` is its inverse.

        To the last bit: the scaled state is kept beside it.
        """
        if units is NO_UNITS:
            return self
        scaled = State(
            _each(self.x, lambda value: value * units.length),
            _each(self.v, lambda value: value * units.speed),
            _each(self.y, lambda value: value * units.length),
            _each(self.u, lambda value: value * units.speed),
            self.time * units.time,
        )
        scaled.__dict__.update(_units=units, _over_units=self)
        return scaled


def _each(value: Any, scaled: Callable[[float], float]) -> Any:
    """One number scaled, or each of several."""
    return tuple(map(scaled, value)) if isinstance(value, tuple) else scaled(value)


def require_state(given: State | None, name: str = "state") -> None:
    """Raise TypeError unless it is a State, or none at all."""
    if given is not None and not isinstance(given, State):
        raise TypeError(f"{name} = {given!r}: must be a damper.State(x, v, y, u)")


#: The state at the start of a run; in an SI study lengths are in m and speeds in m/s.
INITIAL_QUANTITIES = (
    Quantity(
        "initial_displacement", "$x_0$", "initial displacement of the primary", LENGTH, default=0.0
    ),
    Quantity(
        "initial_velocity", r"$\dot x_0$", "initial velocity of the primary", SPEED, default=0.0
    ),
    Quantity(
        "initial_position",
        "$p_0$",
        "initial place of the free mass between the walls",
        minimum=-1.0,
        maximum=1.0,
        default=0.0,
        note="-1 at the left wall, +1 at the right one",
    ),
    Quantity(
        "initial_relative_velocity",
        r"$\dot y_0 - \dot x_0$",
        "initial velocity of the free mass relative to the primary",
        SPEED,
        default=0.0,
    ),
    Quantity(
        "initial_spacing",
        "$s_0$",
        "initial distance of each of several free masses from the one before",
        minimum=0.0,
        maximum=4.0,
        default=0.0,
        note="over the clearance, thrown back by the walls: 0 is alike, 2 the other wall",
    ),
)

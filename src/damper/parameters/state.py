"""The state that a run starts from, and the quantities by which a study gives it."""

import math
from dataclasses import dataclass, fields

from damper.parameters.quantity import Quantity, real
from damper.parameters.units import LENGTH, NO_UNITS, SPEED, Units


@dataclass(frozen=True)
class State:
    """Positions and velocities at one time.

    Parameters
    ----------
    x, v : float
        Displacement (units of F0/K) and velocity of the primary.
    y, u : float
        Displacement and velocity of the free mass, in the same frame (not relative).
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

    x: float
    v: float
    y: float
    u: float
    time: float = 0.0

    def __post_init__(self) -> None:
        for field in fields(self):
            value = real(field.name, getattr(self, field.name))
            if not math.isfinite(value):
                raise ValueError(f"{field.name} = {value!r}: must be a finite number")
            object.__setattr__(self, field.name, value)

    def over(self, units: Units) -> "State":
        """Return the state in dimensionless units, given in SI units."""
        if units is NO_UNITS:
            return self
        if self.__dict__.get("_units") == units:
            return self.__dict__["_over_units"]
        return State(
            self.x / units.length,
            self.v / units.speed,
            self.y / units.length,
            self.u / units.speed,
            self.time / units.time,
        )

    def times(self, units: Units) -> "State":
        """Return the state in SI units, given in dimensionless units; `over` is its inverse.

        To the last bit: the scaled state is kept beside it.
        """
        if units is NO_UNITS:
            return self
        scaled = State(
            self.x * units.length,
            self.v * units.speed,
            self.y * units.length,
            self.u * units.speed,
            self.time * units.time,
        )
        scaled.__dict__.update(_units=units, _over_units=self)
        return scaled


def need_state(given: State | None, name: str = "state") -> None:
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
)

"""A machine with its damper, advanced from one communication point to the next."""

import math
from collections.abc import Mapping
from typing import Literal

from damper.engine.segment import EventKind
from damper.parameters import SIParameters, State
from damper.parameters.forcing import Forcing, NoForce, Record
from damper.parameters.setting import Setting
from damper.sweep.started import start

#: Parameters of the machine and its damper, in SI units.
PARAMETERS = {
    "mass": Setting(1.0, "vibrating mass of the machine", "kg", gt=0),
    "natural_frequency": Setting(1.0, "natural frequency without the damper", "Hz", gt=0),
    "damping_ratio": Setting(0.0, "part of critical damping", ge=0, lt=1),
    "free_mass": Setting(0.0, "mass between the walls", "kg", ge=0),
    "gap": Setting(1.0, "whole travel of the free mass", "m", gt=0),
    "restitution": Setting(0.5, "rebound over approach speed", ge=0, le=1),
    "initial_displacement": Setting(0.0, "displacement of both masses at the start, at rest", "m"),
    "initial_position": Setting(
        0.0, "place of the free mass at the start: -1 at the left wall, 1 at the right", ge=-1, le=1
    ),
    "input_order": Setting(
        1,
        "input within a step: 0 held; 1 on the line through the last two values; 2 on a line to "
        "the value, which is that at the end of the step",
        ge=0,
        le=2,
    ),
}
#: Meaning of the input.
Drive = Literal["force", "base_acceleration"]
#: Values of `input_order`.
HELD, EXTRAPOLATED, INTERPOLATED = range(3)


class SteppedMachine:
    """A machine with its damper, which an input drives step by step.

    Parameters
    ----------
    values : mapping of str to float
        Value of each of `PARAMETERS`.
    drive : {"force", "base_acceleration"}
        Meaning of the input; under an acceleration of the base (m/s2) displacements are relative
        to the base.
    value : float, default 0
        Input at the start, in N or m/s2.

    Attributes
    ----------
    state : State
        Displacements and velocities at the communication point, in m and m/s.
    impacts : int
        Number of impacts so far.
    impulse : float
        Impulse of the free mass on the machine in the last step, in N s.

    Raises
    ------
    ValueError
        With name, value and range of a parameter.

    Examples
    --------
    >>> values = {name: setting.default for name, setting in PARAMETERS.items()}
    >>> machine = SteppedMachine(values | {"free_mass": 0.1, "gap": 0.01}, "force")
    >>> for _ in range(10):
    ...     machine.step(0.1, value=1.0)
    >>> machine.impacts, round(machine.state.x, 4)
    (8, 0.0028)
    """

    def __init__(
        self,
        values: Mapping[str, float],
        drive: Drive,
        value: float = 0.0,
    ) -> None:
        given = {name: one.checked(name, values[name]) for name, one in PARAMETERS.items()}
        mass, rate, gap = given["mass"], math.tau * given["natural_frequency"], given["gap"]
        self._drive, self._order = drive, given["input_order"]
        self._free = SIParameters(
            primary_mass=mass,
            damping=2.0 * given["damping_ratio"] * mass * rate,
            stiffness=mass * rate**2,
            free_mass=given["free_mass"],
            gap=gap,
            restitution=given["restitution"],
            **SIParameters.left_out("none"),
            forcing="none",
        )
        # The input has this unit, so that half of the gap is the unit of length.
        self._unit = 0.5 * gap * rate**2 * (mass if drive == "force" else 1.0)
        x, place = given["initial_displacement"], 0.5 * gap * given["initial_position"]
        self.state = State(x, 0.0, x + place, 0.0)
        self._run = start(self._free, self.state)
        self._last, self._length = value, 0.0
        self.impacts, self.impulse = 0, 0.0

    @property
    def sticking(self) -> bool:
        """Whether the free mass moves with a wall at the communication point."""
        return self._run.sticking[0]

    def step(self, length: float, value: float) -> None:
        """Advance by `length` in s, with this value of the input.

        Raises
        ------
        ValueError, TypeError
            For a length that is not positive, and for values that are no finite numbers.
        RuntimeError
            Where the run stops early.
        """
        begun, (first, last) = self.state, self._line(length, value)
        forcing: Forcing = NoForce()
        if first or last:
            # The line goes on at both ends, so that no sample falls into the step.
            times = [begun.time - length, begun.time + 2.0 * length]
            values = [(2.0 * first - last) / self._unit, (2.0 * last - first) / self._unit]
            forcing = Record(times, values, self._drive)
        amplitude = self._unit if forcing.samples else 0.0
        driven = self._free.replaced(forcing=forcing, force_amplitude=amplitude)
        self._run = start(driven, begun)
        events = self._run.advance(begun.time + length)
        self.state = self._run.state
        if len(events) and events["kind"][-1] == EventKind.STOPPED:
            raise RuntimeError(f"the run stopped early, at {self._run.time!r} s: too many events")
        self.impacts += int((events["kind"] == EventKind.IMPACT).sum())
        base = 0.5 * (first + last) * length if self._drive == "base_acceleration" else 0.0
        self.impulse = self._free.free_mass * (begun.u - self.state.u - base)
        self._last, self._length = value, length

    def _line(self, length: float, value: float) -> tuple[float, float]:
        """Input at the start and at the end of a step."""
        if self._order == INTERPOLATED:
            return self._last, value
        if self._order == HELD or not self._length:
            return value, value
        return value, value + (value - self._last) / self._length * length

"""The part of an FMU that runs on the importing machine: its variables and its steps."""

from collections.abc import Callable, Mapping
from functools import partial
from typing import Any, ClassVar

from damper.fmu.stepped import PARAMETERS, Drive, SteppedMachine

#: Input -> unit, meaning.
INPUTS = {
    "force": ("N", "force on the machine"),
    "base_acceleration": ("m/s2", "acceleration of the base, to which motion is relative"),
}
#: Output -> unit, meaning, value.
OUTPUTS: dict[str, tuple[str, str, Callable[[SteppedMachine], float]]] = {
    "displacement": ("m", "displacement of the machine", lambda m: m.state.x),
    "velocity": ("m/s", "velocity of the machine", lambda m: m.state.v),
    "relative_displacement": ("m", "of the free mass in its box", lambda m: m.state.y - m.state.x),
    "relative_velocity": ("m/s", "of the free mass in its box", lambda m: m.state.u - m.state.v),
    "impulse": ("N s", "of the free mass on the machine in the last step", lambda m: m.impulse),
    "impacts": ("", "number of impacts so far", lambda m: m.impacts),
    "sticking": ("", "whether the free mass moves with a wall", lambda m: m.sticking),
}
#: Variable -> its kind, where that is not Float64.
KINDS = {"input_order": "Int32", "impacts": "Int32", "sticking": "Boolean"}
#: Unit -> its exponents of base units.
UNITS = {
    "kg": {"kg": 1},
    "m": {"m": 1},
    "m/s": {"m": 1, "s": -1},
    "m/s2": {"m": 1, "s": -2},
    "N": {"kg": 1, "m": 1, "s": -2},
    "N s": {"kg": 1, "m": 1, "s": -1},
    "Hz": {"s": -1},
}


class DamperSlave:
    """Base of the class in an FMU, beside `pythonfmu3.Fmi3Slave`."""

    drive: ClassVar[Drive]
    """Name of the input."""
    begin: ClassVar[Mapping[str, float]]
    """Start value of each parameter."""

    def __init__(self, **given: Any) -> None:
        import pythonfmu3 as fmi

        super().__init__(**given)
        self._values = dict(self.begin)
        self._made: SteppedMachine | None = None
        self._input = self._time = 0.0
        slave: Any = self
        slave.register_units([fmi.Unit(name, **powers) for name, powers in UNITS.items()])

        def add(name: str, unit: str, meaning: str, cause: str, varies: str, **access: Any) -> None:
            variable = getattr(fmi, KINDS.get(name, "Float64"))(
                name,
                description=meaning,
                causality=fmi.Fmi3Causality[cause],
                variability=fmi.Fmi3Variability[varies],
                **access,
            )
            if unit:
                variable.unit = unit
            slave.register_variable(variable)

        add("time", "", "time in s", "independent", "continuous", getter=lambda: self._time)
        for name, setting in PARAMETERS.items():
            about = setting.units, setting.meaning, "parameter", "fixed"
            read, write = partial(self._values.get, name), partial(self._set, name)
            add(name, *about, getter=read, setter=write)
        write = partial(setattr, self, "_input")
        access: dict[str, Any] = {"getter": lambda: self._input, "setter": write}
        add(self.drive, *INPUTS[self.drive], "input", "continuous", **access)
        for name, (unit, meaning, value) in OUTPUTS.items():
            varies = "discrete" if name in KINDS else "continuous"
            shown = partial(lambda value: value(self._machine), value)
            add(name, unit, meaning, "output", varies, getter=shown)

    def _set(self, name: str, value: float) -> None:
        self._values[name], self._made = value, None

    @property
    def _machine(self) -> SteppedMachine:
        """The machine, made anew when a parameter has changed."""
        if self._made is None:
            self._made = SteppedMachine(self._values, self.drive)
        return self._made

    def exit_initialization_mode(self) -> None:
        """Check the parameters, and begin with the value that the input has now."""
        self._made = SteppedMachine(self._values, self.drive, self._input)

    def do_step(self, current_time: float, step_size: float) -> bool:
        """Advance from one communication point to the next."""
        self._machine.step(step_size, self._input)
        self._time = current_time + step_size
        return True

"""What describes a run beside its point: how long it is recorded, how exact it is.

Each number is declared here and nowhere else. Checks in Python, the arguments and the docstring of
`damper.simulate`, the keys of a study, the block `engine` of the configuration and the reference
follow from that.
"""

from collections.abc import Mapping
from dataclasses import dataclass, field, fields
from textwrap import wrap
from typing import Any

from damper.parameters.quantity import real
from damper.parameters.setting import END, Setting
from damper.parameters.units import TIME

#: A length in cycles that is as near to a whole number is that: sections count cycles.
_ROUNDING = 1e-12


def _number(default: float, meaning: str, units: str = "", **about: Any) -> Any:
    """Field of a class of settings; the arguments are those of `Setting`."""
    return field(default=default, metadata={"setting": Setting(default, meaning, units, **about)})


@dataclass(frozen=True, kw_only=True)
class _Checked:
    """Settings whose values are checked.

    Raises
    ------
    ValueError, TypeError
        With name, value and range, for a value out of range.
    """

    def __post_init__(self) -> None:
        for one in fields(self):
            object.__setattr__(self, one.name, checked(one.name, getattr(self, one.name)))


@dataclass(frozen=True, kw_only=True)
class RunLength(_Checked):
    """How long every run is."""

    transient: int | Mapping[str, Any] = _number(
        200,
        "How long each run goes on before it is recorded. A cycle is 2 pi over the frequency, the "
        "period of a harmonic force; {time: 30} is that many s (sqrt(M/K)), {time: end} until "
        "the record or noise ends.",
        "cycles",
        ge=0,
        stated=True,
        timed=True,
    )
    periods: int | Mapping[str, Any] = _number(
        50, "How long the window is, likewise.", "cycles", ge=1, stated=True, timed=True
    )

    @property
    def timed(self) -> bool:
        """Whether one of them is a time."""
        return isinstance(self.transient, Mapping) or isinstance(self.periods, Mapping)

    def cycles(self, cycle: float, end: float) -> tuple[float, float]:
        """Return cycles before the window, and in it.

        Parameters
        ----------
        cycle, end : float
            Length of a cycle, and when what drives the damper ends, if it does, in the unit of the
            times that are given.

        Raises
        ------
        ValueError
            Where it does not end, or not within the window.
        """
        before = _in_cycles("transient", self.transient, cycle, end)
        length = _in_cycles("periods", self.periods, cycle, end)
        if self.periods == {"time": END}:
            length = _rounded(length - before)
            if not length > 0.0:
                raise ValueError(
                    f"periods = {self.periods!r}: what drives the damper ends at {end:g}, before "
                    f"the window begins: must be > 0 after transient = {self.transient!r}"
                )
        return before, length


@dataclass(frozen=True, kw_only=True)
class EngineSettings(_Checked):
    """Settings of the event-driven engine."""

    accuracy: float = _number(
        1e-12,
        "Largest error of the time at which a complete burst ends; all else is exact to rounding. "
        "Dimensionless, also for a study in SI units.",
        TIME,
        ge=1e-15,
        le=1e-3,
    )
    max_events: int = _number(
        1_000_000,
        "Budget of a run, after which it stops and `status` in the cube says so: events, and "
        "hundreds of evaluations that find none.",
        ge=1,
        le=10**15,
    )


@dataclass(frozen=True, kw_only=True)
class RunSettings(EngineSettings, RunLength):
    """Settings of every run: how long it lasts, how exact it is."""


def declared_in(cls: type[_Checked]) -> dict[str, Setting]:
    """Return the settings of a class by name."""
    return {one.name: one.metadata["setting"] for one in fields(cls)}


SETTINGS = declared_in(RunSettings)
#: Name of each setting of a run -> its default.
DEFAULTS: dict[str, Any] = {name: setting.default for name, setting in SETTINGS.items()}


def checked(name: str, value: Any) -> Any:
    """Return the value of a setting in its type; ValueError or TypeError if it is not allowed."""
    setting = SETTINGS[name]
    # A run pays for no more than this, where nothing else is asked for.
    if type(value) is type(setting.default) and value == setting.default:
        return value
    if not (setting.timed and isinstance(value, Mapping | str)):
        real(name, value)
    return setting.checked(name, value)


def settings_text(cls: type[_Checked] = RunSettings) -> str:
    """Return the entries of a class of settings in a docstring, in numpydoc's form."""
    entries = []
    for name, setting in declared_in(cls).items():
        units = f"; in {setting.units}" if setting.units else ""
        about = wrap(f"{setting.meaning.removesuffix('.')}{units}.", 90)
        head = f"{name} : {type(setting.default).__name__}, default {setting.default}"
        entries += [head, *(f"    {line}" for line in about)]
    return "".join(f"{line}\n" for line in entries)


def _in_cycles(name: str, length: int | Mapping[str, Any], cycle: float, end: float) -> float:
    if not isinstance(length, Mapping):
        return length
    time = length["time"]
    if time == END and not end > 0.0:
        raise ValueError(
            f"{name} = {length!r}: only a record or noise ends: must be a number of cycles, or "
            "{'time': a number > 0}"
        )
    return _rounded((end if time == END else float(time)) / cycle)


def _rounded(cycles: float) -> float:
    whole = float(round(cycles))
    return whole if abs(cycles - whole) <= _ROUNDING * whole else cycles

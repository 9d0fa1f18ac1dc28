"""The machine that a damper is for, as an engineer gives it: SI units, frequencies in Hz."""

from __future__ import annotations

import math
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

from pydantic import Field, ValidationError

from damper.parameters.dampers import Parameters
from damper.parameters.setting import Setting
from damper.study.fields import Pair, Text, Unit
from damper.study.messages import Mistakes, mistakes_of
from damper.study.settings import declared_class
from damper.study.yaml_file import ConfigError, Problem, read_yaml
from damper.theory.steady import steady_amplitude

#: What drives the machine: key -> the forcing of a study.
FORCES = {"force_amplitude": "harmonic", "base_amplitude": "base", "unbalance": "unbalance"}
#: What may count -> the variable of a cube that is to be small, its unit, and how a card calls it.
COUNTS = {
    "peak_displacement": ("peak_displacement", "m", "largest displacement"),
    "rms_displacement": ("rms_displacement", "m", "rms displacement"),
    "peak_acceleration": ("peak_acceleration", "m/s2", "largest acceleration between impacts"),
    "decay_time": ("fall_time", "s", "time of decay"),
}
AUTO = "auto"
#: Least and largest free mass over that of the machine.
MASS_RATIOS = (next(q.minimum for q in Parameters.quantities if q.name == "mass_ratio"), 1.0)

#: All but title and band.
SETTINGS = {
    "mass": Setting(1.0, "Vibrating mass of the machine.", "kg", gt=0, stated=True),
    "natural_frequency": Setting(None, "Without the damper; or stiffness.", "Hz", gt=0),
    "stiffness": Setting(None, "In place of natural_frequency.", "N/m", gt=0),
    "damping_ratio": Setting(0.0, "Part of critical damping.", ge=0, lt=1, stated=True),
    "force_amplitude": Setting(None, "Amplitude of a harmonic force.", "N", gt=0),
    "base_amplitude": Setting(None, "Amplitude of a base that moves.", "m", gt=0),
    "unbalance": Setting(None, "Rotating mass times eccentricity.", "kg m", gt=0),
    "initial_displacement": Setting(None, "From which free motion decays.", "m", gt=0),
    "largest_mass": Setting(1.0, "Of the damper's free mass.", "kg", gt=0, stated=True),
    "largest_gap": Setting(1.0, "Room for its whole travel.", "m", gt=0, stated=True),
    "restitution": Setting(0.0, "Rebound over approach speed.", ge=0, lt=1, stated=True),
    "mass_tolerance": Setting(0.0, "How far the free mass may be off, either way.", "kg", ge=0),
    "gap_tolerance": Setting(0.0, "How far the gap may be off, either way.", "m", ge=0),
    "restitution_tolerance": Setting(0.0, "How far that may be off, either way.", ge=0),
    "counts": Setting(
        AUTO,
        "What is to be small: peak_displacement, rms_displacement, peak_acceleration or "
        "decay_time; auto is the last one in free motion, else the first.",
        choices=(AUTO, *COUNTS),
    ),
    "decay_to": Setting(0.1, "Part of the first peak to which decay is timed.", gt=0, lt=1),
    "limit": Setting(None, "Largest value of what counts that is allowed.", "m or s", gt=0),
}
if TYPE_CHECKING:
    Settings = Any
else:
    Settings = declared_class("Settings", "What a machine is given by.", SETTINGS)


class Machine(Settings):  # type: ignore[misc]
    """A vibrating machine, the room there is for a damper, and what counts.

    Exactly one of force_amplitude, base_amplitude, unbalance and initial_displacement says what
    makes it vibrate; the last one is free motion, which is to decay.
    """

    title: Annotated[Text, Field(description="What the machine is, for headings.")] = "A machine"
    band: Annotated[
        Pair[float] | None,
        Unit("Hz"),
        Field(description="Lowest and highest frequency of what drives it."),
    ] = None

    def check_together(self, mistakes: Mistakes) -> None:
        _exactly_one(self, ("natural_frequency", "stiffness"), mistakes)
        _exactly_one(self, (*FORCES, "initial_displacement"), mistakes)
        free = self.initial_displacement is not None
        if free and self.band is not None:
            mistakes.add(("band",), "free motion has no band of frequencies", "a force with it")
        if not free and self.band is None:
            mistakes.add(("band",), "band is missing", "band: [lowest, highest] in Hz")
        if self.band is not None and self.band[0] <= 0.0:
            message = f"the band begins at {self.band[0]:g} Hz"
            mistakes.add(("band",), message, "lowest and highest frequency, both > 0")
        if self.counts != AUTO and (self.counts == "decay_time") != free:
            what = (
                "decay_time" if free else ", ".join(name for name in COUNTS if "time" not in name)
            )
            motion = "free motion" if free else "driven motion"
            mistakes.add(("counts",), f"{self.counts} does not go with {motion}", what)
        least, most = (ratio * self.mass for ratio in MASS_RATIOS)
        if not least <= self.largest_mass - self.mass_tolerance or self.largest_mass > most:
            message = (
                f"a free mass of {self.largest_mass:g} +- {self.mass_tolerance:g} kg does not go "
                f"with a machine of {self.mass:g} kg"
            )
            mistakes.add(
                ("largest_mass",), message, f"{least:g} to {most:g} kg, tolerance included"
            )
        if not self.gap_tolerance < self.largest_gap:
            message = f"a gap of up to {self.largest_gap:g} m is within its tolerance"
            allowed = f"more than gap_tolerance = {self.gap_tolerance:g} m"
            mistakes.add(("largest_gap",), message, allowed)
        low = self.restitution - self.restitution_tolerance
        high = self.restitution + self.restitution_tolerance
        if low < 0.0 or high >= 1.0:
            message = f"restitution from {low:g} to {high:g}"
            allowed = f"up to {min(self.restitution, 1.0 - self.restitution):g}, for 0 <= r < 1"
            mistakes.add(("restitution_tolerance",), message, allowed)

    @property
    def is_free(self) -> bool:
        """Whether nothing drives it."""
        return self.initial_displacement is not None

    @property
    def force(self) -> tuple[str, float]:
        """Kind of the forcing and its amplitude, as a study has them."""
        if self.is_free:
            return "none", 0.0
        key = next(key for key in FORCES if getattr(self, key) is not None)
        return FORCES[key], float(getattr(self, key))

    @property
    def rate(self) -> float:
        """Natural angular frequency in rad/s."""
        if self.natural_frequency is not None:
            return 2.0 * math.pi * self.natural_frequency
        return math.sqrt(float(self.stiffness or 0.0) / self.mass)

    @property
    def primary(self) -> dict[str, float]:
        """Quantities of the primary and of what drives it, in SI units."""
        stiffness = self.stiffness or self.mass * self.rate**2
        damping = 2.0 * self.damping_ratio * math.sqrt(stiffness * self.mass)
        made = {"primary_mass": self.mass, "damping": damping, "stiffness": stiffness}
        return made | {"force_amplitude": self.force[1]}

    @property
    def length(self) -> float:
        """Unit of length of its runs, in m: F0/K of a force, amplitude of a base."""
        kind, amplitude = self.force
        per = {"harmonic": self.primary["stiffness"], "unbalance": float(self.mass)}
        return amplitude / per.get(kind, 1.0)

    @property
    def static(self) -> float:
        """Amplitude that drives it at resonance, over the stiffness, in m."""
        based = self.force[0] == "base"
        return self.length * (math.hypot(1.0, 2.0 * self.damping_ratio) if based else 1.0)

    @property
    def size(self) -> float:
        """What counts, in SI units, over that of a run in its own."""
        if self.is_free:
            return 1.0 / self.rate
        return self.length * (self.rate**2 if self.counts == "peak_acceleration" else 1.0)

    def counted(self, amplitude: float, frequency: float) -> float:
        """What counts of a harmonic motion with an amplitude in m, at a frequency in Hz."""
        by = {"rms_displacement": math.sqrt(0.5), "peak_acceleration": (math.tau * frequency) ** 2}
        return amplitude * by.get(self.counts, 1.0)

    def undamped(self, frequency: float) -> float:
        """Amplitude in m without the damper at a frequency in Hz; infinite where it grows."""
        ratio = 2.0 * math.pi * frequency / self.rate
        kind = self.force[0]
        factor = {"harmonic": 1.0, "unbalance": ratio**2}.get(kind)
        if factor is None:
            own = 2.0 * self.damping_ratio
            factor = math.hypot(1.0, own * ratio) / math.hypot(1.0, own)
        return self.static * factor * steady_amplitude(self.damping_ratio, ratio)

    @property
    def measured(self) -> tuple[str, str, str]:
        """Of what counts: variable of a cube, unit, words."""
        usual = "decay_time" if self.is_free else "peak_displacement"
        return COUNTS[usual if self.counts == AUTO else self.counts]


def _exactly_one(machine: Machine, keys: tuple[str, ...], mistakes: Mistakes) -> None:
    given = tuple(key for key in keys if getattr(machine, key) is not None)
    if len(given) != 1:
        message = f"{' and '.join(given)} are given" if given else "none of these is given"
        mistakes.add((given or keys)[:1], message, f"exactly one of {', '.join(keys)}")


def read_machine(path: Path | str) -> Machine:
    """Read the YAML file of a machine; ConfigError lists all that is wrong, with its lines."""
    file = read_yaml(Path(path))
    problems = file.problems
    try:
        made = Machine.model_validate(file.data)
    except ValidationError as error:
        found = ((loc, file.find(loc), report) for loc, report in mistakes_of(error))
        problems += [Problem(at.place, loc, line=at.line, **report) for loc, at, report in found]
    if problems:
        raise ConfigError.of(sorted(problems, key=lambda problem: problem.line))
    return made


def machine_of(given: Any) -> Machine:
    """Return what a caller in Python gives as a machine; ValueError lists all that is wrong."""
    return Machine.checked("", given)

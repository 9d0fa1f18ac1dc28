"""The machine that a damper is for, as an engineer gives it: SI units, frequencies in Hz."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Annotated, Any, Literal

from pydantic import Field, ValidationError

from damper.parameters.dampers import Parameters
from damper.study.fields import Pair, Strict, Text, Unit
from damper.study.messages import Mistakes, mistakes_of
from damper.study.yaml_file import ConfigError, Problem, read_yaml
from damper.theory.steady import steady_amplitude

#: What drives the machine: key -> the forcing of a study.
FORCES = {"force_amplitude": "harmonic", "base_amplitude": "base", "unbalance": "unbalance"}
#: What may count -> the variable of a cube that is to be small, its unit, and how a card calls it.
COUNTS = {
    "peak_displacement": ("peak_displacement", "m", "largest displacement"),
    "rms_displacement": ("rms_displacement", "m", "rms displacement"),
    "decay_time": ("fall_time", "s", "time of decay"),
}
#: Least and largest free mass over that of the machine.
MASS_RATIOS = (next(q.minimum for q in Parameters.quantities if q.name == "mass_ratio"), 1.0)

_Positive = Annotated[float, Field(gt=0)]
_Tolerance = Annotated[float, Field(ge=0)]


class Machine(Strict):
    """A vibrating machine, the room there is for a damper, and what counts.

    Exactly one of force_amplitude, base_amplitude, unbalance and initial_displacement says what
    makes it vibrate; the last one is free motion, which is to decay.
    """

    title: Annotated[Text, Field(description="What the machine is, for headings.")] = "A machine"
    mass: Annotated[_Positive, Unit("kg"), Field(description="Vibrating mass of the machine.")]
    natural_frequency: Annotated[
        _Positive | None, Unit("Hz"), Field(description="Without the damper; or stiffness.")
    ] = None
    stiffness: Annotated[
        _Positive | None, Unit("N/m"), Field(description="In place of natural_frequency.")
    ] = None
    damping_ratio: Annotated[
        float, Field(ge=0, lt=1, description="Part of critical damping without the damper.")
    ]
    force_amplitude: Annotated[
        _Positive | None, Unit("N"), Field(description="Amplitude of a harmonic force.")
    ] = None
    base_amplitude: Annotated[
        _Positive | None, Unit("m"), Field(description="Amplitude of a base that moves.")
    ] = None
    unbalance: Annotated[
        _Positive | None,
        Unit("kg m"),
        Field(description="Rotating mass times its eccentricity."),
    ] = None
    initial_displacement: Annotated[
        _Positive | None, Unit("m"), Field(description="From which free motion decays.")
    ] = None
    band: Annotated[
        Pair[float] | None,
        Unit("Hz"),
        Field(description="Lowest and highest frequency of what drives it."),
    ] = None
    largest_mass: Annotated[_Positive, Unit("kg"), Field(description="Of the damper's free mass.")]
    largest_gap: Annotated[
        _Positive, Unit("m"), Field(description="Room for the free mass's whole travel.")
    ]
    restitution: Annotated[
        float, Field(ge=0, lt=1, description="Rebound speed over approach speed at the stops.")
    ]
    mass_tolerance: Annotated[
        _Tolerance, Unit("kg"), Field(description="The free mass may be so much off either way.")
    ] = 0.0
    gap_tolerance: Annotated[
        _Tolerance, Unit("m"), Field(description="The gap may be so much off either way.")
    ] = 0.0
    restitution_tolerance: Annotated[
        _Tolerance, Field(description="The restitution may be so much off either way.")
    ] = 0.0
    counts: Annotated[
        Literal["peak_displacement", "rms_displacement", "decay_time"] | None,
        Field(
            description="What is to be small in the worst case: by default peak_displacement, and "
            "in free motion decay_time."
        ),
    ] = None
    decay_to: Annotated[
        float, Field(gt=0, lt=1, description="Part of the first peak to which decay is timed.")
    ] = 0.1
    limit: Annotated[
        _Positive | None,
        Unit("m or s"),
        Field(description="Largest value of what counts that is allowed."),
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
        if self.counts is not None and (self.counts == "decay_time") != free:
            what = "decay_time" if free else "peak_displacement or rms_displacement"
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
    def static(self) -> float:
        """Amplitude that drives it at resonance, over the stiffness, in m: F0/K of a force."""
        kind, amplitude = self.force
        if kind == "harmonic":
            return amplitude / self.primary["stiffness"]
        if kind == "unbalance":
            return amplitude / self.mass
        return amplitude * math.hypot(1.0, 2.0 * self.damping_ratio)

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
        return COUNTS[self.counts or ("decay_time" if self.is_free else "peak_displacement")]


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

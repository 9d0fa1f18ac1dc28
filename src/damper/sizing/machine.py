"""The machine that a damper is for, as an engineer gives it: SI units, frequencies in Hz."""

from __future__ import annotations

import math
import re
from collections.abc import Mapping
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, ClassVar

import numpy as np
from pydantic import BeforeValidator, Field

from damper.parameters.forcing import Record
from damper.parameters.record_file import Reading, columns_of
from damper.parameters.setting import Setting
from damper.parameters.unit_text import number_in
from damper.parameters.unusual import USUAL, unusual
from damper.study.fields import (
    DistinctList,
    Line,
    NamedMapping,
    Pair,
    StrictModel,
    Text,
    Unit,
    refused,
)
from damper.study.forcing import Columns, Letter
from damper.study.messages import Mistakes
from damper.study.settings import Assumed, Stated, check_origin, declared_class
from damper.study.yaml_file import read_yaml, unreadable
from damper.theory.steady import steady_amplitude

#: What drives the machine: key -> the forcing of a study.
FORCES = {"force_amplitude": "harmonic", "base_amplitude": "base", "unbalance": "unbalance"}
#: Keys of CSV files with what drives it over time -> what the samples are.
RECORDS: dict[str, Any] = {"force_record": "force", "acceleration_record": "base_acceleration"}
#: How `Record.read` reads a file: each is a key of a machine after `record_`.
READING = Reading._fields
_DRIVES = (*FORCES, *RECORDS, "initial_displacement")
#: Value of `counts` -> the variable of a cube to make small, its unit, its name on a card.
COUNTS = {
    "peak_displacement": ("peak_displacement", "m", "largest displacement"),
    "rms_displacement": ("rms_displacement", "m", "rms displacement"),
    "peak_acceleration": ("peak_acceleration", "m/s2", "largest acceleration between impacts"),
    "decay_time": ("fall_time", "s", "time of decay"),
}
#: Keys of which one is given -> what is said where none is.
ONE_OF_STOPS: dict[tuple[str, ...], str] = {
    ("restitution", "restitution_range", "materials"): "the restitution of the stops is missing",
}
_ONE_OF: dict[tuple[str, ...], str] = {
    ("natural_frequency", "stiffness"): "the natural frequency is missing",
    _DRIVES: "the drive is missing: what makes the machine vibrate",
    **ONE_OF_STOPS,
}
AUTO = "auto"
#: How a box may stand.
LYING, UPRIGHT = ORIENTATIONS = ("lying", "upright")
#: Standard acceleration of gravity in m/s2, as studies have it.
GRAVITY = 9.81
#: Part of the displacement that ends a decay by which the weight may move the machine.
_SHIFT = 0.1
#: Restitutions of a range that the first grid has.
_RESTITUTIONS = 4
#: Least and largest free mass over that of the machine.
MASS_RATIOS = (1e-5, 1.0)

#: Frequencies of a band over the natural one: beyond these the damper has nothing to do.
FREQUENCY_RATIOS = (0.01, 100.0)
#: Least tolerance over what it is of: less is lost in roundoff.
_LEAST_TOLERANCE = 1e-6
#: Of stops: with more, impacts take too little for a damper.
LARGEST_RESTITUTION = 0.999
#: Materials at most: each gets an answer of its own.
MOST_MATERIALS = 20
#: Free masses side by side at most, and numbers of them that are tried: each takes a search.
MOST_UNITS, _MOST_COUNTS = 16, 5
_MASS: Any = {"units": "kg", "ge": 1e-9, "le": 1e12}
_LENGTH: Any = {"units": "m", "ge": 1e-12, "le": 1e6}

#: All but those with words or several numbers.
SETTINGS = {
    "mass": Setting(1.0, "Vibrating mass of the machine.", **_MASS, stated=True),
    "natural_frequency": Setting(None, "Without the damper; or stiffness.", "Hz", ge=1e-6, le=1e9),
    "stiffness": Setting(None, "In place of natural_frequency.", "N/m", ge=1e-9, le=1e24),
    "damping_ratio": Setting(0.0, "Part of critical damping.", ge=0, lt=1, stated=True),
    "force_amplitude": Setting(None, "Amplitude of a harmonic force.", "N", ge=1e-12, le=1e15),
    "base_amplitude": Setting(None, "Amplitude of a base that moves.", **_LENGTH),
    "unbalance": Setting(None, "Rotating mass times eccentricity.", "kg m", ge=1e-15, le=1e15),
    "initial_displacement": Setting(None, "From which free motion decays.", **_LENGTH),
    "largest_mass": Setting(1.0, "Of the damper's free mass.", "kg", gt=0, stated=True),
    "largest_gap": Setting(1.0, "Room for its whole travel.", **_LENGTH, stated=True),
    "restitution": Setting(None, "Rebound over approach speed.", ge=0, le=LARGEST_RESTITUTION),
    "mass_tolerance": Setting(0.0, "How far the free mass may be off, either way.", "kg", ge=0),
    "gap_tolerance": Setting(0.0, "How far the gap may be off, either way.", "m", ge=0),
    "restitution_tolerance": Setting(0.0, "How far that may be off, either way.", ge=0),
    "record_step": Setting(None, "Time between samples, of a record of values alone.", "s", gt=0),
    "record_factor": Setting(None, "By what a record's values are multiplied, for its unit."),
    "orientation": Setting(
        LYING, "Of the box: lying, or upright, with its motion along gravity.", choices=ORIENTATIONS
    ),
    "friction_coefficient": Setting(
        0.0, "Of dry friction between the free mass and a lying box.", ge=0, le=10
    ),
    "stop_modulus": Setting(
        None, "Young's modulus of the stops, for the contact force; steel.", "Pa", ge=1e3, le=1e13
    ),
    "counts": Setting(
        AUTO,
        "What is to be small: peak_displacement, rms_displacement, peak_acceleration or "
        "decay_time; auto is the last one in free motion, else the first.",
        choices=(AUTO, *COUNTS),
    ),
    "decay_to": Setting(0.1, "Part of the first peak to which decay is timed.", ge=1e-6, lt=1),
    "limit": Setting(None, "Largest value of what counts that is allowed.", "m, s or m/s2", gt=0),
}
#: Settings that a damper on a structure has as well.
OF_ROOM = (
    *("largest_mass", "largest_gap", "restitution", "mass_tolerance", "gap_tolerance"),
    *("restitution_tolerance", "record_step", "record_factor", "friction_coefficient"),
    *("orientation", "stop_modulus", "limit"),
)
if TYPE_CHECKING:
    Settings = Any
    RoomSettings = Any
    RoomBase = Any
else:
    RoomBase = StrictModel
    _OF_ROOM = {name: SETTINGS[name] for name in OF_ROOM}
    Settings = declared_class("Settings", "What a machine is given by.", SETTINGS)
    RoomSettings = declared_class("RoomSettings", "What a damper may be.", _OF_ROOM)


class Material(StrictModel):
    """A material of the stops."""

    shorthand = "restitution"
    restitution: Annotated[
        float,
        Field(
            ge=0,
            le=LARGEST_RESTITUTION,
            description="Rebound over approach speed; alone, it is all.",
        ),
    ]
    assumed: Assumed = None
    stated: Stated = None

    def check_together(self, mistakes: Mistakes) -> None:
        check_origin(self, mistakes)


def _counted(counts: Any, is_free: bool) -> str:
    """Return the key of `COUNTS` that a machine's `counts` means."""
    usual = "decay_time" if is_free else "peak_displacement"
    return usual if counts == AUTO else str(counts)


class Room(RoomBase):  # type: ignore[misc]
    """The room there is for a damper on a machine or a structure, and what its stops are of."""

    one_of: ClassVar[Mapping[tuple[str, ...], str]]
    """Keys of which exactly one is given -> what is said where none is."""
    carrier: ClassVar[str] = "the machine's mass"
    """What a free mass is compared with."""

    title: Annotated[Line, Field(description="What it is, for headings.")] = "A machine"
    band: Annotated[
        Pair[float] | None,
        Unit("Hz"),
        Field(description="Lowest and highest frequency of what drives it."),
    ] = None
    force_record: Annotated[
        Text | None,
        Unit("s, N"),
        Field(description="File of a force over time; from the file's folder."),
    ] = None
    acceleration_record: Annotated[
        Text | None,
        Unit("s, m/s2"),
        Field(description="File of the base's acceleration; from the file's folder."),
    ] = None
    record_columns: Annotated[
        Columns | None,
        BeforeValidator(columns_of),
        Field(description="Its columns of time and value, where it has more, such as t,north."),
    ] = None
    record_delimiter: Annotated[
        Letter | None, Field(description="What stands between its columns; else it is found.")
    ] = None
    restitution_range: Annotated[
        Pair[float] | None,
        Field(description="In place of restitution: the best one in it is found."),
    ] = None
    materials: Annotated[
        dict[str, Material],
        NamedMapping("material", to="its restitution"),
        Field(description="In place of restitution: name -> restitution; the best is found."),
    ] = {}  # noqa: RUF012
    units: Annotated[
        DistinctList[Annotated[int, Field(ge=1, le=MOST_UNITS)]] | None,
        Field(
            description="Numbers of equal free masses side by side to choose from, such as 1,2,4: "
            "they share the whole mass, each in a box of its own of the same gap."
        ),
    ] = None

    @classmethod
    def without_units(
        cls, given: Mapping[str, Any], name: str | None, mistakes: Mistakes
    ) -> dict[str, Any]:
        # Before its commas are taken for decimal ones.
        split = {"units": columns_of(given["units"])} if "units" in given else {}
        read = super().without_units({**given, **split}, name, mistakes)
        counts = _counted(given.get("counts", AUTO), "initial_displacement" in given)
        if "limit" in read and counts in COUNTS:
            with refused(("limit",), mistakes):
                read["limit"] = number_in("", read["limit"], [COUNTS[counts][1]])
        return read

    @classmethod
    def check_keys(cls, given: Any, mistakes: Mistakes) -> None:
        for keys, missing in cls.one_of.items():
            there = [key for key in keys if given.get(key) not in (None, {})]
            if len(there) != 1:
                message = f"{' and '.join(there)} are given" if there else missing
                mistakes.add((*there, *keys)[:1], message, f"exactly one of {', '.join(keys)}")

    @property
    def is_free(self) -> bool:
        """Whether nothing drives it."""
        return False

    @property
    def counts_of_masses(self) -> list[int]:
        """Numbers of equal free masses to choose from, the fewest first."""
        return sorted(self.units or [1])

    @property
    def weight(self) -> dict[str, float]:
        """Quantities of a run by which weight acts on the free mass; none if it does not."""
        if self.orientation == UPRIGHT:
            return {"gravity": GRAVITY}
        own = {"friction_coefficient": self.friction_coefficient}
        pressed = {"transverse_acceleration": GRAVITY}
        return own | pressed if self.friction_coefficient else {}

    def written(self) -> dict[str, Any]:
        """Its settings as a file has them."""
        return self.model_dump(mode="json", exclude_unset=True)

    def check_room(self, mistakes: Mistakes) -> None:
        """Note what does not go with the room: numbers of masses, tolerances, restitutions."""
        if (count := len(self.units or ())) > _MOST_COUNTS:
            message = f"{count} numbers of masses, each of which takes a search"
            mistakes.add(("units",), message, f"at most {_MOST_COUNTS}")
        if self.orientation == UPRIGHT and self.friction_coefficient:
            message = "friction_coefficient in an upright box: nothing presses the mass on its side"
            mistakes.add(("friction_coefficient",), message, f"0, or orientation: {LYING}")
        if len(self.materials) > MOST_MATERIALS:
            message = f"{len(self.materials)} materials, each of which gets an answer"
            mistakes.add(("materials",), message, f"at most {MOST_MATERIALS}")
        if not self.gap_tolerance < self.largest_gap:
            message = f"a gap of up to {self.largest_gap:g} m is within its tolerance"
            allowed = f"more than gap_tolerance = {self.gap_tolerance:g} m"
            mistakes.add(("largest_gap",), message, allowed)
        self._check_tolerances(mistakes)
        self._check_restitutions(mistakes)

    def check_record(self, mistakes: Mistakes) -> None:
        """Note a record that cannot be read."""
        drive = next((key for key in RECORDS if getattr(self, key) is not None), "")
        for name in READING if not drive else ():
            if getattr(self, f"record_{name}") is not None:
                message = f"record_{name} says how a record is read, and there is none"
                mistakes.add(
                    (f"record_{name}",), message, f"left out, or with {' or '.join(RECORDS)}"
                )
        if drive:
            try:
                if self.record.time[0] < 0.0:
                    mistakes.add((drive,), "the record begins before 0 s", "times from 0 on")
            except OSError as error:
                path = getattr(self, drive)
                problem, near = unreadable(Path(path), error)
                allowed = "a file of a record"
                mistakes.add((drive,), f"{path}: {problem}", allowed, near)
            except ValueError as error:
                keys = rf"`({'|'.join(READING)})`"  # those of `Record.read`
                message, _, allowed = re.sub(keys, r"`record_\1`", str(error)).partition(
                    ": must be "
                )
                mistakes.add((drive,), message, allowed)

    def _check_tolerances(self, mistakes: Mistakes) -> None:
        """Note tolerances that are lost in roundoff."""
        of = {"mass": self.largest_mass, "gap": self.largest_gap, "restitution": 1.0}
        for name, most in of.items():
            key = f"{name}_tolerance"
            if 0.0 < getattr(self, key) < _LEAST_TOLERANCE * most:
                message = f"{getattr(self, key):g} is lost in roundoff"
                mistakes.add((key,), message, f"0, or at least {_LEAST_TOLERANCE * most:g}")

    def _check_restitutions(self, mistakes: Mistakes) -> None:
        tolerance = self.restitution_tolerance
        for value in self.restitutions:
            if not 0.0 <= value - tolerance <= value + tolerance <= LARGEST_RESTITUTION:
                message = f"restitution from {value - tolerance:g} to {value + tolerance:g}"
                most = min(value, LARGEST_RESTITUTION - value)
                allowed = f"0 <= r <= {LARGEST_RESTITUTION:g}"
                allowed = f"up to {most:g}, for {allowed}" if most >= 0.0 else allowed
                key = "restitution_tolerance" if tolerance else "restitution_range"
                mistakes.add((key,), message, allowed)
                return

    @property
    def unusual(self) -> tuple[str, ...]:
        """A sentence for each value that few machines have, such as a gap of 20 m."""
        given = {name: getattr(self, name, None) for name in USUAL if name in SETTINGS}
        return unusual({name: [value] for name, value in given.items() if value is not None})

    @property
    def notes(self) -> tuple[str, ...]:
        """Sentences on what is unusual, and on what was found in the file of a record."""
        layout = self.record.layout if self.is_recorded else ""
        if not layout:
            return self.unusual
        keys = ", ".join(f"record_{name}" for name in READING)
        return (
            *self.unusual,
            f"The file of the record has {layout} ({keys} may say otherwise).",
        )

    @property
    def is_recorded(self) -> bool:
        """Whether a record drives it."""
        return self.force_record is not None or self.acceleration_record is not None

    @property
    def records(self) -> list[str | None]:
        """Files of records."""
        return [getattr(self, key) for key in RECORDS]

    @cached_property
    def record(self) -> Record:
        """The record in s and N or m/s2; OSError or ValueError where its file cannot be read."""
        key = "force_record" if self.force_record is not None else "acceleration_record"
        how = {name: getattr(self, f"record_{name}") for name in READING}
        return Record.read(getattr(self, key), of=RECORDS[key], **how)

    @property
    def forcing(self) -> Any:
        """The force, as the setting `forcing` of a study."""
        if not self.is_recorded:
            return self.force[0]
        of, time, value = self.record.of, self.record.time.tolist(), self.record.value.tolist()
        return {"kind": "record", "of": of, "time": time, "value": value}

    @property
    def restitutions(self) -> list[float]:
        """Those of the first grid."""
        if self.restitution_range is not None:
            return list(np.linspace(*self.restitution_range, _RESTITUTIONS).round(3).tolist())
        found = dict.fromkeys(one.restitution for one in self.materials.values())
        return list(found) if self.restitution is None else [self.restitution]

    def counted(self, amplitude: float, frequency: float) -> float:
        """Variable that counts, of a harmonic motion of an amplitude in m and a frequency in Hz."""
        by = {"rms_displacement": math.sqrt(0.5), "peak_acceleration": (math.tau * frequency) ** 2}
        return amplitude * by.get(self.counts, 1.0)

    def material(self, restitution: float) -> str:
        """Materials with a restitution, and its origins; empty where no name is given."""
        names = []
        for name, one in self.materials.items():
            if one.restitution == restitution:
                origins = {"stated": one.stated, "assumed": one.assumed}
                found = [f"{key}: {text}" for key, text in origins.items() if text]
                origin = "; ".join(found) or "the origin of its restitution is not given"
                names.append(f"{name} ({origin})")
        return " or ".join(names)

    @property
    def cases(self) -> str:
        """What a worst case is over."""
        frequencies = ["frequencies"] * (self.band is not None)
        return ", ".join([*frequencies, "starts", *["tolerances"] * self.has_tolerances])

    @property
    def has_tolerances(self) -> bool:
        """Whether any size of the damper may be off."""
        return any((self.mass_tolerance, self.gap_tolerance, self.restitution_tolerance))


class Machine(Room, Settings):  # type: ignore[misc]
    """A vibrating machine, the room there is for a damper, and what counts.

    Exactly one of force_amplitude, base_amplitude, unbalance, force_record, acceleration_record and
    initial_displacement says what makes it vibrate; the last one is free motion, which is to decay.
    Exactly one of restitution, restitution_range and materials says what the stops are of.
    """

    one_of = _ONE_OF

    def check_together(self, mistakes: Mistakes) -> None:
        self._check_drive(mistakes)
        self._check_weight(mistakes)
        self._check_band(mistakes)
        least, most = (ratio * self.mass for ratio in MASS_RATIOS)
        if not least <= self.largest_mass - self.mass_tolerance or self.largest_mass > most:
            message = (
                f"a free mass of {self.largest_mass:g} +- {self.mass_tolerance:g} kg does not go "
                f"with a machine of {self.mass:g} kg"
            )
            mistakes.add(
                ("largest_mass",), message, f"{least:g} to {most:g} kg, tolerance included"
            )
        self.check_room(mistakes)

    def _check_drive(self, mistakes: Mistakes) -> None:
        """Note what does not go with the key that says what drives it."""
        drive = next((key for key in _DRIVES if getattr(self, key) is not None), "")
        if drive in FORCES and self.band is None:
            mistakes.add(("band",), "band is missing", "band: [lowest, highest] in Hz")
        if drive and drive not in FORCES and self.band is not None:
            message = f"{drive} has no band of frequencies"
            mistakes.add(("band",), message, f"left out, or with one of {', '.join(FORCES)}")
        if self.counts != AUTO and (self.counts == "decay_time") != self.is_free:
            what = (name for name in COUNTS if (name == "decay_time") == self.is_free)
            mistakes.add(("counts",), f"{self.counts} does not go with {drive}", ", ".join(what))
        if drive and "decay_to" in self.model_fields_set and not self.is_free:
            message = f"decay_to says where a free motion ends, and {drive} drives this one"
            mistakes.add(("decay_to",), message, "left out, or with initial_displacement")
        self.check_record(mistakes)

    def _check_weight(self, mistakes: Mistakes) -> None:
        """Note a weight that hides the end of a decay."""
        upright = self.orientation == UPRIGHT
        # Where the natural frequency is missing, that is said already.
        if not (upright and self.is_free and self.rate):
            return
        shift = self.largest_mass * GRAVITY / self.primary["stiffness"]
        if shift > _SHIFT * self.decay_to * self.initial_displacement:
            message = (
                f"the weight of a free mass of {self.largest_mass:g} kg moves the machine by "
                f"{shift:.3g} m, more than a tenth of where the decay ends"
            )
            mistakes.add(("orientation",), message, "a smaller largest_mass or a larger decay_to")

    def _check_band(self, mistakes: Mistakes) -> None:
        """Note a band that is far from the natural frequency."""
        if self.band is None:
            return
        own = self.rate / math.tau
        low, high = (ratio * own for ratio in FREQUENCY_RATIOS)
        if not low <= self.band[0] <= self.band[1] <= high:
            given = f"{self.band[0]:g} to {self.band[1]:g} Hz"
            message = f"{given} with a natural frequency of {own:.4g} Hz"
            mistakes.add(("band",), message, f"within {low:.4g} to {high:.4g} Hz")

    @property
    def is_free(self) -> bool:
        """Whether nothing drives it."""
        return self.initial_displacement is not None

    @property
    def force(self) -> tuple[str, float]:
        """Kind of the forcing and its amplitude, as a study has them."""
        if self.is_free:
            return "none", 0.0
        if self.is_recorded:
            return "record", 1.0
        key = next(key for key in FORCES if getattr(self, key) is not None)
        return FORCES[key], float(getattr(self, key))

    @property
    def least_mass(self) -> float:
        """Least free mass in kg."""
        return float(MASS_RATIOS[0] * self.mass)

    @property
    def has_closed_forms(self) -> bool:
        """Whether closed forms know the drive, and weight does not act on the free mass."""
        return not self.is_recorded and not self.weight

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
        if self.is_recorded and self.record.of == "base_acceleration":
            return amplitude / self.rate**2
        stiffness = self.primary["stiffness"]
        per = {"harmonic": stiffness, "record": stiffness, "unbalance": float(self.mass)}
        return amplitude / per.get(kind, 1.0)

    @property
    def static(self) -> float:
        """Amplitude that drives it at resonance, over the stiffness, in m."""
        based = self.force[0] == "base"
        return self.length * (math.hypot(1.0, 2.0 * self.damping_ratio) if based else 1.0)

    @property
    def size(self) -> float:
        """Dimensionless unit of the variable that counts, in SI units."""
        if self.is_free:
            return 1.0 / self.rate
        return self.length * (self.rate**2 if self.counts == "peak_acceleration" else 1.0)

    def undamped(self, frequency: float) -> float:
        """Amplitude in m without the damper at a frequency in Hz; infinite where it grows."""
        ratio = 2.0 * math.pi * frequency / self.rate
        return self.driven(frequency) * steady_amplitude(self.damping_ratio, ratio)

    def driven(self, frequency: float) -> float:
        """Amplitude in m of what drives it at a frequency in Hz, as a force over the stiffness."""
        ratio = 2.0 * math.pi * frequency / self.rate
        kind = self.force[0]
        factor = {"harmonic": 1.0, "unbalance": ratio**2}.get(kind)
        if factor is None:
            own = 2.0 * self.damping_ratio
            factor = math.hypot(1.0, own * ratio) / math.hypot(1.0, own)
        return self.static * factor

    @property
    def measured(self) -> tuple[str, str, str]:
        """Of what counts: variable of a cube, unit, words."""
        variable, unit, words = COUNTS[_counted(self.counts, self.is_free)]
        relative = self.acceleration_record is not None and unit == "m"
        return variable, unit, f"{words} from the base" if relative else words


def read_machine(path: Path | str, given: Mapping[str, Any] | None = None) -> Machine:
    """Read the YAML file of a machine; ConfigError lists all that is wrong, with its lines.

    A value in `given` replaces the file's.
    """
    file = read_yaml(Path(path))
    data = file.data
    if isinstance(data, dict):
        data = of_folder(data, path) | dict(given or {})
    return Machine.checked_in(file, data)


def of_folder(data: Mapping[str, Any], path: Path | str) -> dict[str, Any]:
    """Settings of a file, with the paths of records from its folder."""
    here = {key: data[key] for key in RECORDS if isinstance(data.get(key), str)}
    return dict(data) | {key: f"{Path(path).parent / name}" for key, name in here.items()}


def machine_of(given: Any) -> Machine:
    """Return what a caller in Python gives as a machine; ValueError lists all that is wrong."""
    return Machine.checked("", given)

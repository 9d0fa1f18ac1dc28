"""Parameters of free masses in the boxes of a structure: in SI units, and scaled for the engine.

The units of the scaled parameters are powers of two, so scaling loses no digit.
"""

import math
from collections.abc import Mapping, Sequence
from dataclasses import KW_ONLY, dataclass, replace
from functools import cached_property
from typing import Any

import numpy as np

from damper.parameters.dampers import SIParameters
from damper.parameters.forcing import (
    HARMONIC,
    Base,
    Forcing,
    NoForce,
    Record,
    check_force,
    read_forcing,
)
from damper.parameters.masses import Mass, listed, no_such_mass, own_names, refuse_untaken, with_own
from damper.parameters.names import OF_A_MASS_STRUCTURE, split, unknown_name
from damper.parameters.quantity import Quantity, QuantityClass, quantity, shared
from damper.parameters.state import State
from damper.parameters.structure import Structure
from damper.parameters.tables import (
    WALL_TABLES,
    Table,
    put_own,
    read_table,
    refuse_beside_tables,
)
from damper.parameters.unit_text import number_in
from damper.parameters.units import NO_UNITS, Units

#: Names of `SIParameters` that a structure has in another way, or not at all -> what to do.
_ELSEWHERE = (
    dict.fromkeys(
        ("primary_mass", "damping", "stiffness"), "the structure has its own; leave it out"
    )
    | dict.fromkeys(
        ("support_stiffness", "support_damping"),
        "ties a free mass to the ground; give tie_stiffness or tie_damping, to its box",
    )
    | dict.fromkeys(
        (
            *("contact_stiffness", "contact_tension"),
            *("modulation_depth", "modulation_order", "modulation_phase"),
        ),
        "goes with one primary mass, not with a structure; leave it out",
    )
    | dict.fromkeys(
        ("mass_share", "clearance_factor"), "give each mass of a structure its free_mass and gap"
    )
)
#: Quantities that every free mass needs.
_NEEDED = ("free_mass", "gap")


@dataclass(frozen=True)
class StructureMass:
    """One free mass, scaled as the structure is."""

    box: str
    mass: float
    clearance: float
    restitution: float
    restitution_left: float
    """Infinite where it is that of the right wall."""
    yield_speed: float
    """Infinite where restitution does not depend on the approach speed."""
    yield_exponent: float
    friction: float
    """Acceleration by dry friction while it slides."""
    gravity: float
    """Acceleration to the left wall."""
    tie_stiffness: float
    tie_damping: float
    tables: tuple[Table, ...] = ()
    """Restitution by the approach speed, of the left and of the right wall, if there is a table."""

    @property
    def law(self) -> str:
        """Which of `damper.engine.impact.LAWS` its walls have."""
        return "tabled" if self.tables else "yielding"

    @property
    def pull(self) -> float:
        """As of `damper.Parameters`."""
        return self.gravity

    @property
    def restitutions(self) -> tuple[float, float]:
        """Coefficients of restitution of the left and of the right wall, at small speeds."""
        left = self.restitution_left
        return self.restitution if left == math.inf else left, self.restitution


@dataclass(frozen=True)
class ScaledArrays:
    """Arrays of a structure in scaled units."""

    mass: np.ndarray
    damping: np.ndarray
    stiffness: np.ndarray
    force: np.ndarray
    base: np.ndarray | None
    points: Mapping[str, np.ndarray]
    boxes: Mapping[str, np.ndarray]
    base_shares: Mapping[str, float]
    """Displacement of each box in a unit displacement of the base."""


@dataclass(frozen=True)
class ScaledParameters:
    """What the engine is given: `StructureParameters` in scaled units."""

    structure: ScaledArrays
    each: tuple[StructureMass, ...]
    frequency_ratio: float
    """Angular frequency of the clock."""
    force_amplitude: float
    phase: float
    forcing: Forcing
    origin: "StructureParameters"
    """What is scaled."""
    model = "structure"
    units = NO_UNITS
    hits_stop = False
    walls = 0.0

    @property
    def cycle(self) -> float:
        """Cycle 2 pi / frequency_ratio of the clock."""
        return 2.0 * math.pi / self.frequency_ratio

    @property
    def features(self) -> tuple[str, ...]:
        """Models whose rules act, as `damper.Parameters.features`."""
        return ("structure", *(["sliding"] if self.rubs else []))

    @property
    def rubs(self) -> bool:
        """Whether any free mass rubs on its box."""
        return any(one.friction for one in self.each)

    @property
    def law(self) -> str:
        """Which of `damper.engine.impact.LAWS` the walls ask for."""
        return "yielding" if any(m.yield_speed < math.inf for m in self.each) else "constant"

    @property
    def dimensionless(self) -> "ScaledParameters":
        """These parameters."""
        return self

    def value_of(self, name: str) -> float:
        """As that of `StructureParameters`, in SI units."""
        return self.origin.value_of(name)

    def beside(self, values: Mapping[str, float]) -> "ScaledParameters":
        """As that of `StructureParameters`, of values in SI units."""
        return self.origin.beside(values).dimensionless

    def size_of(self, name: str) -> float:
        """Size of a change of a quantity that counts as of order 1, in its SI unit."""
        units = self.origin.units
        mass = units.energy / units.speed**2
        sizes = {"m": units.length, "kg": mass, "m/s": units.speed, "m/s2": units.acceleration}
        sizes |= dict.fromkeys(("rad/s", "Hz"), 1.0 / units.time)
        sizes |= {"N/m": mass / units.time**2, "N s/m": mass / units.time}
        return sizes.get(self.origin.quantity_of(name).units, 1.0)

    # Values of the first mass, by which the contact law of a run is made.

    @property
    def restitution(self) -> float:
        """Restitution of the first mass."""
        return self.each[0].restitution

    @property
    def restitution_left(self) -> float:
        """Restitution of the left wall of the first mass."""
        return self.each[0].restitution_left

    @property
    def yield_speed(self) -> float:
        """Yield speed of the first mass."""
        return self.each[0].yield_speed

    @property
    def yield_exponent(self) -> float:
        """Exponent of the yielding of the first mass."""
        return self.each[0].yield_exponent


class StructureParameters(QuantityClass, shares=SIParameters):
    """Free masses in the boxes of a structure, in SI units; `damper.SIParameters` makes it.

    Parameters
    ----------
    structure : Structure
    {quantities}

    Other Parameters
    ----------------
    {options}
    box : str, optional
        Where the masses without a box of their own are; the structure's only box by itself.
    forcing : Forcing or str, default Harmonic()
        As for `damper.SIParameters`: at the structure's force, or by the motion of its base. Then
        displacements are relative to the base.
    masses : sequence of mapping, optional
        Several free masses, a mapping for each: its own `box`, `free_mass`, `gap`, `restitution`,
        `restitution_left`, their tables, `yield_speed`, `yield_exponent`, `gravity`,
        `friction_coefficient`, `tie_stiffness`, `tie_damping` and `pendulum_length`, in place of
        the values for all masses.
    restitution_table, restitution_table_left : sequence of (float, float), optional
        As for `damper.SIParameters`: rows (approach speed in m/s, coefficient), or a CSV file.

    Raises
    ------
    ValueError, TypeError
        With the name, the value and what is allowed.

    Examples
    --------
    >>> import damper
    >>> beam = damper.Structure.from_modes([1.0, 6.3], 0.01, {"tip": [2, -2], "force": [0.7, 1]})
    >>> p = damper.SIParameters(structure=beam, force_amplitude=3.0, forcing_frequency=6.2,
    ...                         masses=[{"free_mass": 0.05, "gap": 0.8, "restitution": 0.5}])
    >>> p.each[0].box, p.units.length, p.units.time
    ('tip', 0.5, 0.125)
    """

    structure: Any
    force_amplitude: float = quantity(
        "$F_0$",
        "forcing amplitude",
        "N",
        definition="0 is free motion; that of a base's motion is in m, of its acceleration in "
        "m/s2, of an unbalance in kg m; need not be given without a force",
        minimum=0.0,
        default=None,
    )
    forcing_frequency: float = quantity(
        r"$\Omega$",
        "angular forcing frequency",
        "rad/s",
        definition="2 pi times that in Hz; 1 Hz when left out under no force, a record or noise, "
        "which have none: a cycle is a second",
        minimum=0.0,
        above=True,
        default=None,
    )
    free_mass: float = quantity("$m$", "free mass", "kg", minimum=0.0, above=True, default=None)
    gap: float = quantity(
        "$2D$",
        "gap, the free mass's whole travel",
        "m",
        definition="without its own size; the clearance is half of it",
        minimum=0.0,
        above=True,
        default=None,
    )
    restitution: float = shared(default=None)
    phase: float = shared(default=0.0)

    _: KW_ONLY

    restitution_left: float = shared(default=math.inf)
    yield_speed: float = shared(default=math.inf)
    yield_exponent: float = shared(default=0.25)
    gravity: float = shared(default=0.0)
    inclination: float = shared(default=90.0)
    friction_coefficient: float = shared(default=0.0)
    transverse_acceleration: float = quantity(
        r"$g_\perp$",
        "acceleration across the box",
        "m/s2",
        definition="that of gravity in a level box; it presses the free mass on the box, and "
        "pulls a pendulum back",
        minimum=0.0,
        default=0.0,
    )
    tie_stiffness: float = quantity(
        "$k$", "stiffness of the tie of free mass and box", "N/m", minimum=0.0, default=0.0
    )
    tie_damping: float = quantity(
        "$c$",
        "damping coefficient of the tie of free mass and box",
        "N s/m",
        minimum=0.0,
        default=0.0,
    )
    pendulum_length: float = quantity(
        r"$\ell$",
        "length of the pendulum that the free mass is",
        "m",
        definition="a tie of stiffness m transverse_acceleration / length, for small angles",
        minimum=0.0,
        above=True,
        default=math.inf,
        note="leave it out for a mass that does not hang",
    )

    box: Any = None
    # A force, or the name of one without settings until it is read.
    forcing: Any = HARMONIC
    masses: Any = None
    restitution_table: Any = None
    restitution_table_left: Any = None

    def __post_init__(self) -> None:
        values = self.__dict__
        if not isinstance(self.structure, Structure):
            raise TypeError(f"structure = {self.structure!r}: must be a damper.Structure")
        # Coordinates are relative to the base.
        based = isinstance(self.forcing, str) and self.forcing == "base"
        values["forcing"] = Base("base") if based else read_forcing(self.forcing)
        unit = self.forcing.si_unit
        values["force_amplitude"] = number_in("force_amplitude", self.force_amplitude, [unit])
        self.check_each()
        for name in WALL_TABLES:
            if values[name] is not None:
                values[name] = read_table(name, values[name], "m/s")
        if self.masses is not None:
            own = enumerate(listed(self.masses, (*OF_A_MASS_STRUCTURE, *WALL_TABLES)))
            values["masses"] = tuple(_own_values(k, one) for k, one in own)
        self._check_forcing()
        self.dimensionless  # noqa: B018 - raises unless the scaled values are allowed, too

    @classmethod
    def of_any(cls, *values: Any, **named: Any) -> "StructureParameters":
        """Make it of arguments of `SIParameters`, of which it refuses some by name."""
        if values:
            raise TypeError("give the parameters of a structure by name")
        for name in named:
            if name in _ELSEWHERE:
                raise TypeError(f"{name}: {_ELSEWHERE[name]}")
        return cls(**named)

    def _check_forcing(self) -> None:
        values, force = self.__dict__, self.forcing
        if isinstance(force, NoForce) and self.force_amplitude is None:
            values["force_amplitude"] = 0.0
        missing: list[str] = [] if self.force_amplitude is not None else ["force_amplitude"]
        if self.forcing_frequency is None:
            if force.has_phase and self.force_amplitude != 0.0:
                missing.append("forcing_frequency")
            values["forcing_frequency"] = math.tau  # no more than the unit of cycles
        if missing:
            raise TypeError(
                f"missing parameters: {', '.join(missing)}; or forcing='none' for free motion"
            )
        check_force(force, self.phase, self.force_amplitude, (0.0,))
        if not self.force_amplitude:
            return
        if isinstance(force, Base) and force.frame != "base":
            raise ValueError(
                f"forcing = {force!r}: the coordinates of a structure are relative to its base; "
                "give damper.Base(frame='base')"
            )
        if moves_base(force):
            if self.structure.base is None:
                raise ValueError(
                    f"forcing = {force!r}: the structure has no influence of its base; give base= "
                    "to damper.Structure, or shapes['base'] to from_modes"
                )
        elif self.structure.force is None:
            raise ValueError(
                "the structure has no place of the force; give force= to damper.Structure, or "
                "shapes['force'] to from_modes; or forcing='none' here"
            )

    @cached_property
    def each(self) -> tuple[StructureMass, ...]:
        """The free masses, in SI units."""
        own = self.masses if self.masses is not None else ({},)
        return tuple(
            self._mass("" if self.masses is None else f"masses[{k}].", dict(one))
            for k, one in enumerate(own)
        )

    def _mass(self, where: str, own: Mapping[str, Any]) -> StructureMass:
        here = {**self.__dict__, **own}
        put_own(here, own)
        boxes = tuple(self.structure.boxes)
        if here["box"] is None and len(boxes) != 1:
            known = f"must be one of {', '.join(boxes)}" if boxes else "the structure has none"
            raise TypeError(f"{where}box is missing: {known}")
        box = boxes[0] if here["box"] is None else here["box"]
        self.structure.box(box, f"{where}box")
        missing = [name for name in _NEEDED if here[name] is None]
        if here["restitution"] is None and here["restitution_table"] is None:
            missing.append("restitution")
        if missing:
            raise TypeError(f"missing parameters: {', '.join(where + name for name in missing)}")
        self._check_mass(where, here)
        tables = _tables_in(where, here)
        across = here["transverse_acceleration"]
        hanging = here["free_mass"] * across / here["pendulum_length"]
        return StructureMass(
            box=box,
            mass=here["free_mass"],
            clearance=0.5 * here["gap"],
            restitution=tables[1][0][1] if tables else here["restitution"],
            restitution_left=tables[0][0][1] if tables else here["restitution_left"],
            yield_speed=here["yield_speed"],
            yield_exponent=here["yield_exponent"],
            friction=here["friction_coefficient"] * across,
            gravity=here["gravity"] * math.sin(math.radians(here["inclination"])),
            tie_stiffness=here["tie_stiffness"] + hanging,
            tie_damping=here["tie_damping"],
            tables=tables,
        )

    def _check_mass(self, where: str, here: Mapping[str, Any]) -> None:
        if here["yield_exponent"] != 0.25 and here["yield_speed"] == math.inf:
            raise ValueError(
                f"{where}yield_exponent without yield_speed: it has no effect; give both or none"
            )
        hangs = here["pendulum_length"] < math.inf
        for name, does in (
            ("friction_coefficient", "presses the free mass on the box"),
            ("pendulum_length", "pulls the pendulum back"),
        ):
            given = hangs if name == "pendulum_length" else here[name] != 0.0
            if given and not here["transverse_acceleration"]:
                raise ValueError(
                    f"{where}{name} = {here[name]!r} without transverse_acceleration: nothing "
                    f"{does}; give it for all masses in m/s2, 9.81 in a level box"
                )
        if hangs and (here["tie_stiffness"] or here["friction_coefficient"]):
            other = "tie_stiffness" if here["tie_stiffness"] else "friction_coefficient"
            raise ValueError(
                f"{where}pendulum_length and {other}: a pendulum is its own tie and does not rub; "
                "leave out one of the two"
            )
        pulled = self.gravity or any(dict(one).get("gravity") for one in self.masses or ())
        if self.inclination not in (0.0, 90.0) and not pulled:
            raise ValueError(
                f"inclination = {self.inclination!r} without gravity: nothing pulls the "
                "free mass along the box; give it in m/s2, 9.81 on the earth"
            )

    @cached_property
    def _sizes(self) -> tuple[float, float, float]:
        """Units of mass, length and time, powers of two.

        Half of the largest gap, the lowest natural frequency, and the mass that the structure has
        at the box of the first free mass are of size 1.
        """
        length = max(one.clearance for one in self.each)
        rate = _lowest_rate(self.structure) or self.forcing_frequency
        shape = self.structure.boxes[self.each[0].box]
        mass = 1.0 / float(shape @ np.linalg.solve(self.structure.mass, shape))
        sizes = mass, length, 1.0 / rate
        if not all(1e-200 < size < 1e200 for size in sizes):
            raise ValueError(
                f"mass {mass:g} kg, clearance {length:g} m, frequency {rate:g} rad/s: cannot be "
                "scaled; must be between 1e-200 and 1e200"
            )
        return tuple(2.0 ** round(math.log2(size)) for size in sizes)  # type: ignore[return-value]

    @cached_property
    def units(self) -> Units:
        """Sizes of the scaled units."""
        mass, length, time = self._sizes
        return Units(length, time, mass * (length / time) ** 2)

    @cached_property
    def dimensionless(self) -> ScaledParameters:
        """The scaled parameters."""
        (mass, length, time), units, s = self._sizes, self.units, self.structure
        amplitudes = {
            "force": units.force,
            "B": length,
            "U": mass * length,
            "A": units.acceleration,
        }
        force = self.forcing
        arrays = ScaledArrays(
            mass=s.mass / mass,
            damping=s.damping * (time / mass),
            stiffness=s.stiffness * (time * time / mass),
            force=np.zeros(len(s)) if s.force is None else s.force,
            base=s.base,
            points=s.points,
            boxes=s.boxes,
            base_shares=s.base_shares,
        )
        each = tuple(
            StructureMass(
                box=one.box,
                mass=one.mass / mass,
                clearance=one.clearance / length,
                restitution=one.restitution,
                restitution_left=one.restitution_left,
                yield_speed=one.yield_speed / units.speed,
                yield_exponent=one.yield_exponent,
                friction=one.friction / units.acceleration,
                gravity=one.gravity / units.acceleration,
                tie_stiffness=one.tie_stiffness * (time * time / mass),
                tie_damping=one.tie_damping * (time / mass),
                tables=tuple(tuple((v / units.speed, r) for v, r in t) for t in one.tables),
            )
            for one in self.each
        )
        return ScaledParameters(
            structure=arrays,
            each=each,
            frequency_ratio=self.forcing_frequency * time,
            force_amplitude=self.force_amplitude / amplitudes.get(force.amplitude, units.force),
            phase=self.phase,
            forcing=force.over(time),
            origin=self,
        )

    def started(
        self,
        displacement: Sequence[float] = (),
        velocity: Sequence[float] = (),
        position: Sequence[float] = (),
        relative_velocity: Sequence[float] = (),
    ) -> State:
        """State with the free masses placed between their walls.

        Parameters
        ----------
        displacement, velocity : sequence of float, optional
            Of each coordinate or mode, in m and m/s; 0 when not given.
        position : sequence of float, optional
            Of each free mass between its walls: -1 at the left one, 1 at the right one, 0 when not
            given.
        relative_velocity : sequence of float, optional
            Of each free mass relative to its box, in m/s; 0 when not given.

        Raises
        ------
        ValueError
            For a wrong number of values.
        """
        modes, masses = (len(self.structure), "coordinate or mode"), (len(self.each), "free mass")
        given = {
            "displacement": (displacement, *modes),
            "velocity": (velocity, *modes),
            "position": (position, *masses),
            "relative_velocity": (relative_velocity, *masses),
        }
        arrays = []
        for name, (values, size, what) in given.items():
            if len(values) not in (0, size):
                wanted = f"{size}, one for each {what}"
                raise ValueError(f"{name} has {len(values)} values: must be {wanted}")
            arrays.append(np.array(values if len(values) else np.zeros(size), dtype=float))
        x, v, place, rate = arrays
        boxes = np.array([self.structure.boxes[one.box] for one in self.each])
        y = boxes @ x + place * [one.clearance for one in self.each]
        return State(x.tolist(), v.tolist(), y.tolist(), (boxes @ v + rate).tolist())

    @property
    def cycle(self) -> float:
        """Cycle 2 pi / forcing_frequency of the clock in s."""
        return 2.0 * math.pi / self.forcing_frequency

    def work(self, cycles: float) -> float:
        """Cycles, or samples of a record, times coordinates. The time of a run grows with it."""
        coordinates = len(self.structure) + len(self.each)
        return max(cycles, self.forcing.samples) * coordinates

    @property
    def settings(self) -> dict[str, Any]:
        """All of it in plain values: structure, forcing, and the other parameters."""
        beside: dict[str, Any] = dict(self.given)
        made = {"structure": beside.pop("structure").settings, "forcing": self.forcing.settings}
        beside.pop("forcing", None)
        if isinstance(self.forcing, Record):
            samples = {"time": self.forcing.time.tolist(), "value": self.forcing.value.tolist()}
            made["forcing"] = {k: v for k, v in made["forcing"].items() if k != "samples"} | samples
        if self.masses is not None:
            beside["masses"] = [dict(one) for one in self.masses]
        return {**made, "parameters": beside}

    def quantity_of(self, name: str) -> Quantity:
        """Return what is declared of a number that `having` takes.

        Raises
        ------
        ValueError, TypeError
            For an unknown name, with the nearest one, and a mass that there is not.
        """
        own_numbers = *self.structure.quantities, *self.forcing.quantities
        known = {q.name: q for q in (*self.quantities, *own_numbers)}
        common, number = split(name, OF_A_MASS_STRUCTURE) or (name, 0)
        if common not in known:
            own = (f"{one}_{k}" for k in range(len(self.each)) for one in OF_A_MASS_STRUCTURE[1:])
            raise unknown_name("quantity of a structure", name, [*known, *own])
        if number >= len(self.each):
            raise ValueError(f"{name} {no_such_mass(number, len(self.each))}")
        return known[common]

    def words_of(self, name: str) -> str:
        """Return the words for a number that `having` takes, with the box of a single mass."""
        common, number = split(name, OF_A_MASS_STRUCTURE) or (name, -1)
        words, boxes = common.replace("_", " "), [one.box for one in self.each]
        if number < 0 or len(boxes) == 1:
            return words
        alone = boxes.count(boxes[number]) == 1
        return f"{words}{'' if alone else f' of mass {number}'} in {boxes[number]}"

    def having(self, values: Mapping[str, Any]) -> "StructureParameters":
        """Return these parameters with other values.

        `gap_1` is that of mass 1, from 0; `mode_1_frequency`, in Hz, and `mode_1_damping_ratio` are
        those of the structure's first mode; `harmonic_2` is a number of its force.
        """
        of_modes = {name: v for name, v in values.items() if name in self.structure.numbers}
        of_force = {name: v for name, v in values.items() if name in self.forcing.numbers}
        changed = {k: v for k, v in values.items() if k not in of_modes and k not in of_force}
        own = {name: changed.pop(name) for name in values if split(name, OF_A_MASS_STRUCTURE)}
        masses = with_own(changed.get("masses", self.masses), own, OF_A_MASS_STRUCTURE)
        refuse_untaken(changed, own_names((), masses))
        if own:
            changed["masses"] = masses
        if of_modes:
            structure = changed.get("structure", self.structure)
            changed["structure"] = structure.having(**of_modes)
        if of_force:
            changed["forcing"] = changed.get("forcing", self.forcing).having(of_force)
        return replace(self, **changed)

    def value_of(self, name: str) -> float:
        """Value of a number that `having` takes.

        Raises
        ------
        ValueError, TypeError
            As `quantity_of`, and where each mass has its own.
        """
        self.quantity_of(name)
        numbers = self.structure.numbers | self.forcing.numbers
        if name in numbers:
            return numbers[name]
        common, number = split(name, OF_A_MASS_STRUCTURE) or (name, -1)
        own = dict(self.masses[number]) if number >= 0 and self.masses else {}
        everywhere = [k for k, one in enumerate(self.masses or ()) if common in dict(one)]
        if number < 0 and everywhere:
            raise ValueError(f"{name}: masses[{everywhere[0]}] has its own; give {name}_0")
        return float(own.get(common, getattr(self, common)))

    def beside(self, values: Mapping[str, float]) -> "StructureParameters":
        """As `having`, scaled in the units of these parameters."""
        made = self.having(values)
        made.__dict__.pop("units", None)
        made.__dict__.pop("dimensionless", None)
        made.__dict__["_sizes"] = self._sizes
        return made


def moves_base(forcing: Forcing) -> bool:
    """Whether a force is the motion of a structure's base."""
    return forcing.amplitude in ("B", "A")


def _lowest_rate(structure: Structure) -> float:
    """Lowest natural angular frequency that is not zero, in rad/s; 0 where there is none."""
    rates = 2.0 * math.pi * structure.frequencies
    # A rigid-body mode has the frequency of rounding.
    moving = rates[rates > 1e-6 * rates[-1]]
    return float(moving[0]) if len(moving) else 0.0


def _tables_in(where: str, here: Mapping[str, Any]) -> tuple[Table, ...]:
    """Tables of the left and of the right wall; none where neither has one."""
    given = [name for name in WALL_TABLES if here[name] is not None]
    if not given:
        return ()
    refuse_beside_tables(here, where)
    if here["yield_speed"] < math.inf:
        raise ValueError(
            f"{where}yield_speed and {given[0]} ask for different contact laws: give one"
        )
    right = here["restitution_table"] or ((1.0, here["restitution"]),)
    left = here["restitution_table_left"]
    if left is None and here["restitution_left"] < math.inf:
        left = ((1.0, here["restitution_left"]),)
    return left or right, right


def _own_values(k: int, given: Mapping[str, Any]) -> Mass:
    known = {q.name: q for q in StructureParameters.quantities}
    made: list[tuple[str, Any]] = []
    for name, value in given.items():
        try:
            if name in WALL_TABLES:
                made.append((name, read_table(name, value, "m/s")))
            else:
                made.append((name, value if name == "box" else known[name].check(value)))
        except (ValueError, TypeError) as error:
            raise type(error)(f"masses[{k}].{error}") from None
    return Mass(made)

"""The parameters of a run: dimensionless, and the same damper in SI units.

Lengths are scaled by F0/K and times by sqrt(M/K), so the primary obeys
``x'' + 2 zeta x' + x = sin(omega t + phase)`` and the free mass flies between two walls that
move with it, ``|y - x| <= clearance``. The ranges are those for which results are promised.
"""

import math
from collections.abc import Callable, Collection, Iterable, Mapping
from dataclasses import KW_ONLY
from functools import cached_property
from importlib import import_module
from typing import Any

from damper.parameters.forcing import HARMONIC, check_force, left_out, read_forcing
from damper.parameters.masses import changed_in, of_first_mass, own_values, read_masses, value_in
from damper.parameters.models import models_of
from damper.parameters.names import OF_A_MASS_SI
from damper.parameters.quantity import Quantity, QuantityClass, quantity, shared
from damper.parameters.tables import (
    TABLE_SPEED,
    WALL_TABLES,
    Table,
    listed_tables,
    put_own,
    read_table,
    refuse_beside_tables,
    tables_over,
)
from damper.parameters.unit_text import number_in
from damper.parameters.units import ACCELERATION, FORCE, LENGTH, NO_UNITS, SPEED, Units
from damper.parameters.unusual import unusual_damper

#: Least restitution of compliant contact without tension: its dashpot would have to be infinite.
LEAST_COMPLIANT_RESTITUTION = 1e-3
#: Largest frequency, in units of sqrt(K/M), of a force.
LARGEST_FREQUENCY = 1e3
#: Largest weight, in units of F0, of a free mass along its box.
LARGEST_WEIGHT = 1e6
#: Largest rate, in units of sqrt(K/M), at which a support moves the free mass.
LARGEST_SUPPORT_RATE = 2000.0


def _friction_acceleration(
    friction_coefficient: float,
    transverse_acceleration: float,
    primary_mass: float,
    force_amplitude: float,
) -> float:
    return friction_coefficient * transverse_acceleration * primary_mass / force_amplitude


class Parameters(QuantityClass):
    """Dimensionless parameters of an impact damper.

    The quantities under Parameters make the damper with rigid walls and Newton's restitution. The
    quantities under Other Parameters add to it, and choose at most one other model: compliant
    contact, a time-varying free mass, a support that ties the free mass to the frame, or several
    free masses. Dry friction between free mass and box goes with rigid walls, with a support and
    with several masses.

    Parameters
    ----------
    {quantities}

    Other Parameters
    ----------------
    {options}
    forcing : Forcing or str, default Harmonic()
        What drives the damper: `damper.Harmonic`, `NoForce`, `Harmonics`, `Base`, `Unbalance`,
        `Record` or `Noise`, or "harmonic", "none", "base" or "unbalance".
    restitution_table, restitution_table_left : sequence of (float, float), optional
        In place of `restitution` and `restitution_left`: rows (approach speed, coefficient) at
        rising speeds, in units of F0/sqrt(K M). Between two rows the coefficient is linear in the
        logarithm of the speed, before the first and beyond the last it is constant.
    masses : sequence of mapping, optional
        Several free masses, a mapping for each: its own `mass_ratio`, `clearance`, `restitution`,
        `restitution_left`, their tables, `yield_speed`, `yield_exponent`, `gravity`, `friction`,
        `support_stiffness_ratio` and `support_damping_ratio`, in place of the values for all
        masses. Its `mass_share` and `clearance_factor` multiply mass ratio and clearance:
        `damper.equal_masses` divides one free mass so.

    Raises
    ------
    ValueError
        Names the field, the value and the range when a value is not finite or out of range;
        names the fields when they contradict each other.
    TypeError
        When a value is not a real number.

    Examples
    --------
    >>> Parameters(mass_ratio=0.1, damping_ratio=0.05, frequency_ratio=0.8,
    ...            clearance=1.0, restitution=0.6).cycle
    7.853981633974483
    >>> Parameters(0.1, 0.05, 0.8, 1.0, restitution=1.2)
    Traceback (most recent call last):
    ...
    ValueError: restitution = 1.2: must be a finite number with 0 <= restitution <= 1
    """

    mass_ratio: float = quantity(
        r"$\mu$",
        "mass ratio m/M",
        definition="free mass over primary mass; with 0 it does not act back, with inf it is a "
        "fixed stop",
        minimum=1e-6,
        maximum=1e18,
        limit_cases=(0.0, math.inf),
        from_si=lambda free_mass, primary_mass: free_mass / primary_mass,
    )
    damping_ratio: float = quantity(
        r"$\zeta$",
        "damping ratio of the primary",
        definition="C / (2 sqrt(K M))",
        minimum=0.0,
        maximum=10.0,
        from_si=lambda damping, stiffness, primary_mass: (
            0.5 * damping / math.sqrt(stiffness * primary_mass)
        ),
    )
    frequency_ratio: float = quantity(
        r"$\omega$",
        "frequency ratio",
        definition="forcing frequency over sqrt(K/M); 1 when left out under no force, a record or "
        "noise, which have none",
        minimum=1e-3,
        maximum=LARGEST_FREQUENCY,
        from_si=lambda forcing_frequency, primary_mass, stiffness: (
            forcing_frequency * math.sqrt(primary_mass / stiffness)
        ),
    )
    clearance: float = quantity(
        r"$d$",
        "clearance to each wall",
        LENGTH,
        definition="half of the free mass's whole travel",
        minimum=0.0,
        from_si=lambda gap, stiffness, force_amplitude: 0.5 * gap * stiffness / force_amplitude,
    )
    restitution: float = quantity(
        r"$r$",
        "coefficient of restitution",
        definition="of both walls; of the right one where restitution_left is given",
        minimum=0.0,
        maximum=1.0,
        default=math.inf,
        unless="restitution_table",
    )
    phase: float = quantity(
        r"$\varphi$",
        "forcing phase",
        "rad",
        definition="the force is sin(omega t + phase)",
        default=0.0,
    )

    # Options are given by name.
    _: KW_ONLY

    force_amplitude: float = quantity(
        "$f_0$",
        "forcing amplitude",
        FORCE,
        definition="what multiplies the force; 0 is free motion",
        minimum=0.0,
        default=1.0,
    )
    restitution_left: float = quantity(
        r"$r_\mathrm{L}$",
        "coefficient of restitution of the left wall",
        minimum=0.0,
        maximum=1.0,
        default=math.inf,
        note="leave it out for walls that are alike",
    )
    yield_speed: float = quantity(
        r"$v_\mathrm{y}$",
        "yield speed of the contact",
        SPEED,
        definition="approach speed above which restitution falls as a power of yield_speed / speed",
        minimum=0.0,
        above=True,
        default=math.inf,
        note="leave it out for a constant restitution",
        law="yielding",
    )
    yield_exponent: float = quantity(
        "$p$",
        "exponent with which restitution falls above the yield speed",
        definition="as (yield_speed / speed)^yield_exponent; 1/4 is fully plastic indentation",
        minimum=0.0,
        maximum=1.0,
        default=0.25,
        note="with more a harder hit would come back slower",
        law="yielding",
        needs="yield_speed",
    )
    gravity: float = quantity(
        r"$\gamma$",
        "gravity along the box",
        ACCELERATION,
        definition="acceleration of the free mass to the left wall: that of gravity times the sine "
        "of the box's inclination",
        default=0.0,
        from_si=lambda gravity, inclination, primary_mass, force_amplitude: (
            gravity * math.sin(math.radians(inclination)) * primary_mass / force_amplitude
        ),
    )
    support_stiffness_ratio: float = quantity(
        r"$\kappa$",
        "stiffness of the free mass's support over that of the primary",
        minimum=0.0,
        default=0.0,
        model="grounded",
        from_si=lambda support_stiffness, stiffness: support_stiffness / stiffness,
    )
    support_damping_ratio: float = quantity(
        r"$\zeta_2$",
        "damping ratio of the free mass's support",
        definition="C2 / (2 sqrt(K M)) with K and M of the primary",
        minimum=0.0,
        default=0.0,
        model="grounded",
        from_si=lambda support_damping, stiffness, primary_mass: (
            0.5 * support_damping / math.sqrt(stiffness * primary_mass)
        ),
    )
    contact_stiffness_ratio: float = quantity(
        r"$k_\mathrm{c}$",
        "stiffness of the contact over that of the primary",
        definition="its damping gives an impact between free bodies the restitution",
        minimum=1e-3,
        maximum=1e8,
        default=math.inf,
        note="leave it out for a rigid wall",
        model="compliant",
        from_si=lambda contact_stiffness, stiffness: contact_stiffness / stiffness,
    )
    contact_tension: float = quantity(
        r"$\chi$",
        "whether the contact force may be tensile",
        minimum=0.0,
        maximum=1.0,
        whole=True,
        default=0.0,
        note="0: contact ends when its force vanishes, 1: when the gap reopens",
        model="compliant",
        chooses=False,
    )
    modulation_depth: float = quantity(
        r"$\mu_1/\mu$",
        "modulation of the free mass over its mean",
        definition="it is mass_ratio (1 + depth cos(omega t / order + modulation_phase))",
        minimum=0.0,
        maximum=1.0,
        below=True,
        default=0.0,
        model="time_varying",
    )
    modulation_order: float = quantity(
        "$n$",
        "cycles in one period of the modulation",
        minimum=1.0,
        maximum=1000.0,
        whole=True,
        default=1.0,
        model="time_varying",
        chooses=False,
        needs="modulation_depth",
    )
    modulation_phase: float = quantity(
        r"$\varphi_\mu$",
        "phase of the modulation",
        "rad",
        default=0.0,
        model="time_varying",
        chooses=False,
        needs="modulation_depth",
    )
    friction: float = quantity(
        r"$a_\mathrm{f}$",
        "acceleration of the sliding free mass by dry friction",
        ACCELERATION,
        definition="friction coefficient times the acceleration that presses it on the box",
        minimum=0.0,
        default=0.0,
        model="sliding",
        from_si=_friction_acceleration,
    )
    mass_share: float = quantity(
        r"$\beta$",
        "share of the mass ratio that one of several masses has",
        minimum=1e-6,
        maximum=1.0,
        default=1.0,
        model="several",
        chooses=False,
    )
    clearance_factor: float = quantity(
        r"$\delta$",
        "factor of the clearance of one of several masses",
        minimum=0.0,
        default=1.0,
        model="several",
        chooses=False,
    )

    walls: float = quantity(
        "$w$",
        "walls that the box has",
        definition="left, both or right; with one wall the clearance is its distance from x",
        minimum=-1.0,
        maximum=1.0,
        whole=True,
        default=0.0,
        note="left -1, both 0, right 1",
        words=(("left", -1.0), ("both", 0.0), ("right", 1.0)),
    )
    carrier: float = quantity(
        "$c$",
        "what carries the box",
        definition="an oscillator, the primary; or nothing: the box's motion x(t) is prescribed",
        minimum=0.0,
        maximum=1.0,
        whole=True,
        default=0.0,
        note="oscillator 0, prescribed 1",
        words=(("oscillator", 0.0), ("prescribed", 1.0)),
        model="prescribed",
    )

    # A force, or the name of one without settings until it is read.
    forcing: Any = HARMONIC
    masses: Any = None
    restitution_table: Any = None
    restitution_table_left: Any = None

    def __post_init__(self) -> None:
        options = self.check_each()
        tabled = _read_tables(self.__dict__, "1")
        if self.forcing is not HARMONIC:
            self.__dict__["forcing"] = read_forcing(self.forcing)
            check_force(self.forcing, self.phase, self.force_amplitude, (0.0, 1.0))
            fastest = self.forcing.highest_order * self.frequency_ratio
            if not fastest <= LARGEST_FREQUENCY:
                raise ValueError(
                    f"{self.forcing!r} with frequency_ratio = {self.frequency_ratio!r}: has the "
                    f"frequency {fastest:g} sqrt(K/M); must be <= {LARGEST_FREQUENCY:g} sqrt(K/M)"
                )
        asks = options or tabled or self.masses is not None or self.restitution == math.inf
        # One value, not what follows from it: an object of more than thirty values takes four times
        # the memory, as Python cannot share their names, and a sweep holds many.
        self.__dict__["_asks"] = asks or self.mass_ratio in _LIMITS
        if self.asks:
            check_together(self.__dict__)
            self._check_each()

    @classmethod
    def left_out(cls, forcing: Any) -> Mapping[str, float]:
        """Return what need not be given under a force, with its values."""
        return left_out(read_forcing(forcing), si=False)

    of_masses = classmethod(of_first_mass)

    def _check_each(self) -> None:
        """Check what each of several masses comes to."""
        if self.masses is None:
            if self.restitution_table is None:
                # Infinity, what stands there where a table is given, is no coefficient.
                _QUANTITIES["restitution"].check(self.restitution)
            for name in _FACTORS:
                if getattr(self, name) != 1.0:
                    raise ValueError(f"{name} = {getattr(self, name)!r} without masses: give both")
        else:
            self.__dict__["masses"] = read_masses(self.masses)
        if "several" in self.features:
            for q in _laws(self.__dict__):
                if q.law not in _LAWS_OF_EACH:
                    raise ValueError(
                        f"masses and {q.name} ({q.law}): the walls of several masses have the "
                        f"contact laws {', '.join(_LAWS_OF_EACH)}; leave out one of the two"
                    )
            for k, one in enumerate(self.each):
                if not one.clearance:
                    raise ValueError(f"clearance = 0.0 of mass {k}: each of several must have some")
                if one.yield_speed == math.inf and "yield_exponent" in dict(self.masses[k]):
                    raise ValueError(
                        f"mass {k}: yield_exponent without yield_speed: it has no effect; give "
                        "both or none"
                    )
                if one.mass_ratio == math.inf:
                    raise ValueError(
                        f"mass_ratio = inf of mass {k}: beside a fixed stop there is no other free "
                        "mass; give one mass"
                    )

    @property
    def each(self) -> tuple["Parameters", ...]:
        """A damper with one free mass for each mass, also where there is no list of masses."""
        return (self,) if self.masses is None else self._own[0]

    @cached_property
    def _own(self) -> tuple[tuple["Parameters", ...], tuple[str, ...]]:
        """Dampers of each of several masses, and the `features`.

        At once, as Python shares the names of values that all dampers get in one order.
        """
        each = () if self.masses is None else self._make_each()
        return each, self._find_features(each or (self,))

    def _make_each(self) -> tuple["Parameters", ...]:
        made, common = [], {name: getattr(self, name) for pair in _FACTORS.items() for name in pair}
        for k, own in enumerate(self.masses):
            has = dict(own)
            tables = {name: has.pop(name) for name in WALL_TABLES if name in has}
            try:
                values: dict[str, Any] = {
                    name: _QUANTITIES[name].check(value) for name, value in (common | has).items()
                }
                put_own(values, has | tables)
                for factor, name in _FACTORS.items():
                    values[name] *= values[factor]
                    values[factor] = 1.0
                made.append(self.replaced(masses=None, **values))
            except ValueError as error:
                raise ValueError(f"mass {k}: {error}") from None
        return tuple(made)

    @property
    def asks(self) -> bool:
        """Whether these are more than numbers of one free mass between rigid walls."""
        return bool(self.__dict__["_asks"])

    @property
    def model(self) -> str:
        """Model of walls and free masses: "rigid walls", "compliant" or "time_varying"."""
        return next(filter(_UNLIKE_RIGID.__contains__, self.features), "rigid walls")

    @property
    def main_feature(self) -> str:
        """The first of `features`: the cost of an impact depends on it most."""
        return self.features[0]

    @property
    def features(self) -> tuple[str, ...]:
        """All of `damper.models` that these parameters ask for: walls, count, support, friction."""
        return self._own[1] if self.asks else ("rigid",)

    def _find_features(self, each: tuple["Parameters", ...]) -> tuple[str, ...]:
        asked = {*_asked(self.__dict__)} - _OF_EACH
        if self.masses is not None:
            asked.add("several")
        if any(one.support_stiffness_ratio or one.support_damping_ratio for one in each):
            asked.add("grounded")
        if any(one.friction for one in each):
            asked.add("sliding")
        return tuple(name for name in _ORDER if name in asked) or ("rigid",)

    @property
    def rubs(self) -> bool:
        """Whether any free mass rubs on its box."""
        return "sliding" in self.features

    @property
    def pull(self) -> float:
        """Constant acceleration of the free mass to the left wall: gravity."""
        return self.gravity

    @property
    def hits_stop(self) -> bool:
        """Whether the free mass is a fixed stop."""
        return self.masses is None and self.mass_ratio == math.inf

    @property
    def law(self) -> str:
        """Which of `damper.engine.impact.LAWS` these parameters ask for."""
        if not self.asks:
            return "constant"
        if any(getattr(self, name) is not None for name in WALL_TABLES):
            return "tabled"
        return next((q.law for q in _laws(self.__dict__)), "constant")

    @property
    def acting(self) -> dict[str, Any]:
        """The values that are `given`, but for those of a model or law that is not asked for."""
        own = {"", *models_of(self), self.law}
        forcing = {} if self.forcing == HARMONIC else {"forcing": self.forcing}
        others = {n: v for n in ("masses", *WALL_TABLES) if (v := getattr(self, n)) is not None}
        return (
            forcing
            | others
            | {
                q.name: value
                for q in self.quantities
                if (value := getattr(self, q.name)) != q.default and {q.model, q.law} <= own
            }
        )

    @property
    def restitutions(self) -> tuple[float, float]:
        """Coefficients of restitution of the left and of the right wall, at small speeds."""
        if self.law == "tabled":
            (at_left, *_), (at_right, *_) = self.tables
            return at_left[1], at_right[1]
        left = self.restitution_left
        return self.restitution if left == math.inf else left, self.restitution

    @property
    def tables(self) -> tuple[Table, Table]:
        """Tables of the left and of the right wall; one row where the restitution is constant."""
        right = self.restitution_table or ((1.0, self.restitution),)
        if self.restitution_left != math.inf:
            return ((1.0, self.restitution_left),), right
        return self.restitution_table_left or right, right

    @property
    def cycle(self) -> float:
        """Cycle 2 pi / frequency_ratio of the clock, in units of sqrt(M/K).

        A force that repeats does so in it; windows, sections and records are counted in it.
        """
        return 2.0 * math.pi / self.frequency_ratio

    @property
    def dimensionless(self) -> "Parameters":
        """These parameters: `SIParameters` have others."""
        return self

    @property
    def units(self) -> Units:
        """What the answers are in: sizes of 1."""
        return NO_UNITS

    def rates(self, name: str) -> dict[str, float]:
        """Derivatives by a parameter; `SIParameters` have more."""
        return {name: 1.0}


class SIParameters(QuantityClass, shares=Parameters):
    """The same damper in SI units; its results are in SI units too.

    A number may be text with its unit: ``gap="20 mm"``, ``forcing_frequency="12 Hz"``.

    Parameters
    ----------
    {quantities}

    Other Parameters
    ----------------
    {options}
    forcing : Forcing or str, default Harmonic()
        As for `Parameters`, with times in s and frequencies in rad/s. `force_amplitude` is the
        forcing's amplitude B, and sets the unit of length: F0/K of a force, B of the motion of a
        base, B/M of an unbalance, B M/K of the acceleration of a base.
    restitution_table, restitution_table_left : sequence of (float, float), optional
        As for `Parameters`, with speeds in m/s.
    masses : sequence of mapping, optional
        As for `Parameters`, with `free_mass`, `gap`, `friction_coefficient`, `support_stiffness`
        and `support_damping` in place of the dimensionless quantities.
    structure : Structure, optional
        In place of `primary_mass`, `damping` and `stiffness`: the masses are in boxes of a
        `damper.Structure`. The result is a `damper.parameters.StructureParameters`, which says what
        a mass has there: its `box`, `tie_stiffness`, `tie_damping`, `pendulum_length`.

    Raises
    ------
    ValueError, TypeError
        As `Parameters`; also when a dimensionless parameter leaves its range, which the message
        names with the values that it is formed from.

    Examples
    --------
    >>> p = SIParameters(primary_mass=2.0, damping=4.0, stiffness=200.0, force_amplitude=10.0,
    ...                  forcing_frequency=11.0, free_mass=0.2, gap=0.02, restitution=0.6)
    >>> p.dimensionless.clearance, p.dimensionless.damping_ratio
    (0.2, 0.1)
    >>> p.units.length, p.units.time
    (0.05, 0.1)
    """

    primary_mass: float = quantity("$M$", "mass of the primary", "kg", minimum=0.0, above=True)
    damping: float = quantity("$C$", "damping coefficient of the primary", "N s/m", minimum=0.0)
    stiffness: float = quantity("$K$", "stiffness of the primary", "N/m", minimum=0.0, above=True)
    force_amplitude: float = quantity(
        "$F_0$",
        "forcing amplitude",
        "N",
        definition="0 is free motion; that of a base's motion is in m, of its acceleration in "
        "m/s2, of an unbalance in kg m; need not be given without a force",
        minimum=0.0,
    )
    forcing_frequency: float = quantity(
        r"$\Omega$",
        "angular forcing frequency",
        "rad/s",
        definition="2 pi times that in Hz; 1 Hz when left out under no force, a record or noise, "
        "which have none: a cycle is a second",
        minimum=0.0,
        above=True,
    )
    free_mass: float = quantity(
        "$m$",
        "free mass",
        "kg",
        definition="with 0 it does not act back, with inf it is a fixed stop",
        minimum=0.0,
        limit_cases=(math.inf,),
    )
    gap: float = quantity(
        "$2D$",
        "gap, the free mass's whole travel",
        "m",
        definition="without its own size; the clearance is half of it",
        minimum=0.0,
    )
    restitution: float = shared(default=math.inf)
    phase: float = shared(default=0.0)

    _: KW_ONLY

    restitution_left: float = shared(default=math.inf)
    yield_speed: float = shared(default=math.inf)
    yield_exponent: float = shared(default=0.25)
    gravity: float = quantity(
        r"$\gamma$",
        "acceleration of gravity",
        "m/s2",
        definition="its sine of the inclination accelerates the free mass to the left wall",
        default=0.0,
    )
    inclination: float = quantity(
        r"$\alpha$",
        "inclination of the box",
        "degree",
        definition="0 is level; -90 has the left wall on top",
        minimum=-90.0,
        maximum=90.0,
        default=90.0,
    )
    support_stiffness: float = quantity(
        "$K_2$", "stiffness of the free mass's support", "N/m", minimum=0.0, default=0.0
    )
    support_damping: float = quantity(
        "$C_2$", "damping coefficient of the free mass's support", "N s/m", minimum=0.0, default=0.0
    )
    contact_stiffness: float = quantity(
        r"$K_\mathrm{c}$",
        "stiffness of the contact",
        "N/m",
        minimum=0.0,
        above=True,
        default=math.inf,
        note="leave it out for a rigid wall",
    )
    contact_tension: float = shared(default=0.0)
    modulation_depth: float = shared(default=0.0)
    modulation_order: float = shared(default=1.0)
    modulation_phase: float = shared(default=0.0)
    friction_coefficient: float = quantity(
        r"$\mu_\mathrm{f}$",
        "coefficient of dry friction between free mass and box",
        minimum=0.0,
        default=0.0,
    )
    transverse_acceleration: float = quantity(
        r"$g_\perp$",
        "acceleration that presses the free mass on the box",
        "m/s2",
        definition="that of gravity in a level box",
        minimum=0.0,
        default=0.0,
    )
    mass_share: float = shared(default=1.0)
    clearance_factor: float = shared(default=1.0)
    walls: float = shared(default=0.0)
    carrier: float = shared(default=0.0)

    # A force, or the name of one without settings until it is read.
    forcing: Any = HARMONIC
    masses: Any = None
    structure: Any = None
    restitution_table: Any = None
    restitution_table_left: Any = None

    def __new__(cls, *values: Any, structure: Any = None, **named: Any) -> Any:
        if structure is None:
            return object.__new__(cls)
        # By name: that module takes quantities from here.
        structural = import_module("damper.parameters.structural")
        return structural.StructureParameters.of_any(*values, structure=structure, **named)

    def __post_init__(self) -> None:
        own = self.__dict__
        own["forcing"] = read_forcing(self.forcing)
        unit = self.forcing.si_unit
        own["force_amplitude"] = number_in("force_amplitude", self.force_amplitude, [unit])
        self.check_each()
        _read_tables(self.__dict__, "m/s")
        if self.masses is not None:
            units = {q.name: q.units for q in self.quantities}
            own["masses"] = read_masses(self.masses, OF_A_MASS_SI, units)
        check_force(self.forcing, self.phase, self.force_amplitude, (0.0,))
        name = "friction_coefficient"
        rubs = {name: self.friction_coefficient}
        rubs |= {
            f"masses[{k}].{name}": dict(m).get(name, 0.0) for k, m in enumerate(self.masses or ())
        }
        for name, value in rubs.items():
            if value and not self.transverse_acceleration:
                raise ValueError(
                    f"{name} = {value!r} without transverse_acceleration: nothing presses the free "
                    "mass on the box; give it for all masses in m/s2, 9.81 in a level box"
                )
        pulled = self.gravity or any(dict(m).get("gravity") for m in self.masses or ())
        if self.inclination not in (0.0, 90.0) and not pulled:
            raise ValueError(
                f"inclination = {self.inclination!r} without gravity: nothing pulls the free mass "
                "along the box; give it in m/s2, 9.81 on the earth"
            )
        self.dimensionless  # noqa: B018 - raises unless the scaled values are allowed, too

    @classmethod
    def left_out(cls, forcing: Any) -> Mapping[str, float]:
        """Return what need not be given under a force, with its values."""
        return left_out(read_forcing(forcing), si=True)

    of_masses = classmethod(of_first_mass)

    @classmethod
    def of(
        cls, parameters: Parameters, primary_mass: float, stiffness: float, force_amplitude: float
    ) -> "SIParameters":
        """Return the damper of dimensionless parameters with this primary and force.

        Examples
        --------
        >>> SIParameters.of(Parameters(0.1, 0.1, 1.1, 1.0, 0.6), 2.0, 200.0, 10.0).gap
        0.1
        """
        primary: dict[str, Any] = {
            "primary_mass": primary_mass,
            "stiffness": stiffness,
            "force_amplitude": force_amplitude,
            "forcing": parameters.forcing,
            "masses": None,
        }
        given, primary = primary, _referred(primary) | _BESIDE
        units = _units(primary)
        given["force_amplitude"] *= parameters.force_amplitude
        given["forcing"] = parameters.forcing.over(1.0 / units.time)
        for q, (own, *others) in _SCALED:
            value = getattr(parameters, q.name)
            if value != (math.inf if q.unless else q.default):
                given |= {name: _BESIDE[name] for name in others if name in _BESIDE}
                # Each ratio is in proportion to its own counterpart.
                given[own] = value / _scaled(q, primary | {own: 1.0}, units)
        if parameters.masses is not None:
            has = {name for mass in parameters.masses for name, _ in mass}
            for q, (_, *others) in _SCALED:
                if q.name in has:
                    given |= {name: _BESIDE[name] for name in others if name in _BESIDE}
            given["masses"] = [
                {
                    own: dict(mass)[q.name] / _scaled(q, primary | {own: 1.0}, units)
                    for q, (own, *_) in _SCALED
                    if q.name in dict(mass)
                }
                | tables_over(dict(mass), 1.0 / units.speed)
                for mass in parameters.masses
            ]
        given |= tables_over({**vars(parameters), "masses": None}, 1.0 / units.speed)
        return cls.unchecked(**given)

    @cached_property
    def dimensionless(self) -> Parameters:
        """The scaled parameters."""
        values, units = self.__dict__, self.units
        # 0, 1 and infinity are the same in both systems.
        given = {
            names[0]
            for q, names in _SCALED
            if values[names[0]] != (math.inf if q.unless else q.default)
        }
        scaled = _scaled_values(values, values, given, units)
        scaled["force_amplitude"] = float(values["force_amplitude"] != 0.0)
        tables = tables_over({**values, "masses": None}, units.speed)
        check_together(_DEFAULTS | scaled | tables, SI_NAME, values)
        masses: Any = None if self.masses is None else []
        for k, own in enumerate(self.masses or ()):
            has = dict(own)
            here = values | has
            try:
                changes: dict[str, Any] = _scaled_values(values, here, has, units)
                check_together(_DEFAULTS | scaled | changes, SI_NAME, here)
            except ValueError as error:
                raise ValueError(f"mass {k}: {error}") from None
            masses.append(changes | tables_over(has, units.speed))
        # Values at their defaults are left out.
        forcing = self.forcing.over(units.time)
        return Parameters.unchecked(**scaled, **tables, forcing=forcing, masses=masses)

    @cached_property
    def units(self) -> Units:
        """Sizes of the dimensionless units of this damper."""
        values = self.__dict__
        if not values["force_amplitude"] and not values["gap"]:
            raise ValueError(
                "gap = 0.0 with force_amplitude = 0.0: free motion has its lengths in half of the "
                "gap; give one of the two"
            )
        units = _units(_referred(values))
        if not (
            _ordinary(units.time) and all(map(_ordinary, (units.length, units.speed, units.energy)))
        ):
            given = ("force_amplitude", "stiffness", "primary_mass")
            raise ValueError(
                f"{', '.join(f'{name} = {values[name]!r}' for name in given)}: cannot be scaled: "
                "F0/K, sqrt(M/K), F0/sqrt(K M) or F0^2/K is zero or infinite"
            )
        return units

    @property
    def unusual(self) -> tuple[str, ...]:
        """A sentence for each value that few machines have, such as a gap of 20 m."""
        values = {q.name: getattr(self, q.name) for q in self.quantities}
        values |= own_values(map(dict, self.masses or ()))
        return unusual_damper({name: [v] for name, v in values.items()}, self.forcing.kind)

    @property
    def cycle(self) -> float:
        """Cycle 2 pi / forcing_frequency of the clock in s; see `Parameters.cycle`."""
        return 2.0 * math.pi / self.forcing_frequency

    def rates(self, name: str) -> dict[str, float]:
        """Derivatives by a quantity: of the scaled parameters, of LENGTH and SPEED; not those of 0.

        But for the inclination's, all are products of powers, whose exponents doubling it shows;
        from 0 they are linear.
        """
        values, found = self.__dict__, {}
        own = value_in(values, name)

        def having(value: float) -> dict[str, Any]:
            return values | changed_in(values, {name: value})

        if name == "force_amplitude" and not own:  # lengths stay in half of the gap
            one = _referred(having(1.0))[name]
            return {name: one / _referred(values)[name]}
        if name == "inclination":
            upright, slope = _all_scaled(having(90.0)), math.radians(math.cos(math.radians(own)))
            return {n: slope * v for n, v in upright.items() if n.startswith("gravity")}
        here = _all_scaled(having(own))
        for key, value in _all_scaled(having(2.0 * own or 1.0)).items():
            if value != here[key]:
                linear = value - here[key]
                if key == TABLE_SPEED:
                    value, linear, here[key] = value / here[key], linear / here[key], 1.0
                found[key] = here[key] * math.log2(value / here[key]) / own if own else linear
        return found


#: Dimensionless parameter -> its counterpart in SI units, which may be of the same name.
SI_NAME = {q.name: q.si_names[0] for q in Parameters.quantities}
#: Lengths are in units that make the amplitude of the force 1.
_SCALED = tuple((q, q.si_names) for q in Parameters.quantities if q.name != "force_amplitude")
#: SI quantities that are formed from another one, with their defaults.
_BESIDE = {"inclination": 90.0, "transverse_acceleration": 1.0}
_DEFAULTS = {q.name: q.default for q in Parameters.quantities if q.default is not None}
_DEFAULTS |= {q.name: math.inf for q in Parameters.quantities if q.unless}
_QUANTITIES = {q.name: q for q in Parameters.quantities}
#: Factor of each of several masses -> its quantity.
_FACTORS = {"mass_share": "mass_ratio", "clearance_factor": "clearance"}
_CHOOSING = tuple(q for q in Parameters.quantities if q.model and q.chooses)
_OF_LAWS = tuple(q for q in Parameters.quantities if q.law)


#: Contact laws of the walls of several masses.
_LAWS_OF_EACH = ("constant", "yielding", "tabled")
#: Models that each of several masses may be one of.
_OF_EACH = {"sliding", "grounded"}
#: Models that go with one another.
_TOGETHER = (_OF_EACH, {"sliding", "prescribed"})
#: Features whose equations are not those of constant masses between rigid walls.
_UNLIKE_RIGID = ("compliant", "time_varying")
#: Order of `Parameters.features`: the slowest model first.
_ORDER = ("compliant", "time_varying", "several", "prescribed", "sliding", "grounded")


#: Quantities that every damper needs.
BASIC = ("mass_ratio", "damping_ratio", "frequency_ratio", "clearance", "restitution", "phase")


def require_known(parameters: Parameters, known: Collection[str], what: str) -> None:
    """Raise ValueError where a quantity acts on the damper that a formula does not know.

    `what` is the formula, as the message calls it.
    """
    for name, value in parameters.acting.items():
        if name not in known:
            raise ValueError(
                f"{name} = {value!r}: {what} holds for {', '.join(known)} only; leave {name} out"
            )


def _scaled_values(
    common: Mapping[str, Any], values: Mapping[str, Any], given: Collection[str], units: Units
) -> dict[str, float]:
    """Parameters of the quantities in SI units that are `given`.

    `values` has all, of one mass where each of several has its own; `common` those of the damper.
    """
    by = {**values, "force_amplitude": _referred(common)["force_amplitude"]}
    scaled = {}
    for q, names in _SCALED:
        if names[0] not in given:
            continue
        ratio = _scaled(q, by, units)
        # A gap or a spring that underflows to zero would be another damper.
        ordinary = _ordinary(ratio) == all(_ordinary(by[n]) for n in names)
        if by[names[0]] != q.default and not (q.holds(ratio) and ordinary):
            origin = ", ".join(f"{name} = {values[name]!r}" for name in names)
            origin = "" if names == (q.name,) else f", from {origin}"
            raise ValueError(
                f"{q.name} = {ratio!r}{origin}: must be a finite number with {q.allowed}"
            )
        scaled[q.name] = ratio
    return scaled


def check_together(
    values: Mapping[str, Any],
    called: Mapping[str, str] = {},
    given: Mapping[str, Any] | None = None,
) -> None:
    """Raise ValueError where options of a damper, each in its range, contradict each other.

    `called` is what the message calls a parameter, where that is not its name; `given` has its
    value under that name.
    """
    given = values if given is None else given

    def named(name: str) -> str:
        return called.get(name, name)

    asked = _asked(values)
    if len(asked) > 1 and {*asked} not in _TOGETHER:
        words = (f"{', '.join(map(named, names))} ({model})" for model, names in asked.items())
        raise ValueError(f"{' and '.join(words)} ask for different models: give those of one")
    laws = [(q.name, q.law) for q in _laws(values)]
    laws += [(name, "tabled") for name in WALL_TABLES if values.get(name)]
    if len({law for _, law in laws}) > 1:
        words = (f"{named(name)} ({law})" for name, law in laws)
        raise ValueError(f"{' and '.join(words)} ask for different contact laws: give one")
    _check_several(values, asked, named)
    _check_box(values, asked, named, given)
    _check_limits(values, asked, named, given)
    refuse_beside_tables(values)
    for name, does in (
        ("gravity", "weighs {:g} F0 along its box"),
        ("friction", "rubs by {:g} F0"),
    ):
        force = values["mass_ratio"] * abs(values[name]) if values[name] else 0.0
        if not force <= LARGEST_WEIGHT:
            raise ValueError(
                f"{named(name)} = {given[named(name)]!r} with {named('mass_ratio')}: the free mass "
                f"{does.format(force)}; must be <= {LARGEST_WEIGHT:g} F0"
            )
    if "compliant" in asked:
        _check_compliant(values, named)
    elif values["contact_tension"]:
        raise ValueError(
            f"contact_tension = 1: a rigid wall has no tension; give {named(_STIFFNESS)} with it"
        )
    if "grounded" in asked:
        _check_support(values, named)


def _check_box(
    values: Mapping[str, Any],
    asked: Mapping[str, list[str]],
    named: Callable[[str], str],
    given: Mapping[str, Any],
) -> None:
    """Refuse what a box with one wall, or of prescribed motion, does not have."""
    if values["walls"]:
        others = [name for model in ("compliant", "time_varying") for name in asked.get(model, ())]
        others += ["masses"] if given.get("masses") is not None else []
        for name in others:
            raise ValueError(f"walls and {named(name)}: with {named(name)} a box has both walls")
        for name, common in (("restitution_left", "restitution"), WALL_TABLES[::-1]):
            if values.get(name) not in (None, math.inf):
                raise ValueError(
                    f"walls and {name}: {common} is that of the only wall; leave out {name}"
                )
    if not values["carrier"]:
        return
    what = "carrier = 'prescribed'"
    if named("mass_ratio") != "mass_ratio":
        raise ValueError(
            f"{what} in SI units: nothing scales the motion; give damper.Parameters its lengths in "
            "m and its times in s"
        )
    for name, why in (
        ("mass_ratio", "nothing acts back on the box"),
        ("damping_ratio", "there is no primary"),
    ):
        if values[name]:
            raise ValueError(f"{name} = {values[name]!r} with {what}: {why}; must be 0")
    force = given["forcing"]
    if force.samples and not force.moves_frame:
        raise ValueError(
            f"forcing = {force!r} with {what}: a box that follows straight lines between samples "
            "would jump in velocity at each of them; give its acceleration, with "
            "of='base_acceleration'"
        )
    if force.moves_frame and not force.samples:
        raise ValueError(f"forcing = {force!r} with {what}: give damper.Harmonic(), the box's x(t)")


#: Limits of the mass ratio: it does not act back, it is a fixed stop.
_LIMITS = (0.0, math.inf)
#: Limit -> model that does not have it, and why.
_LIMITLESS = {
    0.0: {
        "grounded": "a support moves a free mass without mass infinitely fast",
        "compliant": "a free mass without mass swings infinitely fast in a compliant contact",
        "time_varying": "a free mass without mass cannot vary",
    },
    math.inf: {
        "grounded": "a support cannot move a fixed stop",
        "compliant": "a fixed stop has rigid walls",
        "time_varying": "a fixed stop cannot vary",
        "sliding": "friction of a fixed stop would need a coefficient over the primary's mass",
    },
}


def _check_limits(
    values: Mapping[str, Any],
    asked: Mapping[str, list[str]],
    named: Callable[[str], str],
    given: Mapping[str, Any],
) -> None:
    """Refuse what a free mass without mass, or a fixed stop, does not have."""
    limit = values["mass_ratio"]
    if limit not in _LIMITS:
        return
    mass = f"{named('mass_ratio')} = {limit:g}"
    for model, why in _LIMITLESS[limit].items():
        for name in asked.get(model, ()):
            raise ValueError(f"{named(name)} with {mass}: {why}; leave out {named(name)}")
    if limit == math.inf and values["gravity"]:
        raise ValueError(
            f"{named('gravity')} = {given[named('gravity')]!r} with {mass}: a fixed stop does not "
            "fall, and the primary's own weight only shifts its place of rest; leave out gravity"
        )
    if limit == math.inf and given["forcing"].moves_frame:
        raise ValueError(
            f"forcing = {given['forcing']!r} with {mass}: displacements are relative to the base, "
            "and the stop stands on the ground; for a stop on the base give the inertia as a force"
        )


def _check_several(
    values: Mapping[str, Any], asked: Mapping[str, list[str]], named: Callable[[str], str]
) -> None:
    if values.get("masses") is not None:
        beside = {model: names for model, names in asked.items() if model not in _OF_EACH}
        for name in [n for names in beside.values() for n in names]:
            raise ValueError(
                f"masses and {named(name)}: several free masses have rigid walls and constant "
                f"mass; leave out {named(name)} or masses"
            )


def _check_compliant(values: Mapping[str, Any], named: Callable[[str], str]) -> None:
    for name in (*(q.name for q in _laws(values)), *filter(values.get, WALL_TABLES)):
        raise ValueError(
            f"{named(name)} and {named(_STIFFNESS)}: compliant contact has a constant "
            "restitution; leave out one of the two"
        )
    for name in ("restitution", "restitution_left"):
        if values[name] < LEAST_COMPLIANT_RESTITUTION and not values["contact_tension"]:
            raise ValueError(
                f"{name} = {values[name]!r} with {named(_STIFFNESS)}: must be >= "
                f"{LEAST_COMPLIANT_RESTITUTION:g}, as a contact without tension always rebounds; "
                "or contact_tension = 1"
            )


def _check_support(values: Mapping[str, Any], named: Callable[[str], str]) -> None:
    stiffness, damping = "support_stiffness_ratio", "support_damping_ratio"
    mass = values["mass_ratio"]
    rate = 2.0 * values[damping] / mass + math.sqrt(values[stiffness] / mass)
    if not rate <= LARGEST_SUPPORT_RATE:
        raise ValueError(
            f"{named(stiffness)}, {named(damping)}: the support moves the free mass at the rate "
            f"C2/m + sqrt(K2/m) = {rate:g} sqrt(K/M); must be <= {LARGEST_SUPPORT_RATE:g} sqrt(K/M)"
        )


_STIFFNESS = "contact_stiffness_ratio"


def _asked(values: Mapping[str, Any]) -> dict[str, list[str]]:
    """Models that are asked for, each with the names that ask."""
    asked: dict[str, list[str]] = {}
    for q in _CHOOSING:
        if values[q.name] != q.default:
            asked.setdefault(q.model, []).append(q.name)
    return asked


def _laws(values: Mapping[str, Any]) -> list[Quantity]:
    """Quantities that ask for another contact law than constant restitution."""
    return [q for q in _OF_LAWS if values[q.name] != q.default]


def _read_tables(values: dict[str, Any], unit: str) -> bool:
    """Check the tables of a damper in place; whether it has any."""
    given = [name for name in WALL_TABLES if values[name] is not None]
    for name in given:
        values[name] = read_table(name, values[name], unit)
    return bool(given)


def _referred(values: Mapping[str, Any]) -> dict[str, float]:
    """A damper in SI units with the force F0 of which F0/K is the unit of length.

    In free motion that is half of the gap.
    """
    amplitude, mass, stiffness = (
        values[name] for name in ("force_amplitude", "primary_mass", "stiffness")
    )
    force = values["forcing"].force(amplitude, mass, stiffness)
    return {**values, "force_amplitude": force if amplitude else 0.5 * values["gap"] * stiffness}


def _units(values: Mapping[str, Any]) -> Units:
    """Sizes of the dimensionless units of a damper in SI units, `_referred`."""
    length = values["force_amplitude"] / values["stiffness"]
    time = math.sqrt(values["primary_mass"] / values["stiffness"])
    return Units(length, time, values["force_amplitude"] * length)


def _scaled(q: Quantity, values: Mapping[str, Any], units: Units) -> float:
    """A dimensionless parameter of a damper in SI units, `_referred`."""
    given = [values[name] for name in q.si_names]
    return _ratio(q.from_si, given) if q.from_si else given[0] / units.size(q.units)


def _all_scaled(values: Mapping[str, Any]) -> dict[str, float]:
    """The dimensionless parameters of a damper in SI units, and the sizes of its units."""
    masses = values["masses"] or ()
    values = _referred(values)
    units = _units(values)
    sizes = {unit: units.size(unit) for unit in (LENGTH, SPEED)}
    if listed_tables(values):
        sizes[TABLE_SPEED] = 1.0 / units.speed
    own = {
        f"{q.name}_{k}": _scaled(q, values | dict(mass), units)
        for k, mass in enumerate(masses)
        for q, (name, *_) in _SCALED
        if name in dict(mass)
    }
    return {q.name: _scaled(q, values, units) for q, _ in _SCALED} | own | sizes


def _ratio(formula: Callable[..., float], given: Iterable[float]) -> float:
    """Value of a formula; NaN where a divisor underflows to zero."""
    try:
        return formula(*given)
    except ArithmeticError:
        return math.nan


def _ordinary(value: float) -> bool:
    """Whether a number is neither zero nor infinite."""
    return 0.0 < abs(value) < math.inf

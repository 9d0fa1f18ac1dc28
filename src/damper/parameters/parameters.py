"""What a run is: the parameters of the damper and the state it starts from.

Lengths are scaled by F0/K and times by sqrt(M/K), so the primary obeys
``x'' + 2 zeta x' + x = sin(omega t + phase)`` and the free mass flies between two walls that
move with it, ``|y - x| <= clearance``. `SIParameters` is the same in kg, m and s.
"""

import math
from dataclasses import dataclass, fields
from functools import cache

from damper.parameters.quantities import MODEL_NAMES, check_model, check_quantity, real
from damper.parameters.variables import ENERGY, LENGTH, SPEED, TIME


@dataclass(frozen=True)
class Parameters:
    """Dimensionless parameters of an impact damper.

    The first six make the rigid damper. The rest choose another model, one of the three at most:
    a support that ties the free mass to ground, walls that give, or a free mass that varies.

    Parameters
    ----------
    mass_ratio : float
        Free mass over primary mass, m / M; > 0.
    damping_ratio : float
        C / (2 sqrt(K M)); >= 0. Under-, critically and overdamped primaries are all exact.
    frequency_ratio : float
        Forcing frequency over the natural frequency, Omega / sqrt(K / M); > 0.
    clearance : float
        Distance from the centre to *each* wall (the half gap) times K / F0; >= 0.
        The total free travel is twice this.
    restitution : float
        Newton's coefficient of restitution; 0 <= restitution <= 1.
    phase : float, default 0
        Phase of the force sin(frequency_ratio t + phase) in radians; pi/2 gives a cosine.

    Other Parameters
    ----------------
    support_stiffness_ratio : float, default 0
        Grounded free mass: stiffness of its support over that of the primary; >= 0.
    support_damping_ratio : float, default 0
        Damping of its support as C2 / (2 sqrt(K M)) with K and M of the primary; >= 0.
    support_damping_factor : float, default 0
        The same as a multiple C2 / C1 of the primary's damping; not with the one above.
    contact_stiffness_ratio : float, default inf
        Compliant contact: stiffness of the walls over that of the primary; > 0. Its damping is
        the one that gives an impact between free bodies the restitution.
    contact_tension : {0, 1}, default 0
        0: the contact lets go when its force vanishes. 1: it may pull, until the gap reopens.
    modulation_depth : float, default 0
        Time-variant free mass: mass_ratio (1 + modulation_depth cos(frequency_ratio t /
        modulation_order + modulation_phase)); 0 <= modulation_depth < 1.
    modulation_order : int, default 1
        Forcing periods in one period of the modulation.
    modulation_phase : float, default 0
        Its phase at time 0 in radians.

    Raises
    ------
    ValueError
        Names the field, the value and the range when a value is not finite or out of range;
        names the fields when they ask for more than one model.
    TypeError
        When a value is not a real number.

    Examples
    --------
    >>> Parameters(mass_ratio=0.1, damping_ratio=0.05, frequency_ratio=0.8,
    ...            clearance=1.0, restitution=0.6).period
    7.853981633974483
    >>> Parameters(0.1, 0.05, 0.8, 1.0, restitution=1.2)
    Traceback (most recent call last):
    ...
    ValueError: restitution = 1.2: must be a finite number with 0 <= restitution <= 1
    """

    mass_ratio: float
    damping_ratio: float
    frequency_ratio: float
    clearance: float
    restitution: float
    phase: float = 0.0
    support_stiffness_ratio: float = 0.0
    support_damping_ratio: float = 0.0
    support_damping_factor: float = 0.0
    contact_stiffness_ratio: float = math.inf
    contact_tension: float = 0.0
    modulation_depth: float = 0.0
    modulation_order: float = 1.0
    modulation_phase: float = 0.0

    def __post_init__(self) -> None:
        _check(self)

    @property
    def model(self) -> str:
        """Which of `damper.models` these parameters ask for."""
        if self.contact_stiffness_ratio < math.inf:
            return "compliant"
        if self.modulation_depth > 0.0:
            return "time_varying"
        if self.support_stiffness_ratio > 0.0 or self.support_damping > 0.0:
            return "grounded"
        return "rigid"

    @property
    def support_damping(self) -> float:
        """Damping ratio of the free mass's support, however it is given."""
        return self.support_damping_ratio + self.damping_ratio * self.support_damping_factor

    @property
    def period(self) -> float:
        """Forcing period 2 pi / frequency_ratio, in units of sqrt(M/K)."""
        return 2.0 * math.pi / self.frequency_ratio


@dataclass(frozen=True)
class SIParameters:
    """The same damper in SI units; `damper.events` and `damper.simulate` answer in SI units then.

    Parameters
    ----------
    primary_mass : float
        M in kg; > 0.
    damping : float
        C in N s/m; >= 0.
    stiffness : float
        K in N/m; > 0.
    force_amplitude : float
        F0 in N; > 0, because lengths are scaled by F0/K inside.
    forcing_frequency : float
        Omega in rad/s (not Hz); > 0.
    free_mass : float
        m in kg; > 0.
    gap : float
        The free mass's *whole* travel from wall to wall in m, without its own size; >= 0. The
        dimensionless clearance is half of it, times K / F0.
    restitution, phase : float
        As in `Parameters`.

    Other Parameters
    ----------------
    support_stiffness, support_damping : float, default 0
        Grounded free mass: K2 in N/m and C2 in N s/m of its support; >= 0.
    contact_stiffness : float, default inf
        Compliant contact: stiffness of the walls in N/m; > 0.
    support_damping_factor, contact_tension, modulation_depth, modulation_order, modulation_phase
        As in `Parameters`.

    Raises
    ------
    ValueError, TypeError
        As `Parameters`; also when the ratios leave the range of floating-point numbers.

    Examples
    --------
    >>> p = SIParameters(primary_mass=2.0, damping=4.0, stiffness=200.0, force_amplitude=10.0,
    ...                  forcing_frequency=11.0, free_mass=0.2, gap=0.02, restitution=0.6)
    >>> p.dimensionless.clearance, p.dimensionless.damping_ratio
    (0.2, 0.1)
    >>> p.units.length, p.units.time
    (0.05, 0.1)
    """

    primary_mass: float
    damping: float
    stiffness: float
    force_amplitude: float
    forcing_frequency: float
    free_mass: float
    gap: float
    restitution: float
    phase: float = 0.0
    support_stiffness: float = 0.0
    support_damping: float = 0.0
    support_damping_factor: float = 0.0
    contact_stiffness: float = math.inf
    contact_tension: float = 0.0
    modulation_depth: float = 0.0
    modulation_order: float = 1.0
    modulation_phase: float = 0.0

    def __post_init__(self) -> None:
        _check(self)
        try:
            units, clearance = self.units, self.dimensionless.clearance
            sizes = (units.length, units.time, units.speed, units.energy)
            sound = all(0.0 < size < math.inf for size in sizes) and clearance < math.inf
            # A gap that vanished by rounding would be another model: stuck for good.
            sound = sound and (clearance > 0.0) == (self.gap > 0.0)
        except (ValueError, ArithmeticError):
            sound = False
        if not sound:
            raise ValueError(
                f"{self!r}: these values cannot be scaled: F0/K, sqrt(M/K), F0^2/K, m/M, "
                "C/(2 sqrt(K M)), Omega sqrt(M/K) or gap K/F0 is not a number of ordinary size"
            )

    @property
    def dimensionless(self) -> Parameters:
        """The scaled parameters."""
        return Parameters(
            mass_ratio=self.free_mass / self.primary_mass,
            damping_ratio=0.5 * self.damping / math.sqrt(self.stiffness * self.primary_mass),
            frequency_ratio=self.forcing_frequency * self.units.time,
            clearance=0.5 * self.gap * self.stiffness / self.force_amplitude,
            restitution=self.restitution,
            phase=self.phase,
            support_stiffness_ratio=self.support_stiffness / self.stiffness,
            support_damping_ratio=0.5
            * self.support_damping
            / math.sqrt(self.stiffness * self.primary_mass),
            support_damping_factor=self.support_damping_factor,
            contact_stiffness_ratio=self.contact_stiffness / self.stiffness,
            contact_tension=self.contact_tension,
            modulation_depth=self.modulation_depth,
            modulation_order=self.modulation_order,
            modulation_phase=self.modulation_phase,
        )

    @property
    def units(self) -> "Units":
        """Sizes of the dimensionless units of this damper."""
        length = self.force_amplitude / self.stiffness
        return Units(
            length, math.sqrt(self.primary_mass / self.stiffness), self.force_amplitude * length
        )

    @property
    def period(self) -> float:
        """Forcing period 2 pi / forcing_frequency in s."""
        return 2.0 * math.pi / self.forcing_frequency


@dataclass(frozen=True)
class Units:
    """Sizes of the dimensionless units of one damper: F0/K in m, sqrt(M/K) in s, F0^2/K in J."""

    length: float
    time: float
    energy: float

    @property
    def speed(self) -> float:
        """Size of the unit of speed in m/s."""
        return self.length / self.time

    def size(self, unit: str) -> float:
        """SI size of one of the units of `damper.parameters.variables`; 1 for anything else."""
        return {
            LENGTH: self.length,
            SPEED: self.speed,
            TIME: self.time,
            ENERGY: self.energy,
        }.get(unit, 1.0)


#: Units of a dimensionless run.
NO_UNITS = Units(1.0, 1.0, 1.0)


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
        return State(
            self.x / units.length,
            self.v / units.speed,
            self.y / units.length,
            self.u / units.speed,
            self.time / units.time,
        )


_OF_OTHER_MODELS = frozenset(name for names in MODEL_NAMES.values() for name in names)


@cache
def _defaults(kind: type) -> tuple[tuple[str, object], ...]:
    """Name and default of every field, with `MISSING` for those without one."""
    return tuple((field.name, field.default) for field in fields(kind))


def _check(given: Parameters | SIParameters) -> None:
    """Check every value in place, and that all together ask for one model."""
    other = False
    for name, default in _defaults(type(given)):
        value = getattr(given, name)
        # What is left out is the very object of the default. A rigid damper pays for no more: this
        # loop is a good part of what a lane costs before it runs.
        if value is not default:
            object.__setattr__(given, name, check_quantity(name, value))
            other = other or name in _OF_OTHER_MODELS
    if other:
        check_model({name: getattr(given, name) for name, _ in _defaults(type(given))})

"""Functions for the observer `laws`: each model has them in the module `laws` of its folder."""

from typing import Any, NamedTuple

import numpy as np

from damper.engine.bodies import Ballistic, FixedStop, acceleration_of
from damper.engine.compiled import compiled
from damper.engine.dispatch import by_class, by_class_or_default
from damper.engine.forcing import bound_of, phase_at, rate_of, turn_over, turned
from damper.engine.impact import inertia_of, law_at, restitution_at
from damper.engine.model import mass_ratio_at, motion
from damper.engine.oscillator import Motion, Oscillator
from damper.engine.segment import CONTACT, FLIGHT, IMPACT, Segment
from damper.models.flights import Both, travel_of, unclipped


class Sample(NamedTuple):
    """Where a free mass is at one time of a segment; the gap unclipped, which `motion` clips."""

    x: float
    v: float
    """Of the primary."""
    gap: float
    rate: float
    """At the segment's wall."""
    terms: float
    """Size of the gap's terms."""


#: Columns of an array that has a row for each free mass: those fields of a `Sample`.
GAP, RATE, TERMS = range(3)


class ObservedMass(NamedTuple):
    """Constants of a free mass."""

    ratio: float
    """In energies: 0 of a fixed stop."""
    share: float
    """Its part of all free masses."""
    clearance: float
    travel: float
    """From wall to wall."""
    body: Any
    """In flight, but for friction."""


class Begun(NamedTuple):
    """State of a free mass at the start of a segment."""

    gap: float
    rate: float
    side: float
    mode: float
    is_hit: bool
    """Whether an impact of it on a rigid wall begins the segment."""
    kick: float
    """Speed off its wall by an impact of another mass, where the mass is back there at once."""


@by_class_or_default
def free_mass(model: Any, segment: Any, k: int) -> ObservedMass:
    """Constants of one of the free masses, at a segment's start."""
    ratio = inertia_of(mass_ratio_at(model, segment.periods, segment.time))
    return ObservedMass(ratio, 1.0, model.clearance, travel_of(model), model.mass)


@by_class_or_default
def begun(model: Any, segment: Any, k: int) -> Begun:
    """State of one of the free masses at a segment's start."""
    s = segment
    is_hit = s.cause == IMPACT and s.mode != CONTACT
    return Begun(s.gap, s.gap_rate, s.side, s.mode, is_hit, 0.0)


@by_class_or_default
def rebound_of(model: Any, k: int, side: float, speed: float) -> float:
    """Rebound speed of one of the free masses by the law of its wall."""
    return restitution_at(law_at(model.law, side), speed) * speed


@by_class_or_default
def sample(
    model: Any, segment: Any, start: Any, tau: float, masses: np.ndarray
) -> tuple[float, float]:
    """Displacement and velocity of the primary; each free mass in a row of `masses`."""
    s = segment
    if s.mode == FLIGHT and s.gap >= 0.0:
        x, v, masses[0, GAP], masses[0, RATE] = unclipped(model, s, start, tau)
        masses[0, TERMS] = s.gap + (abs(s.gap_rate) + abs(s.v)) * tau
        masses[0, TERMS] += mass_size(model.mass, start, tau)
    else:
        x, v, gap, masses[0, RATE] = motion(model, s, tau)
        masses[0, GAP] = gap
        masses[0, TERMS] = abs(gap) + (abs(s.v) + abs(s.gap_rate)) * s.duration
    return x, v


@by_class_or_default
def tells_all(model: Any, segment: Any) -> bool:
    """Whether the log has told of all events at a segment's start; another row tells of others."""
    return True


@by_class_or_default
def braked_by(model: Any, segment: Any, masses: np.ndarray) -> float:
    """Change of the primary's velocity by masses that come to rest at once after impacts.

    `masses` are those before, as `sample` has them.
    """
    return 0.0


@by_class_or_default
def has_no_time(model: Any, segment: Any, k: int, rebound: float) -> bool:
    """Whether a mass comes to rest after an impact within the tolerance, so at once."""
    return False


@by_class
def contact_force(model: Any, segment: Any, k: int, tau: float, at: Sample) -> tuple[float, float]:
    """Contact force of a mass that sticks or rests, over the mass, and the size of its terms.

    It is that beyond the force at which friction gives way; over the primary's mass where the free
    mass is infinite.
    """


@by_class
def contact_speed(model: Any, segment: Segment) -> float:
    """Speed at which a lasting contact would swing: what slow velocities in it round by."""


@by_class
def mass_size(mass: Any, start: Any, tau: float) -> float:
    """Size of what a free mass in flight adds to the gap's terms."""


@by_class
def mass_speed(mass: Any, clearance: float, x: float, v: float, duration: float) -> float:
    """Speed that support and force give or take in a time; `x` and `v` are the primary's sizes."""


@by_class
def force_size(mass: Any, model: Any, segment: Segment, tau: float, at: Sample) -> float:
    """Size of the terms of what parts masses that stick."""


@compiled
def larger(old: float, new: float) -> float:
    """The larger of the two; the old one is NaN as long as there is none."""
    return old if old >= new else new


@compiled
def violation(difference: float, size: float) -> float:
    """A difference over the size of its terms; none is no violation, whatever the size."""
    return abs(difference) / size if difference != 0.0 else 0.0


#: Samples of a segment beside its end; of one in which little can turn, and of a long one.
SAMPLES, FEWEST_SAMPLES, MOST_SAMPLES = 8, 3, 64
#: Product of a segment's length and the primary's fastest rate below which little can turn.
SHORT = 0.5


@compiled
def samples_in(rate: float, forcing_rate: float, duration: float) -> int:
    """Number of samples of a flight whose primary has this fastest rate."""
    if max(rate, forcing_rate) * duration <= SHORT:
        return FEWEST_SAMPLES
    swings = duration * max(1.0, forcing_rate)
    return int(min(max(swings, float(SAMPLES)), float(MOST_SAMPLES)))


def have_rigid_walls(kind: type) -> None:
    """Let the contact force of a model be that of rigid walls."""
    contact_force.of(kind)(rigid_contact_force)
    contact_speed.of(kind)(_no_contact_speed)
    force_bound.of(kind)(largest_force)


@by_class
def force_bound(model: Any) -> float:
    """Largest force on the primary, and of friction on the free mass."""


@compiled
def largest_force(model: Any) -> float:
    """Largest value of what drives the primary."""
    return float(model.free.strength * bound_of(model.free.forcing, 0))


@compiled
def rigid_contact_force(
    model: Any, segment: Segment, k: int, tau: float, at: Sample
) -> tuple[float, float]:
    """As `contact_force`, of rigid walls."""
    # What parts the masses: the difference of their accelerations in the flight that would begin.
    s = segment
    phase = phase_in(model.free.forcing, s, tau)
    heavier = 1.0 + inertia_of(mass_ratio_at(model, s.periods, s.time + tau))
    a = acceleration_of(model.free, at.x, at.v, phase)
    y = at.x + s.side * (model.clearance - s.gap)
    b = acceleration_of(model.mass, y, at.v, phase)
    return -s.side * (a - b) / heavier, force_size(model.mass, model, s, tau, at) / heavier


@compiled
def phase_in(forcing: Any, segment: Any, tau: float) -> Any:
    """Phase of a force in a segment; at the end that before a jump which ends the segment."""
    start = phase_at(forcing, segment.periods, segment.time)
    return turned(forcing, start, turn_over(forcing, tau))


@compiled
def _no_contact_speed(model, segment):
    return 0.0


@mass_size.of(Ballistic)
def _ballistic_size(mass, start, tau):
    return 0.0


@mass_size.of(Oscillator)
def _oscillator_size(mass, start, tau):
    own = mass_motion(start)
    return abs(own.v) * tau + abs(own.x)


@by_class
def mass_motion(start: Any) -> Motion:
    """Motion of a free mass on which a force acts, of what its flight follows from."""


@mass_motion.of(Both)
def _motion_of_both(start):
    return start.mass


@mass_speed.of(Ballistic)
def _ballistic_speed(mass, clearance, x, v, duration):
    return abs(mass.acceleration) * duration


@mass_speed.of(Oscillator)
def _oscillator_speed(mass, clearance, x, v, duration):
    drag = 2.0 * mass.damping
    # The spring gives and takes back speed, in all swings until the dashpot has damped them. The
    # end of a flight is a double, and many swings magnify its roundoff.
    swings = mass.stiffness * (duration if drag * duration < 1.0 else 1.0 / drag)
    speed = swings * (x + clearance) + v * min(drag * duration, 1.0)
    # The force acts for one swing of its own.
    turn = min(duration * rate_of(mass.forcing), 2.0)
    lasts = turn / rate_of(mass.forcing) if turn > 0.0 else duration
    return speed + mass.strength * bound_of(mass.forcing, 0) * lasts


@force_size.of(Ballistic)
def _size_beside_ballistic(mass, model, segment, tau, at):
    s = segment
    free = model.free
    force = force_bound(model) + abs(mass.acceleration)
    # What the velocity is made of: itself, and what spring and force add against the dashpot.
    drag = max(2.0 * free.damping, 1.0)
    speed = abs(at.v) + abs(s.v) + (force + abs(s.x)) * min(tau, 1.0 / drag)
    return force + 2.0 * free.damping * speed + abs(at.x) + abs(s.x)


@force_size.of(Oscillator)
def _size_beside_oscillator(mass, model, segment, tau, at):
    s = segment
    free = model.free
    force = force_bound(model) + mass.strength * bound_of(mass.forcing, 0)
    x0 = abs(s.x) + model.clearance
    drag = max(2.0 * model.stuck.damping, 1.0)
    speed = abs(at.v) + abs(s.v) + (force + x0) * min(tau, 1.0 / drag)
    size = force + 2.0 * (free.damping + mass.damping) * speed
    return size + (1.0 + mass.stiffness) * (abs(at.x) + x0 + speed * min(tau, 1.0))


for _function in (mass_size, mass_speed, force_size):
    _function.like(FixedStop, Ballistic)

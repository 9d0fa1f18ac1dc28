"""Events of a free mass in contact or sliding: its hold, and the speed of a slide.

Contact force, support and dry friction are one quantity: the force that the common motion asks of
wall and friction, beyond the one at which they give way. docs/models.md.
"""

import math
from typing import Any, NamedTuple

from damper.engine.bodies import (
    Ballistic,
    FixedStop,
    Primary,
    WeightedSum,
    longest_increments,
    start_point,
    strength_on,
    weight_on,
)
from damper.engine.bounds import energy_norm
from damper.engine.compiled import compiled
from damper.engine.dispatch import by_class
from damper.engine.forcing import bound_of, common, force_rates, rate_of, turn_over, turned
from damper.engine.forcing.weighed import WeighedForce
from damper.engine.oscillator import (
    Motion,
    Oscillator,
    displaced,
    higher_derivatives,
    increments,
    motion_from,
)
from damper.engine.search import GAVE_UP, ROUNDOFF, EventPoint, first_root, point_at, rates_of
from damper.engine.tuples import changed


class Hold(NamedTuple):
    """The hold of a free mass, over the mass, as an event function.

    It is the contact force, -side (x'' less the acceleration of the mass that nothing holds), plus
    the largest friction. On a wall the mass leaves where the sum vanishes. Off the walls it also
    slides where the sum is twice the largest friction.
    """

    osc: Oscillator
    """The primary with all that moves with it."""
    mass: Any
    """The free mass as a body of its own, without friction."""
    start: Motion
    """Of `osc`, about its place of rest."""
    side: float
    anchor: float
    """The mass's displacement less that of `osc`."""
    friction: float
    """Acceleration by the largest friction."""


class Pushed(NamedTuple):
    """Acceleration of a free mass that moves along and that nothing holds, and its derivatives."""

    a: float
    a1: float
    a2: float
    a3: float
    a4: float
    bound4: float
    """Bound on the fourth derivative now."""
    growth: float
    """Of that bound, over time."""
    size: float
    """Size of the terms of `a`."""


@by_class
def pushed(mass: Any, hold: Hold, motion: Motion, snap: float, crackle: float) -> Pushed:
    """Return what acts on a free mass that moves along, beside wall and friction."""


@pushed.of(Ballistic)
def _pushed_ballistic(mass, hold, motion, snap, crackle):
    a = mass.acceleration
    return Pushed(a, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, abs(a))


@pushed.of(FixedStop)
def _pushed_beside_a_stop(mass, hold, motion, snap, crackle):
    # Over the primary's mass: what the stop takes from the primary, which would move without it.
    free = mass.primary
    k = free.strength
    force, force1, force2, force3, force4 = force_rates(free.forcing, motion.phase)
    return Pushed(
        free.stiffness * motion.x - k * force,
        -k * force1,
        -k * force2,
        -k * force3,
        -k * force4,
        k * bound_of(free.forcing, 4),
        0.0,
        abs(k * force) + abs(free.stiffness * motion.x),
    )


@pushed.of(Oscillator)
def _pushed_driven(mass, hold, motion, snap, crackle):
    osc, k = hold.osc, mass.strength
    drag, stiffness = 2.0 * mass.damping, mass.stiffness
    force, force1, force2, force3, force4 = force_rates(mass.forcing, motion.phase)
    y = motion.x + hold.anchor
    bound4 = drag * energy_norm(osc, snap, crackle) + stiffness * energy_norm(osc, motion.j, snap)
    growth = drag * bound_of(osc.forcing, 4) + stiffness * bound_of(osc.forcing, 3)
    return Pushed(
        k * force - drag * motion.v - stiffness * y,
        k * force1 - drag * motion.a - stiffness * motion.v,
        k * force2 - drag * motion.j - stiffness * motion.a,
        k * force3 - drag * snap - stiffness * motion.j,
        k * force4 - drag * crackle - stiffness * snap,
        k * bound_of(mass.forcing, 4) + bound4,
        osc.strength * growth,
        abs(k * force) + drag * abs(motion.v) + stiffness * abs(y),
    )


@by_class
def longest_along(mass: Any, osc: Oscillator) -> float:
    """Time up to which the common motion is formed by increments."""


@longest_along.of(Ballistic)
def _longest_along_ballistic(mass, osc):
    return math.inf


longest_along.like(FixedStop, Ballistic)


@longest_along.of(Oscillator)
def _longest_along_driven(mass, osc):
    # The way back and forth of a stiff support would round in units of its rate times the time.
    return longest_increments(osc) if mass.rate > 0.0 else math.inf


@compiled
def hold_point(hold: Hold, tau: float, dx: float, motion: Motion) -> EventPoint:
    """Where the hold is, at a state of the motion."""
    osc, side = hold.osc, hold.side
    snap, crackle, sixth = higher_derivatives(osc, motion)
    own = pushed(hold.mass, hold, motion, snap, crackle)
    growth = osc.strength * bound_of(osc.forcing, 5) + own.growth
    size = osc.strength * bound_of(osc.forcing, 0) + 2.0 * osc.damping * abs(motion.v)
    return EventPoint(
        tau,
        -side * (motion.a - own.a) + hold.friction,
        -side * (motion.j - own.a1),
        -side * (snap - own.a2),
        -side * (crackle - own.a3),
        -side * (sixth - own.a4),
        0.0,
        energy_norm(osc, crackle, sixth) + own.bound4,
        growth,
        ROUNDOFF * (size + osc.stiffness * abs(hold.start.x + dx) + own.size + hold.friction),
        Primary(dx, motion.v, motion.a, motion.j, snap, 0.0),
    )


@compiled
def hold_at_start(hold: Hold) -> EventPoint:
    """Where the hold is at the start."""
    return hold_point(hold, 0.0, 0.0, hold.start)


@point_at.of(Hold)
def _point_of_hold(moving, tau):
    osc, start = moving.osc, moving.start
    if tau > longest_along(moving.mass, osc):
        turn = turn_over(osc.forcing, tau)
        dx, v, _ = displaced(osc, start, turn, tau)
        phase = turned(osc.forcing, start.phase, turn)
        return hold_point(moving, tau, dx, motion_from(osc, start.x + dx, v, phase))
    dx, dv, phase = increments(osc, start, tau)
    dx += start.v * tau
    motion = motion_from(osc, start.x + dx, start.v + dv, phase)
    return hold_point(moving, tau, dx, motion)


@rates_of.of(Hold)
def _rates_of_hold(moving):
    osc = moving.osc
    forcing_rate = rate_of(osc.forcing)
    return forcing_rate, max(forcing_rate, osc.rate), osc.coupling


@compiled
def holds(point: EventPoint, width: float) -> bool:
    """Whether a mass stays at rest; on the brink the first derivative decides that acts."""
    if point.value > 0.0 and point.value < width:
        return True
    if point.value < 0.0 or point.value > width:
        return False
    inwards = 1.0 if point.value == 0.0 else -1.0
    rate = point.slope
    if rate == 0.0:
        rate = point.second
    if rate == 0.0:
        rate = point.third
    return inwards * rate >= 0.0


# --- slides


@by_class
def pushed_by(mass: Any, acceleration: float) -> Any:
    """A free mass in flight with a constant acceleration beside what else acts on it."""


@pushed_by.of(Ballistic)
def _ballistic_pushed_by(mass, acceleration):
    # Compiled code knows no defaults.
    return Ballistic(mass.acceleration + acceleration, 0.0, 0.0, 0.0)


@pushed_by.of(Oscillator)
def _driven_pushed_by(mass, acceleration):
    m = mass
    force = WeighedForce(common(m.forcing), strength_on(m), weight_on(m) + acceleration)
    return _driven_by(m, 1.0, force)


_driven_by = changed(Oscillator, "strength", "forcing")


class Speed(NamedTuple):
    """The relative speed in a slide, as the search sees it."""

    gap: WeightedSum
    """That grows in the slide: its rate is the speed."""


@compiled
def speed_point(moving: Speed, p: EventPoint) -> EventPoint:
    """Where the speed is, from where the gap is."""
    gap = moving.gap
    _, _, coupling = rates_of(gap)
    size = abs(gap.slope) + abs(p.slope)
    size += (abs(gap.acceleration) + abs(gap.terms.start.a) + abs(p.state.a)) * p.tau
    return rate_point(p, coupling, size)


@compiled
def rate_point(p: EventPoint, coupling: float, size: float) -> EventPoint:
    """Where the rate of what moves is, with the size of its terms; the coupling: `rates_of`."""
    return EventPoint(
        p.tau,
        p.slope,
        p.second,
        p.third,
        p.fourth,
        p.fifth,
        0.0,
        # The bound on the gap's fourth derivative makes one on its fifth.
        p.growth + coupling * p.bound4,
        coupling * p.growth,
        ROUNDOFF * size,
        p.state,
    )


@point_at.of(Speed)
def _point_of_speed(moving, tau):
    return speed_point(moving, point_at(moving.gap, tau))


@rates_of.of(Speed)
def _rates_of_speed(moving):
    return rates_of(moving.gap)


class Stop(NamedTuple):
    """Where a slide ends."""

    tau: float
    """Time at which the relative velocity vanishes; infinite where it does not by then."""
    gave_up: bool
    """Whether the search did."""
    steps: int


@compiled
def first_stop(gap: WeightedSum, last: float) -> Stop:
    """When a gap that grows in a slide grows no longer, up to a time."""
    speed = Speed(gap)
    root = first_root(speed, speed_point(speed, start_point(gap)), math.inf, False, last, 0.0)
    tau = root.point.tau + root.step
    stops = root.side == 1.0 and tau <= last
    return Stop(tau if stops else math.inf, root.side == GAVE_UP, root.steps)

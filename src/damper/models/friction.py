"""Dry (Coulomb) friction of a free mass and its box, as the search sees it.

What is left of the force that holds the mass at rest is one quantity, the relative speed in a slide
the other. docs/models.md.
"""

from typing import Any, NamedTuple

from damper.engine.bodies import Ballistic, WeightedSum
from damper.engine.compiled import compiled
from damper.engine.dispatch import by_class
from damper.engine.forcing.weighed import WeighedForce
from damper.engine.oscillator import Oscillator, oscillator
from damper.engine.search import ROUNDOFF, EventPoint, point_at, rates_of
from damper.models.rigid import ContactForce, force_point


@by_class
def pushed_by(mass: Any, acceleration: float) -> Any:
    """A free mass in flight with a constant acceleration beside what else acts on it."""


@pushed_by.of(Ballistic)
def _ballistic_pushed_by(mass, acceleration):
    # Compiled code knows no defaults.
    return Ballistic(mass.acceleration + acceleration, 0.0, 0.0, 0.0)


@pushed_by.of(Oscillator)
def _driven_pushed_by(mass, acceleration):
    # That of the inertia in the frame of a base, which has a weight beside it.
    forcing = mass.forcing
    weight = forcing.weight + acceleration
    return oscillator(0.0, 0.0, 1.0, WeighedForce(forcing.forcing, forcing.share, weight))


class Hold(NamedTuple):
    """What friction has left to hold the free mass at rest, as the search sees it.

    Contact force in sticking over the free mass, plus the largest friction: on a wall the masses
    part where it vanishes, off the walls also where it is twice the largest friction.
    """

    force: ContactForce
    friction: float


@compiled
def _with_friction(p, friction):
    return EventPoint(
        p.tau,
        p.value + friction,
        p.slope,
        p.second,
        p.third,
        p.fourth,
        p.fifth,
        p.bound4,
        p.growth,
        p.roundoff + ROUNDOFF * friction,
        p.state,
    )


@point_at.of(Hold)
def _point_of_hold(moving, tau):
    return _with_friction(point_at(moving.force, tau), moving.friction)


@rates_of.of(Hold)
def _rates_of_hold(moving):
    return rates_of(moving.force)


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


@compiled
def hold_at_start(hold: Hold) -> EventPoint:
    """What is left of friction at the start."""
    return _with_friction(force_point(hold.force, 0.0, 0.0, hold.force.start), hold.friction)

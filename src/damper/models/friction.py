"""Dry (Coulomb) friction of a free mass and its box, as the search sees it.

What is left of the force that holds the mass at rest is one quantity, the relative speed in a slide
the other. docs/models.md.
"""

import math
from typing import Any, NamedTuple

from damper.engine import completion
from damper.engine.bodies import Ballistic, WeightedSum
from damper.engine.compiled import compiled
from damper.engine.dispatch import by_class
from damper.engine.forcing import horizon
from damper.engine.forcing.weighed import WeighedForce
from damper.engine.impact import law_at, restitution_at
from damper.engine.oscillator import Oscillator, oscillator
from damper.engine.search import ROUNDOFF, EventPoint, point_at, rates_of
from damper.engine.segment import Segment
from damper.models.flights import relative_rates
from damper.models.rigid import ContactForce, Rigid, force_point


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


# --- chatter


class Bounce(NamedTuple):
    """The bounces of a complete chatter sequence, to first order in their speed."""

    out: float
    """Relative acceleration towards the wall on the way out, friction with it."""
    back: float
    """On the way back, friction against it; not positive where they do not reach the wall."""
    shrinks: float
    """Speed of a rebound over that of the one before."""


@compiled
def bounce_from(start: Any, flight: Rigid, segment: Segment, friction: float) -> Bounce:
    """How a free mass bounces that slides away from a wall, in the flight that begins there."""
    a, _, _, _ = relative_rates(start, flight)
    out = -segment.side * a
    back = out - 2.0 * (1.0 + flight.mass_ratio) * friction
    shrinks = 0.0
    if back > 0.0:
        law = law_at(flight.law, segment.side)
        shrinks = restitution_at(law, 0.0) * math.sqrt(back / out)
    return Bounce(out, back, shrinks)


@compiled
def completes_rubbing(
    start: Any, flight: Rigid, segment: Segment, friction: float
) -> tuple[float, float]:
    """Time to the completion point after an impact, to first order, and its error.

    The arguments are those of `bounce_from`. An infinite error says that the sequence need not
    complete from here. docs/models.md.
    """
    out, back, q = bounce_from(start, flight, segment, friction)
    if not (back > 0.0 and q < 1.0):
        return 0.0, math.inf
    w = segment.gap_rate
    left = w * (1.0 / out + 1.0 / math.sqrt(out * back)) / (1.0 - q)
    # By how much the pressing acceleration changes meanwhile: with the force and the springs, and
    # with what impacts and friction do to the primary's velocity.
    _, jerk, _, snap = relative_rates(start, flight)
    mu = flight.mass_ratio
    drag = 2.0 * flight.free.damping
    jerk = abs(jerk) + 2.0 * drag * mu * friction
    change = (jerk + left * snap) * left + 2.0 * drag * mu / (1.0 + mu) * w
    if not change < 0.25 * back:
        return 0.0, math.inf
    # A bounce's time and speed change by that over `back`; each one's speed depends on all before.
    drift = change / back * (1.0 + (out - back) / (out * (1.0 - q)))
    law = law_at(flight.law, segment.side)
    falls = abs(restitution_at(law, w) - restitution_at(law, 0.0))
    error = left * (drift + falls / (1.0 - q))
    if left > horizon(flight.free.forcing, start.phase):
        return 0.0, math.inf
    return left, error


@compiled
def bounce_at(bounce: Bounce, duration: float, gap_rate: float, tau: float) -> tuple[float, float]:
    """Gap and gap rate in the closed rest of a sequence: its bounces are self-similar."""
    if bounce.out == bounce.back:
        return completion.bounce_at(bounce.shrinks, duration, gap_rate, tau)
    left = 1.0 - tau / duration if duration > 0.0 else 0.0
    if bounce.shrinks == 0.0 or left <= 0.0:
        return 0.0, 0.0
    count = math.floor(math.log(left) / math.log(bounce.shrinks))
    shrink = math.exp(count * math.log(bounce.shrinks))
    speed = gap_rate * shrink
    now = (1.0 - left / shrink) * duration * shrink
    turn = speed / bounce.out
    if now <= turn:
        return max(now, 0.0) * (speed - 0.5 * bounce.out * max(now, 0.0)), speed - bounce.out * now
    height, fallen = 0.5 * speed * turn, now - turn
    return max(height - 0.5 * bounce.back * fallen * fallen, 0.0), -bounce.back * fallen

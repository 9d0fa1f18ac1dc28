"""Largest force in spring and dashpot, and largest acceleration of the primary, within a segment.

Force and acceleration are sums of an oscillator's displacement, its derivatives and the force. So
their peaks are found like the displacement's (`damper.engine.peak`), with bounds on two more
derivatives of the motion. In the closed rest of a burst they are those of both masses' centre,
about which the primary's velocity goes on to jump by less than the approach speed that is left.
"""

from typing import Any, NamedTuple

from damper.engine.bodies import strength_on
from damper.engine.bounds import bounds_ahead
from damper.engine.compiled import compiled
from damper.engine.dispatch import by_class_or_default
from damper.engine.forcing import bound_ahead, common, force_rates
from damper.engine.oscillator import Motion, Oscillator, higher_derivatives, increments, motion_from
from damper.engine.peak import Moment, bounds_of, highest, moment_at
from damper.engine.segment import FLIGHT, Segment
from damper.models.response import centre_in_contact, flying_primary


class Combination(NamedTuple):
    """A sum along an oscillator's motion, whose x is its own less `shift`."""

    osc: Oscillator
    start: Motion
    shift: float
    of_x: float
    of_v: float
    of_a: float
    of_force: float
    """Of the shape of the force, without a weight beside it."""


@moment_at.of(Combination)
def _moment_at(moving, tau):
    start, osc = moving.start, moving.osc
    dx, dv, phase = increments(osc, start, tau)
    now = motion_from(osc, start.x + (start.v * tau + dx), start.v + dv, phase)
    snap, _, _ = higher_derivatives(osc, now)
    force, force1, force2, _, _ = force_rates(common(osc.forcing), phase)
    of_x, of_v, of_a, of_force = moving.of_x, moving.of_v, moving.of_a, moving.of_force
    return Moment(
        tau,
        of_x * (now.x - moving.shift) + of_v * now.v + of_a * now.a + of_force * force,
        of_x * now.v + of_v * now.a + of_a * now.j + of_force * force1,
        of_x * now.a + of_v * now.j + of_a * snap + of_force * force2,
        now,
    )


@bounds_of.of(Combination)
def _bounds_of(moving, moment, span):
    osc = moving.osc
    motion = moment.motion
    force2 = bound_ahead(osc.forcing, motion.phase, 2, span)
    force3 = bound_ahead(osc.forcing, motion.phase, 3, span)
    second, third = bounds_ahead(osc, motion, span)
    # By the equation of motion; a weight beside the force is in none of these derivatives.
    fourth = osc.strength * force2 + 2.0 * osc.damping * third + osc.stiffness * second
    fifth = osc.strength * force3 + 2.0 * osc.damping * fourth + osc.stiffness * third
    force2 = bound_ahead(common(osc.forcing), motion.phase, 2, span)
    force3 = bound_ahead(common(osc.forcing), motion.phase, 3, span)
    of_x, of_v, of_a = abs(moving.of_x), abs(moving.of_v), abs(moving.of_a)
    return (
        of_x * second + of_v * third + of_a * fourth + abs(moving.of_force) * force2,
        of_x * third + of_v * fourth + of_a * fifth + abs(moving.of_force) * force3,
    )


@by_class_or_default
def primary_extremes(
    model: Any, segment: Segment, low: float, high: float, through: float, most: Any
) -> None:
    """Take the force and acceleration on [low, high] of a segment into the fields of `most`.

    `through` is the part of the force on the primary that comes through spring and dashpot: 1 for
    a base whose motion is that of the ground, else 0.
    """
    if segment.mode == FLIGHT:
        flying = flying_primary(model, segment)
        extremes_of(model, flying.osc, flying.start, flying.shift, low, high, through, most)
    else:
        centre = centre_in_contact(model, segment)
        extremes_of(model, centre.osc, centre.start, centre.shift, low, high, through, most)


@compiled
def extremes_of(
    model: Any,
    osc: Oscillator,
    start: Motion,
    shift: float,
    low: float,
    high: float,
    through: float,
    most: Any,
) -> None:
    """As `primary_extremes`, of a primary that moves as an oscillator from a start."""
    free = model.free
    spring = (1.0, 2.0 * free.damping, 0.0, -through * free.strength)
    # In the frame of a base the force is that of inertia, minus the base's acceleration.
    moved = (0.0, 0.0, 1.0, -strength_on(model.mass))
    most.force = _highest(osc, start, shift, spring, low, high, most.force)
    most.acceleration = _highest(osc, start, shift, moved, low, high, most.acceleration)


@compiled
def _highest(osc, start, shift, parts, low, high, peak):
    moving = Combination(osc, start, shift, *parts)
    first = moment_at(moving, low)
    if not low < high:
        return max(peak, abs(first.x))
    return highest(moving, first, moment_at(moving, high), peak)

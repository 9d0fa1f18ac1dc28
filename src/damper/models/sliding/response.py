"""The response of the damper with dry friction: what a segment of it adds.

A slide goes one way, so friction takes its force times the change of the gap. What it takes stands
in the place of what a support does, which no damper with friction has.
"""

import math

from damper.engine.bodies import strength_on
from damper.engine.compiled import compiled
from damper.engine.forcing import force_rates, phase_at
from damper.engine.model import begin, motion
from damper.engine.oscillator import motion_from
from damper.engine.segment import FLIGHT, TAIL, centre_velocity
from damper.models.response import (
    ResponseIntegrals,
    ShiftedOscillator,
    have_rigid_walls,
    integrate_segment,
    oscillation,
    work_in_flight,
)
from damper.models.sliding import Sliding, bounce_of, shift_of

have_rigid_walls(Sliding)


@integrate_segment.of(Sliding)
def _integrate_segment(model, tables, segment, low, high, peak):
    s = segment
    if s.mode == FLIGHT:
        return _integrate_slide(model, s, low, high, peak)
    phase = phase_at(model.stuck.forcing, s.periods, s.time)
    start = motion_from(model.stuck, s.x, centre_velocity(s, model.mass_ratio), phase)
    in_tail = s.mode == TAIL and s.gap_rate > 0.0
    found = oscillation(ShiftedOscillator(model.stuck, start, 0.0), low, high, peak)
    found = _together(model, found)
    if in_tail:
        return _with_bounces(model, s, start, found, low, high)
    return found


@compiled
def _together(model, found):
    """Integrals with the work of the force on both masses, which move as one."""
    strength = model.free.strength + model.mass_ratio * strength_on(model.mass)
    work = strength * found.work
    return ResponseIntegrals(found.square, found.speed_square, work, 0.0, 0.0, 0.0, found.peak)


@compiled
def _integrate_slide(model, s, low, high, peak):
    free = model.free
    slide = begin(model, s)
    shift = shift_of(model, slide.sigma)
    phase = phase_at(free.forcing, s.periods, s.time)
    moving = ShiftedOscillator(free, motion_from(free, s.x - shift, s.v, phase), -shift)
    found = oscillation(moving, low, high, peak)
    _, _, gap_low, _ = motion(model, s, low)
    _, _, gap_high, _ = motion(model, s, high)
    slid = abs(gap_high - gap_low)
    rubbed = model.mass_ratio * model.friction * slid
    on_mass = work_in_flight(slide.flight.mass, slide.flight, slide.shifted, low, high)
    work = free.strength * found.work + on_mass
    return ResponseIntegrals(found.square, found.speed_square, work, 0.0, rubbed, 0.0, found.peak)


@compiled
def _with_bounces(model, s, start, centre, low, high):
    """Add what the bounces of a tail lose, and how far the first ones carry the primary.

    As for the rigid damper: the bounce under way has carried the primary from the centre. Of what
    all of them lose, friction takes the same part of each.
    """
    bounce = bounce_of(model, s, begin(model, s))
    mu = model.mass_ratio
    share = s.side * mu / (1.0 + mu)
    force, force1, _, _, _ = force_rates(model.free.forcing, start.phase)
    pressing = bounce.out + bounce.back
    speed_square, work, lost = centre.speed_square, centre.work, 0.0
    for k in range(2):
        tau = high if k == 1 else low
        sign = 1.0 if k == 1 else -1.0
        _, _, gap, rate = motion(model, s, tau)
        # Until it ends, a bounce holds what its height and its speed are worth without friction.
        lost -= sign * 0.5 * abs(share) * (rate * rate + pressing * gap)
        carried = sign * share * gap
        work += (model.free.strength - strength_on(model.mass)) * (force + tau * force1) * carried
        speed_square += 2.0 * (start.v + tau * start.a) * carried
    # The first bounce on from here rises highest.
    top = min(max(s.gap_rate / bounce.out, low), high)
    x, _, _, _ = motion(model, s, top)
    restitution = bounce.shrinks * math.sqrt(bounce.out / bounce.back)
    rubbed = bounce.out - bounce.back
    rubbed /= bounce.out - restitution * restitution * bounce.back
    return ResponseIntegrals(
        centre.square,
        speed_square,
        work,
        (1.0 - rubbed) * lost,
        rubbed * lost,
        0.0,
        max(centre.peak, abs(x)),
    )

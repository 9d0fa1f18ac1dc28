"""The response of the damper with dry friction: what a segment of it adds.

A slide goes one way, so friction takes its force times the change of the gap. What it takes stands
in the place of what a support does, which no damper with friction has.
"""

from damper.engine.bodies import strength_on
from damper.engine.compiled import compiled
from damper.engine.forcing import phase_at
from damper.engine.model import begin, motion
from damper.engine.oscillator import motion_from
from damper.engine.segment import FLIGHT, TAIL, centre_velocity
from damper.models.response import (
    ResponseIntegrals,
    ShiftedOscillator,
    have_rigid_walls,
    integrate_segment,
    oscillation,
    tail_of,
    with_rubbing_bounces,
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
        bounce = bounce_of(model, s, begin(model, s))
        tail = tail_of(model, model.mass_ratio, s, start, 0.0)
        return with_rubbing_bounces(model, s, found, tail, bounce, low, high)
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

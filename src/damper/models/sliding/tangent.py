"""What small deviations become under dry friction, and what a small change of a parameter does.

Friction is constant in a slide, so deviations fly as without it. Where the relative velocity
vanishes, the relative acceleration falls by a factor, from one slide to the other or to nothing
where friction holds, and the relative velocity of a deviation by the same: of the four directions
one vanishes in a rest. At a slip all accelerations are continuous. docs/orbits.md.
"""

import math

from damper.engine.bodies import body_at
from damper.engine.compiled import compiled
from damper.engine.forcing import phase_at
from damper.engine.oscillator import increments, motion_from
from damper.engine.segment import FLIGHT, IMPACT, REST, RESTING, REVERSAL, STICK
from damper.models import sensitivity, tangent
from damper.models.friction import hold_at_start, pushed_by
from damper.models.rigid import Rigid
from damper.models.sliding import Sliding, direction, hold_of, shift_of
from damper.models.tangent import TOGETHER

tangent.have_rigid_walls(Sliding)
tangent.contact_flow.like(Sliding, Rigid)
tangent.mass_ratio_rate.like(Sliding, Rigid)


@tangent.friction_in.of(Sliding)
def _friction_in(model):
    return model.friction


@tangent.joins.of(Sliding)
def _joins(model, s):
    return s.mode not in (FLIGHT, RESTING)


@tangent.lost_in.of(Sliding)
def _lost_in(model, s, own):
    if s.mode == RESTING:
        return 1.0
    return 0.0 if s.mode == FLIGHT else 2.0


@compiled
def _turned(model, s):
    """Relative acceleration after a stop, over that before it."""
    if s.mode == RESTING:
        return 0.0
    if model.friction == 0.0:
        return 1.0
    force = abs(hold_at_start(hold_of(model, s)).value - model.friction)
    return (force - model.friction) / (force + model.friction)


@tangent.shrunk_by.of(Sliding)
def _shrunk_by(model, s):
    return _turned(model, s) if s.cause == REVERSAL else tangent.shrunk_by_impact(model, s)


@compiled
def _slow_down(model, part, deviations):
    """Leave a part of the relative velocities."""
    mu = model.mass_ratio
    for k in range(deviations.shape[1]):
        v, u = deviations[1, k], deviations[3, k]
        lost = (1.0 - part) * (u - v) / (1.0 + mu)
        deviations[1, k] = v + mu * lost
        deviations[3, k] = deviations[1, k] if part == 0.0 else u - lost


@tangent.enter.of(Sliding)
def _enter(model, s, deviations, happened):
    if happened:
        tangent.over_event(model, s, deviations)
    elif s.mode == RESTING:
        _slow_down(model, 0.0, deviations)
    elif s.mode != FLIGHT:
        tangent.join(model.mass_ratio, deviations)


@tangent.over_event.of(Sliding)
def _over_event(model, s, deviations):
    if s.cause == IMPACT:
        tangent.strike(model, s, deviations)
    elif s.cause in (REST, REVERSAL):
        _slow_down(model, _turned(model, s), deviations)
    elif s.cause == STICK and (deviations[1] != deviations[3]).any():
        # A slide that stops at the very wall: one beside it hits, or stops ahead of it; unless
        # it is the last of a sequence, for that ends there in any case.
        for k in range(deviations.shape[1]):
            x, y = deviations[0, k], deviations[2, k]
            if abs(x - y) > TOGETHER * (abs(x) + abs(y)):
                deviations[:] = math.nan
        tangent.join(model.mass_ratio, deviations)


@tangent.stay_on.of(Sliding)
def _stay_on(model, s, low, tau, deviations):
    apart = deviations[2] - deviations[0]
    tangent.stay_joined(model, s, low, tau, deviations)
    if s.mode == RESTING:
        deviations[2] += apart


@sensitivity.flown.of(Sliding)
def _flown(model, s, y, slower):
    tau = s.duration * slower
    sigma = direction(model, s)
    phase = phase_at(model.free.forcing, s.periods, s.time * slower)
    start = motion_from(model.free, s.x - shift_of(model, sigma), s.v, phase)
    dx, dv, _ = increments(model.free, start, tau)
    u = s.v - s.side * s.gap_rate
    mass = pushed_by(model.mass, -(sigma * model.friction))
    dy, later = body_at(mass, y, u, phase, tau)
    return s.v * tau + dx, dv, dy, later - u

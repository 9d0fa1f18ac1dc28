"""Classical Runge-Kutta with a fixed step, impacts looked for at the ends of steps.

This is how impact dampers are usually simulated, the papers included. A step goes through the wall
as if there were none. At its end, if |y - x| >= d and the masses approach, the law of impact is
applied there and then: positions stay, beyond the wall as they may be. So an impact is late by up
to a step, the method is of first order, and two crossings within one step are not seen at all.

**Sticking** has to be added by hand. Left alone, the free mass sinks through a wall that pushes it
with the acceleration a: with impacts at every step end, the rebound speed settles at
r a h / (1 + r), and the mass goes deeper by a h^2 (1 - r) / (2 (1 + r)) per step h - slowly, but
without end. So after an impact with the rebound speed w, the masses stay together if the wall
pushes, a > 0, and the flight back to it, 2 w / a long, takes no more than a step: the steps cannot
show that flight. Both masses are then one oscillator, at a constant distance. At the end of a step
at which the wall no longer pushes they part.
"""

from typing import NamedTuple

from damper.engine.segment import IMPACT, RELEASE, STICK
from damper.models.walls import slack
from damper.verification.comparison import fixed_step as steps


class StepEnd(NamedTuple):
    """The method."""

    damper: steps.Damper
    step: float


class StepEndState(NamedTuple):
    """State at the end of a step."""

    x: float
    v: float
    y: float
    u: float
    side: float
    stuck: bool
    offset: float
    """y - x of masses that move as one."""


@steps.begin.of(StepEnd)
def _begin(method, start, time):
    x, v, y, u = start
    if method.damper.d > 0.0:
        return StepEndState(x, v, y, u, 0.0, False, 0.0)
    # Together for good, with no wall to leave.
    v = steps.common_velocity(method.damper.mu, v, u)
    return StepEndState(x, v, y, v, 0.0, True, y - x)


@steps.take_events.of(StepEnd)
def _take_events(method, state, time, index, notes, counts):
    p = method.damper
    x, v, y, u, side, stuck, offset = state
    if stuck:
        if side != 0.0:
            counts = steps.count_evaluations(counts, 1)
            a, _ = steps.wall_acceleration(p, 1.0 + p.mu, x, v, time, side)
            if a < 0.0:
                stuck = False
                counts = steps.note(notes, counts, time, RELEASE, side, 0.0)
        return StepEndState(x, v, y, u, side, stuck, offset), counts
    side = steps.nearer_wall(x, y)
    depth = side * (y - x) - p.d
    counts = steps.record_penetration(counts, depth)
    speed = side * (u - v)
    touches = depth >= 0.0 and speed > 0.0
    if index == 0:
        touches = depth >= -slack(p.d, x, y) and speed >= 0.0
    if touches:
        rebound = p.r * speed
        if speed > 0.0:
            counts = steps.note(notes, counts, time, IMPACT, side, speed)
            v += side * p.mu * (1.0 + p.r) / (1.0 + p.mu) * speed
            u = v - side * rebound
        common = steps.common_velocity(p.mu, v, u)
        counts = steps.count_evaluations(counts, 1)
        a, j = steps.wall_acceleration(p, 1.0, x, common, time, side)
        if steps.sticks(a, j, rebound, method.step):
            stuck = True
            offset = y - x
            v = u = common
            counts = steps.note(notes, counts, time, STICK, side, 0.0)
    return StepEndState(x, v, y, u, side, stuck, offset), counts


@steps.advance.of(StepEnd)
def _advance(method, state, piece, counts):
    p, h = method.damper, piece.left
    x, v, y, u, side, stuck, offset = state
    mass = 1.0 + p.mu if stuck else 1.0
    curve, dv = steps.rk4(p, mass, x, v, piece.time, h)
    x = x + (v * h + curve)
    v = v + dv
    y = x + offset if stuck else y + u * h
    after = StepEndState(x, v, y, v if stuck else u, side, stuck, offset)
    return after, steps.count_evaluations(counts, 4), h, False


SOLVER = steps.fixed_step(3e7, lambda damper, step, until: StepEnd(damper, step))

"""The response of the damper with a grounded free mass: what a segment of it adds.

The primary in flight is that of the rigid damper. In contact both masses swing about their own
place of rest, and the support's dashpot takes energy in every segment.
"""

import math

from damper.engine.compiled import compiled
from damper.engine.model import motion
from damper.engine.segment import FLIGHT, STICKING, TAIL
from damper.models.grounded import Grounded, rest_shift
from damper.models.response import (
    ResponseIntegrals,
    energy_in,
    impact_loss,
    integrate_segment,
    lost_at_a_rigid_wall,
    oscillation,
    primary_and_masses,
    shifted_oscillator,
    tail_of,
    with_bounces,
)

impact_loss.of(Grounded)(lost_at_a_rigid_wall)


@integrate_segment.of(Grounded)
def _integrate_segment(model, tables, segment, low, high, peak):
    shift = 0.0 if segment.mode == FLIGHT else rest_shift(model, segment.side)
    moving = shifted_oscillator(model, model.mass_ratio, segment, shift)
    in_tail = segment.mode == TAIL
    found = oscillation(moving, low, high, math.inf if in_tail else peak)
    # Of the centre alone: bounces are accounted for in the loss itself.
    support = _support_loss(model, segment, low, high, found.speed_square)
    if in_tail:
        tail = tail_of(model, model.mass_ratio, segment, moving.start, shift)
        found = with_bounces(found, tail, low, high, peak)
    return ResponseIntegrals(
        found.square, found.speed_square, found.work, found.loss, support, 0.0, found.peak
    )


@energy_in.of(Grounded)
def _energy_in(model, segment, mass_ratio, state):
    x, v, gap, _ = state
    side = segment.side
    y = x + side * (model.clearance - gap)
    energy = primary_and_masses(model, segment, mass_ratio, state) + 0.5 * model.stiffness * y * y
    if segment.mode == TAIL:
        # What the support's dashpot has given the centre in the bounce under way.
        energy += 2.0 * model.damping * v * side / (1.0 + mass_ratio) * gap
    return energy


@compiled
def _support_loss(model, segment, low, high, speed_square):
    """Energy that the support's dashpot takes from `low` to `high` of a segment.

    In flight that is what spring and free mass lose: nothing else acts on them. In contact it is
    2 damping times the integral of the free mass's velocity squared. `speed_square` is that of both
    masses' centre.
    """
    if model.damping == 0.0:
        return 0.0
    side = segment.side
    lost = 0.0
    if segment.mode != STICKING:
        for k in range(2):
            sign = 1.0 if k == 1 else -1.0
            x, v, gap, rate = motion(model, segment, high if k == 1 else low)
            if segment.mode == FLIGHT:
                y = x + side * (model.clearance - gap)
                u = v - side * rate
                lost -= sign * 0.5 * (model.stiffness * y * y + model.mass_ratio * u * u)
            else:
                # The bounce under way has carried the free mass back from the centre.
                heavier = 1.0 + model.mass_ratio
                centre = v - side * model.mass_ratio / heavier * rate
                speed_square -= sign * 2.0 * centre * side / heavier * gap
    return lost if segment.mode == FLIGHT else 2.0 * model.damping * speed_square

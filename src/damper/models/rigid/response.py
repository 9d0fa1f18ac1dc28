"""The response of the rigid damper: what a segment of it adds."""

import math

from damper.engine.segment import TAIL
from damper.models.response import (
    energy_in,
    impact_loss,
    lost_at_a_rigid_wall,
    oscillation,
    part_of,
    primary_and_masses,
    swing_of,
    tail_of,
    with_bounces,
)
from damper.models.rigid import Rigid

impact_loss.of(Rigid)(lost_at_a_rigid_wall)
energy_in.of(Rigid)(primary_and_masses)


@part_of.of(Rigid)
def _part_of(model, tables, segment, low, high, peak):
    moving = swing_of(model, model.mass_ratio, segment, 0.0)
    in_tail = segment.mode == TAIL
    part = oscillation(moving, low, high, math.inf if in_tail else peak)
    if in_tail:
        tail = tail_of(model, model.mass_ratio, segment, moving.start, 0.0)
        part = with_bounces(part, tail, low, high, peak)
    return part

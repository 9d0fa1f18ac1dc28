"""The response of the rigid damper: what a segment of it adds."""

import math

from damper.engine.segment import TAIL
from damper.models.response import oscillation, part_of, swing_of, tail_of, with_bounces
from damper.models.rigid import Rigid


@part_of.of(Rigid)
def _part_of(model, tables, segment, low, high, peak):
    moving = swing_of(model, model.mass_ratio, segment, 0.0)
    in_tail = segment.mode == TAIL
    part = oscillation(moving, low, high, math.inf if in_tail else peak)
    if in_tail:
        tail = tail_of(model, model.mass_ratio, segment, moving.start, 0.0)
        part = with_bounces(part, tail, low, high, peak)
    return part

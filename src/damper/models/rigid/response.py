"""The response of the rigid damper: what a segment of it adds."""

import math

from damper.engine.segment import TAIL
from damper.models.response import (
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
from damper.models.rigid import Rigid

impact_loss.of(Rigid)(lost_at_a_rigid_wall)
energy_in.of(Rigid)(primary_and_masses)


@integrate_segment.of(Rigid)
def _integrate_segment(model, tables, segment, low, high, peak):
    moving = shifted_oscillator(model, model.mass_ratio, segment, 0.0)
    in_tail = segment.mode == TAIL
    found = oscillation(moving, low, high, math.inf if in_tail else peak)
    if in_tail:
        tail = tail_of(model, model.mass_ratio, segment, moving.start, 0.0)
        found = with_bounces(found, tail, low, high, peak)
    return found

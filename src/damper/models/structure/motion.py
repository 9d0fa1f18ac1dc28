"""The motion of a structure and its free masses in a segment."""

import numpy as np

from damper.engine import model as declared
from damper.engine.compiled import compiled, compiled_apart
from damper.engine.completion import bounce_at
from damper.engine.search import ROUNDOFF
from damper.engine.segment import FLIGHT, TAIL, clock_after
from damper.models.structure.constants import (
    BEFORE,
    COMPLETION,
    DISPLACEMENT,
    GAP,
    MODE,
    RATE,
    SIDE,
    SPEED,
    VELOCITY,
    OnStructure,
    StructureSegment,
    box_in,
    law_of,
    mass_in,
    shapes_in,
)
from damper.models.structure.courses import course_of, gap_after
from damper.models.structure.flow import (
    ModalStart,
    begin_after,
    impulses_to_rest,
    modes_after,
    pushed,
)
from damper.models.structure.linear import dot, times
from damper.models.structure.log import segment_of_all

#: Roundoffs of a gap within which an approaching mass is at the wall together with another.
_TOGETHER = 4.0


@compiled_apart
def all_after(
    model: OnStructure,
    s: StructureSegment,
    start: ModalStart,
    tau: float,
    first: int,
    wall: float,
) -> tuple[StructureSegment, np.ndarray]:
    """Where all are after a time, and the wall at which each mass arrives, or 0.

    The mass `first` arrives at a wall then, or none if that is -1; others may be at walls with it.
    """
    way, change = modes_after(model, start, tau)
    bodies, arrives = s.bodies.copy(), np.zeros(len(s.bodies))
    modes = np.zeros((3, s.modes.shape[1]))
    # How far the first one is off its wall is roundoff, which the others have as well.
    off = 0.0
    if first >= 0:
        gap, _, _ = gap_after(course_of(model, s.bodies, start, first), way, change, tau)
        there = s.bodies[first, SIDE] == wall
        off = abs(gap if there else 2.0 * mass_in(model.masses, first).clearance - gap)
    for k in range(len(bodies)):
        b = bodies[k]
        b[SPEED] = 0.0
        if b[MODE] != FLIGHT:
            continue
        gap, rate, roundoff = gap_after(course_of(model, s.bodies, start, k), way, change, tau)
        width = 2.0 * mass_in(model.masses, k).clearance
        if k == first:
            arrives[k] = wall
        elif gap <= _TOGETHER * (roundoff + off) and rate < 0.0:
            arrives[k] = b[SIDE]
        elif width - gap <= _TOGETHER * (roundoff + off + ROUNDOFF * width) and rate > 0.0:
            arrives[k] = -b[SIDE]
        b[GAP], b[RATE], b[COMPLETION] = min(max(gap, 0.0), width), rate, 0.0
    system = start.system
    for i in range(len(way)):
        way[i] += start.modes[0, i] + tau * start.modes[1, i]
        change[i] += start.modes[1, i]
    n = modes.shape[1]
    if system.plain:
        modes[DISPLACEMENT], modes[VELOCITY] = way, change
    else:
        modes[DISPLACEMENT] = times(shapes_in(system), way)[:n]
        modes[VELOCITY] = times(shapes_in(system), change)[:n]
    modes[BEFORE] = modes[VELOCITY]
    periods, time = clock_after(model.cycle, s.periods, s.time, tau)
    return segment_of_all(periods, time, modes, bodies), arrives


@compiled_apart
def state_after(model: OnStructure, s: StructureSegment, tau: float) -> StructureSegment:
    """Where all are a time after a segment's start; in a tail the bounces go on."""
    here, _ = all_after(model, s, begin_after(model, s, model.flying), tau, -1, 0.0)
    bounces = np.zeros(len(s.bodies), dtype=np.bool_)
    gaps, rates = np.zeros(len(s.bodies)), np.zeros(len(s.bodies))
    for k in range(len(s.bodies)):
        b = s.bodies[k]
        if b[MODE] == TAIL and b[COMPLETION] > 0.0:
            r = law_of(mass_in(model.masses, k), float(b[SIDE])).restitution
            gaps[k], rates[k] = bounce_at(r, float(b[COMPLETION]), float(b[RATE]), tau)
            bounces[k] = True
    if np.any(bounces):
        _carry(model, s, here, gaps, rates)
    return here


@compiled_apart
def _carry(model, s, here, gaps, rates):
    """Let bounces of a tail carry the structure about the motion that it has with them stuck."""
    sticks = s.bodies[:, MODE] != FLIGHT
    moved = here.bodies.copy()
    for order in range(2):
        moved[:, RATE] = -gaps if order == 0 else -rates
        change = pushed(model, moved, impulses_to_rest(model, moved, sticks))
        here.modes[order] += change
        for k in range(len(moved)):
            if sticks[k]:
                here.bodies[k, order] = gaps[k] if order == 0 else rates[k]
            else:
                here.bodies[k, order] += here.bodies[k, SIDE] * dot(box_in(model, k), change)


@declared.motion.of(OnStructure)
def _motion(model, segment, tau):
    here, k = state_after(model, segment, tau), int(segment.body)
    box, b = box_in(model, k), here.bodies[k]
    x, v = dot(box, here.modes[DISPLACEMENT]), dot(box, here.modes[VELOCITY])
    return x, v, float(b[GAP]), float(b[RATE])


@declared.state_in.of(OnStructure)
def _state_in(model, segment, tau):
    here = state_after(model, segment, tau)
    count = len(here.bodies)
    y, u = np.empty(count), np.empty(count)
    for k in range(count):
        y[k], u[k] = place_of(model, here, k)
    x = times(shapes_in(model), here.modes[DISPLACEMENT])
    return x, times(shapes_in(model), here.modes[VELOCITY]), y, u


@compiled
def place_of(model: OnStructure, s: StructureSegment, k: int) -> tuple[float, float]:
    """Displacement and velocity of a free mass at the start of a segment."""
    b, box = s.bodies[k], box_in(model, k)
    offset = b[SIDE] * (mass_in(model.masses, k).clearance - b[GAP])
    y = dot(box, s.modes[DISPLACEMENT]) + offset
    return y, dot(box, s.modes[VELOCITY]) - b[SIDE] * b[RATE]

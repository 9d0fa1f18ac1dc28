"""What small deviations become of a motion with several free masses.

A deviation is one of (x, v, y0, u0, y1, u1, ...). An impact is carried to the moment at which the
deviated motion hits, as `damper.models.tangent` does: the masses that hit and those that the impact
presses on their walls share the impulse, and those that it kicks off go on. Masses that join the
primary follow the centre of all that have.

Masses that hit at one instant do so by one law, which is not that of one impact after the other. So
a deviation that parts them changes the motion by a finite amount, however small it is: it has no
derivative, and its column becomes NaN. Masses in step, alike but for their mass and in one state,
are moved as one. docs/orbits.md.
"""

import math
from typing import Any

import numpy as np

from damper.engine.bodies import acceleration_of, flow_of
from damper.engine.compiled import compiled
from damper.engine.model import read_segment
from damper.engine.oscillator import motion_from
from damper.engine.segment import COLUMNS, FLIGHT, IMPACT, RELEASE, STICKING, TAIL
from damper.models import tangent
from damper.models.several.bodies import (
    CAUSE,
    CLEARANCE,
    GAP,
    GRAVITY,
    MODE,
    RATE,
    RATIO,
    SIDE,
    SPEED,
    Several,
    SeveralSegment,
    begin,
    is_joined,
    mass_of,
    primary_with,
    restitution_of,
)
from damper.models.several.contacts import balance, balanced, settle
from damper.models.several.log import segment_of_all
from damper.models.several.pinch import is_pinched, times_over_gaps, turns_of

#: Part of a deviation, and of what it moves an impact by, that is roundoff.
_TOGETHER = 1e-9


tangent.friction_in.of(Several)(tangent.no_friction)


@tangent.damping_in.of(Several)
def _damping_in(model, s):
    return 2.0 * model.free.damping


@tangent.shrunk_by.of(Several)
def _shrunk_by(model, s):
    r = restitution_of(model, int(s.body), s.side)
    return r * r


@tangent.lost_in.of(Several)
def _lost_in(model, s, own):
    lost = 0.0
    for k in range(len(s.bodies)):
        if is_joined(s.bodies[k, MODE]):
            lost += 2.0 * float(own[k])
    return lost


@tangent.leaders_of.register(Several)
def _leaders_of(model, row):
    bodies = read_segment(model, row).bodies
    alike = np.column_stack([model.masses[:, CLEARANCE:], bodies[:, [GAP, RATE, SIDE, MODE]]])
    # Masses that stick move with the primary, whatever their walls are.
    sticks = bodies[:, MODE] == STICKING
    alike[sticks, -1] += 1.0 + np.flatnonzero(sticks)
    _, first, group = np.unique(alike, axis=0, return_index=True, return_inverse=True)
    return first[group.ravel()]


@tangent.parted_in.register(Several)
def _parted_in(model, log):
    bodies = log[:, COLUMNS + 2 :].reshape(len(log), len(model.masses), -1)
    joined = (bodies[:, :, MODE] == STICKING) | (bodies[:, :, MODE] == TAIL)
    return np.where(joined.any(0), 2, (bodies[:, :, SPEED] > 0.0).any(0).astype(int))


@tangent.over_time.of(Several)
def _over_time(model, s, low, high, deviations):
    tau = high - low
    if is_pinched(s.bodies):
        return  # it takes no time
    primary = flow_of(begin(model, s).osc, tau)
    for c in range(deviations.shape[1]):
        x, v = deviations[0, c], deviations[1, c]
        deviations[0, c] = primary.xx * x + primary.xv * v
        deviations[1, c] = primary.vx * x + primary.vv * v
    for k in range(len(s.bodies)):
        place = 2 + 2 * k
        flow = flow_of(mass_of(model, k, 0.0), tau)
        for c in range(deviations.shape[1]):
            y, u = deviations[place, c], deviations[place + 1, c]
            if is_joined(s.bodies[k, MODE]):
                deviations[place, c] = deviations[0, c]
                deviations[place + 1, c] = deviations[1, c]
            else:
                deviations[place, c] = flow.xx * y + flow.xv * u
                deviations[place + 1, c] = flow.vx * y + flow.vv * u


@tangent.enter.of(Several)
def _enter(model, s, deviations, happened):
    if happened and begins_impacts(s):
        strike(model, s, deviations)
    elif happened:
        return
    if is_pinched(s.bodies):
        join_pinched(model, s, deviations)
    else:
        join(model, s, deviations)


@compiled
def begins_impacts(s: SeveralSegment) -> bool:
    """Whether a segment is the first of those that impacts of one instant begin."""
    told, hits = 1, 0
    for k in range(len(s.bodies)):
        hits += s.bodies[k, SPEED] > 0.0
        told += s.bodies[k, CAUSE] == IMPACT
    return s.cause == IMPACT and told == hits


@compiled
def join(model: Several, s: SeveralSegment, deviations: np.ndarray) -> None:
    """Let deviated masses that have joined follow their centre."""
    for c in range(deviations.shape[1]):
        heavier, x, v = 1.0, deviations[0, c], deviations[1, c]
        for k in range(len(s.bodies)):
            if is_joined(s.bodies[k, MODE]):
                ratio = float(model.masses[k, RATIO])
                heavier += ratio
                x += ratio * deviations[2 + 2 * k, c]
                v += ratio * deviations[3 + 2 * k, c]
        if heavier > 1.0:
            deviations[0, c], deviations[1, c] = x / heavier, v / heavier
            for k in range(len(s.bodies)):
                if is_joined(s.bodies[k, MODE]):
                    deviations[2 + 2 * k, c] = deviations[0, c]
                    deviations[3 + 2 * k, c] = deviations[1, c]


@compiled
def join_pinched(model: Several, s: SeveralSegment, deviations: np.ndarray) -> None:
    """Let deviated masses that pinch the primary follow their centre, until some part from it."""
    bodies, j = s.bodies.copy(), 0
    for k in range(len(bodies)):
        if bodies[k, MODE] == TAIL:
            j = k if bodies[k, RATE] < 0.0 else j
            bodies[k, MODE], bodies[k, GAP], bodies[k, RATE] = STICKING, 0.0, 0.0
    together = begin(model, s).primary
    settle(model.friction, model, segment_of_all(s.periods, s.time, s.x, together.v, bodies), TAIL)
    i = int(s.body)
    coming, leaving = times_over_gaps(s.bodies, i, j, turns_of(model, s.bodies, i, j))
    # By how much later the deviated masses are at rest.
    late = coming * s.bodies[j, SIDE] * (deviations[0] - deviations[2 + 2 * j])
    late += leaving * s.bodies[i, SIDE] * (deviations[0] - deviations[2 + 2 * i])
    join(model, s, deviations)
    if not np.any(bodies[:, CAUSE] == RELEASE):
        return
    if not math.isfinite(coming):
        deviations[:] = math.nan
        return
    after = begin(model, segment_of_all(s.periods, s.time, s.x, together.v, bodies)).primary
    deviations[1] += (together.a - after.a) * late
    for k in range(len(bodies)):
        if s.bodies[k, MODE] == TAIL:
            own = acceleration_of(mass_of(model, k, 0.0), 0.0, 0.0, after.phase)
            own = after.a if is_joined(bodies[k, MODE]) else own
            deviations[3 + 2 * k] += (together.a - own) * late


@compiled
def impulses(model: Several, s: SeveralSegment) -> tuple[Any, Any, Any]:
    """The contacts of an instant with impacts: walls (0 for none), levels, and who pushes.

    As `balance` has them. Walls of masses that stuck before are there, with a level of 0.
    """
    count = len(s.bodies)
    sides, levels = np.zeros(count), np.zeros(count)
    for k in range(count):
        b = s.bodies[k]
        if b[SPEED] > 0.0:
            sides[k] = b[SIDE]
            levels[k] = (1.0 + restitution_of(model, k, float(b[SIDE]))) * b[SPEED]
        elif b[MODE] == STICKING or b[CAUSE] == RELEASE:
            sides[k] = b[SIDE]
    return sides, levels, balance(0.0, sides, model.masses[:, RATIO], levels)


@compiled
def strike(model: Several, s: SeveralSegment, deviations: np.ndarray) -> None:
    """Take deviations over the impacts of an instant, up to where masses join."""
    count = len(s.bodies)
    ratios, bodies = model.masses[:, RATIO], s.bodies
    sides, levels, pushes = impulses(model, s)
    jump = balanced(0.0, sides, ratios, levels, pushes)
    after = begin(model, s).primary
    joined, pull, heavier, fastest = 0.0, 0.0, 1.0, 0
    for k in range(count):
        if sides[k] != 0.0 and levels[k] == 0.0:
            joined += float(ratios[k])
            pull += float(ratios[k] * model.masses[k, GRAVITY])
        heavier += float(ratios[k] * pushes[k])
        if bodies[k, SPEED] > bodies[fastest, SPEED]:
            fastest = k
    a = motion_from(primary_with(model, joined, pull), s.x, s.v_before, after.phase).a
    for c in range(deviations.shape[1]):
        x, v = deviations[0, c], deviations[1, c]
        # By how much later the deviated motion hits.
        late = sides[fastest] * (x - deviations[2 + 2 * fastest, c]) / bodies[fastest, SPEED]
        change, parts = 0.0, False
        for k in range(count):
            y, speed = deviations[2 + 2 * k, c], float(bodies[k, SPEED])
            if speed == 0.0 and _loses_its_wall(bodies[k], sides[k], jump):
                speed = float(bodies[k, SIDE] * jump - bodies[k, RATE])
            if speed > 0.0:
                off = abs(bodies[k, SIDE] * (x - y) - late * speed)
                parts = parts or off > _TOGETHER * (abs(x) + abs(y) + abs(late) * speed)
            if levels[k] > 0.0 and pushes[k] == 1.0:
                own = acceleration_of(mass_of(model, k, 0.0), 0.0, 0.0, after.phase)
                turned = levels[k] / bodies[k, SPEED]
                change += ratios[k] * turned * (deviations[3 + 2 * k, c] - v + (own - a) * late)
        change /= heavier
        for k in range(count):
            own = acceleration_of(mass_of(model, k, 0.0), 0.0, 0.0, after.phase)
            later = after.a if is_joined(bodies[k, MODE]) else own
            stuck = sides[k] != 0.0 and levels[k] == 0.0
            way, gained = 0.0, -(later - (a if stuck else own)) * late
            if pushes[k] == 1.0:
                way, gained = jump, gained + change
                if not stuck:
                    turned = levels[k] / bodies[k, SPEED]
                    way -= sides[k] * levels[k]
                    gained -= turned * (deviations[3 + 2 * k, c] - v + (own - a) * late)
            deviations[2 + 2 * k, c] -= way * late
            deviations[3 + 2 * k, c] += gained
        deviations[0, c] = x - jump * late
        deviations[1, c] = v + change - (after.a - a) * late
        if parts:
            for row in range(len(deviations)):
                deviations[row, c] = math.nan


@compiled
def _loses_its_wall(b, side, jump):
    """Whether a mass arrives at an instant at which another one's impact takes the wall away."""
    arrives = b[MODE] == FLIGHT and b[GAP] == 0.0 and side == 0.0
    return arrives and b[SIDE] * jump > b[RATE]

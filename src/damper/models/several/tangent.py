"""Tangent dynamics of a motion with several free masses.

A deviation is one of (x, v, y0, u0, y1, u1, ...). An impact is carried to the moment at which the
deviated motion hits, as `damper.models.tangent` does. The impulse is shared by the masses that hit
and by the masses that the impact presses on their walls; masses that are kicked off, or that
friction alone held, go on. Masses that join the primary follow the centre of all joined masses.
Where dry friction stops a slide, the accelerations of all masses on the primary jump.

Simultaneous impacts have one law, which differs from one impact after the other. So
a deviation that parts them changes the motion by a finite amount, however small it is: it has no
derivative, and its column becomes NaN. Masses in step, alike but for their mass and in one state,
are moved as one. docs/orbits.md.
"""

import math
from typing import Any

import numpy as np

from damper.engine.bodies import body_at, flow_of
from damper.engine.compiled import compiled
from damper.engine.forcing import phase_at
from damper.engine.impact import rebound_slope, restitution_at
from damper.engine.model import read_segment
from damper.engine.oscillator import increments, motion_from
from damper.engine.segment import COLUMNS, FLIGHT, IMPACT, NOTHING, RESTING, STICKING, TAIL
from damper.models import sensitivity, tangent
from damper.models.friction import SLIP_DIRECTION, is_joined
from damper.models.many import (
    ACCUMULATION,
    CAUSE,
    GAP,
    MODE,
    RATE,
    SIDE,
    SPEED,
    MassesSegment,
    is_on_wall,
)
from damper.models.several.bodies import (
    CLEARANCE,
    DAMPING,
    FOLLOWS,
    FRICTION,
    JOINED,
    LEVEL,
    MOST,
    PREVIOUS_STATE,
    RATIO,
    REPORTED,
    STIFFNESS,
    WALL,
    Several,
    begin,
    body_in,
    flying,
    load_in,
    mass_at,
    offset_of,
    own_acceleration,
    primary_with,
    ways_in,
)
from damper.models.several.contacts import balance, decide_contacts
from damper.models.several.log import segment_of_all
from damper.models.several.pinch import is_pinched, times_over_gaps, turns_of
from damper.models.tangent import TOGETHER
from damper.models.wall_laws import law_of


@tangent.friction_in.of(Several)
def _friction_in(model):
    return float(np.max(model.masses[:, FRICTION]))


@tangent.damping_in.of(Several)
def _damping_in(model, s):
    damping = model.free.damping
    for k in range(len(s.bodies)):
        if not is_joined(s.bodies[k, MODE]):
            damping += float(model.masses[k, DAMPING])
    return 2.0 * damping


@tangent.shrunk_by.of(Several)
def _shrunk_by(model, s):
    k, bodies = int(s.body), s.bodies
    if s.cause == IMPACT:
        law = law_of(model.single, mass_at(model, k), s.side)
        return rebound_slope(law, s.speed) * restitution_at(law, s.speed)
    if bodies[0, PREVIOUS_STATE] == REPORTED or np.any(bodies[:, SPEED] > 0.0):
        return 1.0  # told of before, or a part of an impact
    a, own = accelerations(model, s, s.v, bodies[:, PREVIOUS_STATE])
    after, later = accelerations(model, s, s.v, ways_in(bodies))
    return (later[k] - after) / (own[k] - a)


@tangent.lost_in.of(Several)
def _lost_in(model, s, own):
    lost = 0.0
    for k in range(len(s.bodies)):
        if is_joined(s.bodies[k, MODE]):
            lost += (1.0 if s.bodies[k, MODE] == RESTING else 2.0) * float(own[k])
    return lost


@tangent.leaders_of.register(Several)
def _leaders_of(model, row):
    bodies = read_segment(model, row).bodies
    alike = np.column_stack([model.masses[:, CLEARANCE:], bodies[:, [GAP, RATE, SIDE, MODE]]])
    # Masses that stick move with the primary, whatever their walls are.
    sticks = bodies[:, MODE] == STICKING
    alike[sticks, -1] += 1.0 + RESTING + np.flatnonzero(sticks)
    _, first, group = np.unique(alike, axis=0, return_index=True, return_inverse=True)
    return first[group.ravel()]


@tangent.parted_in.register(Several)
def _parted_in(model, log):
    bodies = log[:, COLUMNS + 2 :].reshape(len(log), len(model.masses), -1)
    modes = bodies[:, :, MODE]
    happens = (
        bodies[:, :, PREVIOUS_STATE] * bodies[:, :, SLIP_DIRECTION] == -1.0,
        modes == RESTING,
        bodies[:, :, SPEED] > 0.0,
        (modes == STICKING) | (modes == TAIL),
    )
    return np.max([(k + 1) * each.any(0) for k, each in enumerate(happens)], axis=0)


@tangent.over_time.of(Several)
def _over_time(model, s, low, high, deviations):
    tau = high - low
    if is_pinched(s.bodies):
        return  # it takes no time
    start = begin(model, s)
    primary, stiffness = flow_of(start.osc, tau), start.osc.stiffness * (1.0 + start.joined)
    # Supports of masses that rest off the walls move the place about which the primary swings.
    shifts = np.zeros(deviations.shape[1])
    for k in range(len(s.bodies)):
        if s.bodies[k, MODE] == RESTING:
            deviations[2 + 2 * k] -= deviations[0]
            support = float(model.masses[k, RATIO] * model.masses[k, STIFFNESS])
            shifts += support / stiffness * deviations[2 + 2 * k]
    for c in range(deviations.shape[1]):
        x, v = deviations[0, c] + shifts[c], deviations[1, c]
        deviations[0, c] = primary.xx * x + primary.xv * v - shifts[c]
        deviations[1, c] = primary.vx * x + primary.vv * v
    for k in range(len(s.bodies)):
        place, mode = 2 + 2 * k, s.bodies[k, MODE]
        flow = flow_of(flying(model.single, mass_at(model, k), 0.0), tau)
        for c in range(deviations.shape[1]):
            y, u = deviations[place, c], deviations[place + 1, c]
            if is_joined(mode):
                deviations[place, c] = deviations[0, c] + (y if mode == RESTING else 0.0)
                deviations[place + 1, c] = deviations[1, c]
            else:
                deviations[place, c] = flow.xx * y + flow.xv * u
                deviations[place + 1, c] = flow.vx * y + flow.vv * u


@tangent.enter.of(Several)
def _enter(model, s, deviations, happened):
    if happened and begins_impacts(model, s):
        strike(model, s, deviations)
    elif happened and not stop(model, s, deviations):
        return
    if _ends_at_once(s.bodies):
        join_at_once(model, s, deviations)
    else:
        join(model, s, deviations)


@compiled
def begins_impacts(model: Several, s: MassesSegment) -> bool:
    """Whether a segment is the first of those that impacts of one instant begin."""
    return s.cause == IMPACT and s.bodies[0, PREVIOUS_STATE] != REPORTED


@compiled
def offsets_in(model: Several, bodies: np.ndarray) -> np.ndarray:
    """Displacements of all masses less the primary's."""
    found = np.zeros(len(bodies))
    for k in range(len(bodies)):
        found[k] = offset_of(mass_at(model, k), body_in(bodies, k))
    return found


@compiled
def accelerations(
    model: Several, s: MassesSegment, v: float, ways: np.ndarray
) -> tuple[float, np.ndarray]:
    """Accelerations of the primary and of each mass, as for `ways_in`, at a segment's start."""
    osc = primary_with(model, load_in(model, ways, offsets_in(model, s.bodies)))
    phase = phase_at(osc.forcing, s.periods, s.time)
    a = motion_from(osc, s.x, v, phase).a
    own = np.full(len(ways), a)
    for k in range(len(ways)):
        if ways[k] != JOINED:
            m, b = mass_at(model, k), body_in(s.bodies, k)
            own[k] = own_acceleration(model.single, m, b, s.x, v, phase, float(ways[k]))
    return a, own


@compiled
def join(model: Several, s: MassesSegment, deviations: np.ndarray) -> None:
    """Let deviated masses that have joined follow their centre; off the walls their places stay."""
    for c in range(deviations.shape[1]):
        heavier, on_walls, x, v = 1.0, 1.0, deviations[0, c], deviations[1, c]
        for k in range(len(s.bodies)):
            ratio = float(model.masses[k, RATIO])
            if is_joined(s.bodies[k, MODE]):
                heavier += ratio
                v += ratio * deviations[3 + 2 * k, c]
            if is_on_wall(s.bodies[k, MODE]):
                on_walls += ratio
                x += ratio * deviations[2 + 2 * k, c]
        if heavier > 1.0:
            deviations[0, c], deviations[1, c] = x / on_walls, v / heavier
        for k in range(len(s.bodies)):
            if is_joined(s.bodies[k, MODE]):
                deviations[3 + 2 * k, c] = deviations[1, c]
            if is_on_wall(s.bodies[k, MODE]):
                deviations[2 + 2 * k, c] = deviations[0, c]


@compiled
def _ends_at_once(bodies):
    """Whether a tail ends at once, and may let some part from the primary."""
    if is_pinched(bodies):
        return True
    found = False
    for k in range(len(bodies)):
        found = found or bool(bodies[k, MODE] == TAIL and bodies[k, ACCUMULATION] == 0.0)
    return found and bool(np.any(bodies[:, SLIP_DIRECTION] != 0.0))


@compiled
def join_at_once(model: Several, s: MassesSegment, deviations: np.ndarray) -> None:
    """Let deviated masses that pinch the primary follow their centre, until some part from it."""
    bodies, j = s.bodies.copy(), 0
    for k in range(len(bodies)):
        if bodies[k, MODE] == TAIL:
            j = k if bodies[k, RATE] < 0.0 else j
            bodies[k, MODE], bodies[k, CAUSE] = STICKING, NOTHING
            bodies[k, GAP], bodies[k, RATE] = 0.0, 0.0
    v = begin(model, s).primary.v
    decide_contacts(model, segment_of_all(s.periods, s.time, s.x, v, bodies), TAIL)
    ways, after = ways_in(s.bodies), ways_in(bodies)
    if np.all(ways == after):
        join(model, s, deviations)
        return
    i, coming, leaving = int(s.body), math.inf, math.inf
    if s.bodies[j, RATE] < 0.0:
        turns = turns_of(model, s.bodies, i, j)
        coming, leaving = times_over_gaps(s.bodies, i, j, turns)
    if not math.isfinite(coming):
        deviations[:] = math.nan
        return
    # By how much later the deviated masses are at rest.
    late = coming * s.bodies[j, SIDE] * (deviations[0] - deviations[2 + 2 * j])
    late += leaving * s.bodies[i, SIDE] * (deviations[0] - deviations[2 + 2 * i])
    join(model, s, deviations)
    _change_course(model, s, v, ways, after, late, deviations)


@compiled
def _change_course(model, s, v, before, after, late, deviations):
    """Let deviated masses change their ways later than the motion itself."""
    a, own = accelerations(model, s, v, before)
    a_after, later = accelerations(model, s, v, after)
    deviations[1] += (a - a_after) * late
    for k in range(len(own)):
        deviations[3 + 2 * k] += (own[k] - later[k]) * late


@compiled
def stop(model: Several, s: MassesSegment, deviations: np.ndarray) -> bool:
    """Take deviations over slides that stop, up to where masses rest; whether there are any.

    Where those rest and nothing else changes it does not matter when: their centre goes on.
    """
    bodies = s.bodies
    before, after = bodies[:, PREVIOUS_STATE].copy(), ways_in(bodies)
    stops = (np.abs(before) == 1.0) & (bodies[:, RATE] == 0.0) & (before != after)
    if not np.any(stops):
        return False
    turns = bool(np.any((before != after) & ~(stops & (after == JOINED))))
    a, own = accelerations(model, s, s.v, before)
    late = np.zeros(deviations.shape[1])
    for c in range(deviations.shape[1]):
        v, parts, known = deviations[1, c], False, False
        for k in range(len(bodies)):
            if not stops[k]:
                continue
            u, falls = deviations[3 + 2 * k, c], float(own[k] - a)
            if not known and turns and falls != 0.0:
                late[c] = (v - u) / falls
            known = True
            off = abs(u - v + falls * late[c])
            parts = parts or (turns and off > TOGETHER * (abs(u) + abs(v) + abs(falls * late[c])))
            if bodies[k, MODE] == TAIL:
                # It stops at the very wall: a deviated mass hits the wall, or stops before it.
                x, y = deviations[0, c], deviations[2 + 2 * k, c]
                parts = parts or abs(x - y) > TOGETHER * (abs(x) + abs(y))
        if parts:
            for row in range(len(deviations)):
                deviations[row, c] = math.nan
    if turns:
        _change_course(model, s, s.v, before, after, late, deviations)
    return True


@compiled
def impulses(model: Several, s: MassesSegment) -> tuple[Any, Any, Any]:
    """The contacts of an instant with impacts: walls (0 for none), levels, and who pushes.

    As `balance` has them. Walls of masses at rest on them before are there, with a level of 0.
    """
    bodies = s.bodies.copy()
    for k in range(len(bodies)):
        b = bodies[k]
        b[WALL], b[LEVEL], b[MOST] = 0.0, 0.0, 0.0
        if b[SPEED] > 0.0:
            b[WALL] = b[SIDE]
            r = restitution_at(
                law_of(model.single, mass_at(model, k), float(b[SIDE])), float(b[SPEED])
            )
            b[LEVEL] = b[WALL] * (1.0 + r) * b[SPEED]
        elif b[GAP] == 0.0 and (b[PREVIOUS_STATE] == JOINED or b[RATE] == 0.0):
            b[WALL] = b[SIDE]
    balance(0.0, model.masses, bodies)
    return bodies[:, WALL], bodies[:, LEVEL], bodies[:, FOLLOWS]


@compiled
def change_by(ratios: np.ndarray, levels: np.ndarray, pushes: np.ndarray) -> float:
    """Change of the primary's velocity by impacts of which it is known who pushes."""
    change, heavier = 0.0, 1.0
    for k in range(len(ratios)):
        if pushes[k] == 1.0:
            change += float(ratios[k] * levels[k])
            heavier += float(ratios[k])
    return change / heavier


@compiled
def _turned_by(model, b, k):
    """Derivative of the change of a mass's relative velocity in its impact, by that velocity."""
    return 1.0 + rebound_slope(
        law_of(model.single, mass_at(model, k), float(b[SIDE])), float(b[SPEED])
    )


@compiled
def strike(model: Several, s: MassesSegment, deviations: np.ndarray) -> None:
    """Take deviations over the impacts of an instant, up to where masses join."""
    count = len(s.bodies)
    ratios, bodies = model.masses[:, RATIO], s.bodies
    sides, levels, pushes = impulses(model, s)
    jump = change_by(ratios, levels, pushes)
    a, own = accelerations(model, s, s.v_before, bodies[:, PREVIOUS_STATE].copy())
    common = begin(model, s).primary.v
    after, later = accelerations(model, s, common, ways_in(bodies))
    heavier, fastest = 1.0, 0
    for k in range(count):
        # A support's dashpot brakes the mass's own velocity.
        drag, side = 2.0 * float(model.masses[k, DAMPING]), float(bodies[k, SIDE])
        u = s.v - side * float(bodies[k, RATE])
        if not is_joined(bodies[k, MODE]):
            later[k] -= drag * (u - common)
        if bodies[k, PREVIOUS_STATE] != JOINED:
            before = s.v_before + side * float(bodies[k, SPEED])
            own[k] -= drag * ((before if bodies[k, SPEED] > 0.0 else u) - s.v_before)
        heavier += float(ratios[k] * pushes[k])
        if bodies[k, SPEED] > bodies[fastest, SPEED]:
            fastest = k
    for c in range(deviations.shape[1]):
        x, v = deviations[0, c], deviations[1, c]
        # By how much later the deviated motion hits.
        late = sides[fastest] * (x - deviations[2 + 2 * fastest, c]) / bodies[fastest, SPEED]
        change, parts = 0.0, False
        for k in range(count):
            y, speed = deviations[2 + 2 * k, c], float(bodies[k, SPEED])
            if sides[k] != 0.0 and speed == 0.0 and bodies[k, PREVIOUS_STATE] != JOINED:
                # It only touches its wall: a deviation that parts them takes it out of the impact.
                parts = parts or x != y or v != deviations[3 + 2 * k, c]
            if speed == 0.0 and _loses_its_wall(bodies[k], sides[k], jump):
                speed = float(bodies[k, SIDE] * jump - bodies[k, RATE])
            if speed > 0.0:
                off = abs(bodies[k, SIDE] * (x - y) - late * speed)
                parts = parts or off > TOGETHER * (abs(x) + abs(y) + abs(late) * speed)
            if levels[k] != 0.0 and pushes[k] == 1.0:
                turned = _turned_by(model, bodies[k], k)
                change += ratios[k] * turned * (deviations[3 + 2 * k, c] - v + (own[k] - a) * late)
        change /= heavier
        for k in range(count):
            way, gained = 0.0, (own[k] - later[k]) * late
            if pushes[k] == 1.0:
                way, gained = jump, gained + change
                if levels[k] != 0.0:
                    turned = _turned_by(model, bodies[k], k)
                    way -= levels[k]
                    gained -= turned * (deviations[3 + 2 * k, c] - v + (own[k] - a) * late)
            deviations[2 + 2 * k, c] -= way * late
            deviations[3 + 2 * k, c] += gained
        deviations[0, c] = x - jump * late
        deviations[1, c] = v + change + (a - after) * late
        if parts:
            for row in range(len(deviations)):
                deviations[row, c] = math.nan


@compiled
def _loses_its_wall(b, side, jump):
    """Whether a mass arrives at an instant at which another one's impact takes the wall away."""
    arrives = b[MODE] == FLIGHT and b[GAP] == 0.0 and side == 0.0
    return arrives and b[SIDE] * jump > b[RATE]


# --- the change by a parameter: impacts and flows of neighbouring models from one state


@sensitivity.clearances_of.register(Several)
def _clearances_of(model: Several) -> Any:
    return model.masses[:, CLEARANCE]


@sensitivity.wall_of.of(Several)
def _wall_of(model, segment, k):
    return float(segment.bodies[k, SIDE]), float(segment.bodies[k, MODE])


sensitivity.strikes.of(Several)(begins_impacts)


@sensitivity.lead.of(Several)
def _lead(there, model, s, struck, found):
    if struck:
        _after_impacts(there, model, s, found)
    else:
        _after(there, model, s, begin(model, s).primary.v, found)


@compiled
def _after_impacts(there, model, s, found):
    """Velocities after the impacts that begin a segment, those of joined masses their centre's."""
    sides, _, pushes = impulses(model, s)
    _, levels, _ = impulses(there, s)
    v = s.v_before + change_by(there.masses[:, RATIO], levels, pushes)
    heavier, carried = 1.0, v
    for k in range(len(s.bodies)):
        b = s.bodies[k]
        u = 0.0
        if pushes[k] == 1.0:
            # The rebound is what the level has beyond the approach.
            u = v - (levels[k] - sides[k] * b[SPEED])
        elif b[PREVIOUS_STATE] == JOINED or is_joined(b[MODE]):
            u = s.v_before
        found[3 + 2 * k] = u
        if is_joined(b[MODE]):
            heavier += there.masses[k, RATIO]
            carried += there.masses[k, RATIO] * u
    found[1] = carried / heavier
    for k in range(len(s.bodies)):
        if is_joined(s.bodies[k, MODE]):
            found[3 + 2 * k] = found[1]


@compiled
def _after(there, model, s, v, found):
    """Change of the state by the flow over a segment, with a cycle that is longer in proportion."""
    slower = there.cycle / model.cycle
    offsets, beside = offsets_in(model, s.bodies), offsets_in(there, s.bodies)
    for k in range(len(offsets)):
        if is_on_wall(s.bodies[k, MODE]):
            offsets[k] = beside[k]
    tau, osc = s.duration * slower, primary_with(there, load_in(there, ways_in(s.bodies), offsets))
    phase = phase_at(osc.forcing, s.periods, s.time * slower)
    way, gained, _ = increments(osc, motion_from(osc, s.x, v, phase), tau)
    found[0], found[1] = v * tau + way, gained
    for k in range(len(s.bodies)):
        b = s.bodies[k]
        if is_joined(b[MODE]):
            found[2 + 2 * k], found[3 + 2 * k] = found[0], gained
        else:
            y = s.x + b[SIDE] * (model.masses[k, CLEARANCE] - b[GAP])
            u = s.v - b[SIDE] * b[RATE]
            mass = flying(there.single, mass_at(there, k), float(b[SLIP_DIRECTION]))
            way, later = body_at(mass, y, u, phase, tau)
            found[2 + 2 * k], found[3 + 2 * k] = way, later - u

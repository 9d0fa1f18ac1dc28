"""The closed rest of complete chatter sequences, of one mass among several."""

import math
from typing import Any, NamedTuple

import numpy as np

from damper.engine.bodies import WeightedSum
from damper.engine.compiled import compiled
from damper.engine.dispatch import by_class
from damper.engine.forcing import phase_at
from damper.engine.oscillator import advance, motion_from
from damper.engine.search import GAVE_UP, first_root
from damper.engine.segment import (
    FLIGHT,
    IMPACT,
    NOTHING,
    RELEASE,
    RESTING,
    SLIP,
    STICKING,
    TAIL,
    Segment,
)
from damper.engine.tuples import changed
from damper.models import walls
from damper.models.flights import completes, completes_rubbing, first_wall, gap_of, is_balanced
from damper.models.friction import SLIP_DIRECTION, Frictions, NoFriction, is_joined
from damper.models.many import (
    ACCUMULATION,
    CAUSE,
    GAP,
    MODE,
    RATE,
    SIDE,
    SPEED,
    MassesSegment,
    negligible,
)
from damper.models.masses import Rigid
from damper.models.masses.holds import Hold, first_stop, hold_at_start
from damper.models.several.bodies import (
    CLEARANCE,
    FRICTION,
    RATIO,
    MassConstants,
    MassState,
    Several,
    Start,
    begin,
    begin_after,
    body_in,
    flight_of,
    flight_of_body,
    flying,
    mass_at,
    offset_of,
    own_acceleration,
    segment_of,
    single_mass_view,
)
from damper.models.several.contacts import decide_contacts
from damper.models.several.log import segment_of_all
from damper.models.several.pinch import SHORTEST
from damper.models.wall_laws import have_one_law, restitution_of


class NextEvent(NamedTuple):
    """The first that happens to a body."""

    tau: float
    side: float
    """Of the search."""
    steps: int
    stops: bool
    """Whether it is that a slide stops."""


@compiled
def next_event(
    friction: Any,
    single: Rigid,
    m: MassConstants,
    b: MassState,
    start: Start,
    last: float,
    margin: float,
    slowest: float,
) -> NextEvent:
    """When a body arrives at a wall, no longer rests, or ends a slide; up to a time.

    It arrives within a margin of a wall, and ends a slide at the speed `slowest`.
    """
    if is_joined(b.mode):
        mass, offset = flying(single, m, 0.0), offset_of(m, b)
        hold = Hold(start.osc, mass, start.primary, b.side, offset, m.friction)
        here = hold_at_start(hold)
        width = 2.0 * hold.friction if b.mode == RESTING else math.inf
        if is_balanced(here, width):
            # All masses hang at rest: the force is the roundoff of their weights.
            return NextEvent(last, 0.0, 1, False)
        lifts_off = here.value == 0.0 and here.slope == 0.0 and here.second == 0.0
        root = first_root(hold, here, width, lifts_off, last, 0.0)
        return NextEvent(root.point.tau + root.step, root.side, root.steps, False)
    seg, view, own = flight_of_body(single, m, b, start)
    stop = slide_end(friction, own, view, seg, b.slip, last, slowest)
    if stop.side == GAVE_UP:
        return stop
    moving = less(gap_of(own, view, seg, 1.0), margin, 0.0)
    root = first_wall(moving, 2.0 * (view.clearance - margin), stop.tau)
    tau, steps = root.point.tau + root.step, stop.steps + root.steps
    if root.side == GAVE_UP or (root.side != 0.0 and tau <= stop.tau):
        return NextEvent(tau, root.side, steps, False)
    return NextEvent(stop.tau, stop.side, steps, stop.stops)


@compiled
def less(gap: WeightedSum, margin: float, speed: float) -> WeightedSum:
    """A gap that is this much smaller, and grows so much more slowly."""
    return _shifted(gap, gap.value - margin, gap.slope - speed)


_shifted = changed(WeightedSum, "value", "slope")


@by_class
def slide_end(
    friction: Any, own: Any, view: Rigid, segment: Segment, way: float, last: float, slowest: float
) -> NextEvent:
    """When a slide has slowed down to this speed; up to a time."""


@slide_end.of(NoFriction)
def _no_stop(friction, own, view, segment, way, last, slowest):
    return NextEvent(last, 0.0, 0, False)


@slide_end.of(Frictions)
def _slide_end(friction, own, view, segment, way, last, slowest):
    if way == 0.0:
        return NextEvent(last, 0.0, 0, False)
    gap = gap_of(own, view, segment, -way * segment.side)
    stop = first_stop(less(gap, 0.0, slowest), last)
    if stop.tau <= last:
        return NextEvent(stop.tau, 1.0, stop.steps, True)
    return NextEvent(last, GAVE_UP if stop.gave_up else 0.0, stop.steps, False)


class ChatterSequence(NamedTuple):
    """Rest of a chatter sequence."""

    left: float
    """Time to the accumulation point; infinite where none is known well enough."""
    rise: float
    """Height of the bounces, at most."""
    ratio: float
    """Mass ratio of all that chatter as one."""


@compiled
def close(model: Several, s: MassesSegment, start: Start) -> tuple[float, bool]:
    """Close the chatter sequences that complete before anything else happens; in place.

    A sequence that has less than the tolerance left is at its end whatever other masses do: where
    several masses chatter on one wall, each impact kicks the others off the wall, and all come to
    rest at one instant. Returned are the primary's velocity, and whether anything is closed.
    """
    faded, change = close_together(model, s, start)
    any_rests = False
    if not faded:
        for k in range(len(s.bodies)):
            # Asked before the calls, which take time even where they answer at once.
            b = body_in(s.bodies, k)
            if b.mode != FLIGHT or b.gap != 0.0 or b.cause == NOTHING:
                continue
            if is_brief(model, b.rate) and is_negligible(model, s, start, k, 0.0):
                any_rests = True
                continue
            if b.rate > 0.0 and b.cause == IMPACT:
                ratio = _chattering_with(model, s.bodies, k)
                chatter = _chatter_of(model.single, mass_at(model, k), b, start, ratio)
                lasts = negligible(model.tolerance) < chatter.left < math.inf
                if lasts and _is_closed(model, s, start, k, chatter):
                    return s.v, True
    if any_rests:
        change = merge_at_rest(model, s)
    if faded or any_rests:
        # Slides may have turned round.
        decide_contacts(model, segment_of_all(s.periods, s.time, s.x, s.v + change, s.bodies), TAIL)
        return s.v + change, True
    return s.v, False


@compiled
def _chatter_of(single, m, b, start, ratio):
    """Rest of the chatter sequence of a mass, and of masses of this ratio that chatter as one."""
    seg = segment_of(b, start)
    view = single_mass_view(single, m, start, ratio, b.side, b.slip)
    own = flight_of(view.mass, start, view, seg)
    part = 1.0
    if m.friction == 0.0:
        left, error = completes(view, view.mass_ratio, seg, own)
        part -= restitution_of(m, b.side)
    else:
        left, error = completes_rubbing(own, view, seg, m.friction)
    # The next bounce must turn before the other wall; a constant force lets it rise this high.
    rise = 0.25 * seg.gap_rate * left * part
    if not (error <= single.tolerance and rise <= view.clearance):
        left = math.inf
    return ChatterSequence(left, rise, ratio)


@compiled
def _is_closed(model, s, start, k, chatter):
    """Close a sequence unless another body disturbs it, in place; whether that is done."""
    bodies, left = s.bodies, chatter.left
    if not _is_undisturbed(model, s, start, k, chatter):
        return False
    for j in range(len(bodies)):
        if _chatters_with(model, bodies, k, j):
            bodies[j, MODE], bodies[j, ACCUMULATION], bodies[j, SLIP_DIRECTION] = TAIL, left, 0.0
    return True


@compiled
def merge_at_rest(model: Several, s: MassesSegment) -> float:
    """Let all rest at once that have nothing left, in place; the change of the primary's velocity.

    A kick takes speed from the masses that have just kicked others off their wall. Later kicks
    would take the rest of the speed, so a mass comes to rest with the masses that it kicks, even
    where it is elastic.
    """
    bodies = s.bodies
    for k in range(len(bodies)):
        b = bodies[k]
        if b[MODE] == FLIGHT and b[CAUSE] == RELEASE and b[RATE] == 0.0:
            # A kick that is none has released it.
            b[MODE], b[CAUSE], b[SLIP_DIRECTION] = STICKING, NOTHING, 0.0
    start = begin(model, s)
    rests = np.zeros(len(bodies))
    change, last = 0.0, -1.0
    while np.sum(rests) > last:
        last = float(np.sum(rests))
        for k in range(len(bodies)):
            if is_negligible(model, s, start, k, change):
                rests[k] = 1.0
        change = change_by_rest(model, bodies, rests, start.joined)
    for k in range(len(bodies)):
        b = bodies[k]
        b[SLIP_DIRECTION] = 0.0 if rests[k] == 1.0 else b[SLIP_DIRECTION]
        if rests[k] == 1.0 and b[CAUSE] == RELEASE:
            b[MODE], b[CAUSE], b[SPEED], b[RATE] = STICKING, NOTHING, -b[RATE], 0.0
        elif rests[k] == 1.0:
            b[MODE], b[ACCUMULATION], b[RATE] = TAIL, 0.0, 0.0
        elif b[MODE] == FLIGHT:
            b[RATE] += b[SIDE] * change
    return change


@compiled
def is_negligible(model: Several, s: MassesSegment, start: Start, k: int, change: float) -> bool:
    """Whether a mass to which something has happened on a wall bounces there for no time.

    `change` is the change of the primary's velocity by other masses that come to rest.
    """
    m, b, p = mass_at(model, k), body_in(s.bodies, k), start.primary
    if not (b.mode == FLIGHT and b.gap == 0.0 and b.cause != NOTHING):
        return False
    r, rate = restitution_of(m, b.side), b.rate + b.side * change
    if m.left_table >= 0.0 and abs(rate) > m.yields:
        return False
    if change != 0.0 and b.cause == IMPACT:
        r = max(rate, 0.0) / b.speed
    # Accelerations towards the wall, on the way out and on the way back.
    joined = 1.0 + start.joined
    out = b.side * (own_acceleration(model.single, m, b, s.x, s.v, p.phase, b.slip) - p.a)
    back = out - 2.0 * (joined + m.ratio) / joined * m.friction
    if back <= 0.0:
        return False
    shrinks = r * math.sqrt(back / out) if out > 0.0 else r
    left = abs(rate) * (back + math.sqrt(out * back))
    return left <= negligible(model.tolerance) * out * back * (1.0 - shrinks)


@compiled
def _chatters_with(model, bodies, k, j):
    """Whether two masses chatter as one: their motions at a wall are the same, number by number."""
    b, c = body_in(bodies, k), body_in(bodies, j)
    if not (c.cause == IMPACT and c.side == b.side and c.rate == b.rate):
        return False
    one, other = mass_at(model, k), mass_at(model, j)
    supports = one.stiffness == other.stiffness and one.damping == other.damping
    placed = one.stiffness == 0.0 or one.clearance == other.clearance
    pulled = one.gravity == other.gravity and one.friction == other.friction
    return pulled and supports and placed and have_one_law(one, other, b.side)


@compiled
def _chattering_with(model, bodies, k):
    """Mass ratio of all that chatter as one with a body."""
    ratio = float(model.masses[k, RATIO])
    for j in range(len(bodies)):
        if j != k and bodies[j, CAUSE] == IMPACT and _chatters_with(model, bodies, k, j):
            ratio += float(model.masses[j, RATIO])
    return ratio


@compiled
def _is_undisturbed(model, s, start, k, chatter):
    """Whether nothing happens to any other body while the sequence of one completes."""
    bodies, left, side = s.bodies, chatter.left, float(s.bodies[k, SIDE])
    share = chatter.ratio / (1.0 + start.joined + chatter.ratio)
    together = _together(model, s, start, k)
    # Bounces carry the primary this far from the centre and are so fast, at most; twice that to be
    # sure.
    margin, slowest = 2.0 * share * chatter.rise, 2.0 * share * float(bodies[k, RATE])
    for j in range(len(bodies)):
        b = bodies[j]
        if j == k or _chatters_with(model, bodies, k, j):
            continue
        flies = b[MODE] == FLIGHT
        width = 2.0 * float(model.masses[j, CLEARANCE])
        near = flies and not margin < b[GAP] < width - margin
        speed = -b[SLIP_DIRECTION] * b[SIDE] * (b[RATE] + b[SIDE] * (together.primary.v - s.v))
        turns = flies and b[SLIP_DIRECTION] != 0.0 and speed <= slowest
        # Each impact moves one that rests, or sticks to the same wall.
        moved = b[MODE] == RESTING or (b[MODE] == STICKING and b[SIDE] == side)
        if near or turns or moved or b[MODE] == TAIL:
            return False
        # Between impacts a contact force is what it is without the mass that bounces.
        moving, m = together if flies else start, mass_at(model, j)
        found = next_event(
            model.friction, model.single, m, body_in(bodies, j), moving, left, margin, slowest
        )
        if found.side != 0.0 and found.tau <= left:
            return False
    return True


@compiled
def _set_leaving(model, s, mode):
    """Give a mode to all masses that leave a wall as that of a segment does, in place; their ratio.

    They leave the same wall at the same speed, just now.
    """
    bodies, ratio = s.bodies, 0.0
    b = body_in(bodies, int(s.body))
    for j in range(len(bodies)):
        c = body_in(bodies, j)
        leaves = c.mode == TAIL or c.mode == FLIGHT
        if leaves and c.gap == 0.0 and c.side == b.side and c.rate == b.rate:
            ratio += float(model.masses[j, RATIO])
            bodies[j, MODE] = mode
    return ratio


@walls.alone.of(Several)
def _alone(model, segment):
    """Masses that leave the wall together count as one."""
    ratio = _set_leaving(model, segment, FLIGHT)
    k, start = int(segment.body), begin(model, segment)
    m, b = mass_at(model, k), body_in(segment.bodies, k)
    view = single_mass_view(model.single, m, start, ratio, b.side, 0.0)
    own = segment_of(b, start)
    return view, own, flight_of(view.mass, start, view, own)


@walls.travel_together.of(Several)
def _travel_together(model, segment, tau):
    _set_leaving(model, segment, TAIL)
    start = begin(model, segment)
    return advance(start.osc, start.primary, tau)[0]


@compiled
def _together(model, s, start, k):
    """The motion of the primary with all masses that chatter as mass `k` does."""
    bodies = s.bodies.copy()
    for j in range(len(bodies)):
        if j == k or _chatters_with(model, s.bodies, k, j):
            bodies[j, MODE], bodies[j, SLIP_DIRECTION] = TAIL, 0.0
    here = segment_of_all(s.periods, s.time, s.x, s.v, bodies)
    return begin_after(model, here, start.osc, start.load)


# --- masses that lose their speed with one another in no time
#
# Each is disturbed by the others' impacts. No chatter sequence is one by itself then, and speeds
# fall without end.


#: Acceleration, in units of F0/M, beyond which none is promised: weights are up to this.
_LARGEST = 1e6


@compiled
def is_brief(model: Several, speed: float) -> bool:
    """Whether accelerations may stop a speed in no time: asked before they are worked out."""
    return abs(speed) <= negligible(model.tolerance) * _LARGEST


@compiled
def close_together(model: Several, s: MassesSegment, start: Start) -> tuple[bool, float]:
    """Close what masses do with one another in no time, in place.

    Returned is whether they do so, and the change of the primary's velocity.
    """
    any_brief = False
    for k in range(len(s.bodies)):
        b = s.bodies[k]
        any_brief = any_brief or bool(b[CAUSE] == IMPACT and is_brief(model, b[SPEED]))
    if not any_brief:
        return False, 0.0
    fades = _fading(model, s)
    if not np.any(fades):
        return False, 0.0
    return True, _stop(model, s, start, fades)


@compiled
def _fading(model, s):
    """Masses of negligible speed after an impact of negligible speed, marked by 1.

    A wall may press a mass only as long as other masses rest, which each impact moves. No chatter
    sequence is one by itself then, and speeds fall without end in no time. The speeds left here are
    so small that the forces alone decide which masses rest.
    """
    bodies, longest = s.bodies, negligible(model.tolerance)
    fades = np.zeros(len(bodies))
    phase = phase_at(model.free.forcing, s.periods, s.time)
    largest = abs(motion_from(model.free, s.x, s.v, phase).a)
    for k in range(len(bodies)):
        m, b = mass_at(model, k), body_in(bodies, k)
        own = abs(own_acceleration(model.single, m, b, s.x, s.v, phase, 0.0))
        largest = max(largest, own + m.friction)
    slow = largest * longest
    if not _face(bodies, slow, longest):
        # On one wall a sequence completes by itself, and before speeds are as low as this. Where
        # friction lets others rest between its impacts, it may not complete.
        slow *= longest if np.any(model.masses[:, FRICTION] > 0.0) else 0.0
    any_hits = False
    for k in range(len(bodies)):
        m, b = mass_at(model, k), body_in(bodies, k)
        near = 2.0 * b.gap <= largest * longest * longest
        if b.mode == FLIGHT and abs(b.rate) <= slow and (near or m.friction > 0.0):
            fades[k] = 1.0
            bodies[k, GAP] = 0.0 if near else b.gap
            any_hits = any_hits or (b.cause == IMPACT and b.speed <= slow)
    return fades if any_hits else np.zeros(len(bodies))


@compiled
def _face(bodies, slow, longest):
    """Whether masses of negligible speed are at both walls."""
    at_left, at_right = False, False
    for k in range(len(bodies)):
        b = body_in(bodies, k)
        if b.mode == FLIGHT and abs(b.rate) <= slow and 2.0 * b.gap <= slow * longest:
            at_left, at_right = at_left or b.side < 0.0, at_right or b.side > 0.0
    return at_left and at_right


@compiled
def _stop(model, s, start, fades):
    """Take their speed from masses, in place; the change of the primary's velocity."""
    bodies = s.bodies
    change = change_by_rest(model, bodies, fades, start.joined)
    for k in range(len(bodies)):
        b = bodies[k]
        if fades[k] == 0.0:
            b[RATE] += b[SIDE] * change if b[MODE] == FLIGHT else 0.0
            continue
        if b[CAUSE] == IMPACT:
            # It is asked again at the end of the tail, which the others may have let go of.
            b[MODE], b[ACCUMULATION] = TAIL, -SHORTEST
        elif b[CAUSE] == RELEASE:
            b[MODE], b[CAUSE], b[SPEED] = STICKING, NOTHING, -b[RATE]
        elif b[CAUSE] == SLIP:
            b[MODE], b[CAUSE] = RESTING, NOTHING
        b[RATE], b[SLIP_DIRECTION] = 0.0, 0.0
    return change


@compiled
def change_by_rest(model: Several, bodies: np.ndarray, rests: np.ndarray, joined: float) -> float:
    """Change of the primary's velocity where masses come to rest on it, those marked by 1."""
    heavier, pushed = 1.0 + joined, 0.0
    for k in range(len(bodies)):
        ratio = float(rests[k] * model.masses[k, RATIO])
        heavier += ratio
        pushed += float(bodies[k, SIDE]) * ratio * float(bodies[k, RATE])
    return -pushed / heavier

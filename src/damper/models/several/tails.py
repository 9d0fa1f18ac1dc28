"""The closed rest of complete chatter sequences, of one mass among several."""

import math
from typing import Any, NamedTuple

import numpy as np

from damper.engine.bodies import WeightedSum, acceleration_of, start_point
from damper.engine.compiled import compiled
from damper.engine.dispatch import by_class
from damper.engine.oscillator import motion_from
from damper.engine.search import EventPoint, first_root
from damper.engine.segment import FLIGHT, IMPACT, NOTHING, RELEASE, STICKING, TAIL
from damper.models.flights import completes, gap_of, rests
from damper.models.rigid import ContactForce, force_point
from damper.models.several.bodies import (
    CAUSE,
    CLEARANCE,
    COMPLETION,
    GAP,
    GRAVITY,
    MODE,
    RATE,
    RATIO,
    SIDE,
    SPEED,
    WAY,
    NoFriction,
    Several,
    SeveralSegment,
    Start,
    begin,
    flight_of,
    flight_of_body,
    mass_of,
    primary_with,
    restitution_of,
    segment_of,
    view_of,
)
from damper.models.several.contacts import contact_forces
from damper.models.several.pinch import NOTHING_LEFT, SHORTEST

#: Acceleration, in units of F0/M, beyond which none is promised: weights are up to this.
_LARGEST = 1e6


class NextEvent(NamedTuple):
    """The first that happens to a body."""

    tau: float
    side: float
    """Of the search."""
    steps: int
    stops: bool
    """Whether it is that a slide stops."""


@by_class
def next_event(
    friction: Any,
    model: Several,
    s: SeveralSegment,
    start: Start,
    k: int,
    last: float,
    margin: float,
) -> NextEvent:
    """When a body arrives at a wall, or within a margin of it, or no longer rests; up to a time."""


@next_event.of(NoFriction)
def _next_event(friction, model, s, start, k, last, margin):
    b = s.bodies[k]
    if b[MODE] == STICKING:
        force = ContactForce(start.osc, mass_of(model, k, 0.0), start.primary, float(b[SIDE]))
        here = force_point(force, 0.0, 0.0, start.primary)
        if rests(here) or is_balanced(here, math.inf):
            # All hang at rest: what is left of a force that others' weights do not let vanish.
            return NextEvent(last, 0.0, 1, False)
        lifts_off = here.value == 0.0 and here.slope == 0.0 and here.second == 0.0
        root = first_root(force, here, math.inf, lifts_off, last, 0.0)
    else:
        seg, view, own = flight_of_body(model, s, start, k)
        g = gap_of(own, view, seg, 1.0)
        moving = WeightedSum(
            g.value - margin, g.slope, g.acceleration, g.longest, g.rate, g.coupling, g.terms
        )
        here = start_point(moving)
        lifts_off = seg.gap == 0.0 and seg.gap_rate == 0.0 and here.second == 0.0
        root = first_root(moving, here, 2.0 * (view.clearance - margin), lifts_off, last, 0.0)
    return NextEvent(root.point.tau + root.step, root.side, root.steps, False)


@compiled
def is_balanced(here: EventPoint, width: float) -> bool:
    """Whether all that holds a mass is just enough, and stays so."""
    least = min(abs(here.value), abs(width - here.value))
    largest = max(least, abs(here.slope), abs(here.second), abs(here.third))
    return here.growth == 0.0 and largest <= here.roundoff


@by_class
def close(friction: Any, model: Several, s: SeveralSegment) -> float:
    """Close the chatter sequences that complete before anything else happens; in place.

    A sequence that has less than the tolerance left is at its end whatever the others do: masses
    that chatter on one wall kick each other off it, and come to rest at one instant. Returned is
    the primary's velocity.
    """


@close.of(NoFriction)
def _close(friction, model, s):
    bodies = s.bodies
    start = begin(model, s)
    any_rests = False
    for k in range(len(bodies)):
        b = bodies[k]
        at_wall = b[MODE] == FLIGHT and b[GAP] == 0.0 and b[RATE] > 0.0
        if not at_wall or b[CAUSE] == NOTHING:
            continue
        ratio = _chattering_with(model, bodies, k)
        seg = segment_of(s, start, k)
        view = view_of(model, start, k, ratio, seg.side, 0.0)
        own = flight_of(view.mass, start, view, seg)
        far = start.primary.a - acceleration_of(view.mass, seg.x, s.v, start.primary.phase)
        brief = 2.0 * b[SPEED] <= NOTHING_LEFT * model.tolerance * abs(far)
        if b[CAUSE] == IMPACT and brief and _fade(model, s):
            return s.v
        left, error = completes(view, view.mass_ratio, seg, own)
        # The next bounce must turn before the other wall; a constant force lets it rise this high.
        r = restitution_of(model, k, seg.side)
        rise = 0.25 * seg.gap_rate * left * (1.0 - r)
        if not (error <= model.tolerance and rise <= view.clearance):
            continue
        if left <= NOTHING_LEFT * model.tolerance:
            any_rests = any_rests or not _meets_another(bodies, k, left)
        elif b[CAUSE] == IMPACT and _is_undisturbed(model, s, start, k, ratio, left, rise):
            for j in range(len(bodies)):
                if _chatters_with(model, bodies, k, j):
                    bodies[j, MODE] = TAIL
                    bodies[j, COMPLETION] = left
            return s.v
    return s.v + rest_together(model, s) if any_rests else s.v


@compiled
def _meets_another(bodies, k, left):
    """Whether a mass comes to the opposite wall before a sequence is over: it begins anew."""
    for j in range(len(bodies)):
        c = bodies[j]
        if c[MODE] == FLIGHT and c[SIDE] != bodies[k, SIDE] and c[GAP] < -c[RATE] * left:
            return True
    return False


@compiled
def _fade(model, s):
    """Close what masses at both walls do with one another in no time.

    Each impact of one disturbs the others, so no sequence is one of its own, and one that is
    elastic has none; all lose speed as long as one of them is not. They rest, or leave their walls
    at once, where the speed of each is that of a contact force in a hundredth of the accuracy.
    """
    bodies, longest = s.bodies, NOTHING_LEFT * model.tolerance
    count = len(bodies)
    slow = np.abs(bodies[:, RATE]) <= longest * _LARGEST
    inside = slow & (bodies[:, MODE] == FLIGHT) & (bodies[:, GAP] <= longest)
    last = count + 1
    forces = np.zeros(count)
    while np.sum(inside) < last:
        last = int(np.sum(inside))
        forces, _ = contact_forces(
            model, s, np.where(inside | (bodies[:, MODE] == STICKING), bodies[:, SIDE], 0.0)
        )
        forces = np.abs(forces)
        for k in range(count):
            b = bodies[k]
            brief = 2.0 * abs(b[RATE]) <= longest * forces[k]
            inside[k] = inside[k] and brief and b[GAP] <= longest * longest * forces[k]
    left, any_loses, walls = SHORTEST, False, 0.0
    for k in range(count):
        if inside[k]:
            walls += float(bodies[k, SIDE])
            left = max(left, 2.0 * abs(float(bodies[k, RATE])) / float(forces[k]))
            any_loses = any_loses or restitution_of(model, k, float(bodies[k, SIDE])) < 1.0
    if abs(walls) == last or not any_loses:
        return False
    for k in range(count):
        if inside[k]:
            bodies[k, MODE], bodies[k, COMPLETION] = TAIL, -left
    return True


@compiled
def rest_together(model: Several, s: SeveralSegment) -> float:
    """Let all rest at once that have nothing left, in place; the change of the primary's velocity.

    That takes speed from those which have just kicked others off their wall. It would from all that
    are left as well, so one that kicks others comes to rest with them even where it is elastic.
    """
    bodies = s.bodies
    for k in range(len(bodies)):
        b = bodies[k]
        if b[MODE] == FLIGHT and b[CAUSE] == RELEASE and b[RATE] == 0.0:
            # A kick that is none has released it.
            b[MODE], b[CAUSE], b[WAY] = STICKING, NOTHING, 0.0
    start = begin(model, s)
    rests = np.zeros(len(bodies))
    change, last = 0.0, -1.0
    while np.sum(rests) > last:
        last = float(np.sum(rests))
        heavier, pushed = 1.0 + start.joined, 0.0
        for k in range(len(bodies)):
            if has_nothing_left(model.friction, model, s, start, k, change):
                rests[k] = 1.0
            ratio = float(rests[k] * model.masses[k, RATIO])
            heavier += ratio
            pushed += float(bodies[k, SIDE]) * ratio * float(bodies[k, RATE])
        change = -pushed / heavier
    for k in range(len(bodies)):
        b = bodies[k]
        b[WAY] = 0.0 if rests[k] == 1.0 else b[WAY]
        if rests[k] == 1.0 and b[CAUSE] == RELEASE:
            b[MODE], b[CAUSE], b[SPEED], b[RATE] = STICKING, NOTHING, -b[RATE], 0.0
        elif rests[k] == 1.0:
            b[MODE], b[COMPLETION], b[RATE] = TAIL, 0.0, 0.0
        elif b[MODE] == FLIGHT:
            b[RATE] += b[SIDE] * change
    return change


@by_class
def has_nothing_left(
    friction: Any, model: Several, s: SeveralSegment, start: Start, k: int, change: float
) -> bool:
    """Whether a body that something has happened to on a wall will bounce there for no time.

    `change` is that of the primary's velocity by others which come to rest.
    """


@has_nothing_left.of(NoFriction)
def _has_nothing_left(friction, model, s, start, k, change):
    b = s.bodies[k]
    if not (b[MODE] == FLIGHT and b[GAP] == 0.0 and b[CAUSE] != NOTHING):
        return False
    side = float(b[SIDE])
    r, rate = restitution_of(model, k, side), float(b[RATE]) + side * change
    if change != 0.0 and b[CAUSE] == IMPACT:
        r = max(rate, 0.0) / float(b[SPEED])
    y = s.x + side * float(model.masses[k, CLEARANCE])
    own = acceleration_of(mass_of(model, k, 0.0), y, s.v, start.primary.phase)
    pressed = side * (own - start.primary.a)
    return 2.0 * abs(rate) <= NOTHING_LEFT * model.tolerance * pressed * (1.0 - r)


@compiled
def _chatters_with(model, bodies, k, j):
    """Whether two bodies chatter as one: what they do at a wall is the same number by number."""
    b, c = bodies[k], bodies[j]
    side = float(b[SIDE])
    return (
        c[CAUSE] == IMPACT
        and c[SIDE] == side
        and c[RATE] == b[RATE]
        and model.masses[j, GRAVITY] == model.masses[k, GRAVITY]
        and restitution_of(model, j, side) == restitution_of(model, k, side)
    )


@compiled
def _chattering_with(model, bodies, k):
    """Mass ratio of all that chatter as one with a body."""
    ratio = float(model.masses[k, RATIO])
    for j in range(len(bodies)):
        if j != k and _chatters_with(model, bodies, k, j):
            ratio += float(model.masses[j, RATIO])
    return ratio


@compiled
def _is_undisturbed(model, s, start, k, ratio, left, rise):
    """Whether nothing happens to any other body while the sequence of one completes."""
    bodies = s.bodies
    joined = start.joined + ratio
    side = float(bodies[k, SIDE])
    pull = ratio * float(model.masses[k, GRAVITY])
    for j in range(len(bodies)):
        if bodies[j, MODE] == STICKING:
            pull += float(model.masses[j, RATIO] * model.masses[j, GRAVITY])
    osc = primary_with(model, joined, pull)
    v = s.v - side * ratio / (1.0 + joined) * float(bodies[k, RATE])
    together = Start(osc, joined, motion_from(osc, s.x, v, start.primary.phase))
    # Bounces carry the primary this far from the centre, at most; twice that to be sure.
    margin = 2.0 * ratio / (1.0 + joined) * rise
    for j in range(len(bodies)):
        b = bodies[j]
        if j == k or _chatters_with(model, bodies, k, j):
            continue
        flies = b[MODE] == FLIGHT
        width = 2.0 * float(model.masses[j, CLEARANCE])
        near = flies and not margin < b[GAP] < width - margin
        if near or (b[MODE] == STICKING and b[SIDE] == side) or b[MODE] == TAIL:
            return False
        # Between impacts a contact force is what it is without the mass that bounces.
        moving = together if flies else start
        within = margin if flies else 0.0
        found = next_event(model.friction, model, s, moving, j, left, within)
        if found.side != 0.0 and found.tau <= left:
            return False
    return True

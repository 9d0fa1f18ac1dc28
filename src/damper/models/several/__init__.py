"""Several free masses in boxes of one primary; the walls are rigid.

They act on the primary alone. So each flies as the free mass of a rigid damper does, whose primary
carries those that stick just now: gaps, contact forces and accumulation times are asked of such a
damper (`view_of`). How many there are is no type: one code serves any number. Simultaneous contacts
are solved at once, as one problem of impulses and one of contact forces. docs/models.md.
"""

import math

import numpy as np

from damper.engine import model as declared
from damper.engine.compiled import compiled
from damper.engine.forcing import horizon
from damper.engine.lending import lent
from damper.engine.model import Step
from damper.engine.search import GAVE_UP, HORIZON
from damper.engine.segment import FLIGHT, NOTHING, STICK, STICKING, TAIL
from damper.engine.tuples import changed
from damper.models.friction import SLIP_DIRECTION, clamp_slides
from damper.models.many import (
    ACCUMULATION,
    CAUSE,
    FIRST,
    GAP,
    MODE,
    RATE,
    SIDE,
    MassesSegment,
    report_first,
    with_bodies,
)
from damper.models.several.bodies import (
    ALONE,
    ARRIVES,
    CLEARANCE,
    PLACE,
    PREVIOUS_STATE,
    REPORTED,
    VELOCITY,
    WIDTH,
    Several,
    begin_after,
    body_in,
    mass_at,
)
from damper.models.several.bodies import prepare as prepare
from damper.models.several.contacts import decide_contacts, hit, release
from damper.models.several.log import segment_of_all
from damper.models.several.motion import all_after, bounce_in
from damper.models.several.pinch import close_pinch, is_pinched, turns_of
from damper.models.several.tails import close, next_event
from damper.models.wall_laws import restitution_of
from damper.models.walls import slack

#: A time for which nothing has happened: none to speak of.
_KNOWN = 1e-300


@declared.initial_segment.of(Several)
def _initial_segment(model, periods, time, x, v, y, u):
    count = len(model.masses)
    bodies = np.zeros((count, WIDTH))
    for k in range(count):
        clearance = float(model.masses[k, CLEARANCE])
        place, speed = float(y[k]), float(u[k])
        side = 1.0 if place - x >= 0.0 else -1.0
        gap = clearance - side * (place - x)
        bodies[k, GAP] = 0.0 if gap <= slack(clearance, x, place) else gap
        bodies[k, RATE] = -side * (speed - v)
        bodies[k, SIDE] = side
        bodies[k, MODE] = FLIGHT
        bodies[k, CAUSE] = NOTHING
        bodies[k, PLACE], bodies[k, VELOCITY], bodies[k, ALONE] = place, speed, _KNOWN
    decide_contacts(model, segment_of_all(periods, time, x, v, bodies), STICKING)
    return report_first(model, segment_of_all(periods, time, x, v, bodies), 0.0)


@declared.mass_ratio_at.of(Several)
def _mass_ratio_at(model, periods, time):
    return model.mass_ratio


@declared.speeds_in_tail.of(Several)
def _speeds_in_tail(model, segment):
    bodies, k = segment.bodies, int(segment.body)
    for j in range(len(bodies)):
        if bodies[j, MODE] == TAIL and bodies[j, RATE] < 0.0:
            turns = turns_of(model, bodies, k, j)
            return -turns.next * float(bodies[j, RATE]), turns.speeds
    if bodies[k, MODE] != TAIL or bodies[k, RATE] == 0.0:
        return segment.gap_rate, restitution_of(mass_at(model, k), segment.side)
    bounce = bounce_in(model, segment, k)
    return segment.gap_rate * math.sqrt(bounce.back / bounce.out), bounce.shrinks


@declared.following.of(Several)
def _following(model, segment, start):
    # Whoever calls keeps these, so that nothing below counts references to them.
    m, s, count, tail = lent(model), lent(segment), len(segment.bodies), -1
    for k in range(count):
        if s.bodies[k, CAUSE] != NOTHING:
            new = report_first(model, with_bodies(s, s.bodies.copy()), 0.0)
            new.bodies[:, PREVIOUS_STATE] = REPORTED
            return Step(0.0, True, False, 1, new, start)
        if s.bodies[k, MODE] == TAIL:
            tail = k
    last, first, side, steps, gave_up, stops = _first_event(m, s, lent(start), tail)
    arrives, wall = -1, 0.0
    if first >= 0 and s.bodies[first, MODE] == FLIGHT and not stops:
        arrives, wall = first, side * float(s.bodies[first, SIDE])
    periods, time, x, v, owned = all_after(m, s, lent(start), last, arrives, wall)
    bodies, v_before, loss, hits = lent(owned), v, 0.0, False
    if tail >= 0:
        _end_tail(bodies)
    else:
        clamp_slides(bodies)
        for k in range(count):
            hits = hits or bool(bodies[k, ARRIVES] != 0.0)
    # A release at the instant of an impact: the impact and the forces after it decide.
    if first >= 0 and (stops or not hits):
        release(m, segment_of_all(periods, time, x, v, bodies), first, side)
    if hits:
        v, loss = hit(m, v, bodies)
    here, begun, begins = segment_of_all(periods, time, x, v, bodies), start, True
    if hits or stops or first < 0:
        decide_contacts(m, here, TAIL)
    while begins:
        # Again where chatter has been closed. One place: it becomes a part of this function.
        begun, begins = begin_after(model, here, begun.osc, begun.load), False
        if hits:
            v, closed = close(m, here, lent(begun))
            begins, hits = close_pinch(m, bodies) or closed, False
            here = segment_of_all(periods, time, x, v, bodies)
    for k in range(count):
        if tail >= 0:
            if s.bodies[k, MODE] == TAIL and bodies[k, MODE] == STICKING:
                bodies[k, CAUSE] = STICK
        elif bodies[k, CAUSE] != NOTHING:
            bodies[k, ALONE] = 0.0
    here = _after(segment_of_all(periods, time, x, v, owned), v_before)
    new = report_first(model, here, loss)
    return Step(last, tail >= 0 or new.cause != NOTHING, gave_up, steps, new, begun)


@compiled
def _first_event(model, s, start, tail):
    """The first event of all: when, whose, at which side of the search, evaluations, whether the
    search gave up, and whether a slide stops.

    The end of a tail is no mass's. Nor is the end of the time for which the force is smooth.
    """
    if tail >= 0:
        return abs(float(s.bodies[tail, ACCUMULATION])), -1, 0.0, 1, False, False
    limit = min(HORIZON, horizon(start.osc.forcing, start.primary.phase))
    last, first, side, steps, gave_up, stops = limit, -1, 0.0, 1, False, False
    # The mass that seems to be the first at a wall is searched first. The other masses are searched
    # up to its event alone: most of these searches find no event.
    count, soonest = len(s.bodies), _soonest(model, s.bodies)
    for j in range(count):
        k = soonest + j if soonest + j < count else soonest + j - count
        m, b = mass_at(model, k), body_in(s.bodies, k)
        found = next_event(model.friction, model.single, m, b, start, last, 0.0, 0.0)
        steps += found.steps
        gave_up = gave_up or found.side == GAVE_UP
        if found.side == GAVE_UP and found.tau < last:
            # Up to there nothing happens to this one; beyond it, nobody knows.
            last, first = found.tau, -1
        elif abs(found.side) == 1.0 and found.tau <= last and (first < 0 or found.tau < last):
            last, first, side, stops = found.tau, k, found.side, found.stops
    return last, first, side, steps, gave_up, stops


@compiled
def _soonest(model, bodies):
    """Number of the mass that would be the first at a wall if the rates stayed as they are."""
    first, least = 0, math.inf
    for k in range(len(bodies)):
        gap, rate = float(bodies[k, GAP]), float(bodies[k, RATE])
        way = -gap if rate < 0.0 else 2.0 * float(model.masses[k, CLEARANCE]) - gap
        if rate != 0.0 and way / rate < least:
            first, least = k, way / rate
    return first


@compiled
def _end_tail(bodies):
    """The end of a tail: its masses stick, unless a pinch leaves them without pressing force."""
    # Slides that have turned round since may let go of what rests.
    pinched = is_pinched(bodies) or np.any(bodies[:, SLIP_DIRECTION] != 0.0)
    for k in range(len(bodies)):
        b = bodies[k]
        if b[MODE] == TAIL:
            b[MODE], b[CAUSE] = STICKING, NOTHING if pinched else STICK
            b[GAP], b[RATE], b[FIRST], b[ACCUMULATION], b[SLIP_DIRECTION] = 0.0, 0.0, 0.0, 0.0, 0.0


_after = changed(MassesSegment, "v_before")


# Deviations and sensitivities are a part of this model that needs all of the above.
from damper.models.several import tangent  # noqa: E402, F401

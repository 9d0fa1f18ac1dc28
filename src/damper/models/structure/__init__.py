"""Free masses in boxes anywhere on a structure of several degrees of freedom; the walls are rigid.

The structure is seen by its modes. Masses that stick to it make it another structure, with modes
of its own, and a mass that is tied to its box flies as a part of it. Simultaneous contacts are
solved at once, as one problem of impulses and one of contact forces. docs/models.md.
"""

import math

import numpy as np

from damper.engine import model as declared
from damper.engine.compiled import compiled, compiled_apart
from damper.engine.forcing import horizon, turn_over, turned
from damper.engine.lending import lent
from damper.engine.model import Step
from damper.engine.search import GAVE_UP, HORIZON
from damper.engine.segment import (
    FLIGHT,
    NOTHING,
    RELEASE,
    RESTING,
    SLIP,
    STICK,
    STICKING,
    TAIL,
)
from damper.models.flights import STOPS
from damper.models.friction import SLIP_DIRECTION, clamp_slides, known_friction
from damper.models.many import (
    ACCUMULATION,
    CAUSE,
    FIRST,
    GAP,
    LIFTS,
    MODE,
    RATE,
    SIDE,
    report_first,
    with_bodies,
)
from damper.models.structure.constants import (
    ARRIVES,
    BEFORE,
    DISPLACEMENT,
    PREVIOUS,
    VELOCITY,
    WEIGHTS,
    WIDTH,
    OnStructure,
    box_at,
    first_row,
    friction_of,
    mass_in,
    size_of,
)
from damper.models.structure.contacts import decide_contacts, hit
from damper.models.structure.courses import (
    course_of,
    next_event,
    point_here,
    slide_of,
    slide_point,
)
from damper.models.structure.flow import ModalStart, begin, begin_after
from damper.models.structure.log import segment_of_all
from damper.models.structure.motion import all_after, bounce_in
from damper.models.structure.prepare import prepare as prepare
from damper.models.structure.tails import close
from damper.models.walls import TOUCHES, slack


@declared.initial_segment.of(OnStructure)
def _initial_segment(model, periods, time, x, v, y, u):
    count, n = len(model.masses), size_of(model)
    bodies, modes = np.zeros((count, WIDTH)), np.zeros((3, n))
    first = first_row(model.table, 2)
    for i in range(n):
        for j in range(n):
            modes[DISPLACEMENT, i] += model.table[first + i, j] * x[j]
            modes[VELOCITY, i] += model.table[first + i, j] * v[j]
        modes[BEFORE, i] = modes[VELOCITY, i]
    here = segment_of_all(periods, time, modes, bodies)
    for k in range(count):
        clearance = mass_in(model.masses, k).clearance
        box = box_at(model, here, DISPLACEMENT, k)
        side = 1.0 if y[k] >= box else -1.0
        gap = clearance - side * (y[k] - box)
        b = bodies[k]
        b[GAP] = 0.0 if gap <= slack(clearance, box, float(y[k])) else gap
        b[RATE] = -side * (u[k] - box_at(model, here, VELOCITY, k))
        bound = b[GAP] == 0.0 or friction_of(model, k) > 0.0
        if bound and abs(b[RATE]) <= 4.0 * TOUCHES * _size_of_rate(model, here, k):
            b[RATE] = 0.0
        b[SIDE], b[MODE], b[CAUSE] = side, FLIGHT, NOTHING
    decide_contacts(model, here, STICKING)
    return report_first(model, here, 0.0)


@compiled
def _size_of_rate(model, s, k):
    """Size of the terms of a box's velocity."""
    found = 0.0
    for i in range(size_of(model)):
        found += abs(model.table[WEIGHTS + k, i] * s.modes[VELOCITY, i])
    return found


@declared.mass_ratio_at.of(OnStructure)
def _mass_ratio_at(model, periods, time):
    return model.mass_ratio


@declared.begin.of(OnStructure)
def _begin(model, segment):
    # A mass flies or moves with its box; where it rubs, it slides one way or the other.
    states = 3 if known_friction(model.friction, 1.0) > 0.0 else 2
    return begin(model, segment, states ** min(len(model.masses), 3))


@declared.speeds_in_tail.of(OnStructure)
def _speeds_in_tail(model, segment):
    bounce = bounce_in(model, segment.bodies, int(segment.body))
    return segment.gap_rate * math.sqrt(bounce.back / bounce.out), bounce.shrinks


@declared.following.of(OnStructure)
def _following(model, segment, start):
    # Whoever calls keeps these, so that nothing below counts references to them.
    m, s, begun = lent(model), lent(segment), lent(start)
    count, tail = len(s.bodies), len(s.bodies)
    for k in range(count):
        if s.bodies[k, CAUSE] != NOTHING:
            again = with_bodies(segment, s.bodies.copy())
            return Step(0.0, True, False, 1, report_first(m, again, 0.0), start)
        if s.bodies[k, MODE] == TAIL:
            tail = k
    last, first, wall, steps, gave_up, stops = _first_event(m, s, begun, tail)
    flies = first < count and s.bodies[first, MODE] == FLIGHT and not stops
    here = all_after(m, s, begun, last, first if flies else count, wall)
    now, loss, hits = lent(here), 0.0, False
    if known_friction(m.friction, 1.0) > 0.0:
        clamp_slides(now.bodies)
    for k in range(count):
        hits = hits or now.bodies[k, ARRIVES] != 0.0
    if tail < count:
        _complete(m, now)
    else:
        # A release at the instant of an impact: the impact and the forces after it decide.
        if first < count and (stops or not hits):
            _release(m, s.bodies, now, begun, last, first, wall)
        if hits:
            loss = hit(m, now)
    if tail == count and (hits or stops or first == count):
        decide_contacts(m, now, TAIL)
    begins = True
    while begins:
        # Again where chatter has been closed. One place: it becomes a part of this function.
        later = begin_after(m, now, begun)
        begins, hits = hits and close(m, now, lent(later)), False
    new = report_first(m, here, loss)
    is_event = new.cause != NOTHING
    kept = ModalStart(later.modes, later.slot, start.tables, start.steps, later.phase)
    return Step(last, is_event, gave_up, steps, new, kept)


@compiled
def _first_event(model, s, start, tail):
    """The first event of all: when, whose, at which wall, evaluations, whether that is all known,
    and whether a slide stops.

    The end of a tail is no mass's. Nor is the end of the time for which the force is smooth.
    """
    count = len(s.bodies)
    if tail < count:
        return float(s.bodies[tail, ACCUMULATION]), count, 0.0, 1, False, False
    last, first, wall = min(HORIZON, horizon(model.forcing, start.phase)), count, 0.0
    stops = False
    steps, gave_up = 1, False
    for k in range(count):
        tau, found, taken = next_event(model, s.bodies, start, k, last, 0.0, 0.0)
        steps += taken
        gave_up = gave_up or found == GAVE_UP
        if found == GAVE_UP and tau < last:
            last, first, stops = tau, count, False
        elif found not in (0.0, GAVE_UP) and tau <= last and (first == count or tau < last):
            last, first, wall = tau, k, found * float(s.bodies[k, SIDE])
            stops = found == STOPS
    return last, first, wall, steps, gave_up, stops


@compiled_apart
def _complete(model, s):
    """The end of a tail: its masses stick, in place."""
    bodies = s.bodies
    for k in range(len(bodies)):
        if bodies[k, MODE] == TAIL:
            bodies[k, MODE], bodies[k, CAUSE] = STICKING, NOTHING
            for column in (GAP, RATE, FIRST, ACCUMULATION):
                bodies[k, column] = 0.0
    decide_contacts(model, s, TAIL)
    for k in range(len(bodies)):
        if bodies[k, PREVIOUS] == TAIL and bodies[k, MODE] == STICKING:
            bodies[k, CAUSE] = STICK


@compiled_apart
def _release(model, bodies, s, start, tau, first, wall):
    """Let masses that nothing holds any longer part from their boxes, or stop; in place.

    `bodies` are those before the time tau, with their motion from `start`. The mass
    `first` parts away from a wall, or its slide stops. A mass whose force or speed vanishes at the
    same time parts or stops with it.
    """
    phase = turned(model.forcing, start.phase, turn_over(model.forcing, tau))
    stops = bodies[first, MODE] == FLIGHT
    for k in range(len(bodies)):
        b, way = s.bodies[k], -wall
        joined = b[MODE] in (STICKING, RESTING)
        if joined == stops or (stops and b[SLIP_DIRECTION] == 0.0):
            continue
        leaves = k == first
        if not leaves:
            course = course_of(model, bodies, start, k)
            slide = slide_of(course, bodies)
            force = point_here(slide.course if stops else course, phase, tau)
            if stops:
                force = slide_point(slide, force)
            way = -b[SIDE]
            leaves = force.value <= 4.0 * force.roundoff and force.slope < 0.0
            if b[MODE] == RESTING and force.slope > 0.0:
                way, room = b[SIDE], 2.0 * friction_of(model, k) - force.value
                leaves = room <= 4.0 * force.roundoff
        if leaves and stops:
            b[RATE] = 0.0
        elif leaves:
            b[CAUSE] = RELEASE if b[MODE] == STICKING else SLIP
            b[FIRST] = 0.0 if b[MODE] == STICKING else b[FIRST]
            b[SLIP_DIRECTION] = way if friction_of(model, k) > 0.0 else 0.0
            b[MODE], b[ACCUMULATION] = FLIGHT, LIFTS


from damper.models.structure import tangent  # noqa: E402, F401

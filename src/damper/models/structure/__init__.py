"""Free masses in boxes anywhere on a structure of several degrees of freedom; the walls are rigid.

The structure is seen by its modes. Masses that stick to it make it another structure, with modes
of its own, and a mass that is tied to its box flies as a part of it. Simultaneous contacts are
solved at once, as one problem of impulses and one of contact forces. docs/models.md.
"""

import numpy as np

from damper.engine import model as declared
from damper.engine.compiled import compiled, compiled_apart
from damper.engine.forcing import horizon
from damper.engine.impact import restitution_at
from damper.engine.lending import lent
from damper.engine.model import Step
from damper.engine.search import GAVE_UP, HORIZON
from damper.engine.segment import FLIGHT, NOTHING, RELEASE, STICK, STICKING, TAIL
from damper.models.structure.constants import (
    ACCUMULATION,
    ARRIVES,
    BEFORE,
    CAUSE,
    DISPLACEMENT,
    FIRST,
    GAP,
    MODE,
    RATE,
    SIDE,
    VELOCITY,
    WEIGHTS,
    WIDTH,
    OnStructure,
    box_at,
    first_row,
    law_of,
    mass_in,
    size_of,
)
from damper.models.structure.contacts import decide_contacts, hit
from damper.models.structure.courses import LIFTS, course_of, course_point, next_event
from damper.models.structure.flow import ModalStart, begin, begin_after
from damper.models.structure.log import report_first, segment_of_all
from damper.models.structure.motion import all_after
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
        if b[GAP] == 0.0 and abs(b[RATE]) <= 4.0 * TOUCHES * _size_of_rate(model, here, k):
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
    return begin(model, segment, 1 << len(model.masses))


@declared.speeds_in_tail.of(OnStructure)
def _speeds_in_tail(model, segment):
    m = mass_in(model.masses, int(segment.body))
    return segment.gap_rate, restitution_at(law_of(model, m, segment.side), 0.0)


@declared.following.of(OnStructure)
def _following(model, segment, start):
    # Whoever calls keeps these, so that nothing below counts references to them.
    m, s, begun = lent(model), lent(segment), lent(start)
    count = len(s.bodies)
    tail = count
    for k in range(count):
        if s.bodies[k, CAUSE] != NOTHING:
            again = segment_of_all(s.periods, s.time, segment.modes, s.bodies.copy())
            return Step(0.0, True, False, 1, report_first(m, again, 0.0), start)
        if s.bodies[k, MODE] == TAIL:
            tail = k
    step = _complete(m, s, begun, tail) if tail < count else _fly(m, s, begun)
    now = lent(step)
    new = ModalStart(step.start.modes, now.start.slot, start.tables, start.steps, now.start.phase)
    return Step(now.duration, now.is_event, now.gave_up, now.steps, step.next, new)


@compiled_apart
def _complete(model, s, start, tail):
    """The end of a tail: its masses stick."""
    tau = float(s.bodies[tail, ACCUMULATION])
    here = all_after(model, s, start, tau, len(s.bodies), 0.0)
    now = lent(here)
    for k in range(len(now.bodies)):
        if now.bodies[k, MODE] == TAIL:
            now.bodies[k, MODE], now.bodies[k, CAUSE] = STICKING, NOTHING
            for column in (GAP, RATE, FIRST, ACCUMULATION):
                now.bodies[k, column] = 0.0
    decide_contacts(model, now, TAIL)
    for k in range(len(now.bodies)):
        if s.bodies[k, MODE] == TAIL and now.bodies[k, MODE] == STICKING:
            now.bodies[k, CAUSE] = STICK
    begun = begin_after(model, now, start)
    return Step(tau, True, False, 1, report_first(model, here, 0.0), begun)


@compiled_apart
def _fly(model, s, start):
    """Go to the first event of all."""
    count = len(s.bodies)
    limit = min(HORIZON, horizon(model.forcing, start.phase))
    last, first, side, steps, gave_up = limit, count, 0.0, 1, False
    for k in range(count):
        tau, found, taken = next_event(model, s.bodies, start, k, last, 0.0)
        steps += taken
        gave_up = gave_up or found == GAVE_UP
        if found == GAVE_UP and tau < last:
            last, first = tau, count
        elif abs(found) == 1.0 and tau <= last and (first == count or tau < last):
            last, first, side = tau, k, found
    flies = first < count and s.bodies[first, MODE] == FLIGHT
    wall = side * float(s.bodies[first, SIDE]) if flies else 0.0
    here, hits = all_after(model, s, start, last, first if flies else count, wall), False
    now, loss = lent(here), 0.0
    for k in range(count):
        hits = hits or now.bodies[k, ARRIVES] != 0.0
    if hits:
        loss = hit(model, now)
    elif first < count:
        # At the instant of an impact that and the forces after it decide.
        _release(model, now, start, last, first)
    if hits or first == count:
        decide_contacts(model, now, TAIL)
    begun = begin_after(model, now, start)
    if hits and close(model, now, lent(begun)):
        begun = begin_after(model, now, start)
    new = report_first(model, here, loss)
    return Step(last, new.cause != NOTHING, gave_up, steps, new, begun)


@compiled_apart
def _release(model, s, start, tau, first):
    """Let masses part from the walls that press them no longer, in place."""
    for k in range(len(s.bodies)):
        b = s.bodies[k]
        if b[MODE] != STICKING:
            continue
        leaves = k == first
        if not leaves:
            force = course_point(course_of(model, s.bodies, start, k), tau)
            leaves = force.value <= 4.0 * force.roundoff and force.slope < 0.0
        if leaves:
            b[MODE], b[CAUSE], b[ACCUMULATION], b[FIRST] = FLIGHT, RELEASE, LIFTS, 0.0


from damper.models.structure import tangent  # noqa: E402, F401

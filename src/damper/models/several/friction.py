"""Dry friction of several free masses: the end of a slide, and masses that come to rest.

All masses at rest, on a wall or off it, have the primary's acceleration a. The force of a mass on
the primary is a monotone function of a: the force of inertia as long as friction and wall hold the
mass, and the largest friction beyond that. So there is one a, and one set of masses at rest.
"""

import numpy as np

from damper.engine.compiled import compiled
from damper.engine.forcing import phase_at
from damper.engine.oscillator import motion_from
from damper.engine.search import GAVE_UP
from damper.engine.segment import (
    FLIGHT,
    IMPACT,
    NOTHING,
    RELEASE,
    RESTING,
    SLIP,
    STICKING,
    TAIL,
)
from damper.models.flights import gap_of
from damper.models.masses.holds import first_stop
from damper.models.several.bodies import (
    CAUSE,
    COMPLETION,
    GAP,
    MODE,
    RATE,
    SIDE,
    SLIP_DIRECTION,
    SPEED,
    Frictions,
    body_in,
    mass_at,
    own_acceleration,
)
from damper.models.several.contacts import decide_contacts, negligible
from damper.models.several.log import segment_of_all
from damper.models.several.pinch import SHORTEST
from damper.models.several.tails import (
    NextEvent,
    change_by_rest,
    close_at_both_walls,
    decide_again,
    ends_now,
    is_negligible,
    less,
    slide_end,
)

# --- what happens next


@slide_end.of(Frictions)
def _slide_end(friction, own, view, segment, way, last, slowest):
    if way == 0.0:
        return NextEvent(last, 0.0, 0, False)
    gap = gap_of(own, view, segment, -way * segment.side)
    stop = first_stop(less(gap, 0.0, slowest), last)
    if stop.tau <= last:
        return NextEvent(stop.tau, 1.0, stop.steps, True)
    return NextEvent(last, GAVE_UP if stop.gave_up else 0.0, stop.steps, False)


# --- chatter


@close_at_both_walls.of(Frictions)
def _fade(friction, model, s, start):
    fades = _fading(model, s)
    if not np.any(fades):
        return False, 0.0
    return True, _stop(model, s, start, fades)


@decide_again.of(Frictions)
def _settle_again(friction, model, s, v):
    # Slides may have turned round.
    decide_contacts(model, segment_of_all(s.periods, s.time, s.x, v, s.bodies), TAIL)


@ends_now.of(Frictions)
def _is_over(friction, model, s, start, k, chatter):
    return is_negligible(model, s, start, k, 0.0)


@compiled
def _fading(model, s):
    """Masses of negligible speed after an impact of negligible speed, marked by 1.

    A wall may press a mass only as long as other masses rest, which each impact moves. No chatter
    sequence is one by itself then, and speeds fall without end in no time. The speeds left here are
    so small that the forces alone decide which masses rest.
    """
    bodies = s.bodies
    fades = np.zeros(len(bodies))
    phase = phase_at(model.free.forcing, s.periods, s.time)
    a = abs(motion_from(model.free, s.x, s.v, phase).a)
    any_hits = False
    for k in range(len(bodies)):
        m, b = mass_at(model, k), body_in(bodies, k)
        own = abs(own_acceleration(model.single, m, b, s.x, s.v, phase, 0.0))
        least = (a + own + m.friction) * negligible(model.tolerance) ** 2
        near = 2.0 * b.gap <= least
        if b.mode == FLIGHT and abs(b.rate) <= least and (near or m.friction > 0.0):
            fades[k] = 1.0
            bodies[k, GAP] = 0.0 if near else b.gap
            any_hits = any_hits or (b.cause == IMPACT and b.speed <= least)
    return fades if any_hits else np.zeros(len(bodies))


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
            b[MODE], b[COMPLETION] = TAIL, -SHORTEST
        elif b[CAUSE] == RELEASE:
            b[MODE], b[CAUSE], b[SPEED] = STICKING, NOTHING, -b[RATE]
        elif b[CAUSE] == SLIP:
            b[MODE], b[CAUSE] = RESTING, NOTHING
        b[RATE], b[SLIP_DIRECTION] = 0.0, 0.0
    return change

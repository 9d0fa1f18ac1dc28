"""The closed rest of complete chatter sequences in boxes of a structure."""

import math
from typing import NamedTuple

import numpy as np

from damper.engine.accumulation import accumulation, accumulation_rubbing
from damper.engine.compiled import compiled, compiled_apart
from damper.engine.dispatch import by_class
from damper.engine.forcing import bound_of, horizon
from damper.engine.impact import restitution_at
from damper.engine.search import ROUNDOFF
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
from damper.models import walls
from damper.models.friction import SLIP_DIRECTION, Frictions, NoFriction
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
    with_bodies,
)
from damper.models.structure.constants import (
    ARRIVES,
    COUPLED,
    DAMPING,
    DASHPOTS,
    DISPLACEMENT,
    DRAGS,
    EASED,
    FALLS,
    HEAD,
    LEAST,
    PUSH,
    STIFFENS,
    STIFFNESS,
    VELOCITY,
    WEIGHTS,
    YIELDS,
    OnStructure,
    box_at,
    first_row,
    friction_of,
    mass_in,
    size_in,
    size_of,
)
from damper.models.structure.contacts import decide_contacts, impulses_of, rebound, settle
from damper.models.structure.courses import next_event
from damper.models.structure.flow import (
    ModalStart,
    begin,
    begin_after,
    compliance,
    give,
    impulses_to_rest,
    joined_in,
)
from damper.models.structure.motion import all_after
from damper.models.structure.steps import A, J
from damper.models.wall_laws import have_one_law, law_of

#: Speed over a time that counts as none, beyond which a mass is not at rest.
_SLOW = 1e6
#: Part of two masses' own share below which what one's impact does to the other is roundoff.
_NO_COUPLING = 1e-12


class StructureChatter(NamedTuple):
    """Rest of a chatter sequence."""

    left: float
    """Time to the accumulation point; infinite where none is known well enough."""
    rise: float
    """Height of the bounces, at most."""
    eased: float
    """Pressing acceleration on the way back of a bounce over that on the way out."""
    force: float
    jerk: float
    damping: float
    error: float
    """As those of `damper.models.walls.ChatterAhead`."""


@compiled
def close(model: OnStructure, s: MassesSegment, start: ModalStart) -> bool:
    """Close a chatter sequence that completes before anything else happens; whether one is closed.

    In place. A sequence whose time left is negligible ends now, even if other masses move: where
    impacts kick other masses off their walls, all come to rest at once.
    """
    bodies, longest = s.bodies, negligible(model.tolerance)
    closes = False
    if may_collapse(bodies, longest):
        rests = collapsing(model, bodies)
        for k in range(len(bodies)):
            closes = closes or bool(rests[k])
        if closes:
            _rest(model, s, rests)
    if not closes:
        closes = _fade(model.friction, model, s, start)
    if not closes:
        for k in range(len(bodies)):
            closes = closes or _may_end(model, bodies, start, k)
        closes = closes and _close_one(model, s, start)
    if closes:
        _decide_again(model.friction, model, s)
    return closes


@by_class
def _decide_again(friction, model, s):
    """Let slides turn round where a mass that came to rest has moved their boxes."""


@_decide_again.of(NoFriction)
def _no_slides(friction, model, s):
    pass


@_decide_again.of(Frictions)
def _decide_slides(friction, model, s):
    decide_contacts(model, s, TAIL)


@compiled_apart
def _close_one(model, s, start):
    bodies, longest = s.bodies, negligible(model.tolerance)
    any_rests, rests = False, np.zeros(len(bodies), dtype=np.bool_)
    for k in range(len(bodies)):
        if not _may_end(model, bodies, start, k):
            continue
        chatter = _chatter_of(model, s, start, k)
        if chatter.left <= longest or _is_braked(model, bodies, start, k):
            any_rests, rests[k] = True, True
        elif bodies[k, CAUSE] == IMPACT and _is_undisturbed(model, s, start, k, chatter):
            for j in range(len(bodies)):
                if j == k or _in_step(model, bodies, k, j):
                    bodies[j, MODE], bodies[j, ACCUMULATION] = TAIL, chatter.left
                    bodies[j, SLIP_DIRECTION], bodies[j, EASED] = 0.0, chatter.eased
            return True
    if any_rests:
        _rest(model, s, rests)
    return any_rests


@compiled
def _bend(bodies, start, k):
    """Second and third derivative of the gap of a mass, and a part of the size of the fourth."""
    table, side = start.tables[start.slot], float(bodies[k, SIDE])
    bent, jerk, snap = side * float(table[FALLS, k]), 0.0, 0.0
    for i in range(size_in(table)):
        weight = side * float(table[WEIGHTS + k, i])
        bent += weight * start.modes[A, i]
        jerk += weight * start.modes[J, i]
        snap += abs(weight * table[STIFFNESS, i] * start.modes[A, i])
    return bent, jerk, snap


@compiled
def _is_braked(model, bodies, start, k):
    """Whether a mass that bounces in no time loses its speed to one that is less elastic."""
    longest, own, found = negligible(model.tolerance), give(model, bodies, k, k), False
    if 2.0 * bodies[k, RATE] > longest * -_bend(bodies, start, k)[0]:
        return False
    for j in range(len(bodies)):
        c = bodies[j]
        near = c[MODE] == FLIGHT and c[GAP] <= longest and abs(c[RATE]) <= _SLOW * longest
        loses = restitution_at(law_of(model, mass_in(model.masses, j), float(c[SIDE])), 0.0) < 1.0
        size = math.sqrt(give(model, bodies, j, j) * own)
        bound = abs(give(model, bodies, j, k)) > _NO_COUPLING * size
        found = found or bool(j != k and near and loses and bound)
    return found


@compiled
def _may_end(model, bodies, start, k):
    """Whether a mass has left its wall just now for a brief bounce: asked before what takes time.

    All bounces take at least twice its speed over its acceleration. The acceleration must hardly
    change in this time: less than `damper.engine.accumulation.accumulation` asks for.
    """
    b = bodies[k]
    if b[MODE] != FLIGHT or b[GAP] != 0.0 or b[CAUSE] == NOTHING or not b[RATE] > 0.0:
        return False
    bent, jerk, snap = _bend(bodies, start, k)
    if not (bent < 0.0 and abs(jerk) * b[RATE] < bent * bent):
        return False
    least = 2.0 * float(b[RATE]) / -bent
    change = abs(jerk) / -bent * least
    error = least * (change * change + snap / -bent * least * least)
    small = change < 0.5 and error <= 1.1 * model.tolerance
    return bool(small or least <= negligible(model.tolerance))


@by_class
def _fade(friction, model, s, start):
    """Let masses rest at once whose speeds fall without end, in place; whether there are any.

    A wall may press a mass only as long as friction holds others, which each impact moves. No
    chatter sequence is one by itself then. Speeds far below those of the last bounces of a sequence
    are none, and the forces alone decide who rests.
    """


@_fade.of(NoFriction)
def _never_fade(friction, model, s, start):
    return False


@_fade.of(Frictions)
def _fade_rubbing(friction, model, s, start):
    return _fading(model, s, start)


@compiled_apart
def _fading(model, s, start):
    bodies, table, longest = s.bodies, start.tables[start.slot], negligible(model.tolerance)
    largest, any_fades, fades = 0.0, False, np.zeros(len(bodies), dtype=np.bool_)
    for k in range(len(bodies)):
        size = abs(float(table[FALLS, k])) + friction_of(model, k)
        for i in range(size_in(table)):
            size += abs(float(table[WEIGHTS + k, i] * start.modes[A, i]))
        largest = max(largest, size)
    slow = largest * longest * longest
    for k in range(len(bodies)):
        b = bodies[k]
        near = 2.0 * b[GAP] <= slow
        held = near or friction_of(model, k) > 0.0
        fades[k] = b[MODE] == FLIGHT and abs(b[RATE]) <= slow and held
        any_fades = any_fades or bool(fades[k] and b[CAUSE] == IMPACT and b[SPEED] <= slow)
    if any_fades:
        joined = joined_in(bodies)
        for k in range(len(bodies)):
            b = bodies[k]
            joined[k] = joined[k] or fades[k]
            if fades[k] and 2.0 * b[GAP] > slow:
                fades[k] = False
                if b[CAUSE] == SLIP:
                    b[MODE], b[CAUSE] = RESTING, NOTHING
        _join(model, s, fades, joined)
    return any_fades


@compiled_apart
def _rest(model, s, rests):
    """Let masses come to rest on their walls, in place; those that were kicked off are back."""
    joined = rests.copy()
    for k in range(len(rests)):
        joined[k] = rests[k] or s.bodies[k, MODE] == STICKING
    _join(model, s, rests, joined)


@compiled_apart
def _join(model, s, rests, joined):
    """As `_rest`, with all masses that move with their boxes then."""
    settle(model, s, impulses_to_rest(model, s.bodies, joined))
    for k in range(len(s.bodies)):
        b = s.bodies[k]
        if joined[k]:
            b[RATE], b[SLIP_DIRECTION] = 0.0, 0.0
        if rests[k] and b[CAUSE] == RELEASE:
            b[MODE], b[CAUSE], b[ACCUMULATION] = STICKING, NOTHING, 0.0
        elif rests[k]:
            b[MODE], b[ACCUMULATION], b[GAP] = TAIL, 0.0, 0.0


@compiled_apart
def _in_step(model, bodies, k, j):
    """Whether a mass bounces in step with another: their gaps are the same, number by number."""
    b, c = bodies[k], bodies[j]
    if not (c[CAUSE] == IMPACT and c[SIDE] == b[SIDE] and c[RATE] == b[RATE]):
        return False
    one, other = mass_in(model.masses, k), mass_in(model.masses, j)
    pulled = one.gravity == other.gravity and one.carried == other.carried
    pulled = pulled and one.friction == other.friction
    stiff = one.tie_stiffness * other.mass == other.tie_stiffness * one.mass
    tied = stiff and one.tie_damping * other.mass == other.tie_damping * one.mass
    placed = one.tie_stiffness == 0.0 or one.clearance == other.clearance
    alike = pulled and tied and placed and have_one_law(one, other, float(b[SIDE]))
    for i in range(size_of(model)):
        alike = alike and model.table[WEIGHTS + k, i] == model.table[WEIGHTS + j, i]
    return alike


@compiled_apart
def _yield_of(model, s, start, k):
    """Change of a gap's rate by an impulse that all masses in step with it share."""
    own = 1.0 / mass_in(model.masses, k).mass
    return float(start.tables[start.slot, YIELDS, k]) - own + 1.0 / _total_of(model, s, k)


@compiled_apart
def _total_of(model, s, k):
    """Mass of all that are in step with a mass, itself among them."""
    total = 0.0
    for j in range(len(s.bodies)):
        if j == k or _in_step(model, s.bodies, k, j):
            total += mass_in(model.masses, j).mass
    return total


@compiled_apart
def _chatter_of(model, s, start, k):
    """Rest of the chatter sequence of a mass, and of those in step with it."""
    b, m, table = s.bodies[k], mass_in(model.masses, k), start.tables[start.slot]
    law, size, drag = law_of(model, m, float(b[SIDE])), size_in(table), first_row(table, 0)
    bent, jerk, _ = _bend(s.bodies, start, k)
    shared, snap, bound = _yield_of(model, s, start, k), 0.0, bound_of(model.forcing, 2)
    for i in range(size):
        terms = table[PUSH, i] * bound + table[STIFFNESS, i] * abs(start.modes[A, i])
        if table[HEAD, COUPLED] != 0.0:
            for j in range(size):
                terms += abs(table[drag + i, j] * start.modes[J, j])
        else:
            terms += 2.0 * table[DAMPING, i] * abs(start.modes[J, i])
        snap += abs(table[WEIGHTS + k, i]) * terms
    # Each impact moves the fast modes more than the slowest one does.
    snap += abs(bent) * (float(table[STIFFENS, k]) / shared + float(table[HEAD, LEAST]))
    damping, dashpots = 0.5 * float(table[DRAGS, k]) / shared, float(table[DASHPOTS, k])
    friction, rises = friction_of(model, k), 1.0
    eased = 1.0 - 2.0 * friction * shared * _total_of(model, s, k) / -bent
    if friction == 0.0:
        left, error = accumulation(law, damping, dashpots, snap, -bent, jerk, float(b[RATE]))
        rises -= restitution_at(law, 0.0)
    else:
        drag = 2.0 * damping
        change = abs(jerk) - drag * bent * (1.0 - eased)
        left, error = accumulation_rubbing(
            law, -bent, -bent * eased, change, 2.0 * drag, snap, float(b[RATE])
        )
    # The next bounce must turn before the other wall; a constant force lets it rise this high.
    rise = 0.25 * float(b[RATE]) * left * rises
    known = error <= model.tolerance and rise <= m.clearance
    if not known or left > horizon(model.forcing, start.phase):
        left = math.inf
    return StructureChatter(left, rise, eased, -bent, jerk, damping, error)


@compiled_apart
def _is_undisturbed(model, s, start, k, chatter):
    """Whether nothing happens to any other mass while the sequence of one completes."""
    left, bodies = chatter.left, s.bodies
    if not left < math.inf:
        return False
    others = False
    for j in range(len(bodies)):
        if bodies[j, MODE] == TAIL:
            return False
        others = others or not (j == k or _in_step(model, bodies, k, j))
    if not others:
        return True
    if _kicks(model, bodies, k):
        return False
    joined = bodies.copy()
    for j in range(len(bodies)):
        if j == k or _in_step(model, bodies, k, j):
            joined[j, MODE], joined[j, ACCUMULATION] = TAIL, left
    together = begin_after(model, with_bodies(s, joined), start)
    for j in range(len(bodies)):
        b = bodies[j]
        if joined[j, MODE] == TAIL:
            continue
        if b[MODE] == RESTING:
            return False  # each impact moves its box
        # Bounces carry the box this far, at most; twice that to be sure.
        moved = 2.0 * abs(give(model, bodies, j, k) / give(model, bodies, k, k))
        margin, slowest = moved * chatter.rise, moved * float(bodies[k, RATE])
        flies = b[MODE] == FLIGHT
        width = 2.0 * mass_in(model.masses, j).clearance
        if flies and not margin < b[GAP] < width - margin:
            return False
        # Between impacts a contact force is what it is without the mass that bounces.
        motion, near = together if flies else start, margin if flies else 0.0
        tau, found, _ = next_event(model, joined, motion, j, left, near, slowest)
        if found != 0.0 and tau <= left:
            return False
    return True


@compiled_apart
def _kicks(model, bodies, k):
    """Whether the impacts of a mass kick another one off the wall that it sticks to."""
    count = len(bodies)
    touches, least = np.zeros(count, dtype=np.bool_), np.zeros(count)
    for j in range(count):
        least[j] = 1.0 if j == k or _in_step(model, bodies, k, j) else 0.0
        touches[j] = least[j] > 0.0 or bodies[j, MODE] == STICKING
    matrix = compliance(model, bodies)
    impulses = impulses_of(matrix, least, touches)
    for j in range(count):
        if bodies[j, MODE] == STICKING and impulses[j] == 0.0:
            gained, size = 0.0, 0.0
            for i in range(count):
                gained += matrix[j, i] * impulses[i]
                size += abs(matrix[j, i] * impulses[i])
            if gained > ROUNDOFF * size:
                return True
    return False


# --- inelastic collapse: infinitely many impacts in no time, as of masses that pinch their box


#: Part of the first speed that counts as rest, and impacts after which half of it will do.
_AT_REST, _MOST_IMPACTS = 1e-12, 2000
#: Least gap of a mass in flight: its acceleration takes it off its wall between two impacts.
_OFF = 1e-300


@compiled
def may_collapse(bodies: np.ndarray, longest: float) -> bool:
    """Whether any mass comes to its wall in no time."""
    found = False
    for k in range(len(bodies)):
        b = bodies[k]
        found = found or bool(b[MODE] == FLIGHT and b[RATE] < 0.0 and b[GAP] <= -b[RATE] * longest)
    return found


@compiled_apart
def collapsing(model: OnStructure, bodies: np.ndarray) -> np.ndarray:
    """Masses whose impacts of the coming instant never end: all of them come to rest in no time.

    The impacts are followed one by one; no acceleration does anything in so short a time.
    """
    count, left = len(bodies), negligible(model.tolerance)
    now, hits, none = (
        bodies.copy(),
        np.zeros(count, dtype=np.bool_),
        np.zeros(count, dtype=np.bool_),
    )
    first = 0.0
    for number in range(_MOST_IMPACTS):
        k, soonest = -1, left
        for j in range(count):
            b = now[j]
            if b[MODE] == FLIGHT and b[RATE] < 0.0 and b[GAP] <= -b[RATE] * soonest:
                k, soonest = j, -b[GAP] / b[RATE]
        if k < 0:
            return none
        left -= soonest
        for j in range(count):
            if now[j, MODE] == FLIGHT:
                now[j, GAP] = max(now[j, GAP] + now[j, RATE] * soonest, _OFF)
            now[j, ARRIVES] = now[j, SIDE] if j == k else 0.0
        hits[k] = True
        first = -now[k, RATE] if number == 0 else first
        rebound(model, now)
        fastest = 0.0
        for j in range(count):
            if hits[j]:
                fastest = max(fastest, abs(now[j, RATE]))
        ends = number == _MOST_IMPACTS - 1 and fastest < 0.5 * first
        if number > 0 and (fastest <= _AT_REST * first or ends):
            return hits
    return none


# --- for the observer of accumulations


@walls.law_of_mass.of(OnStructure)
def _law_of_mass(model, body, side):
    return law_of(model, mass_in(model.masses, body), side)


@walls.chatter_of.of(OnStructure)
def _chatter_after(model, segment):
    k = int(segment.body)
    s = with_bodies(segment, _bounced(model, segment, FLIGHT))
    found = _chatter_of(model, s, begin(model, s, 2), k)
    law = law_of(model, mass_in(model.masses, k), segment.side)
    velocity = box_at(model, _together_after(model, segment, 0.0), VELOCITY, k)
    restitution = restitution_at(law, 0.0)
    return walls.ChatterAhead(
        found.force, found.jerk, restitution, found.damping, found.error, velocity
    )


@walls.travel_together.of(OnStructure)
def _travel_together(model, segment, tau):
    k = int(segment.body)
    here = box_at(model, _together_after(model, segment, tau), DISPLACEMENT, k)
    return here - box_at(model, segment, DISPLACEMENT, k)


@compiled_apart
def _bounced(model, s, mode):
    """The masses after an impact, with a mode of those that bounce in step."""
    bodies, k = s.bodies.copy(), int(s.body)
    for j in range(len(bodies)):
        b = bodies[j]
        if b[GAP] == 0.0 and b[RATE] > 0.0 and (b[MODE] == FLIGHT or b[MODE] == TAIL):
            # The log tells of each impact once.
            b[MODE], b[CAUSE], b[ACCUMULATION] = FLIGHT, IMPACT, 0.0
    flying = bodies.copy()
    for j in range(len(bodies)):
        if j == k or _in_step(model, flying, k, j):
            bodies[j, MODE] = mode
    return bodies


@compiled_apart
def _together_after(model, s, tau):
    """Where all are after a time in which the mass of a segment moves with its box."""
    joined = with_bodies(s, _bounced(model, s, TAIL))
    return all_after(model, joined, begin(model, joined, 2), tau, len(s.bodies), 0.0)

"""The closed rest of complete chatter sequences in boxes of a structure."""

import math
from typing import NamedTuple

import numpy as np

from damper.engine.compiled import compiled, compiled_apart
from damper.engine.completion import completion
from damper.engine.forcing import bound_of, force_rates, horizon
from damper.engine.segment import FLIGHT, IMPACT, NOTHING, RELEASE, STICKING, TAIL
from damper.engine.tuples import changed
from damper.models.several.contacts import negligible
from damper.models.structure.collapse import collapsing, may_collapse
from damper.models.structure.constants import (
    CAUSE,
    COMPLETION,
    FALLS,
    GAP,
    MODE,
    RATE,
    SIDE,
    YIELDS,
    OnStructure,
    StructureSegment,
    box_in,
    drag_in,
    law_of,
    mass_in,
    push_in,
    stiffness_in,
)
from damper.models.structure.contacts import impulses_of, is_kicked, settle
from damper.models.structure.courses import next_event
from damper.models.structure.flow import (
    ModalStart,
    begin_after,
    compliance,
    impulses_to_rest,
    rates_in,
)
from damper.models.structure.linear import dot, times

#: Speed over a time that counts as none, beyond which a mass is not at rest.
_SLOW = 1e6
#: Part of two masses' own share below which what one's impact does to the other is roundoff.
_NO_COUPLING = 1e-12


class StructureChatter(NamedTuple):
    """Rest of a chatter sequence."""

    left: float
    """Time to the completion point; infinite where none is known well enough."""
    rise: float
    """Height of the bounces, at most."""


@compiled_apart
def close(model: OnStructure, s: StructureSegment, start: ModalStart) -> bool:
    """Close a chatter sequence that completes before anything else happens; whether one is closed.

    In place. A sequence whose time left is negligible ends now, even if other masses move: where
    impacts kick other masses off their walls, all come to rest at once.
    """
    bodies, longest = s.bodies, negligible(model.tolerance)
    if may_collapse(bodies, longest):
        rests = collapsing(model, bodies)
        if np.any(rests):
            _rest(model, s, rests)
            return True
    any_rests, rests = False, np.zeros(len(bodies), dtype=np.bool_)
    for k in range(len(bodies)):
        if not _may_end(bodies, start, k):
            continue
        chatter = _chatter_of(model, s, start, k)
        if chatter.left <= longest or _is_braked(model, bodies, start, k):
            any_rests, rests[k] = True, True
        elif bodies[k, CAUSE] == IMPACT and _is_undisturbed(model, s, start, k, chatter):
            for j in range(len(bodies)):
                if j == k or _in_step(model, bodies, k, j):
                    bodies[j, MODE], bodies[j, COMPLETION] = TAIL, chatter.left
            return True
    if any_rests:
        _rest(model, s, rests)
    return any_rests


@compiled_apart
def _is_braked(model, bodies, start, k):
    """Whether a mass that bounces in no time loses its speed to one that is less elastic."""
    b, longest = bodies[k], negligible(model.tolerance)
    bent = dot(box_in(start.system, k), start.modes[2]) + start.system.own[FALLS, k]
    if 2.0 * b[RATE] > longest * -b[SIDE] * bent:
        return False
    matrix = compliance(model, bodies)
    found = False
    for j in range(len(bodies)):
        c = bodies[j]
        near = c[MODE] == FLIGHT and c[GAP] <= longest and abs(c[RATE]) <= _SLOW * longest
        loses = law_of(mass_in(model.masses, j), float(c[SIDE])).restitution < 1.0
        bound = abs(matrix[j, k]) > _NO_COUPLING * math.sqrt(matrix[j, j] * matrix[k, k])
        found = found or bool(j != k and near and loses and bound)
    return found


@compiled
def _may_end(bodies, start, k):
    """Whether a mass has left its wall just now for a brief bounce: asked before what takes time.

    The change of its acceleration in the time of all bounces is less than that acceleration.
    """
    b, system = bodies[k], start.system
    if b[MODE] != FLIGHT or b[GAP] != 0.0 or b[CAUSE] == NOTHING or not b[RATE] > 0.0:
        return False
    bent, jerk = b[SIDE] * system.own[FALLS, k], 0.0
    for i in range(start.modes.shape[1]):
        weight = b[SIDE] * system.table[3 + k, i]
        bent += weight * start.modes[2, i]
        jerk += weight * start.modes[3, i]
    return bool(bent < 0.0 and abs(jerk) * b[RATE] < bent * bent)


@compiled_apart
def _rest(model, s, rests):
    """Let masses come to rest on their walls, in place; those that were kicked off are back."""
    joined = rests | (s.bodies[:, MODE] == STICKING)
    settle(model, s, impulses_to_rest(model, s.bodies, joined))
    for k in range(len(s.bodies)):
        b = s.bodies[k]
        if joined[k]:
            b[RATE] = 0.0
        if rests[k] and b[CAUSE] == RELEASE:
            b[MODE], b[CAUSE], b[COMPLETION] = STICKING, NOTHING, 0.0
        elif rests[k]:
            b[MODE], b[COMPLETION], b[GAP] = TAIL, 0.0, 0.0


@compiled_apart
def _in_step(model, bodies, k, j):
    """Whether a mass bounces in step with another: their gaps are the same, number by number."""
    b, c = bodies[k], bodies[j]
    if not (c[CAUSE] == IMPACT and c[SIDE] == b[SIDE] and c[RATE] == b[RATE]):
        return False
    one, other = mass_in(model.masses, k), mass_in(model.masses, j)
    pulled = one.gravity == other.gravity and one.carried == other.carried
    stiff = one.tie_stiffness * other.mass == other.tie_stiffness * one.mass
    tied = stiff and one.tie_damping * other.mass == other.tie_damping * one.mass
    placed = one.tie_stiffness == 0.0 or one.clearance == other.clearance
    side = float(b[SIDE])
    alike = pulled and tied and placed and law_of(one, side) == law_of(other, side)
    return alike and bool(np.all(box_in(model, k) == box_in(model, j)))


@compiled_apart
def _yield_of(model, s, start, k):
    """Change of a gap's rate by an impulse that all masses in step with it share."""
    own = 1.0 / mass_in(model.masses, k).mass
    total = 0.0
    for j in range(len(s.bodies)):
        if j == k or _in_step(model, s.bodies, k, j):
            total += mass_in(model.masses, j).mass
    return float(start.system.own[YIELDS, k]) - own + 1.0 / total


@compiled_apart
def _chatter_of(model, s, start, k):
    """Rest of the chatter sequence of a mass, and of those in step with it."""
    b, m, system = s.bodies[k], mass_in(model.masses, k), start.system
    side, law = float(b[SIDE]), law_of(m, float(b[SIDE]))
    rates = rates_in(
        system, force_rates(model.forcing, start.phase), start.modes[0], start.modes[1]
    )
    weights = side * box_in(system, k)
    bent = dot(weights, rates[2]) + side * float(system.own[FALLS, k])
    jerk = dot(weights, rates[3])
    own = weights.copy()
    if system.carried:
        own[-1] = 0.0  # no impulse moves what follows the force alone
    share = dot(own, own)
    drags = times(drag_in(system), own)
    shared = _yield_of(model, s, start, k)
    dashpots, stiff = 0.0, 0.0
    if share > 0.0:
        dashpots = math.sqrt(dot(drags, drags) / share)
        least = np.min(stiffness_in(system)[: len(own) - int(system.carried)])
        # Each impact moves the fast modes more than the slowest one does.
        stiff = max(dot(stiffness_in(system) * own, own) - least * share, 0.0) / shared
        stiff += least if system.carried else 0.0
    sizes = push_in(system) * bound_of(model.forcing, 2) + stiffness_in(system) * np.abs(rates[2])
    sizes += times(np.abs(drag_in(system)), np.abs(rates[3]))
    snap = dot(np.abs(weights), sizes) + abs(bent) * stiff
    left, error = completion(
        law, 0.5 * dot(drags, own) / shared, dashpots, snap, -bent, jerk, float(b[RATE])
    )
    # The next bounce must turn before the other wall; a constant force lets it rise this high.
    rise = 0.25 * float(b[RATE]) * left * (1.0 - law.restitution)
    known = error <= model.tolerance and rise <= m.clearance
    if not known or left > horizon(model.forcing, start.phase):
        left = math.inf
    return StructureChatter(left, rise)


_with_bodies = changed(StructureSegment, "bodies")


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
            joined[j, MODE], joined[j, COMPLETION] = TAIL, left
    together = begin_after(model, _with_bodies(s, joined), start.system)
    matrix = compliance(model, bodies)
    for j in range(len(bodies)):
        b = bodies[j]
        if joined[j, MODE] == TAIL:
            continue
        # Bounces carry the box this far, at most; twice that to be sure.
        margin = 2.0 * abs(matrix[j, k] / matrix[k, k]) * chatter.rise
        flies = b[MODE] == FLIGHT
        width = 2.0 * mass_in(model.masses, j).clearance
        if flies and not margin < b[GAP] < width - margin:
            return False
        # Between impacts a contact force is what it is without the mass that bounces.
        motion = together if flies else start
        tau, found, _ = next_event(model, joined, motion, j, left, margin if flies else 0.0)
        if found != 0.0 and tau <= left:
            return False
    return True


@compiled_apart
def _kicks(model, bodies, k):
    """Whether the impacts of a mass kick another one off the wall that it sticks to."""
    touches, least = bodies[:, MODE] == STICKING, np.zeros(len(bodies))
    for j in range(len(bodies)):
        if j == k or _in_step(model, bodies, k, j):
            touches[j], least[j] = True, 1.0
    matrix = compliance(model, bodies)
    impulses = impulses_of(matrix, least, touches)
    for j in range(len(bodies)):
        if bodies[j, MODE] == STICKING and is_kicked(matrix, impulses, j):
            return True
    return False

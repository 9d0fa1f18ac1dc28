"""Deviations of a motion on a structure, and its change by a parameter, along the segment log.

A deviation has the displacement and the velocity of each mode of the structure, then those of each
free mass. Between events it follows the matrix exponential of the linear system, which shares
nothing with the flow of the engine. Simultaneous impacts are carried to the moment at which the
deviated motion hits: z = d + f- t there, the impacts' linear map of z, less f+ t. Masses that stick
or are in a tail follow their boxes, by the impulses that would make them: docs/orbits.md.
"""

import math
from typing import Any

import numpy as np

from damper.engine.compiled import compiled, compiled_apart
from damper.engine.forcing import TAYLOR_REMAINDER, force_rates, phase_at
from damper.engine.impact import rebound_slope, restitution_at
from damper.engine.model import begin
from damper.engine.oscillator import TAYLOR_RANGE
from damper.engine.segment import FLIGHT, IMPACT, NOTHING, RESTING
from damper.engine.tuples import changed
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
from damper.models.structure.constants import (
    BEFORE,
    DISPLACEMENT,
    HEAD,
    PREVIOUS,
    PREVIOUS_SLIP,
    PUSH,
    STIFFNESS,
    SYSTEM_RATE,
    VELOCITY,
    WEIGHTS,
    OnStructure,
    box_at,
    first_row,
    friction_of,
    mass_in,
    size_of,
)
from damper.models.structure.contacts import impulses_of
from damper.models.structure.courses import course_of, gap_after
from damper.models.structure.flow import compliance, joined_in, modes_after
from damper.models.structure.linear import product, solve
from damper.models.structure.motion import place_of, structure_after
from damper.models.wall_laws import law_of


@tangent.friction_in.of(OnStructure)
def _friction_in(model):
    found = 0.0
    for k in range(len(model.masses)):
        found = max(found, friction_of(model, k))
    return found


@tangent.leaders_of.register(OnStructure)
def _leaders_of(model, row):
    return np.arange(len(model.masses))


@tangent.coordinates_in.register(OnStructure)
def _coordinates_in(model):
    return size_of(model)


@tangent.fastest_of.register(OnStructure)
def _fastest_of(model):
    return float(model.flying[HEAD, SYSTEM_RATE])


@tangent.of_state.register(OnStructure)
def _of_state(model, deviations):
    return _in_basis(model, 2, deviations)


@tangent.to_state.register(OnStructure)
def _to_state(model, deviations):
    return _in_basis(model, 1, deviations)


def _in_basis(model: OnStructure, block: int, deviations: np.ndarray) -> np.ndarray:
    """Deviations in other coordinates of the structure, by a block of its table."""
    n, first, found = size_of(model), first_row(model.table, block), deviations.copy()
    matrix = model.table[first : first + n, :n]
    found[: 2 * n : 2] = matrix @ deviations[: 2 * n : 2]
    found[1 : 2 * n : 2] = matrix @ deviations[1 : 2 * n : 2]
    return found


@tangent.damping_in.of(OnStructure)
def _damping_in(model, s):
    first, found = first_row(model.table, 0), 0.0
    for i in range(size_of(model)):
        found += float(model.table[first + i, i])
    for k in range(len(s.bodies)):
        if not is_joined(s.bodies[k, MODE]):
            m, share = mass_in(model.masses, k), 0.0
            for i in range(size_of(model)):
                share += float(model.table[WEIGHTS + k, i]) ** 2
            found += m.tie_damping * (1.0 / m.mass + share)
    return found


@tangent.shrunk_by.of(OnStructure)
def _shrunk_by(model, s):
    if s.cause != IMPACT:
        return _turned_by(model, s) if s.bodies[_fastest(s.bodies), SPEED] == 0.0 else 1.0
    law = law_of(model, mass_in(model.masses, int(s.body)), s.side)
    return rebound_slope(law, s.speed) * restitution_at(law, s.speed)


@tangent.lost_in.of(OnStructure)
def _lost_in(model, s, own):
    lost = 0.0
    for k in range(len(s.bodies)):
        lost += 2.0 if is_on_wall(s.bodies[k, MODE]) else 0.0
        lost += 1.0 if s.bodies[k, MODE] == RESTING else 0.0
    return lost


@tangent.over_time.of(OnStructure)
def _over_time(model, s, low, high, deviations):
    if high > low:
        change = _flow_over(model, s.bodies, joined_in(s.bodies), high - low)
        deviations += product(change, deviations)


@compiled_apart
def _flow_over(
    model: OnStructure, bodies: np.ndarray, sticks: np.ndarray, tau: float
) -> np.ndarray:
    """Matrix exponential of a time, less 1, while these masses stick."""
    size = size_of(model) + len(bodies)
    unit, none, rates = np.zeros(size), np.zeros(size), np.zeros((2 * size, 2 * size))
    stiff, drags = 0.0, 0.0
    for j in range(size):
        unit[j], rates[2 * j, 2 * j + 1] = 1.0, 1.0
        bends = _accelerations(model, bodies, sticks, unit, none, 0.0, 0.0, none)
        brakes = _accelerations(model, bodies, sticks, none, unit, 0.0, 0.0, none)
        unit[j] = 0.0
        for i in range(size):
            rates[2 * i + 1, 2 * j], rates[2 * i + 1, 2 * j + 1] = bends[i], brakes[i]
            stiff += bends[i] * bends[i]
            drags += brakes[i] * brakes[i]
    fastest, step, doublings = math.sqrt(drags) + stiff**0.25, tau, 0
    while fastest * step > TAYLOR_RANGE:
        step, doublings = 0.5 * step, doublings + 1
    term = rates * step
    found, order, remainder = term.copy(), 1.0, 1.0
    while remainder > TAYLOR_REMAINDER:
        order += 1.0
        term = product(rates, term) * (step / order)
        found += term
        remainder *= TAYLOR_RANGE / order
    # Less 1, so that slow motion keeps its digits.
    for _ in range(doublings):
        found = 2.0 * found + product(found, found)
    return found


@compiled
def _apart(model, k, places):
    """Displacement of a mass from its box, or their relative velocity."""
    n = size_of(model)
    found = float(places[n + k])
    for i in range(n):
        found -= float(model.table[WEIGHTS + k, i]) * float(places[i])
    return found


@compiled_apart
def _accelerations(
    model: OnStructure,
    bodies: np.ndarray,
    sticks: np.ndarray,
    places: np.ndarray,
    velocities: np.ndarray,
    force: float,
    weight: float,
    rubs: np.ndarray,
) -> np.ndarray:
    """Accelerations of modes and masses; of deviations without force, weight and friction.

    `rubs` has what friction takes from the acceleration of each mass.
    """
    n, count, table = size_of(model), len(bodies), model.table
    found, drag = np.zeros(n + count), first_row(table, 0)
    for i in range(n):
        found[i] = table[PUSH, i] * force - table[STIFFNESS, i] * places[i]
        for j in range(n):
            found[i] -= table[drag + i, j] * velocities[j]
    for k in range(count):
        m = mass_in(model.masses, k)
        pull = m.tie_stiffness * _apart(model, k, places)
        pull += m.tie_damping * _apart(model, k, velocities)
        pull += m.mass * rubs[k]
        found[n + k] = m.carried * force - weight * m.gravity - pull / m.mass
        for i in range(n):
            found[i] += pull * table[WEIGHTS + k, i]
    _join(model, bodies, sticks, found)
    return found


@compiled_apart
def _join(model: OnStructure, bodies: np.ndarray, sticks: np.ndarray, moved: np.ndarray) -> None:
    """Let masses go with their boxes, in place, by impulses between them."""
    needed = np.zeros(len(bodies))
    for k in range(len(bodies)):
        needed[k] = bodies[k, SIDE] * _apart(model, k, moved)
    _push(model, bodies, solve(compliance(model, bodies), needed, sticks), moved)


@compiled
def _push(model, bodies, impulses, moved):
    """Apply impulses in the gaps, in place."""
    n = size_of(model)
    for k in range(len(bodies)):
        impulse = bodies[k, SIDE] * impulses[k]
        moved[n + k] -= impulse / mass_in(model.masses, k).mass
        for i in range(n):
            moved[i] += impulse * model.table[WEIGHTS + k, i]


@compiled
def _is_last(bodies):
    """Whether nothing that happens at an instant is left to tell of: all is done there at once."""
    found = True
    for k in range(len(bodies)):
        found = found and bodies[k, CAUSE] == NOTHING
    return found


@compiled
def _fastest(bodies):
    """Number of the mass whose impact is the fastest of an instant."""
    found = 0
    for k in range(len(bodies)):
        if bodies[k, SPEED] > bodies[found, SPEED]:
            found = k
    return found


@sensitivity.strikes.of(OnStructure)
def _strikes(model, s):
    return bool(_is_last(s.bodies) and s.bodies[_fastest(s.bodies), SPEED] > 0.0)


@tangent.enter.of(OnStructure)
def _enter(model, s, deviations, happened):
    if not _is_last(s.bodies):
        return
    if happened and s.bodies[_fastest(s.bodies), SPEED] > 0.0:
        _strike(model, s, deviations)
    elif happened and tangent.friction_in(model) > 0.0:
        _stop(model, s, deviations)
    joined, sticks = joined_in(s.bodies), joined_in(s.bodies)
    for k in range(len(sticks)):
        sticks[k] = is_on_wall(s.bodies[k, MODE])
    for c in range(deviations.shape[1]):
        for of_rate in range(2):
            moved = deviations[of_rate::2, c].copy()
            # Off the walls masses that rest keep their places.
            _join(model, s.bodies, joined if of_rate else sticks, moved)
            deviations[of_rate::2, c] = moved


@compiled
def _velocities(model, s, order):
    """Velocities of modes and masses after the impacts of an instant, or before them."""
    n, count = size_of(model), len(s.bodies)
    found = np.zeros(n + count)
    for i in range(n):
        found[i] = s.modes[order, i]
    for k in range(count):
        b = s.bodies[k]
        if order == BEFORE and b[SPEED] > 0.0:
            found[n + k] = box_at(model, s, BEFORE, k) + b[SIDE] * b[SPEED]
        elif order == BEFORE and is_joined(b[PREVIOUS]):
            found[n + k] = box_at(model, s, BEFORE, k)
        else:
            found[n + k] = place_of(model, s, k)[1]
    return found


@compiled
def _levels(model, bodies, k):
    """Change of the relative velocity by a mass's impact, and its derivative by the speed."""
    b = bodies[k]
    law, speed = law_of(model, mass_in(model.masses, k), float(b[SIDE])), float(b[SPEED])
    return (1.0 + restitution_at(law, speed)) * speed, 1.0 + rebound_slope(law, speed)


@compiled_apart
def _impulses(model: OnStructure, bodies: np.ndarray) -> np.ndarray:
    """Impulses of the impacts of an instant, also on masses that stick."""
    count = len(bodies)
    touches, least = np.zeros(count, dtype=np.bool_), np.zeros(count)
    for k in range(count):
        touches[k] = is_on_wall(bodies[k, PREVIOUS])
        if bodies[k, SPEED] > 0.0:
            touches[k], least[k] = True, _levels(model, bodies, k)[0]
    return impulses_of(compliance(model, bodies), least, touches)


@compiled_apart
def _strike(model: OnStructure, s: MassesSegment, deviations: np.ndarray) -> None:
    """Take deviations over the impacts of an instant."""
    bodies, count = s.bodies, len(s.bodies)
    pushes, before = _impulses(model, bodies) > 0.0, _velocities(model, s, BEFORE)
    after = _velocities(model, s, VELOCITY)
    _join(model, bodies, joined_in(bodies), after)
    own = _accelerations_at(model, s, before, True)
    later = _accelerations_at(model, s, after, False)
    matrix, hit, levels = compliance(model, bodies), _fastest(bodies), np.zeros(count)
    for c in range(deviations.shape[1]):
        moved, rates = deviations[::2, c].copy(), deviations[1::2, c].copy()
        # By how much later the deviated motion hits.
        late = -bodies[hit, SIDE] * _apart(model, hit, moved) / bodies[hit, SPEED]
        parts = _are_parted(model, bodies, late, moved)
        moved += before * late
        rates += own * late
        for k in range(count):
            faster = bodies[k, SIDE] * _apart(model, k, rates)
            turned = _levels(model, bodies, k)[1] if bodies[k, SPEED] > 0.0 else 1.0
            levels[k] = turned * faster
        _push(model, bodies, solve(matrix, levels, pushes), rates)
        deviations[::2, c] = moved - after * late
        deviations[1::2, c] = rates - later * late
        if parts:
            deviations[:, c] = math.nan


@compiled_apart
def _accelerations_at(
    model: OnStructure, s: MassesSegment, rates: np.ndarray, before: bool
) -> np.ndarray:
    """Accelerations of modes and masses as before, or after, what happens at a segment's start."""
    n, count, bodies = size_of(model), len(s.bodies), s.bodies
    joined, rubs, places = joined_in(bodies), np.zeros(count), np.zeros(n + count)
    for i in range(n):
        places[i] = s.modes[DISPLACEMENT, i]
    for k in range(count):
        places[n + k] = place_of(model, s, k)[0]
        if before:
            joined[k] = is_joined(bodies[k, PREVIOUS])
        rubs[k] = bodies[k, PREVIOUS_SLIP if before else SLIP_DIRECTION] * friction_of(model, k)
    force, _, _, _, _ = force_rates(model.forcing, phase_at(model.forcing, s.periods, s.time))
    return _accelerations(model, bodies, joined, places, rates, force, 1.0, rubs)


@compiled
def _stops_in(b):
    """Whether the slide of a mass stops at an instant, and whether that it rests is all of it."""
    slides = b[PREVIOUS] == FLIGHT and b[PREVIOUS_SLIP] != 0.0 and b[RATE] == 0.0
    rests = is_joined(b[MODE])
    return bool(slides and (rests or b[SLIP_DIRECTION] != b[PREVIOUS_SLIP])), bool(slides and rests)


@compiled_apart
def _stop(model: OnStructure, s: MassesSegment, deviations: np.ndarray) -> None:
    """Take deviations over slides that stop, up to where masses rest.

    Where those rest and nothing else changes it does not matter when.
    """
    bodies, any_stops, turns = s.bodies, False, False
    for k in range(len(bodies)):
        b = bodies[k]
        stops, rests = _stops_in(b)
        changes = is_joined(b[MODE]) != is_joined(b[PREVIOUS])
        changes = changes or b[SLIP_DIRECTION] != b[PREVIOUS_SLIP]
        any_stops, turns = any_stops or stops, turns or (changes and not rests)
    if not any_stops:
        return
    rates = _velocities(model, s, VELOCITY)
    own, later = _accelerations_at(model, s, rates, True), _accelerations_at(model, s, rates, False)
    for c in range(deviations.shape[1]):
        places, moved = deviations[::2, c].copy(), deviations[1::2, c].copy()
        late, known, parts = 0.0, False, False
        for k in range(len(bodies)):
            if not _stops_in(bodies[k])[0]:
                continue
            speed, falls = _apart(model, k, moved), _apart(model, k, own)
            if turns and not known and falls != 0.0:
                # By how much later the deviated slide stops.
                late, known = -speed / falls, True
            off, size = abs(speed + falls * late), abs(falls * late) + _size_apart(model, k, moved)
            parts = parts or (turns and off > tangent.TOGETHER * size)
            # Where it stops at the very wall, a deviated mass hits the wall, or stops before it.
            off, size = abs(_apart(model, k, places)), _size_apart(model, k, places)
            at_wall = is_on_wall(bodies[k, MODE])
            parts = parts or (at_wall and off > tangent.TOGETHER * size)
        if turns:
            deviations[1::2, c] = moved + (own - later) * late
        if parts:
            deviations[:, c] = math.nan


@compiled
def _turned_by(model, s):
    """Relative acceleration of a mass after its slide has turned round, over that before it."""
    k, rates = int(s.body), _velocities(model, s, VELOCITY)
    own, later = _accelerations_at(model, s, rates, True), _accelerations_at(model, s, rates, False)
    return _apart(model, k, later) / _apart(model, k, own)


@compiled
def _size_apart(model, k, places):
    """Size of the terms of `_apart`."""
    n = size_of(model)
    found = abs(float(places[n + k]))
    for i in range(n):
        found += abs(float(model.table[WEIGHTS + k, i] * places[i]))
    return found


@compiled
def _are_parted(model, bodies, late, moved):
    """Whether a deviation, which hits by so much later, parts impacts of one instant."""
    parts = False
    for k in range(len(bodies)):
        b, size = bodies[k], _size_apart(model, k, moved)
        touched = b[GAP] == 0.0 and b[PREVIOUS] == FLIGHT
        off = abs(b[SIDE] * _apart(model, k, moved) + late * b[SPEED])
        parts = parts or (touched and off > tangent.TOGETHER * (size + abs(late) * b[SPEED]))
    return bool(parts)


# --- the change by a parameter


@sensitivity.clearances_of.register(OnStructure)
def _clearances_of(model: OnStructure) -> Any:
    return np.array([mass_in(model.masses, k).clearance for k in range(len(model.masses))])


@sensitivity.wall_of.of(OnStructure)
def _wall_of(model, segment, k):
    return float(segment.bodies[k, SIDE]), float(segment.bodies[k, MODE])


@sensitivity.first_place.of(OnStructure)
def _first_place(model):
    return 2 * size_of(model)


_beside = changed(MassesSegment, "time", "modes", "bodies")


@sensitivity.lead.of(OnStructure)
def _lead(there, model, s, struck, found):
    if struck:
        rates = _velocities(model, s, BEFORE)
        _push(there, s.bodies, _impulses(there, s.bodies), rates)
        _join(there, s.bodies, joined_in(s.bodies), rates)
        found[1::2] = rates
    else:
        _lead_on(there, model, s, found)


@compiled_apart
def _lead_on(there: OnStructure, model: OnStructure, s: MassesSegment, found: np.ndarray) -> None:
    """State after a segment; a mass on a wall is where its box is."""
    slower, bodies, n = there.cycle / model.cycle, s.bodies.copy(), size_of(model)
    modes, rates = s.modes.copy(), _velocities(model, s, VELOCITY)
    _join(model, bodies, joined_in(bodies), rates)
    for i in range(n):
        modes[VELOCITY, i] = rates[i]
    for k in range(len(bodies)):
        bodies[k, RATE] = 0.0
        if not is_joined(bodies[k, MODE]):
            bodies[k, RATE] = -bodies[k, SIDE] * _apart(model, k, rates)
        if bodies[k, MODE] == FLIGHT:
            # Where it has left its wall just now, it would not do so in another model.
            bodies[k, ACCUMULATION] = 0.0
            wider = mass_in(there.masses, k).clearance - mass_in(model.masses, k).clearance
            bodies[k, GAP] += wider
    start = begin(there, _beside(s, s.time * slower, modes, bodies))
    tau = s.duration * slower
    modes_after(there.forcing, start, tau)
    modes = structure_after(there, start, tau)
    for i in range(n):
        found[2 * i], found[2 * i + 1] = modes[DISPLACEMENT, i], modes[VELOCITY, i]
    for k in range(len(bodies)):
        place, rate = 0.0, 0.0
        for i in range(n):
            place += there.table[WEIGHTS + k, i] * modes[DISPLACEMENT, i]
            rate += there.table[WEIGHTS + k, i] * modes[VELOCITY, i]
        if bodies[k, MODE] == FLIGHT:
            gap, closing, _ = gap_after(course_of(there, bodies, start, k), tau)
            side = bodies[k, SIDE]
            place += side * (mass_in(there.masses, k).clearance - gap)
            rate -= side * closing
        found[2 * (n + k)], found[2 * (n + k) + 1] = place, rate

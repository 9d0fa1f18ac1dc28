"""Gaps and contact forces of free masses in boxes of a structure, as the search sees them.

Each is a weighted sum of all modes, or of their second derivatives.
"""

import math
from typing import Any, NamedTuple

import numpy as np

from damper.engine.bodies import TermSums, added, event_point
from damper.engine.bounds import energy_norm
from damper.engine.compiled import compiled, compiled_apart
from damper.engine.forcing import bound_of, force_rates, rate_of, turn_over, turned
from damper.engine.oscillator import higher_derivatives, motion_from, moved
from damper.engine.search import ROUNDOFF, EventPoint, first_root, point_at, rates_of
from damper.engine.tuples import changed
from damper.models.several.tails import is_balanced
from damper.models.structure.constants import (
    COMPLETION,
    FALLS,
    GAP,
    JUMP,
    MODE,
    RATE,
    SIDE,
    OnStructure,
    box_in,
    drag_in,
    mass_in,
    pull_in,
    push_in,
    size_of,
    stiffness_in,
)
from damper.models.structure.flow import (
    ModalStart,
    coupled_after,
    is_on_wall,
    mode_of,
    motion_of,
    rates_in,
)
from damper.models.structure.linear import dot, times

#: In place of a completion: the mass has left its wall without a jump of the force just now, so its
#: gap has no second derivative, exactly.
LIFTS = -1.0


class GapOrForce(NamedTuple):
    """A gap, or a contact force over the mass, from a start on."""

    forcing: Any
    start: ModalStart
    k: int
    """Number of the mass."""
    sign: float
    """Of the modes' weights: the side of a gap, and its opposite for a contact force."""
    is_force: bool
    value: float
    slope: float
    """At the start; of a force the constant part, and 0."""
    acceleration: float
    """The constant one; of a force 0."""


_narrowed = changed(GapOrForce, "value")


@compiled
def course_of(model: OnStructure, b: np.ndarray, start: ModalStart, k: int) -> GapOrForce:
    """Gap of a mass in flight, or contact force of a mass that sticks."""
    m, side = mass_in(model.masses, k), float(b[k, SIDE])
    fall = float(start.system.own[FALLS, k])
    if is_on_wall(b[k, MODE]):
        held = -side * fall - m.tie_stiffness / m.mass * m.clearance
        return GapOrForce(model.forcing, start, k, -side, True, held, 0.0, 0.0)
    acceleration = side * fall
    if b[k, COMPLETION] == LIFTS:
        acceleration = -side * dot(box_in(start.system, k), start.modes[2])
    rate = float(b[k, RATE] + b[k, JUMP])
    return GapOrForce(model.forcing, start, k, side, False, float(b[k, GAP]), rate, acceleration)


@compiled
def _begun(course, tau):
    """The part of a course that is no mode's."""
    if course.is_force:
        value = course.value
        return TermSums(value, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, abs(value))
    value, slope, a = course.value, course.slope, course.acceleration
    size = abs(value) + abs(slope) * tau
    value = value + slope * tau + 0.5 * a * tau * tau
    return TermSums(value, slope + a * tau, a, 0.0, 0.0, 0.0, 0.0, 0.0, size)


@compiled
def _added_force(osc, weight, sums, motion):
    """As `damper.engine.bodies.added`, of the second derivative."""
    snap, crackle, sixth = higher_derivatives(osc, motion)
    size = osc.strength * bound_of(osc.forcing, 0) + 2.0 * osc.damping * abs(motion.v)
    return TermSums(
        sums.value + weight * motion.a,
        sums.slope + weight * motion.j,
        sums.second + weight * snap,
        sums.third + weight * crackle,
        sums.fourth + weight * sixth,
        0.0,
        sums.bound4 + abs(weight) * energy_norm(osc, crackle, sixth),
        sums.growth + abs(weight) * osc.strength * bound_of(osc.forcing, 5),
        sums.size + abs(weight) * (size + osc.stiffness * abs(motion.x)),
    )


@compiled
def first_point(course: GapOrForce) -> EventPoint:
    """Where a course begins."""
    if course.start.system.coupled:
        return _coupled_point(course, 0.0)
    # Compiled code counts references wherever it reads an array out of a struct.
    forcing, modes, phase = course.forcing, course.start.modes, course.start.phase
    table, masses, row = course.start.system.table, course.start.system.number, 3 + course.k
    sign, is_force, sums = course.sign, course.is_force, _begun(course, 0.0)
    for i in range(modes.shape[1]):
        weight = sign * table[row, i]
        if weight != 0.0:
            osc, motion = mode_of(forcing, table, masses, i), motion_of(modes, phase, i)
            if is_force:
                sums = _added_force(osc, weight, sums, motion)
            else:
                sums = added(osc, weight, sums, motion, 0.0, 0.0, 0.0)
    return event_point(0.0, sums, 0.0)


@point_at.of(GapOrForce)
def _point_at(course, tau):
    if course.start.system.coupled:
        return _coupled_point(course, tau)
    forcing, modes, begun = course.forcing, course.start.modes, course.start.phase
    table, masses, row = course.start.system.table, course.start.system.number, 3 + course.k
    turn = turn_over(forcing, tau)
    phase = turned(forcing, begun, turn)
    sign, is_force, sums = course.sign, course.is_force, _begun(course, tau)
    for i in range(modes.shape[1]):
        weight = sign * table[row, i]
        if weight != 0.0:
            osc, first = mode_of(forcing, table, masses, i), motion_of(modes, begun, i)
            way, change = moved(osc, first, turn, tau)
            x, v = first.x + (first.v * tau + way), first.v + change
            motion = motion_from(osc, x, v, phase)
            if is_force:
                sums = _added_force(osc, weight, sums, motion)
            else:
                sums = added(osc, weight, sums, motion, way, change, abs(way))
    return event_point(tau, sums, 0.0)


@compiled_apart
def _coupled_point(course, tau):
    """Where a sum of coupled modes is: their energy together never grows without the force."""
    start, forcing, system = course.start, course.forcing, course.start.system
    way, change = np.zeros(size_of(system)), np.zeros(size_of(system))
    phase = start.phase
    if tau > 0.0:
        way, change = coupled_after(forcing, start, tau)
        phase = turned(forcing, start.phase, turn_over(forcing, tau))
    x, v = start.modes[0] + (start.modes[1] * tau + way), start.modes[1] + change
    rates = rates_in(system, force_rates(forcing, phase), x, v)
    weights, sums = course.sign * box_in(system, course.k), _begun(course, tau)
    order, size = 2, 0.0
    first = (dot(weights, rates[2]), dot(weights, rates[3]))
    if not course.is_force:
        order, first = 0, (dot(weights, way), dot(weights, change))
        size = dot(np.abs(weights), np.abs(way))
    else:
        terms = push_in(system) * bound_of(forcing, 0) + np.abs(pull_in(system))
        terms += times(np.abs(drag_in(system)), np.abs(v)) + stiffness_in(system) * np.abs(x)
        size = dot(np.abs(weights), terms)
    norm = math.sqrt(dot(weights, weights))
    lower, upper = rates[order + 3], rates[order + 4]
    energy = dot(stiffness_in(system) * lower, lower) + dot(upper, upper)
    growth = math.sqrt(dot(push_in(system), push_in(system))) * bound_of(forcing, order + 3)
    fifth = 0.0 if course.is_force else dot(weights, rates[5])
    return EventPoint(
        tau,
        sums.value + first[0],
        sums.slope + first[1],
        sums.second + dot(weights, rates[order + 2]),
        dot(weights, rates[order + 3]),
        dot(weights, rates[order + 4]),
        fifth,
        norm * math.sqrt(energy),
        norm * growth,
        ROUNDOFF * (sums.size + size),
        0.0,
    )


@rates_of.of(GapOrForce)
def _rates_of(course):
    system, forcing_rate = course.start.system, rate_of(course.forcing)
    return forcing_rate, max(forcing_rate, system.rate), system.coupling


@compiled
def gap_after(
    course: GapOrForce, way: np.ndarray, change: np.ndarray, tau: float
) -> tuple[float, float, float]:
    """Gap, its rate and its roundoff after a time, from the increments of the modes."""
    table, row, begun = course.start.system.table, 3 + course.k, _begun(course, tau)
    value, rate, size = 0.0, 0.0, begun.size
    for i in range(len(way)):
        value += table[row, i] * way[i]
        rate += table[row, i] * change[i]
        size += abs(table[row, i] * way[i])
    return begun.value + course.sign * value, begun.slope + course.sign * rate, ROUNDOFF * size


@compiled_apart
def next_event(
    model: OnStructure,
    bodies: np.ndarray,
    start: ModalStart,
    k: int,
    last: float,
    margin: float,
) -> tuple[float, float, int]:
    """When a mass arrives within a margin of a wall, or is pressed on its wall no longer.

    Returns
    -------
    tau, side, steps
        As those of a `damper.engine.search.Root`, up to the time `last`.
    """
    course = course_of(model, bodies, start, k)
    width = math.inf
    if not course.is_force:
        course = _narrowed(course, course.value - margin)
        width = 2.0 * (mass_in(model.masses, k).clearance - margin)
    here = first_point(course)
    if course.is_force and is_balanced(here, width):
        return last, 0.0, 1
    lifts_off = here.value == 0.0 and here.slope == 0.0 and here.second == 0.0
    lifts_off = lifts_off or (not course.is_force and bodies[k, COMPLETION] == LIFTS)
    root = first_root(course, here, width, bool(lifts_off), last, 0.0)
    return root.point.tau + root.step, root.side, root.steps

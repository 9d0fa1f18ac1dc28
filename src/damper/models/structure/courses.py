"""Gaps and contact forces of free masses in boxes of a structure, as the search sees them.

Each is a weighted sum of all modes, or of their second derivatives.
"""

import math
from typing import Any, NamedTuple

import numpy as np

from damper.engine.bodies import TermSums, added, event_point
from damper.engine.bounds import energy_norm
from damper.engine.compiled import compiled, compiled_apart
from damper.engine.dispatch import by_class
from damper.engine.forcing import bound_of, force_rates, rate_of, turn_over, turned
from damper.engine.oscillator import higher_derivatives, motion_from
from damper.engine.search import (
    GAVE_UP,
    ROUNDOFF,
    EventPoint,
    first_root,
    point_at,
    rates_of,
    shorter_step,
)
from damper.engine.segment import RESTING
from damper.engine.tuples import changed
from damper.models.flights import STOPS, is_balanced
from damper.models.friction import SLIP_DIRECTION, Frictions, NoFriction, is_joined
from damper.models.many import ACCUMULATION, GAP, LIFTS, MODE, RATE, SIDE
from damper.models.masses.holds import rate_point
from damper.models.structure.constants import (
    COUPLED,
    FALLS,
    HEAD,
    JUMP,
    PULL,
    PUSH,
    STIFFNESS,
    SYSTEM_COUPLING,
    SYSTEM_RATE,
    WEIGHTS,
    OnStructure,
    first_row,
    friction_of,
    mass_in,
    size_in,
)
from damper.models.structure.flow import ModalStart, increments_after, mode_of, motion_of
from damper.models.structure.steps import (
    CHANGE,
    WAY,
    A,
    V,
    X,
    next_rate,
)

#: Factor of a step that cannot be proved, and how often it is applied at most.
_CUT, _MOST_CUTS = 0.75, 40


class GapOrForce(NamedTuple):
    """A gap, or what holds a mass, over the mass, from a start on.

    That is the contact force plus the largest friction.
    """

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
    """Gap of a mass in flight, or what holds a mass that moves with its box."""
    m, side, table = mass_in(model.masses, k), float(b[k, SIDE]), start.tables[start.slot]
    fall = float(table[FALLS, k])
    if is_joined(b[k, MODE]):
        held = -side * fall - m.tie_stiffness / m.mass * (m.clearance - float(b[k, GAP]))
        held += friction_of(model, k)
        return GapOrForce(model.forcing, start, k, -side, True, held, 0.0, 0.0)
    acceleration = side * fall
    if b[k, ACCUMULATION] == LIFTS:
        acceleration = 0.0
        for i in range(size_in(table)):
            acceleration -= side * table[WEIGHTS + k, i] * start.modes[A, i]
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
def point_here(course: GapOrForce, phase: Any, tau: float) -> EventPoint:
    """Where a course is after a time for which `increments_after` has been called.

    `phase` is that of the force then.
    """
    # Compiled code counts references wherever it reads an array out of a struct.
    forcing, modes, begun = course.forcing, course.start.modes, course.start.phase
    table = course.start.tables[course.start.slot]
    if table[HEAD, COUPLED] != 0.0:
        return _coupled_point(course, phase, tau)
    sign, is_force, sums = course.sign, course.is_force, _begun(course, tau)
    for i in range(size_in(table)):
        weight = sign * float(table[WEIGHTS + course.k, i])
        osc, first = mode_of(forcing, table, i), motion_of(modes, begun, i)
        way, change = float(modes[WAY, i]), float(modes[CHANGE, i])
        motion = motion_from(osc, first.x + (first.v * tau + way), first.v + change, phase)
        if is_force:
            sums = _added_force(osc, weight, sums, motion)
        else:
            sums = added(osc, weight, sums, motion, way, change, abs(way))
    return event_point(tau, sums, 0.0)


@point_at.of(GapOrForce)
def _point_at(course, tau):
    forcing, start, turn = course.forcing, course.start, turn_over(course.forcing, tau)
    increments_after(forcing, start, turn, tau)
    return point_here(course, turned(forcing, start.phase, turn), tau)


@compiled_apart
def _coupled_point(course, phase, tau):
    """Where a sum of coupled modes is: their energy together never grows without the force."""
    start, forcing, sign, is_force = course.start, course.forcing, course.sign, course.is_force
    table, modes, row = start.tables[start.slot], start.modes, WEIGHTS + course.k
    size = size_in(table)
    rates = np.empty((7, size))
    for i in range(size):
        rates[0, i] = modes[X, i] + (modes[V, i] * tau + modes[WAY, i])
        rates[1, i] = modes[V, i] + modes[CHANGE, i]
    force = force_rates(forcing, phase)
    pushes = (force[0], force[1], force[2], force[3], force[4])
    for order in range(5):
        next_rate(table, pushes[order], order, rates, order, order + 1, order + 2)
    order = 2 if is_force else 0
    found = np.zeros(6)
    norm, energy, pushed, terms, drag = 0.0, 0.0, 0.0, 0.0, first_row(table, 0)
    for i in range(size):
        weight = sign * table[row, i]
        if is_force:
            own = table[PUSH, i] * bound_of(forcing, 0) + abs(table[PULL, i])
            for j in range(size):
                own += abs(table[drag + i, j] * rates[1, j])
            own += table[STIFFNESS, i] * abs(rates[0, i])
            found[0] += weight * rates[2, i]
            found[1] += weight * rates[3, i]
        else:
            own = abs(modes[WAY, i])
            found[0] += weight * modes[WAY, i]
            found[1] += weight * modes[CHANGE, i]
            found[5] += weight * rates[5, i]
        for each in range(2, 5):
            found[each] += weight * rates[order + each, i]
        terms += abs(weight) * own
        norm += weight * weight
        lower, upper = rates[order + 3, i], rates[order + 4, i]
        energy += table[STIFFNESS, i] * lower * lower + upper * upper
        pushed += table[PUSH, i] * table[PUSH, i]
    begun, norm = _begun(course, tau), math.sqrt(norm)
    return EventPoint(
        tau,
        begun.value + float(found[0]),
        begun.slope + float(found[1]),
        begun.second + float(found[2]),
        float(found[3]),
        float(found[4]),
        float(found[5]),
        norm * math.sqrt(energy),
        norm * math.sqrt(pushed) * bound_of(forcing, order + 3),
        ROUNDOFF * (begun.size + terms),
        0.0,
    )


@rates_of.of(GapOrForce)
def _rates_of(course):
    tables, slot, forcing_rate = course.start.tables, course.start.slot, rate_of(course.forcing)
    rate = max(forcing_rate, float(tables[slot, HEAD, SYSTEM_RATE]))
    return forcing_rate, rate, float(tables[slot, HEAD, SYSTEM_COUPLING])


@shorter_step.of(GapOrForce)
def _shorter_step(course, point, width, step):
    # The interpolation's error must be less than the distance in the middle: a parabola's here.
    near, bend = 2.0 * min(abs(point.value), abs(width - point.value)), abs(point.second) / 6.0
    for _ in range(_MOST_CUTS):
        square = step * step
        error = (point.bound4 + point.growth * step) * square * square
        if error <= 72.0 * (near + abs(point.slope) * step + bend * square):
            break
        step *= _CUT
    return step


@compiled
def gap_after(course: GapOrForce, tau: float) -> tuple[float, float, float]:
    """Gap, its rate and its roundoff after a time for which `modes_after` has been called."""
    table, modes = course.start.tables[course.start.slot], course.start.modes
    value, rate, begun = 0.0, 0.0, _begun(course, tau)
    size = begun.size
    for i in range(size_in(table)):
        weight = float(table[WEIGHTS + course.k, i])
        value += weight * modes[WAY, i]
        rate += weight * modes[CHANGE, i]
        size += abs(weight * modes[WAY, i])
    return begun.value + course.sign * value, begun.slope + course.sign * rate, ROUNDOFF * size


@compiled_apart
def next_event(
    model: OnStructure,
    bodies: np.ndarray,
    start: ModalStart,
    k: int,
    last: float,
    margin: float,
    slowest: float,
) -> tuple[float, float, int]:
    """When a mass arrives within a margin of a wall, is held no longer, or slides so slowly.

    Returns
    -------
    tau, side, steps
        As those of a `damper.engine.search.Root`, up to the time `last`; `STOPS` for a slide.
    """
    course = course_of(model, bodies, start, k)
    width = math.inf
    if not course.is_force:
        course = _narrowed(course, course.value - margin)
        width = 2.0 * (mass_in(model.masses, k).clearance - margin)
    elif bodies[k, MODE] == RESTING:
        width = 2.0 * friction_of(model, k)
    last, stops, taken = slide_end(model.friction, course, bodies, last, slowest)
    table, modes = start.tables[start.slot], start.modes
    for i in range(size_in(table)):
        modes[WAY, i], modes[CHANGE, i] = 0.0, 0.0
    here = point_here(course, start.phase, 0.0)
    if course.is_force and is_balanced(here, width):
        return last, 0.0, 1
    lifts_off = here.value == 0.0 and here.slope == 0.0 and here.second == 0.0
    lifts_off = lifts_off or (not course.is_force and bodies[k, ACCUMULATION] == LIFTS)
    if bodies[k, SLIP_DIRECTION] != 0.0:
        lifts_off = lifts_off and here.value == 0.0
    root = first_root(course, here, width, bool(lifts_off), last, 0.0)
    tau, steps = root.point.tau + root.step, root.steps + taken
    if stops != 0.0 and not (root.side != 0.0 and tau <= last):
        return last, stops, steps
    return tau, root.side, steps


class SlidingSpeed(NamedTuple):
    """The relative speed in a slide."""

    course: GapOrForce
    """A gap that grows in it."""


@compiled
def slide_of(course: GapOrForce, bodies: np.ndarray) -> SlidingSpeed:
    """The slide of a mass, whose gap is given."""
    k = course.k
    sign = -float(bodies[k, SLIP_DIRECTION] * bodies[k, SIDE])
    value, slope, acceleration = course.value, course.slope, course.acceleration
    return SlidingSpeed(
        _turned(course, sign * course.sign, sign * value, sign * slope, sign * acceleration)
    )


_turned = changed(GapOrForce, "sign", "value", "slope", "acceleration")


@compiled
def slide_point(moving: SlidingSpeed, p: EventPoint) -> EventPoint:
    """Where the speed of a slide is, from where its gap is."""
    course = moving.course
    table, modes = course.start.tables[course.start.slot], course.start.modes
    _, _, coupling = rates_of(course)
    size = abs(course.slope) + abs(course.acceleration) * p.tau
    for i in range(size_in(table)):
        size += abs(table[WEIGHTS + course.k, i] * modes[CHANGE, i])
    return rate_point(p, coupling, float(size))


@point_at.of(SlidingSpeed)
def _speed_at(moving, tau):
    return slide_point(moving, point_at(moving.course, tau))


@rates_of.of(SlidingSpeed)
def _rates_of_slide(moving):
    return rates_of(moving.course)


@shorter_step.of(SlidingSpeed)
def _shorter_step_of_slide(moving, point, width, step):
    return _shorter_step(moving.course, point, width, step)


@by_class
def slide_end(
    friction: Any, course: GapOrForce, bodies: np.ndarray, last: float, slowest: float
) -> tuple[float, float, int]:
    """When a mass slides as slowly, as for `next_event`; the last time if it does not by then."""


@slide_end.of(NoFriction)
def _no_slide(friction, course, bodies, last, slowest):
    return last, 0.0, 0


@slide_end.of(Frictions)
def _slide_end(friction, course, bodies, last, slowest):
    b = bodies[course.k]
    if course.is_force or b[SLIP_DIRECTION] == 0.0:
        return last, 0.0, 0
    moving, start = slide_of(course, bodies), course.start
    moving = SlidingSpeed(_slower(moving.course, moving.course.slope - slowest))
    modes = start.modes
    for i in range(size_in(start.tables[start.slot])):
        modes[WAY, i], modes[CHANGE, i] = 0.0, 0.0
    here = slide_point(moving, point_here(moving.course, start.phase, 0.0))
    if b[ACCUMULATION] == LIFTS:
        here = _flat(here, 0.0)
    root = first_root(moving, here, math.inf, False, last, 0.0)
    tau = root.point.tau + root.step
    if root.side == 1.0 and tau <= last:
        return tau, STOPS, root.steps
    if root.side == GAVE_UP:
        return root.point.tau, GAVE_UP, root.steps
    return last, 0.0, root.steps


_flat, _slower = changed(EventPoint, "slope"), changed(GapOrForce, "slope")

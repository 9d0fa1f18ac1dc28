"""The end of a compliant contact: values and bounds for the certified search.

The event function q is linear in the state of `damper.models.compliant.flow`: the depth -g, or
the contact force. Its fourth derivative is bounded in one of two ways.

**Energy.** Every derivative of the motion obeys the same equations with the derivative of the
force, so the root of its energy grows by at most a bound on that times the step: a bound on the
scale of the contact's own oscillation, for every set of parameters.

**Slow and fast.** Where the contact is faster than everything else, the state splits into a slow
part, which forcing and primary move, and a fast one, the decaying oscillation of the contact:
q = f + y with

    f'' + 2 B f' + K f = a sum of the force's pairs,    y'' + 2 b y' + w^2 y = 0,

exactly and without coupling. sqrt(w^2 y^2 + y'^2) never grows, so |y| stays below its present
bound R, and q is positive while f > R. This step does not depend on the contact's oscillation, so
a contact that lasts costs a few steps, whether the fast part has decayed or is too weak to matter.

The split is that of Chang (SIAM J. Appl. Math. 1972, 22, 151) with the forcing among the slow
variables. Derivations: docs/models.md.
"""

import math
from typing import NamedTuple

import numpy as np

from damper.engine import search
from damper.engine.compiled import compiled
from damper.engine.forcing import bound_of, rate_of
from damper.models.compliant import flow
from damper.models.compliant.pairs import MASSES, bound_of_sum, pair_count, pair_rates

#: Iterations in which the split must converge; else the contact counts as not faster than the rest.
_ITERATIONS = 60
_CONVERGED = 1e-15
#: Size from which on they diverge; its cube, to which one iteration takes it, is finite still.
_DIVERGED = 1e60
#: Part of the way to where the fast part can end a contact that one step over it takes.
_LEAP = 0.9


class Split(NamedTuple):
    """Slow and fast variables of the contact; `separated` is 0 where they are not apart.

    Slow are U, U' and the force's pairs: m of them, a row's length less 2. The terms are for a
    force of strength 1, so that its size does not decide convergence.
    """

    separated: float
    matrix: np.ndarray
    """(m, m) rates of change of the slow variables."""
    manifold: np.ndarray
    """(2, m) r and r' to which the fast part decays, from the slow variables."""
    fast_matrix: np.ndarray
    """(2, 2) rates of change of the fast part."""
    back: np.ndarray
    """(2, 2) what the fast part adds to U and U'."""


class EventFunction(NamedTuple):
    """A linear function of the state, by its coefficients and its slow and fast part.

    The parts are those of the distance to rest.
    """

    separated: float
    gap: float
    """Coefficient of r."""
    gap_rate: float
    """Coefficient of r'."""
    growth: float
    """Growth of the bound on the fourth derivative by energy in a unit of time."""
    slow: np.ndarray
    """(5, row length) slow part and its first four derivatives from the state."""
    fast: np.ndarray
    """(2, row length) fast part and its first derivative from the state."""
    fast_stiffness: float
    fast_drag: float
    """w^2 and 2 b of the fast."""
    stiffness: float
    """K of the slow part."""
    rate: float
    """Fastest rate of the slow part."""
    at_rest: float
    """Value in the state of rest."""
    driving1: float
    driving2: float
    driving3: float
    """Bounds on the first three derivatives of what drives the slow part."""


def split_of(contact: flow.ContactConstants) -> Split:
    """Split a contact into slow and fast variables."""
    m = flow.row_length(contact) - 2
    split = Split(1.0, np.zeros((m, m)), np.zeros((2, m)), np.zeros((2, 2)), np.zeros((2, 2)))
    return split._replace(separated=_separate(contact, split))


def event_function(contact: flow.ContactConstants, split: Split, row: np.ndarray) -> EventFunction:
    """Prepare an event function; `row` has its coefficients on U, U', r and r'."""
    length = flow.row_length(contact)
    slow, fast, driving = np.zeros((5, length)), np.zeros((2, length)), np.zeros(length)
    numbers = _fill_event_function(contact, split, row, slow, fast, driving)
    for columns in slow, fast, driving:
        columns[..., MASSES:] *= contact.strength
    gap, rate = float(row[2]), float(row[3])
    growth = contact.push / math.sqrt(contact.reduced)
    growth *= abs(gap) * bound_of(contact.forcing, 3) + abs(rate) * bound_of(contact.forcing, 4)
    at_rest = float(row[0]) * contact.rest.centre + gap * contact.rest.gap
    bounds = [bound_of_sum(contact.forcing, driving, order) for order in (1, 2, 3)]
    numbers = (*numbers, at_rest, *bounds)
    return EventFunction(split.separated, gap, rate, growth, slow, fast, *numbers)


@compiled
def _separate(contact, split):
    """Fill a split; 1 if it converged to slow variables and a fast part that decays."""
    beta = contact.reduced
    alpha = contact.share
    drag = contact.drag
    stiff = contact.relative_stiffness + beta
    damp = contact.relative_damping + drag * beta
    manifold = split.manifold
    matrix = split.matrix
    m = len(matrix)
    # p by the slow variables alone, and what the force does to the gap.
    target = np.zeros(m)
    target[0], target[1] = -1.0, -drag
    matrix[0, 1] = 1.0
    for pair in range(pair_count(contact.forcing)):
        k = 2 + 2 * pair
        target[k] = contact.on_gap
        matrix[k, k + 1], matrix[k + 1, k] = pair_rates(contact.forcing, pair)
    following = np.zeros(m)
    converged = False
    for _ in range(_ITERATIONS):
        for k in range(m):
            back_on_p = beta * (manifold[0, k] + drag * manifold[1, k])
            pulled = target[k] if k < 2 else 0.0
            matrix[1, k] = alpha * (pulled - back_on_p)
            if k >= 2 and k % 2 == 0:
                matrix[1, k] += contact.on_centre
        largest = 0.0
        change = 0.0
        _times(manifold[0], matrix, manifold[1])
        _times(manifold[1], matrix, following)
        for k in range(m):
            new = (target[k] - following[k] - damp * manifold[1, k]) / stiff
            change = max(change, abs(new - manifold[0, k]))
            largest = max(largest, abs(new))
            manifold[0, k] = new
        if not largest < _DIVERGED:
            return 0.0
        if change <= _CONVERGED * largest:
            converged = True
            break
    if not converged:
        return 0.0
    return _close(contact, split, stiff, damp)


@compiled
def _close(contact, split, stiff, damp):
    """Fill the fast part's own matrix, and what it gives back to the slow one."""
    alpha_beta = contact.share * contact.reduced
    drag = contact.drag
    manifold = split.manifold
    matrix = split.matrix
    m = split.fast_matrix
    m[0, 0] = manifold[0, 1] * alpha_beta
    m[0, 1] = 1.0 + manifold[0, 1] * alpha_beta * drag
    m[1, 0] = -stiff + manifold[1, 1] * alpha_beta
    m[1, 1] = -damp + manifold[1, 1] * alpha_beta * drag
    determinant = m[0, 0] * m[1, 1] - m[0, 1] * m[1, 0]
    if not (determinant > 0.0 and m[0, 0] + m[1, 1] <= 0.0):
        return 0.0
    back = split.back
    for _ in range(_ITERATIONS):
        gap = matrix[1, 0] * back[0, 0] + matrix[1, 1] * back[1, 0] - alpha_beta
        rate = matrix[1, 0] * back[0, 1] + matrix[1, 1] * back[1, 1] - alpha_beta * drag
        new_gap = (gap * m[1, 1] - rate * m[1, 0]) / determinant
        new_rate = (rate * m[0, 0] - gap * m[0, 1]) / determinant
        change = max(abs(new_gap - back[1, 0]), abs(new_rate - back[1, 1]))
        largest = max(abs(new_gap), abs(new_rate))
        back[1, 0] = new_gap
        back[1, 1] = new_rate
        back[0, 0] = (new_gap * m[1, 1] - new_rate * m[1, 0]) / determinant
        back[0, 1] = (new_rate * m[0, 0] - new_gap * m[0, 1]) / determinant
        if not largest < _DIVERGED:
            return 0.0
        if change <= _CONVERGED * largest:
            return 1.0
    return 0.0


@compiled
def _times(row, matrix, result):
    m = len(matrix)
    for k in range(m):
        total = 0.0
        for i in range(m):
            total += float(row[i]) * float(matrix[i, k])
        result[k] = total


@compiled
def _place(variable):
    """Column of a row that belongs to a slow variable."""
    return variable if variable < 2 else variable + 2


@compiled
def _fill_event_function(contact, split, row, slow, fast, driving):
    """Fill the rows of an event function; return its numbers."""
    if split.separated == 0.0:
        return 0.0, 0.0, 0.0, 0.0
    manifold = split.manifold
    matrix = split.matrix
    variables = len(matrix)
    coefficients = np.zeros(variables)
    for k in range(variables):
        coefficients[k] = row[2] * manifold[0, k] + row[3] * manifold[1, k]
        if k < 2:
            coefficients[k] += row[k]
    weights = np.zeros(2)
    for k in range(2):
        weights[k] = row[2 + k]
        for i in range(2):
            weights[k] += coefficients[i] * split.back[i, k]
    stiffness = -float(matrix[1, 0])
    drag = -float(matrix[1, 1])
    _fill_driving(contact, matrix, coefficients, driving)
    # The fast variables r - manifold Y, and then the slow ones Y - back times these.
    own = np.zeros((2, len(driving)))
    for i in range(2):
        for k in range(variables):
            own[i, _place(k)] = -manifold[i, k]
        own[i, 2 + i] = 1.0
    following = np.zeros(variables)
    for order in range(5):
        for k in range(variables):
            slow[order, _place(k)] = coefficients[k]
        for i in range(2):
            part = coefficients[0] * split.back[0, i] + coefficients[1] * split.back[1, i]
            for k in range(len(driving)):
                slow[order, k] -= part * own[i, k]
        _times(coefficients, matrix, following)
        for k in range(variables):
            coefficients[k] = following[k]
    m = split.fast_matrix
    for k in range(len(driving)):
        fast[0, k] = weights[0] * own[0, k] + weights[1] * own[1, k]
        fast[1, k] = (weights[0] * m[0, 0] + weights[1] * m[1, 0]) * own[0, k] + (
            weights[0] * m[0, 1] + weights[1] * m[1, 1]
        ) * own[1, k]
    fast_stiffness = float(m[0, 0] * m[1, 1] - m[0, 1] * m[1, 0])
    fast_drag = -float(m[0, 0] + m[1, 1])
    own_rate = max(drag, 0.0) + math.sqrt(max(stiffness, 0.0))
    return fast_stiffness, fast_drag, stiffness, max(rate_of(contact.forcing), own_rate)


@compiled
def _fill_driving(contact, matrix, coefficients, driving):
    """Fill what drives f, of these coefficients: (D^2 + 2 B D + K) f by the force's pairs."""
    stiffness = -float(matrix[1, 0])
    drag = -float(matrix[1, 1])
    of_u, of_w = coefficients[0], coefficients[1]
    for pair in range(pair_count(contact.forcing)):
        k = 2 + 2 * pair
        up, down = pair_rates(contact.forcing, pair)
        first, second = coefficients[k], coefficients[k + 1]
        detuning = stiffness + up * down
        driving[k + 2] = (
            of_u * matrix[1, k]
            + of_w * down * matrix[1, k + 1]
            + first * detuning
            + second * drag * down
        )
        driving[k + 3] = (
            of_u * matrix[1, k + 1]
            + of_w * up * matrix[1, k]
            + second * detuning
            + first * drag * up
        )


class ContactMotion(NamedTuple):
    """A contact, as the search sees it."""

    contact: flow.ContactConstants
    table: np.ndarray
    """Its propagators."""
    event: EventFunction
    side: float
    """By which the event function is multiplied."""
    start: flow.Pair


class Parts(NamedTuple):
    """State at a point of the search, and the slow part of the event function."""

    z: flow.Pair
    slow: float
    slow1: float
    slow2: float
    slow3: float
    bound4: float
    """Bound on the slow part's fourth derivative, as in `EventPoint`."""
    level: float
    """Bound on the fast part."""


@search.point_at.of(ContactMotion)
def _point_at(moving, tau):
    z = moving.start
    if tau > 0.0:
        z = flow.advance(moving.contact, moving.table, z, tau)
    return contact_point(moving, tau, z)


@compiled
def contact_point(moving: ContactMotion, tau: float, z: flow.Pair) -> search.EventPoint:
    """Event function in a state of the contact."""
    contact = moving.contact
    event = moving.event
    f0, f1, f2, f3, f4 = flow.force_rates_in(contact, z)
    away = flow.from_rest(contact.rest, z)
    z1 = flow.derivative(contact, away, f0)
    z2 = flow.derivative(contact, z1, f1)
    z3 = flow.derivative(contact, z2, f2)
    z4 = flow.derivative(contact, z3, f3)
    z5 = flow.derivative(contact, z4, f4)
    gap = moving.side * event.gap
    rate = moving.side * event.gap_rate
    if event.separated != 0.0:
        parts, fast4 = _parts(moving, z, away)
        bound4 = parts.bound4 + fast4
        growth = event.driving3
    else:
        swing = 1.0 / math.sqrt(contact.reduced)
        bound4 = abs(event.gap) * swing * flow.energy_size(contact, z3)
        if event.gap_rate != 0.0:
            bound4 += abs(event.gap_rate) * swing * flow.energy_size(contact, z4)
        growth = event.growth
        parts = Parts(z, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0)
    return search.EventPoint(
        tau,
        gap * z[2] + rate * z[3],
        gap * z1[2] + rate * z1[3],
        gap * z2[2] + rate * z2[3],
        gap * z3[2] + rate * z3[3],
        gap * z4[2] + rate * z4[3],
        gap * z5[2] + rate * z5[3],
        bound4,
        growth,
        _roundoff(contact, event, z, tau),
        parts,
    )


@search.rates_of.of(ContactMotion)
def _rates_of(moving):
    rate = moving.contact.rate
    return rate, rate, rate


@search.proves_inside.of(ContactMotion)
def _proves_inside(moving, start, end, width):
    """The slow part stays above all that the fast one can take from it."""
    p = start.state
    q = end.state
    if moving.event.separated == 0.0 or p.slow <= p.level:
        return False
    growth = moving.event.driving3
    return search.stays_inside(
        _slow_point(start, p, p.level, growth), _slow_point(end, q, p.level, growth), width
    )


@compiled
def _slow_point(point, parts, level, growth):
    return search.EventPoint(
        point.tau,
        parts.slow - level,
        parts.slow1,
        parts.slow2,
        parts.slow3,
        0.0,
        0.0,
        parts.bound4,
        growth,
        point.roundoff,
        0.0,
    )


@search.longer_step.of(ContactMotion)
def _longer_step(moving, point):
    """Close to where the slow part may come down to the fast one."""
    p = point.state
    if moving.event.separated == 0.0 or p.slow <= p.level:
        return 0.0
    reach = _LEAP * search.parabola_root(p.slow - p.level, p.slow1, p.slow2)
    return min(reach, 1.5 / moving.event.rate)


@compiled
def _parts(moving, state, z):
    """Slow part with its bound and that on the fast part; a bound on the fast fourth derivative."""
    contact = moving.contact
    event = moving.event
    side = moving.side
    y = flow.dot(contact, event.fast[0], z)
    y1 = flow.dot(contact, event.fast[1], z)
    w2 = event.fast_stiffness
    level = math.sqrt(y * y + y1 * y1 / w2)
    y2 = -event.fast_drag * y1 - w2 * y
    y3 = -event.fast_drag * y2 - w2 * y1
    y4 = -event.fast_drag * y3 - w2 * y2
    slow3 = side * flow.dot(contact, event.slow[3], z)
    slow4 = flow.dot(contact, event.slow[4], z)
    parts = Parts(
        state,
        side * (flow.dot(contact, event.slow[0], z) + event.at_rest),
        side * flow.dot(contact, event.slow[1], z),
        side * flow.dot(contact, event.slow[2], z),
        slow3,
        math.sqrt(max(event.stiffness, 0.0) * slow3 * slow3 + slow4 * slow4),
        level,
    )
    return parts, math.sqrt(w2 * y3 * y3 + y4 * y4)


@compiled
def force_size(drag: float, x: float, v: float, force: float) -> float:
    """Size of the forces on the primary, drag = 2 zeta and `force` that of the one from outside."""
    return abs(force) + abs(x) + drag * abs(v)


@compiled
def _roundoff(contact, event, z, tau):
    """Roundoff of the event function: that of the forces, while it lasts."""
    forces = force_size(contact.drag, z[0], z[1], contact.largest)
    reach = min(0.5 * tau * tau, 1.0 / max(contact.relative_stiffness, 1e-300))
    passing = min(math.sqrt(2.0 * reach), 1.0 / max(contact.relative_damping, 1e-300))
    weight = abs(event.gap)
    damping = abs(event.gap_rate)
    return search.ROUNDOFF * (
        weight * abs(z[2]) + damping * abs(z[3]) + (weight * reach + damping * passing) * forces
    )

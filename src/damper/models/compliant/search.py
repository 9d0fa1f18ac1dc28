"""When a compliant contact ends: what the certified search needs to know of it.

The event function q is linear in the state of `damper.models.compliant.flow`: the depth -g, or
the contact force. Its fourth derivative is bounded in one of two ways.

**Energy.** Every derivative of the motion obeys the same equations with the derivative of the
force, so the root of its energy grows by at most omega^n times the step: a bound on the scale of
the contact's own oscillation, for every set of parameters.

**Slow and fast.** Where the contact is faster than everything else, the state splits into a slow
part, which forcing and primary move, and a fast one, the decaying oscillation of the contact:
q = f + y with

    f'' + 2 B f' + K f = harmonic,    y'' + 2 b y' + w^2 y = 0,

exactly and without coupling. sqrt(w^2 y^2 + y'^2) never grows, so |y| stays below its present
bound R, and q is positive while f > R is. Such a step knows nothing of the contact's oscillation:
a contact that lasts costs a few steps, whether the fast part has decayed or is too weak to matter.

The split is that of Chang (SIAM J. Appl. Math. 1972, 22, 151) with the forcing among the slow
variables. Derivations: docs/models.md.
"""

import math
from typing import NamedTuple

import numpy as np

from damper.engine.compiled import compiled
from damper.engine.search import (
    ROUNDOFF,
    EventPoint,
    longer_step,
    parabola_root,
    point_at,
    proves_inside,
    rates_of,
    stays_inside,
)
from damper.models.compliant.flow import ContactConstants, Pair, advance, derivative, energy_size

#: Iterations in which the split must converge; else the contact counts as not faster than the rest.
_ITERATIONS = 60
_CONVERGED = 1e-15
#: Size from which on they diverge; its cube, to which one iteration takes it, is finite still.
_DIVERGED = 1e60
#: Part of the way to where the fast part can end a contact that one step over it takes.
_LEAP = 0.9


class Split(NamedTuple):
    """Slow and fast variables of the contact; `separated` is 0 where they are not apart."""

    separated: float
    slow: np.ndarray
    """(4, 6) slow variables from the state."""
    matrix: np.ndarray
    """(4, 4) their rates of change."""
    manifold: np.ndarray
    """(2, 4) gap and rate to which the fast part decays, from the slow variables."""
    fast: np.ndarray
    """(2, 6) the fast part from the state."""
    fast_matrix: np.ndarray
    """(2, 2) its rates of change."""
    back: np.ndarray
    """(4, 2) what the fast part adds to U, U', S, C."""


class EventFunction(NamedTuple):
    """A linear function of the state, by its coefficients and its slow and fast part."""

    separated: float
    gap: float
    """Coefficient of the gap."""
    gap_rate: float
    """Coefficient of the gap's rate."""
    slow: np.ndarray
    """(5, 6) slow part and its first four derivatives from the state."""
    fast: np.ndarray
    """(2, 6) fast part and its first derivative from the state."""
    fast_stiffness: float
    fast_drag: float
    """w^2 and 2 b of the fast."""
    stiffness: float
    """K of the slow part."""
    force: float
    """Amplitude of what drives the slow part."""
    rate: float
    """Fastest rate of the slow part."""


def split_of(contact: ContactConstants) -> Split:
    """Split a contact into slow and fast variables."""
    split = Split(
        1.0,
        np.zeros((4, 6)),
        np.zeros((4, 4)),
        np.zeros((2, 4)),
        np.zeros((2, 6)),
        np.zeros((2, 2)),
        np.zeros((4, 2)),
    )
    return split._replace(separated=_separate(contact, split))


def event_function(contact: ContactConstants, split: Split, row: np.ndarray) -> EventFunction:
    """Prepare an event function; `row` has its coefficients on (U, U', g, g', S, C)."""
    slow = np.zeros((5, 6))
    fast = np.zeros((2, 6))
    numbers = _fill_event_function(contact, split, row, slow, fast)
    return EventFunction(split.separated, float(row[2]), float(row[3]), slow, fast, *numbers)


@compiled
def _separate(contact, split):
    """Fill a split; 1 if it converged to slow variables and a fast part that decays."""
    beta = contact.reduced
    alpha = contact.share
    drag = contact.drag
    omega = contact.omega
    stiff = contact.relative_stiffness + beta
    damp = contact.relative_damping + drag * beta
    manifold = split.manifold
    matrix = split.matrix
    # p on the manifold, by the slow variables.
    p = np.zeros(4)
    target = (-1.0, -drag, 1.0, 0.0)
    converged = False
    for _ in range(_ITERATIONS):
        for k in range(4):
            p[k] = target[k] - beta * (manifold[0, k] + drag * manifold[1, k])
        matrix[0, 1] = 1.0
        for k in range(4):
            matrix[1, k] = alpha * p[k]
        matrix[2, 3] = omega
        matrix[3, 2] = -omega
        largest = 0.0
        change = 0.0
        _times(manifold[0], matrix, manifold[1])
        following = np.zeros(4)
        _times(manifold[1], matrix, following)
        for k in range(4):
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
    # The fast part's own matrix, and its inverse.
    m = split.fast_matrix
    m[0, 0] = manifold[0, 1] * alpha * beta
    m[0, 1] = 1.0 + manifold[0, 1] * alpha * beta * drag
    m[1, 0] = -stiff + manifold[1, 1] * alpha * beta
    m[1, 1] = -damp + manifold[1, 1] * alpha * beta * drag
    determinant = m[0, 0] * m[1, 1] - m[0, 1] * m[1, 0]
    if not (determinant > 0.0 and m[0, 0] + m[1, 1] <= 0.0):
        return 0.0
    back = split.back
    converged = False
    for _ in range(_ITERATIONS):
        gap = matrix[1, 0] * back[0, 0] + matrix[1, 1] * back[1, 0] - alpha * beta
        rate = matrix[1, 0] * back[0, 1] + matrix[1, 1] * back[1, 1] - alpha * beta * drag
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
            converged = True
            break
    if not converged:
        return 0.0
    places = (0, 1, 4, 5)
    for row in range(2):
        for k in range(4):
            split.fast[row, places[k]] = -manifold[row, k]
        split.fast[row, 2 + row] = 1.0
    for row in range(4):
        for k in range(6):
            split.slow[row, k] = -(
                back[row, 0] * split.fast[0, k] + back[row, 1] * split.fast[1, k]
            )
        split.slow[row, places[row]] += 1.0
    return 1.0


@compiled
def _times(row, matrix, result):
    for k in range(4):
        total = 0.0
        for i in range(4):
            total += float(row[i]) * float(matrix[i, k])
        result[k] = total


@compiled
def _fill_event_function(contact, split, row, slow, fast):
    """Fill the rows of an event function; return its numbers."""
    if split.separated == 0.0:
        return 0.0, 0.0, 0.0, 0.0, 0.0
    places = (0, 1, 4, 5)
    coefficients = np.zeros(4)
    for k in range(4):
        coefficients[k] = (
            row[places[k]] + row[2] * split.manifold[0, k] + row[3] * split.manifold[1, k]
        )
    weights = np.zeros(2)
    for k in range(2):
        weights[k] = row[2 + k]
        for i in range(4):
            weights[k] += coefficients[i] * split.back[i, k]
    # What drives f: (D^2 + 2 B D + K) f is a sum of S and C.
    stiffness = -float(split.matrix[1, 0])
    drag = -float(split.matrix[1, 1])
    omega = contact.omega
    driving_sin = float(split.matrix[1, 2])
    driving_cos = float(split.matrix[1, 3])
    detuning = stiffness - omega * omega
    sin = (
        coefficients[0] * driving_sin
        - coefficients[1] * omega * driving_cos
        + coefficients[2] * detuning
        - coefficients[3] * drag * omega
    )
    cos = (
        coefficients[0] * driving_cos
        + coefficients[1] * omega * driving_sin
        + coefficients[3] * detuning
        + coefficients[2] * drag * omega
    )
    force = math.sqrt(sin * sin + cos * cos)
    following = np.zeros(4)
    for order in range(5):
        for k in range(6):
            total = 0.0
            for i in range(4):
                total += coefficients[i] * split.slow[i, k]
            slow[order, k] = total
        _times(coefficients, split.matrix, following)
        for i in range(4):
            coefficients[i] = following[i]
    m = split.fast_matrix
    for k in range(6):
        fast[0, k] = weights[0] * split.fast[0, k] + weights[1] * split.fast[1, k]
        fast[1, k] = (weights[0] * m[0, 0] + weights[1] * m[1, 0]) * split.fast[0, k] + (
            weights[0] * m[0, 1] + weights[1] * m[1, 1]
        ) * split.fast[1, k]
    fast_stiffness = float(m[0, 0] * m[1, 1] - m[0, 1] * m[1, 0])
    fast_drag = -float(m[0, 0] + m[1, 1])
    rate = max(omega, max(drag, 0.0) + math.sqrt(max(stiffness, 0.0)))
    return fast_stiffness, fast_drag, stiffness, force, rate


@compiled
def dot(row: np.ndarray, z: Pair) -> float:
    """Linear function of a state."""
    return float(
        row[0] * z[0]
        + row[1] * z[1]
        + row[2] * z[2]
        + row[3] * z[3]
        + row[4] * z[4]
        + row[5] * z[5]
    )


class ContactMotion(NamedTuple):
    """A contact, as the search sees it."""

    contact: ContactConstants
    table: np.ndarray
    """Its propagators."""
    event: EventFunction
    start: Pair


class Parts(NamedTuple):
    """State at a point of the search, and the slow part of the event function."""

    z: Pair
    slow: float
    slow1: float
    slow2: float
    slow3: float
    bound4: float
    """Bound on the slow part's fourth derivative, as in `EventPoint`."""
    level: float
    """Bound on the fast part."""


@point_at.of(ContactMotion)
def _point_at(moving, tau):
    z = moving.start
    if tau > 0.0:
        z = advance(moving.contact, moving.table, z, tau)
    return contact_point(moving, tau, z)


@compiled
def contact_point(moving: ContactMotion, tau: float, z: Pair) -> EventPoint:
    """Event function in a state of the contact."""
    contact = moving.contact
    event = moving.event
    z1 = derivative(contact, z)
    z2 = derivative(contact, z1)
    z3 = derivative(contact, z2)
    z4 = derivative(contact, z3)
    z5 = derivative(contact, z4)
    omega = contact.omega
    omega3 = omega * omega * omega
    if event.separated != 0.0:
        slow, slow1, slow2, slow3, slow4, level, fast4 = _parts(event, z)
        slow_bound = math.sqrt(max(event.stiffness, 0.0) * slow3 * slow3 + slow4 * slow4)
        bound4 = slow_bound + fast4
        growth = event.force * omega3
        parts = Parts(z, slow, slow1, slow2, slow3, slow_bound, level)
    else:
        swing = 1.0 / math.sqrt(contact.reduced)
        bound4 = abs(event.gap) * swing * energy_size(contact, z3)
        growth = abs(event.gap) * swing * omega3
        if event.gap_rate != 0.0:
            bound4 += abs(event.gap_rate) * swing * energy_size(contact, z4)
            growth += abs(event.gap_rate) * swing * omega3 * omega
        parts = Parts(z, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0)
    return EventPoint(
        tau,
        event.gap * z[2] + event.gap_rate * z[3],
        event.gap * z1[2] + event.gap_rate * z1[3],
        event.gap * z2[2] + event.gap_rate * z2[3],
        event.gap * z3[2] + event.gap_rate * z3[3],
        event.gap * z4[2] + event.gap_rate * z4[3],
        event.gap * z5[2] + event.gap_rate * z5[3],
        bound4,
        growth,
        _roundoff(contact, event, z, tau),
        parts,
    )


@rates_of.of(ContactMotion)
def _rates_of(moving):
    rate = moving.contact.rate
    return rate, rate, rate


@proves_inside.of(ContactMotion)
def _proves_inside(moving, start, end, width):
    """The slow part stays above all that the fast one can take from it."""
    p = start.state
    q = end.state
    if moving.event.separated == 0.0 or p.slow <= p.level:
        return False
    omega = moving.contact.omega
    growth = moving.event.force * omega * omega * omega
    return stays_inside(
        _slow_point(start, p, p.level, growth), _slow_point(end, q, p.level, growth), width
    )


@compiled
def _slow_point(point, parts, level, growth):
    return EventPoint(
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


@longer_step.of(ContactMotion)
def _longer_step(moving, point):
    """Close to where the slow part may come down to the fast one."""
    p = point.state
    if moving.event.separated == 0.0 or p.slow <= p.level:
        return 0.0
    reach = _LEAP * parabola_root(p.slow - p.level, p.slow1, p.slow2)
    return min(reach, 1.5 / moving.event.rate)


@compiled
def _parts(event, z):
    """Slow part with four derivatives, the fast part's bound, and that of its fourth derivative."""
    y = dot(event.fast[0], z)
    y1 = dot(event.fast[1], z)
    w2 = event.fast_stiffness
    level = math.sqrt(y * y + y1 * y1 / w2)
    y2 = -event.fast_drag * y1 - w2 * y
    y3 = -event.fast_drag * y2 - w2 * y1
    y4 = -event.fast_drag * y3 - w2 * y2
    return (
        dot(event.slow[0], z),
        dot(event.slow[1], z),
        dot(event.slow[2], z),
        dot(event.slow[3], z),
        dot(event.slow[4], z),
        level,
        math.sqrt(w2 * y3 * y3 + y4 * y4),
    )


@compiled
def force_size(drag: float, x: float, v: float, sin: float, cos: float) -> float:
    """Size of the forces on the primary, drag = 2 zeta; in units of F0."""
    return abs(sin) + abs(cos) + abs(x) + drag * abs(v)


@compiled
def _roundoff(contact, event, z, tau):
    """Roundoff of the event function: that of the forces, while it lasts."""
    forces = force_size(contact.drag, z[0], z[1], z[4], z[5])
    reach = min(0.5 * tau * tau, 1.0 / max(contact.relative_stiffness, 1e-300))
    passing = min(math.sqrt(2.0 * reach), 1.0 / max(contact.relative_damping, 1e-300))
    weight = abs(event.gap)
    damping = abs(event.gap_rate)
    return ROUNDOFF * (
        weight * abs(z[2]) + damping * abs(z[3]) + (weight * reach + damping * passing) * forces
    )

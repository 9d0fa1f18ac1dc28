"""The structure with the masses that stick to it as one linear system, by its modes."""

import math

import numpy as np

from damper.engine.compiled import compiled, compiled_apart
from damper.models.structure.constants import (
    FALLS,
    STICKS,
    YIELDS,
    JoinedSystem,
    OnStructure,
    box_in,
    drag_in,
    mass_in,
    push_in,
    size_of,
    stiffness_in,
    table_of,
)
from damper.models.structure.linear import dot, eigenvectors, product, root_inverse, times

#: Part of the largest damping below which that between two modes is roundoff.
_NO_COUPLING = 1e-13


@compiled
def is_tied(model: OnStructure, k: int) -> bool:
    """Whether a free mass is tied to its box."""
    m = mass_in(model.masses, k)
    return m.tie_stiffness > 0.0 or m.tie_damping > 0.0


@compiled
def follows_base(model: OnStructure) -> bool:
    """Whether the force acts on free masses as well."""
    found = False
    for k in range(len(model.masses)):
        found = found or mass_in(model.masses, k).carried != 0.0
    return found


@compiled_apart
def system_of(model: OnStructure, sticks: np.ndarray) -> JoinedSystem:
    """The system in which these masses stick to their boxes."""
    n, count, carried = size_of(model), len(sticks), follows_base(model)
    size = n + int(carried)
    for k in range(count):
        size += int(is_tied(model, k) and not sticks[k])
    mass, stiffness, damping = np.eye(size), np.zeros((size, size)), np.zeros((size, size))
    push, pull, gaps = np.zeros(size), np.zeros(size), np.zeros((count, size))
    falls = np.zeros(count)
    push[:n], damping[:n, :n] = push_in(model), drag_in(model)
    for i in range(n):
        stiffness[i, i] = stiffness_in(model)[i]
    own, plain = n, not carried
    for k in range(count):
        m, box = mass_in(model.masses, k), box_in(model, k)
        gaps[k, :n] = box
        if not sticks[k] and is_tied(model, k):
            plain = False
            gaps[k, own] = -1.0
            mass[own, own], push[own], pull[own] = m.mass, m.mass * m.carried, -m.mass * m.gravity
            _add_tie(stiffness, gaps[k], m.tie_stiffness)
            _add_tie(damping, gaps[k], m.tie_damping)
            own += 1
            continue
        falls[k] = m.gravity
        if carried:
            gaps[k, size - 1] = -m.carried
        if sticks[k]:
            plain = False
            _add_tie(mass, box, m.mass)
            push[:n] += m.mass * m.carried * box
            pull[:n] -= m.mass * m.gravity * box
    if carried:
        push[size - 1] = 1.0
    shapes, squares = np.eye(size), np.diag(stiffness).copy()
    if not plain:
        root = root_inverse(mass)
        squares, vectors = eigenvectors(_symmetric(product(product(root, stiffness), root.T)))
        shapes = product(root.T, vectors)
    return _in_modes(model, sticks, mass, squares, damping, push, pull, gaps, falls, shapes, plain)


@compiled
def _add_tie(matrix, between, size):
    """Add what acts between two places to a matrix, in place."""
    for i in range(len(between)):
        for j in range(len(between)):
            matrix[i, j] += size * between[i] * between[j]


@compiled
def _symmetric(matrix):
    return 0.5 * (matrix + matrix.T)


@compiled_apart
def _in_modes(model, sticks, mass, squares, damping, push, pull, gaps, falls, shapes, plain):
    """The system in its modes, each of which the force pushes forwards."""
    carried, size = follows_base(model), len(squares)
    pushes = times(shapes.T, push)
    for i in range(size):
        squares[i] = max(squares[i], 0.0)
        if pushes[i] < 0.0:
            shapes[:, i] = -shapes[:, i]
            pushes[i] = -pushes[i]
    drag = product(shapes.T, product(damping, shapes))
    largest, sizes, coupled = 0.0, 0.0, False
    for i in range(size):
        largest = max(largest, abs(drag[i, i]))
    for i in range(size):
        for j in range(size):
            if i != j and abs(drag[i, j]) <= _NO_COUPLING * largest:
                drag[i, j] = 0.0
            coupled = coupled or (i != j and drag[i, j] != 0.0)
            sizes += drag[i, j] * drag[i, j]
    weights, yields = product(gaps, shapes), np.zeros(len(gaps))
    for k in range(len(gaps)):
        yields[k] = dot(weights[k], weights[k])
        if carried and gaps[k, size - 1] != 0.0:
            yields[k] -= gaps[k, size - 1] * gaps[k, size - 1]
        if not (is_tied(model, k) and not sticks[k]):
            yields[k] += 1.0 / mass_in(model.masses, k).mass
    own = np.zeros((3, len(gaps)))
    own[STICKS], own[FALLS], own[YIELDS] = sticks, falls, yields
    return JoinedSystem(
        table_of(
            squares,
            pushes,
            times(shapes.T, pull),
            weights,
            drag,
            shapes,
            product(shapes.T, mass),
        ),
        own,
        len(gaps),
        carried,
        coupled,
        plain,
        math.sqrt(sizes) + math.sqrt(np.max(squares)),
        math.sqrt(sizes + np.max(squares)),
    )

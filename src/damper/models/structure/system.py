"""The structure with the masses that stick to it as one linear system, by its modes."""

import math
from typing import Any

import numpy as np

from damper.engine.compiled import compiled, compiled_apart
from damper.engine.dispatch import by_class_or_default
from damper.engine.forcing import gain_of
from damper.engine.forcing.harmonic import Gain, HarmonicForce
from damper.engine.forcing.weighed import WeighedForce
from damper.models.structure.constants import (
    CARRIED,
    COUPLED,
    DAMPING,
    DASHPOTS,
    DRAGS,
    FALLS,
    GAIN_IM,
    GAIN_RE,
    HEAD,
    HEAD_WIDTH,
    JOINED,
    LEAST,
    PLAIN,
    PUSH,
    SIZE,
    SPLIT,
    STATE,
    STIFFENS,
    STIFFNESS,
    SYSTEM_COUPLING,
    SYSTEM_RATE,
    WEIGHTS,
    YIELDS,
    OnStructure,
    fill_table,
    first_row,
    friction_of,
    mass_in,
    size_of,
)
from damper.models.structure.linear import congruent, eigenvectors, product, root_inverse

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
def shape_of_tables(model: OnStructure) -> tuple[int, int, int]:
    """Rows and columns of a table that holds any system of a structure, and the most modes."""
    count = len(model.masses)
    size = size_of(model) + int(follows_base(model))
    for k in range(count):
        size += int(is_tied(model, k))
    return WEIGHTS + count + 3 * size, max(size, count, HEAD_WIDTH), size


@compiled_apart
def make_system(model: OnStructure, states: np.ndarray, table: np.ndarray) -> None:
    """Fill a table of zeros with the system in which the masses have these states."""
    n, count, carried = size_of(model), len(states), follows_base(model)
    size, plain = n + int(carried), not carried
    for k in range(count):
        size += int(is_tied(model, k) and states[k] != JOINED)
        plain = plain and states[k] != JOINED and not is_tied(model, k)
    mass, stiffness = np.zeros((size, size)), np.zeros((size, size))
    damping, gaps = np.zeros((size, size)), np.zeros((count, size))
    push, pull, own, given = np.zeros(size), np.zeros(size), n, model.table
    for i in range(n):
        push[i], stiffness[i, i] = given[PUSH, i], given[STIFFNESS, i]
        for j in range(n):
            damping[i, j] = given[first_row(given, 0) + i, j]
    for i in range(size):
        mass[i, i] = 1.0
    for k in range(count):
        m = mass_in(model.masses, k)
        rubs = 0.0 if states[k] == JOINED else 0.5 * states[k] * friction_of(model, k)
        table[STATE, k] = states[k]
        for i in range(n):
            gaps[k, i] = given[WEIGHTS + k, i]
            pull[i] += m.mass * rubs * gaps[k, i]
        if states[k] == JOINED:
            _add_tie(mass, gaps[k], m.mass)
            for i in range(n):
                push[i] += m.mass * m.carried * gaps[k, i]
                pull[i] -= m.mass * m.gravity * gaps[k, i]
        elif is_tied(model, k):
            gaps[k, own] = -1.0
            mass[own, own], push[own] = m.mass, m.mass * m.carried
            pull[own] = -m.mass * (m.gravity + rubs)
            _add_tie(stiffness, gaps[k], m.tie_stiffness)
            _add_tie(damping, gaps[k], m.tie_damping)
            own += 1
            continue
        table[FALLS, k] = m.gravity + rubs
        if carried:
            gaps[k, size - 1] = -m.carried
    if carried:
        push[size - 1] = 1.0
    # Modes in rows: coordinates are their sums.
    modes, squares = np.eye(size), np.zeros(size)
    if plain:
        for i in range(size):
            squares[i] = stiffness[i, i]
    else:
        root = root_inverse(mass)
        scaled = congruent(root, stiffness)
        for i in range(size):
            for j in range(i):
                scaled[i, j] = scaled[j, i] = 0.5 * (scaled[i, j] + scaled[j, i])
        squares, vectors = eigenvectors(scaled)
        for i in range(size):
            for j in range(size):
                modes[i, j] = 0.0
                for k in range(size):
                    modes[i, j] += vectors[k, i] * root[k, j]
    _in_modes(table, modes, squares, (mass, damping), (push, pull), gaps)
    table[HEAD, PLAIN], table[HEAD, CARRIED] = 1.0 if plain else 0.0, 1.0 if carried else 0.0
    _react(model, table)
    keep_gains(model.forcing, table)


@by_class_or_default
def keep_gains(forcing: Any, table: np.ndarray) -> None:
    """Write what `kept_gain` reads, where it reads anything."""


@by_class_or_default
def kept_gain(forcing: Any, table: np.ndarray, i: int) -> Any:
    """What the force does to a mode: `damper.engine.forcing.gain_of`."""
    return gain_of(
        forcing, float(table[DAMPING, i]), float(table[STIFFNESS, i]), float(table[SPLIT, i])
    )


@keep_gains.of(HarmonicForce)
def _keep_gains(forcing, table):
    for i in range(int(table[HEAD, SIZE])):
        gain = gain_of(
            forcing, float(table[DAMPING, i]), float(table[STIFFNESS, i]), float(table[SPLIT, i])
        )
        table[GAIN_RE, i], table[GAIN_IM, i] = gain.re, gain.im


@kept_gain.of(HarmonicForce)
def _kept_gain(forcing, table, i):
    return Gain(float(table[GAIN_RE, i]), float(table[GAIN_IM, i]))


@keep_gains.of(WeighedForce)
def _keep_weighed_gains(forcing, table):
    keep_gains(forcing.forcing, table)


@kept_gain.of(WeighedForce)
def _kept_weighed_gain(forcing, table, i):
    return kept_gain(forcing.forcing, table, i)


@compiled
def _add_tie(matrix, between, size):
    """Add what acts between two places to a matrix, in place."""
    for i in range(len(between)):
        for j in range(len(between)):
            matrix[i, j] += size * between[i] * between[j]


@compiled
def _in_modes(table, modes, squares, matrices, forces, gaps):
    """The system in its modes, each of which the force pushes forwards."""
    size, (mass, damping) = len(squares), matrices
    push, pull = forces
    pushes, pulls, shapes = np.zeros(size), np.zeros(size), np.zeros((size, size))
    for i in range(size):
        for j in range(size):
            pushes[i] += modes[i, j] * push[j]
        sign = -1.0 if pushes[i] < 0.0 else 1.0
        pushes[i], squares[i] = sign * pushes[i], max(squares[i], 0.0)
        for j in range(size):
            modes[i, j] *= sign
            shapes[j, i] = modes[i, j]
            pulls[i] += modes[i, j] * pull[j]
    drag = congruent(modes, damping)
    largest, sizes, fastest, coupled = 0.0, 0.0, 0.0, False
    for i in range(size):
        largest, fastest = max(largest, abs(drag[i, i])), max(fastest, squares[i])
    for i in range(size):
        for j in range(size):
            if i != j and abs(drag[i, j]) <= _NO_COUPLING * largest:
                drag[i, j] = 0.0
            coupled = coupled or (i != j and drag[i, j] != 0.0)
            sizes += drag[i, j] * drag[i, j]
    blocks = (drag, shapes, product(modes, mass))
    fill_table(table, squares, pushes, pulls, product(gaps, shapes), blocks)
    table[HEAD, COUPLED] = 1.0 if coupled else 0.0
    table[HEAD, SYSTEM_RATE] = math.sqrt(sizes) + math.sqrt(fastest)
    table[HEAD, SYSTEM_COUPLING] = math.sqrt(sizes + fastest)


@compiled
def _react(model, table):
    """Write into the table how an impulse between a free mass and its box moves both."""
    size, carried = int(table[HEAD, SIZE]), table[HEAD, CARRIED] != 0.0
    # No impulse moves what follows the force alone.
    moved, least = size - int(carried), math.inf
    for i in range(moved):
        least = min(least, table[STIFFNESS, i])
    table[HEAD, LEAST] = least if carried else 0.0
    for k in range(len(model.masses)):
        share, drags, braked, bent = 0.0, 0.0, 0.0, 0.0
        for i in range(moved):
            weight, drag = table[WEIGHTS + k, i], 0.0
            for j in range(moved):
                drag += table[first_row(table, 0) + i, j] * table[WEIGHTS + k, j]
            share += weight * weight
            drags += weight * drag
            braked += drag * drag
            bent += weight * weight * table[STIFFNESS, i]
        table[DRAGS, k], table[YIELDS, k] = drags, share
        if not (is_tied(model, k) and table[STATE, k] != JOINED):
            table[YIELDS, k] += 1.0 / mass_in(model.masses, k).mass
        if share > 0.0:
            table[DASHPOTS, k] = math.sqrt(braked / share)
            table[STIFFENS, k] = max(bent - least * share, 0.0)

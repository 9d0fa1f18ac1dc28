"""Small dense linear algebra in plain loops.

LAPACK would give compiled and plain code different bytes, and compiled code needs SciPy for it.
"""

import math

import numpy as np

from damper.engine.compiled import compiled, compiled_apart
from damper.engine.roundoff import EPSILON

#: Sweeps of rotations after which a matrix is taken for diagonal; some eight are needed.
_MOST_SWEEPS = 60


@compiled_apart
def times(matrix: np.ndarray, vector: np.ndarray) -> np.ndarray:
    """Matrix times vector."""
    found = np.zeros(matrix.shape[0])
    for i in range(matrix.shape[0]):
        total = 0.0
        for j in range(matrix.shape[1]):
            total += matrix[i, j] * vector[j]
        found[i] = total
    return found


@compiled_apart
def product(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    """Product of two matrices."""
    found = np.zeros((a.shape[0], b.shape[1]))
    for i in range(a.shape[0]):
        for k in range(a.shape[1]):
            for j in range(b.shape[1]):
                found[i, j] += a[i, k] * b[k, j]
    return found


@compiled_apart
def congruent(outer: np.ndarray, matrix: np.ndarray) -> np.ndarray:
    """Product of a matrix, another one, and the first one transposed."""
    size, half = len(outer), product(outer, matrix)
    found = np.zeros((size, size))
    for i in range(size):
        for j in range(size):
            for k in range(size):
                found[i, j] += half[i, k] * outer[j, k]
    return found


@compiled_apart
def dot(a: np.ndarray, b: np.ndarray) -> float:
    """Sum of products."""
    total = 0.0
    for i in range(len(a)):
        total += a[i] * b[i]
    return total


@compiled_apart
def solve(matrix: np.ndarray, right: np.ndarray, chosen: np.ndarray) -> np.ndarray:
    """Solve a positive definite system of the chosen rows; other unknowns are 0."""
    count = len(right)
    a, b = matrix.copy(), right.copy()
    for i in range(count):
        if chosen[i]:
            for k in range(i + 1, count):
                if chosen[k]:
                    part = a[k, i] / a[i, i]
                    b[k] -= part * b[i]
                    for j in range(i, count):
                        a[k, j] -= part * a[i, j]
    found = np.zeros(count)
    for i in range(count - 1, -1, -1):
        if chosen[i]:
            total = b[i]
            for j in range(i + 1, count):
                total -= a[i, j] * found[j]
            found[i] = total / a[i, i]
    return found


@compiled_apart
def complementary(
    matrix: np.ndarray, least: np.ndarray, low: np.ndarray, high: np.ndarray
) -> np.ndarray:
    """The p from low to high with matrix p = least in each row where p is between the two.

    Where p is low, matrix p >= least; where it is high, matrix p <= least. The matrix is positive
    definite, so there is one p. By principal pivots, the first row first: K. G. Murty, Linear
    Algebra Appl. 1974, 9, 65; a row that leaves one of its ends goes between them first.
    """
    count = len(least)
    chosen, at_high = np.zeros(count, dtype=np.bool_), np.zeros(count, dtype=np.bool_)
    found, wanted = np.zeros(count), np.zeros(count)
    for _ in range(100 * count):
        for i in range(count):
            wanted[i] = least[i]
            for j in range(count):
                if not chosen[j]:
                    wanted[i] -= matrix[i, j] * (high[j] if at_high[j] else low[j])
        found = solve(matrix, wanted, chosen)
        wrong = -1
        for i in range(count):
            if not chosen[i]:
                found[i] = high[i] if at_high[i] else low[i]
        for i in range(count - 1, -1, -1):
            if chosen[i]:
                if found[i] < low[i] or found[i] > high[i]:
                    wrong = i
            else:
                lacks, size = least[i], abs(least[i])
                for j in range(count):
                    lacks -= matrix[i, j] * found[j]
                    size += abs(matrix[i, j] * found[j])
                if (-lacks if at_high[i] else lacks) > 4.0 * EPSILON * size:
                    wrong = i
        if wrong < 0:
            break
        at_high[wrong] = chosen[wrong] and found[wrong] > high[wrong]
        chosen[wrong] = not chosen[wrong]
    for i in range(count):
        found[i] = min(max(found[i], low[i]), high[i])
    return found


@compiled_apart
def root_inverse(mass: np.ndarray) -> np.ndarray:
    """Inverse W of the triangular root of a positive definite matrix: W mass W^T = 1."""
    count = len(mass)
    root = np.zeros((count, count))
    for i in range(count):
        for j in range(i + 1):
            left = mass[i, j]
            for k in range(j):
                left -= root[i, k] * root[j, k]
            root[i, j] = math.sqrt(left) if i == j else left / root[j, j]
    found = np.zeros((count, count))
    for j in range(count):
        found[j, j] = 1.0 / root[j, j]
        for i in range(j + 1, count):
            left = 0.0
            for k in range(j, i):
                left -= root[i, k] * found[k, j]
            found[i, j] = left / root[i, i]
    return found


@compiled_apart
def eigenvectors(matrix: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Eigenvalues of a symmetric matrix, and its eigenvectors in columns, by Jacobi's rotations."""
    count = len(matrix)
    a, vectors = matrix.copy(), np.eye(count)
    for _ in range(_MOST_SWEEPS):
        turned = False
        for p in range(count):
            for q in range(p + 1, count):
                small = EPSILON * 0.25 * math.sqrt(abs(a[p, p] * a[q, q]))
                if abs(a[p, q]) <= small:
                    continue
                turned = True
                tau = (a[q, q] - a[p, p]) / (2.0 * a[p, q])
                t = 1.0 / (abs(tau) + math.sqrt(1.0 + tau * tau))
                t = t if tau >= 0.0 else -t
                c = 1.0 / math.sqrt(1.0 + t * t)
                _rotate(a, vectors, p, q, c, t * c)
        if not turned:
            break
    values = np.zeros(count)
    for i in range(count):
        values[i] = a[i, i]
    return values, vectors


@compiled
def _rotate(a, vectors, p, q, c, s):
    for k in range(len(a)):
        x, y = a[k, p], a[k, q]
        a[k, p], a[k, q] = c * x - s * y, s * x + c * y
        x, y = vectors[k, p], vectors[k, q]
        vectors[k, p], vectors[k, q] = c * x - s * y, s * x + c * y
    for k in range(len(a)):
        x, y = a[p, k], a[q, k]
        a[p, k], a[q, k] = c * x - s * y, s * x + c * y
    a[p, q], a[q, p] = 0.0, 0.0

"""When a contact with a wall that gives ends: a certified search on any scale of time.

The watched quantity q is linear in the state of `damper.models.compliant.flow`: the depth -g, or
the force. A step is kept only if the motion at its two ends proves that q stays positive in
between, by one of three bounds.

**Energy.** Every derivative of the motion obeys the same equations with the derivative of the
force, so the root of its energy grows by at most omega^n times the step: a bound on q'''', on the
scale of the contact's own oscillation, for every set of parameters.

**Slow and fast.** Where the contact is faster than everything else, the state splits into a slow
part, which forcing and primary move, and a ring, the decaying oscillation of the contact:
q = f + y with

    f'' + 2 B f' + K f = harmonic,    y'' + 2 b y' + w^2 y = 0,

exactly and without coupling. sqrt(w^2 y^2 + y'^2) never grows, so |y| stays below its present
bound R, and q is positive while f > R is. Such a step knows nothing of the contact's oscillation: a
contact that lasts costs a few steps, whether the ring has died or is only too weak to matter.

**Age.** Where neither is enough after some steps, the bound of `damper.models.compliant.smoothing`:
steps may grow with the time that fast motion has had to die.

The split is that of Chang (SIAM J. Appl. Math. 1972, 22, 151) with the forcing among the slow
variables. Derivations: docs/models.md.
"""

import math
from typing import NamedTuple

import numpy as np

from damper.engine.compiled import compiled
from damper.engine.oscillator import Oscillator, acceleration, increments
from damper.engine.search import (
    HORIZON,
    MAX_STEPS,
    ROUNDING,
    SPAN,
    falls_through,
    first_root,
    near_root,
    short_of_root,
    stays_between,
)
from damper.models.compliant.flow import Pair, Touch, advance, derivative, energy_size
from damper.models.compliant.smoothing import fill_later, later_bound4

#: Iterations in which the split must converge; else the contact counts as not faster than the rest.
_ITERATIONS = 60
_CONVERGED = 1e-15
#: Rate times time below which a root is corrected by two terms of the Taylor series.
_SMALL = 1e-5
#: Steps after which a search turns to the bound by age.
PATIENCE = 24
#: Change of the slope on the way to it, as a part of the slope, below which that is to rounding.
_STRAIGHT = 1e-4
#: What a search found.
NOT_YET, FOUND, LOST = 0.0, 1.0, 2.0


class Split(NamedTuple):
    """Slow and fast variables of the contact; `separated` is 0 where they are not apart."""

    separated: float
    slow: np.ndarray
    """(4, 6) slow variables from the state."""
    matrix: np.ndarray
    """(4, 4) their rates of change."""
    manifold: np.ndarray
    """(2, 4) gap and rate to which the ring decays, from the slow variables."""
    ring: np.ndarray
    """(2, 6) the ring from the state."""
    ring_matrix: np.ndarray
    """(2, 2) its rates of change."""
    back: np.ndarray
    """(4, 2) what the ring adds to U, U', S, C."""


class Watch(NamedTuple):
    """A quantity to watch, by its coefficients and its slow and fast part."""

    separated: float
    gap: float
    """Coefficient of the gap."""
    gap_rate: float
    """Coefficient of the gap's rate."""
    slow: np.ndarray
    """(5, 6) slow part and its first four derivatives from the state."""
    ring: np.ndarray
    """(2, 6) ring and its first derivative from the state."""
    ring_stiffness: float
    ring_drag: float
    """w^2 and 2 b of the ring."""
    stiffness: float
    """K of the slow part."""
    force: float
    """Amplitude of what drives the slow part."""
    rate: float
    """Fastest rate of the slow part."""
    later: np.ndarray
    """(levels + 1, 4) of `damper.models.compliant.smoothing`, empty for a flight, not a number
    until it is filled when first needed."""


def split_of(touch: Touch) -> Split:
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
    return split._replace(separated=_separate(touch, split))


def watch_of(touch: Touch, split: Split, row: np.ndarray) -> Watch:
    """Prepare a quantity to watch; `row` has its coefficients on (U, U', g, g', S, C)."""
    slow = np.zeros((5, 6))
    ring = np.zeros((2, 6))
    numbers = _watch(touch, split, row, slow, ring)
    later = np.full((touch.levels + 1, 4), np.nan)
    return Watch(split.separated, float(row[2]), float(row[3]), slow, ring, *numbers, later)


def loose_watch(gap: float, gap_rate: float) -> Watch:
    """Watch a quantity of a free flight, where there is no ring."""
    slow, ring, later = np.zeros((5, 6)), np.zeros((2, 6)), np.zeros((0, 4))
    return Watch(0.0, gap, gap_rate, slow, ring, 0.0, 0.0, 0.0, 0.0, 0.0, later)


@compiled
def _separate(touch, split):
    """Fill a split; 1 if it converged to slow variables and a ring that decays."""
    beta = touch.reduced
    alpha = touch.share
    drag = touch.drag
    omega = touch.omega
    stiff = touch.relative_stiffness + beta
    damp = touch.relative_damping + drag * beta
    manifold = split.manifold
    matrix = split.matrix
    # p on the manifold, by the slow variables.
    push = np.zeros(4)
    target = np.array([-1.0, -drag, 1.0, 0.0])
    converged = False
    for _ in range(_ITERATIONS):
        for k in range(4):
            push[k] = target[k] - beta * (manifold[0, k] + drag * manifold[1, k])
        matrix[0, 1] = 1.0
        for k in range(4):
            matrix[1, k] = alpha * push[k]
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
        if not largest < 1e300:
            return 0.0
        if change <= _CONVERGED * largest:
            converged = True
            break
    if not converged:
        return 0.0
    # The ring's own matrix, and its inverse.
    m = split.ring_matrix
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
        if not largest < 1e300:
            return 0.0
        if change <= _CONVERGED * largest:
            converged = True
            break
    if not converged:
        return 0.0
    places = (0, 1, 4, 5)
    for row in range(2):
        for k in range(4):
            split.ring[row, places[k]] = -manifold[row, k]
        split.ring[row, 2 + row] = 1.0
    for row in range(4):
        for k in range(6):
            split.slow[row, k] = -(
                back[row, 0] * split.ring[0, k] + back[row, 1] * split.ring[1, k]
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
def _watch(touch, split, row, slow, ring):
    """Fill the rows of a watch; return its numbers."""
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
    omega = touch.omega
    push_sin = float(split.matrix[1, 2])
    push_cos = float(split.matrix[1, 3])
    detuning = stiffness - omega * omega
    sin = (
        coefficients[0] * push_sin
        - coefficients[1] * omega * push_cos
        + coefficients[2] * detuning
        - coefficients[3] * drag * omega
    )
    cos = (
        coefficients[0] * push_cos
        + coefficients[1] * omega * push_sin
        + coefficients[3] * detuning
        + coefficients[2] * drag * omega
    )
    force = math.hypot(sin, cos)
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
    m = split.ring_matrix
    for k in range(6):
        ring[0, k] = weights[0] * split.ring[0, k] + weights[1] * split.ring[1, k]
        ring[1, k] = (weights[0] * m[0, 0] + weights[1] * m[1, 0]) * split.ring[0, k] + (
            weights[0] * m[0, 1] + weights[1] * m[1, 1]
        ) * split.ring[1, k]
    ring_stiffness = float(m[0, 0] * m[1, 1] - m[0, 1] * m[1, 0])
    ring_drag = -float(m[0, 0] + m[1, 1])
    rate = max(omega, max(drag, 0.0) + math.sqrt(max(stiffness, 0.0)))
    return ring_stiffness, ring_drag, stiffness, force, rate


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


@compiled
def fly(touch: Touch, free: Oscillator, z: Pair, tau: float) -> Pair:
    """State after a time `tau` without force between the masses."""
    u, w, g, h, s, c = z
    beta = touch.reduced
    x = u + beta * g
    v = w + beta * h
    a, j = acceleration(free, x, v, s, c)
    dx, dv, s, c = increments(free, x, v, a, j, s, c, tau)
    g += h * tau + dx
    h += dv
    return x + (v * tau + dx) - beta * g, v + dv - beta * h, g, h, s, c


@compiled
def find_switch(
    touch: Touch,
    table: np.ndarray,
    free: Oscillator,
    watch: Watch,
    start: Pair,
    limit: float,
) -> tuple[float, float, Pair, int]:
    """First time at which a watched quantity falls through zero, by steps that cannot skip it.

    Parameters
    ----------
    touch : Touch
        The contact; with no stiffness, free flight.
    table : ndarray
        Its propagators, from `damper.models.compliant.flow.propagators`.
    free : tuple
        The primary's `damper.engine.oscillator.oscillator` in flight.
    watch : Watch
    start : tuple
        State at the start, at which the quantity is not negative.
    limit : float
        Where the search ends.

    Returns
    -------
    tau, found, state, steps
        Time, at most `limit`; NOT_YET, FOUND, or LOST where MAX_STEPS ran out; the state then; the
        number of evaluations.
    """
    flies = touch.stiffness == 0.0
    omega = touch.omega
    swing = 1.0 / math.sqrt(touch.reduced)
    stiffness = max(touch.relative_stiffness, 1e-300)
    growth3 = omega * omega * omega
    longest = SPAN / touch.rate
    longest_slow = SPAN / watch.rate if watch.separated != 0.0 else 0.0
    tau = 0.0
    z = start
    step = 0.0
    short = 0.0
    fresh = True
    sure = False
    bold = False
    level = 0.0
    q = q1 = q2 = q3 = q4 = 0.0
    f = f1 = f2 = f3 = f4 = 0.0
    size3 = size4 = slow_norm = ring_norm = rounding = 0.0
    # Two earlier times, and the energy norms of the state's derivatives then.
    by_age = False
    early = late = 0.0
    sizes_early = sizes_late = (0.0, 0.0)
    tau_before = q1_before = escape = 0.0
    for steps in range(MAX_STEPS):
        if steps == PATIENCE and not flies:
            by_age = True
            if math.isnan(watch.later[0, 0]):
                row = np.array([0.0, 0.0, watch.gap, watch.gap_rate, 0.0, 0.0])
                fill_later(touch, table, row, watch.later)
            z1 = derivative(touch, start)
            size = energy_size(touch, z1)
            sizes_early = sizes_late = (size, energy_size(touch, derivative(touch, z1)))
        if fresh:
            z1 = derivative(touch, z)
            z2 = derivative(touch, z1)
            z3 = derivative(touch, z2)
            z4 = derivative(touch, z3)
            q = watch.gap * z[2] + watch.gap_rate * z[3]
            q1 = watch.gap * z1[2] + watch.gap_rate * z1[3]
            q2 = watch.gap * z2[2] + watch.gap_rate * z2[3]
            q3 = watch.gap * z3[2] + watch.gap_rate * z3[3]
            q4 = watch.gap * z4[2] + watch.gap_rate * z4[3]
            rounding, slope_rounding = _roundings(touch, watch, z, tau, flies, stiffness)
            before = escape
            escape = 0.0
            if q <= rounding:
                falls = q1 < 0.0 or (q1 == 0.0 and q2 < 0.0)
                if q < -rounding and tau > 0.0:
                    # A drift of the other sign would not have let it come here.
                    falls = True
                elif abs(q1) <= slope_rounding:
                    drift, escape, lasts = _drift(touch, watch, z, slope_rounding)
                    if drift != 0.0:
                        falls = drift < 0.0
                    # Where damping leaves it within rounding, twice as far each time.
                    escape = min(max(escape, 2.0 * before), lasts)
                if falls:
                    return tau, FOUND, z, steps
            if tau >= limit:
                return tau, NOT_YET, z, steps
            size3 = swing * energy_size(touch, z3)
            size4 = swing * energy_size(touch, z4) if watch.gap_rate != 0.0 else 0.0
            if watch.separated != 0.0:
                f, f1, f2, f3, f4, level, ring_norm = _parts(watch, z)
                slow_norm = math.sqrt(max(watch.stiffness, 0.0) * f3 * f3 + f4 * f4)

            bound4 = _bound4(
                watch, swing, growth3, omega, size3, size4, slow_norm, ring_norm, longest
            )
            sure = q <= rounding and q1 == 0.0 and q2 == 0.0
            if sure and escape == 0.0 and (q3 < 0.0 or (q3 == 0.0 and q4 < 0.0)):
                return tau, FOUND, z, steps
            if escape > 0.0:
                sure = True
                step = escape
                short = step
            elif sure:
                # Third order, as a lift-off: while q'' grows nothing else can happen.
                step = min(longest, q3 / bound4) if bound4 > 0.0 else longest
                step = max(step, 1e-3 / touch.rate)
                short = step
            else:
                root = near_root(q, q1, q2, q3, q4)
                if 0.0 < root < math.inf:
                    ahead = 2.0 * root
                    bound4 = _bound4(
                        watch, swing, growth3, omega, size3, size4, slow_norm, ring_norm, ahead
                    )
                    if falls_through(q, q1, q2, abs(q3) + bound4 * ahead, ahead):
                        if tau + root > limit:
                            # It is the only one ahead, and beyond the limit.
                            z = _at(touch, table, free, start, limit, flies)
                            return limit, NOT_YET, z, steps + 1
                        return _polish(
                            touch, table, free, watch, start, tau, root, limit, flies, steps
                        )
                root = first_root(q, q1, q2)
                short = short_of_root(root, longest, touch.rate, q, q1, q2, q3, q4, 0.0)
                step = short
                if watch.separated != 0.0 and f > level:
                    root = first_root(f - level, f1, f2)
                    step = max(
                        step,
                        short_of_root(
                            root, longest_slow, watch.rate, f - level, f1, f2, f3, f4, 0.0
                        ),
                    )
            if by_age and not sure:
                if tau - late >= 2.0 * (late - early):
                    early = late
                    sizes_early = sizes_late
                    late = tau
                    sizes_late = (energy_size(touch, z1), energy_size(touch, z2))
                # The difference of slopes, for rounding of q'' grows with the fastest rate.
                bend = (q1 - q1_before) / (tau - tau_before) if tau > tau_before else q2
                aim = 0.9 * first_root(q, q1, bend)
                bound4 = later_bound4(touch, watch.later, early, sizes_early, tau, tau - early)
                if bound4 < math.inf:
                    aim = min(aim, math.sqrt(math.sqrt(72.0 * max(q, rounding) / bound4)), HORIZON)
                    step = max(step, aim)
            tau_before = tau
            q1_before = q1
            bold = step > short
        end = tau + step
        if tau + 0.25 * step == tau:
            # Nearer than time can resolve.
            return tau, FOUND, z, steps
        end = min(end, limit)
        span = end - tau
        new = _at(touch, table, free, start, end, flies)
        fresh = sure
        if not fresh:
            slope = derivative(touch, new)
            bound4 = _bound4(watch, swing, growth3, omega, size3, size4, slow_norm, ring_norm, span)
            if by_age:
                aged = later_bound4(touch, watch.later, early, sizes_early, tau, span)
                bound4 = min(bound4, aged)
            fresh = stays_between(
                q,
                q1,
                watch.gap * new[2] + watch.gap_rate * new[3],
                watch.gap * slope[2] + watch.gap_rate * slope[3],
                math.inf,
                span,
                bound4,
                rounding,
            )
            if not fresh and watch.separated != 0.0 and f > level:
                fresh = stays_between(
                    f - level,
                    f1,
                    dot(watch.slow[0], new) - level,
                    dot(watch.slow[1], new),
                    math.inf,
                    span,
                    slow_norm + watch.force * growth3 * span,
                    rounding,
                )
        if fresh:
            if step >= longest:
                longest = 2.0 * longest
            if step >= longest_slow:
                longest_slow = 2.0 * longest_slow
            tau = end
            z = new
        else:
            # A bold step that failed leaves the careful one.
            step = max(0.5 * span, short) if bold else 0.5 * span
            bold = step > short
    return tau, LOST, z, MAX_STEPS


@compiled
def _at(touch, table, free, start, tau, flies):
    if flies:
        return fly(touch, free, start, tau)
    return advance(touch, table, start, tau)


@compiled
def _parts(watch, z):
    """Slow part with four derivatives, the ring's bound, and that of its fourth derivative."""
    y = dot(watch.ring[0], z)
    y1 = dot(watch.ring[1], z)
    w2 = watch.ring_stiffness
    level = math.sqrt(y * y + y1 * y1 / w2)
    y2 = -watch.ring_drag * y1 - w2 * y
    y3 = -watch.ring_drag * y2 - w2 * y1
    y4 = -watch.ring_drag * y3 - w2 * y2
    return (
        dot(watch.slow[0], z),
        dot(watch.slow[1], z),
        dot(watch.slow[2], z),
        dot(watch.slow[3], z),
        dot(watch.slow[4], z),
        level,
        math.sqrt(w2 * y3 * y3 + y4 * y4),
    )


@compiled
def _bound4(watch, swing, growth3, omega, size3, size4, slow_norm, ring_norm, span):
    """Bound on the watched quantity's fourth derivative over a coming span."""
    if watch.separated != 0.0:
        return slow_norm + watch.force * growth3 * span + ring_norm
    bound = abs(watch.gap) * (size3 + swing * growth3 * span)
    if watch.gap_rate != 0.0:
        bound += abs(watch.gap_rate) * (size4 + swing * growth3 * omega * span)
    return bound


@compiled
def pushes(drag: float, x: float, v: float, sin: float, cos: float) -> float:
    """Size of the terms of what pushes the primary, drag = 2 zeta; in units of F0."""
    return abs(sin) + abs(cos) + abs(x) + drag * abs(v)


@compiled
def _roundings(touch, watch, z, tau, flies, stiffness):
    """Rounding of the watched quantity and of its slope: that of what pushes, while it lasts."""
    forces = pushes(touch.drag, z[0], z[1], z[4], z[5])
    weight = abs(watch.gap)
    damping = abs(watch.gap_rate)
    reach = 0.5 * tau * tau
    passing = tau
    if not flies:
        reach = min(reach, 1.0 / stiffness)
        passing = min(math.sqrt(2.0 * reach), 1.0 / max(touch.relative_damping, 1e-300))
    value = weight * abs(z[2]) + damping * abs(z[3]) + (weight * reach + damping * passing) * forces
    slope = weight * abs(z[3]) + (weight * passing + damping) * forces
    return ROUNDING * value, ROUNDING * slope


@compiled
def _drift(touch, watch, z, slope_rounding):
    """How a quantity moves on that vanishes with its slope, and when that is more than rounding.

    A depth moves with the push p, and where that is rounding, with its derivative. So does a force
    that vanishes with its slope, for p is rounding then.

    Returns
    -------
    drift, escape, lasts : float
        The sign of the motion to come, 0 if nothing moves; the time after which the slope should be
        four times its rounding; a time over which the sign surely stays.
    """
    velocity = z[1] + touch.reduced * z[3]
    jerk = touch.omega * z[5] - velocity
    push = 0.0
    drift = watch.gap_rate * jerk
    if watch.gap_rate == 0.0:
        x = z[0] + touch.reduced * z[2]
        push = z[4] - touch.drag * velocity - x
        if abs(push) <= ROUNDING * pushes(touch.drag, x, velocity, z[4], z[5]):
            push = 0.0
        drift = watch.gap * (push if push != 0.0 else jerk)
    if drift == 0.0:
        return 0.0, 0.0, 0.0
    escape = 4.0 * slope_rounding / abs(drift)
    if watch.gap_rate == 0.0 and push == 0.0:
        escape = math.sqrt(2.0 * escape)
    # The push relaxes towards jerk / drag, and the jerk's rate is -omega^2 sin - p.
    if push * jerk >= 0.0 and jerk != 0.0:
        omega = touch.omega
        slower = (omega * omega * abs(z[4]) + abs(push)) / abs(jerk)
        lasts = 0.5 / (slower + omega * math.sqrt(omega / abs(jerk)))
    else:
        lasts = 0.5 * abs(push) / max(abs(jerk) + touch.drag * abs(push), 1e-300)
    return drift, escape, lasts


@compiled
def _polish(touch, table, free, watch, start, tau, root, limit, flies, steps):
    """Newton's iteration for a root that is known to be the only one nearby."""
    end = tau + root
    z = start
    for _ in range(8):
        z = _at(touch, table, free, start, end, flies)
        steps += 1
        slope = derivative(touch, z)
        q = watch.gap * z[2] + watch.gap_rate * z[3]
        q1 = watch.gap * slope[2] + watch.gap_rate * slope[3]
        late = q / -q1 if q1 < 0.0 else 0.0
        late = min(max(late, tau - end), tau + 2.0 * root - end)
        bend = derivative(touch, slope)
        q2 = watch.gap * bend[2] + watch.gap_rate * bend[3]
        if touch.rate * abs(late) <= _SMALL and abs(q2 * late) <= _STRAIGHT * abs(q1):
            if q1 < 0.0:
                late -= 0.5 * q2 / q1 * late * late
            half = 0.5 * late
            z = (
                z[0] + late * (slope[0] + half * bend[0]),
                z[1] + late * (slope[1] + half * bend[1]),
                z[2] + late * (slope[2] + half * bend[2]),
                z[3] + late * (slope[3] + half * bend[3]),
                z[4],
                z[5],
            )
            return end + late, FOUND, z, steps
        end += late
    # Not settled, for rounding of a small root: the state is that of the time all the same.
    return end, FOUND, _at(touch, table, free, start, end, flies), steps + 1

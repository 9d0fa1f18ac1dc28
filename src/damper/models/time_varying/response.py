"""The response where the free mass varies: what `damper.observers.response` adds up for a segment.

Flight is that of the rigid damper. While the masses move as one, each step is a polynomial
(`damper.models.time_varying.motion`) short enough for one Gauss-Legendre rule, and the
peak is sought on it.
"""

import math

import numpy as np

from damper.engine.compiled import compiled
from damper.engine.oscillator import acceleration, oscillator, sine_cosine
from damper.engine.search import tail_duration
from damper.engine.segment import FLIGHT, MODE, PERIOD, RATE, SIDE, TAIL, TIME, V, X
from damper.models.time_varying import TimeVarying
from damper.models.time_varying.motion import DEGREE, evaluate, expand, modulation
from damper.observers.response import (
    MAX_ITERATIONS,
    MODULATION,
    NODES,
    PEAK,
    ROUNDING,
    SPEED_SQUARE,
    SQUARE,
    WEIGHTS,
    WORK,
    add_bounces,
    add_oscillation,
    add_part,
)


@add_part.of(TimeVarying)
def _add_part(model, more, row, low, high, totals):
    free = model.free
    law = model.law
    periods = float(row[PERIOD])
    time = float(row[TIME])
    side = float(row[SIDE])
    rate = float(row[RATE])
    x = float(row[X])
    v = float(row[V])
    sin, cos, _ = sine_cosine(free[3] * time + model.phase)
    a, j = acceleration(free, x, v, sin, cos)
    if row[MODE] == FLIGHT:
        add_oscillation(free, (x, v, a, j, sin, cos), 0.0, low, high, True, totals)
        u = v - side * rate
        before, _, _ = modulation(law, periods, time + low)
        after, _, _ = modulation(law, periods, time + high)
        totals[MODULATION] += 0.5 * u * u * (after - before)
        return
    mass_ratio, _, _ = modulation(law, periods, time)
    heavier = 1.0 + mass_ratio
    v -= side * (mass_ratio / heavier) * rate
    if row[MODE] == TAIL and rate > 0.0:
        # What bounces add is O(w^2) at most: the mass may stay what it was at the start.
        duration, _ = tail_duration(free, mass_ratio, model.restitution, side, a, j, sin, rate)
        stuck = oscillator(free[0] / heavier, 1.0 / heavier, 1.0 / heavier, free[3])
        a, j = acceleration(stuck, x, v, sin, cos)
        start = (x, v, a, j, sin, cos)
        add_bounces(
            model.restitution, mass_ratio, stuck, row, start, 0.0, duration, low, high, totals
        )
    _add_together(model, periods, time, x, v, sin, cos, low, high, row[MODE] != TAIL, totals)


@compiled
def _add_together(model, periods, time, x, v, sin, cos, low, high, watch, totals):
    """Add the integrals over [low, high] of both masses' common motion; watch for the peak."""
    free = model.free
    law = model.law
    omega = free[3]
    half_swing = 0.5 * law[0] * law[1] * law[2]
    terms = np.empty(DEGREE + 1)
    nodes = NODES.shape[1]
    passed = 0.0
    sin1 = sin
    cos1 = cos
    while True:
        step, v, _ = expand(free, law, periods, time + passed, x, v, sin1, cos1, terms)
        first = max(low - passed, 0.0)
        span = min(high - passed, step) - first
        if span >= 0.0:
            square = 0.0
            speed_square = 0.0
            work = 0.0
            gain = 0.0
            for k in range(nodes):
                tau = first + span * float(NODES[-1, k])
                weight = float(WEIGHTS[-1, k])
                dx, v_k = evaluate(terms, step, v, tau / step)
                turn_sin, turn_cos, _ = sine_cosine(omega * tau)
                _, sin_m, _ = modulation(law, periods, time + (passed + tau))
                square += weight * (x + dx) * (x + dx)
                speed_square += weight * v_k * v_k
                work += weight * v_k * (sin1 * turn_cos + cos1 * turn_sin)
                gain -= weight * v_k * v_k * sin_m
            totals[SQUARE] += span * square
            totals[SPEED_SQUARE] += span * speed_square
            totals[WORK] += span * work
            totals[MODULATION] += span * half_swing * gain
            if watch and totals[PEAK] < math.inf:
                end = (first + span) / step
                totals[PEAK] = _climb(terms, step, x, v, first / step, end, float(totals[PEAK]))
        if passed + step >= high:
            return
        dx, v = evaluate(terms, step, v, 1.0)
        x += dx
        passed += step
        turn_sin, turn_cos, _ = sine_cosine(omega * passed)
        sin1 = sin * turn_cos + cos * turn_sin
        cos1 = cos * turn_cos - sin * turn_sin


@compiled
def _climb(terms, step, x, v, low, high, peak):
    """Largest of `peak` and |x| on the parts [low, high] of a step, for sure and to rounding.

    As `damper.observers.response._climb`, with the derivatives' bounds by the sums of their terms.
    """
    bound2 = 0.0
    bound3 = 0.0
    for k in range(DEGREE + 1):
        bound2 += abs(float(terms[k]))
        bound3 += k * abs(float(terms[k]))
    bound3 /= step
    t = low
    x1, v1, a1 = _state(terms, step, x, v, t)
    peak = max(peak, abs(x1))
    part = high - low
    while t < high and t + part > t:
        end = min(t + part, high)
        x2, v2, a2 = _state(terms, step, x, v, end)
        peak = max(peak, abs(x2))
        span = (end - t) * step
        eighth = 0.125 * span * span
        if max(abs(x1), abs(x2)) + bound2 * eighth > peak * (1.0 + ROUNDING):
            same_sign = (v1 > 0.0 and v2 > 0.0) or (v1 < 0.0 and v2 < 0.0)
            if not same_sign and abs(a1) > bound3 * span:
                peak = max(peak, _turn(terms, step, x, v, t, end, v1))
            elif not (same_sign and min(abs(v1), abs(v2)) > bound3 * eighth):
                part *= 0.5
                continue
        t = end
        x1 = x2
        v1 = v2
        a1 = a2
        part *= 2.0
    return peak


@compiled
def _turn(terms, step, x, v, low, high, v_low):
    """|x| where the velocity vanishes between two parts of a step, once, by Newton's method."""
    rising = v_low > 0.0
    t = 0.5 * (low + high)
    x1 = 0.0
    for _ in range(MAX_ITERATIONS):
        x1, v1, a1 = _state(terms, step, x, v, t)
        if v1 * v1 <= ROUNDING * abs(x1 * a1) or a1 == 0.0:
            break
        if (v1 > 0.0) == rising:
            low = t
        else:
            high = t
        t -= v1 / (a1 * step)
        if not low < t < high:
            t = 0.5 * (low + high)
    return abs(x1)


@compiled
def _state(terms, step, x, v, part):
    """x and its first two derivatives at a part of a step."""
    dx, v = evaluate(terms, step, v, part)
    a = 0.0
    for k in range(DEGREE, -1, -1):
        a = a * part + float(terms[k])
    return x + dx, v, a

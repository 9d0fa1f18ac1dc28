"""The response where walls give: integrals and peak through contacts.

**Integrals** of quadratic functions of the state, x^2, v^2, force times v and what the contact's
dashpot takes, over the intervals h of the propagators T of `damper.models.compliant.flow` are
quadratic forms G of the state, with G(2 h) = G(h) + T' G(h) T. They are made once for a run, and a
contact of any length and any oscillation costs some twenty of them. What is left of the time is a
Gauss-Legendre sum. The forms' state is that of the propagators: where a heavily damped primary
hardly moves, its velocity is one of the variables and not a difference of two.

**The peak** is found as in flight, by bounds on the derivatives of x, which the energy gives; or,
where the contact is faster than the rest, by those on its slow part and on the size of the ring.

**The energy in the contact** is k g^2 / 2 while g < 0. A wall that cannot pull loses what is left
of it when it has let go, as the gap reopens.
"""

import math
from typing import NamedTuple

import numpy as np

from damper.engine.compiled import compiled
from damper.engine.oscillator import acceleration
from damper.engine.segment import FLIGHT, GAP, MODE, SIDE, TIME, V, X
from damper.models import motion
from damper.models.compliant import Compliant, pair_at
from damper.models.compliant.flow import (
    advance,
    derivative,
    energy_size,
    leap,
    shifted,
    short_increment,
    unit_state,
    unshifted,
)
from damper.models.compliant.search import Watch, dot, watch_of
from damper.observers.response import (
    LOSS,
    MAX_ITERATIONS,
    PEAK,
    ROUNDING,
    SPEED_SQUARE,
    SQUARE,
    WORK,
    add_oscillation,
    add_part,
    gauss_rule,
    impact_loss,
    stored_energy,
)

_NODES, _WEIGHTS = gauss_rule(10)
_FORMS = 4


class Integrals(NamedTuple):
    """What `add_part` needs beside the model."""

    forms: np.ndarray
    """(levels + 1, 4, 6, 6) integrals over the intervals of the propagators."""
    displacement: Watch
    """The primary's displacement, as slow part and ring."""


def prepare(model: Compliant) -> Integrals:
    """Make what `add_part` needs beside the model, once for a run."""
    forms = np.zeros((model.touch.levels + 1, _FORMS, 6, 6))
    _fill(model.touch, model.table, forms)
    row = np.array([1.0, 0.0, model.touch.reduced, 0.0, 0.0, 0.0])
    return Integrals(forms, watch_of(model.touch, model.split, row))


@impact_loss.of(Compliant)
def _impact_loss(model, row):
    # The contact loses energy while it lasts.
    return 0.0


@stored_energy.of(Compliant)
def _stored_energy(model, row, tau):
    x, v, gap, rate = motion(model, row, tau)
    # Both walls are one case: the free mass moves at v - side * rate.
    u = v - float(row[SIDE]) * rate
    touch = min(gap, 0.0)
    return 0.5 * (v * v + x * x + model.mass_ratio * u * u + model.touch.stiffness * touch * touch)


@add_part.of(Compliant)
def _add_part(model, integrals, row, low, high, totals):
    if row[MODE] == FLIGHT:
        free = model.free
        x = float(row[X])
        v = float(row[V])
        angle = free[3] * float(row[TIME]) + model.phase
        sin = math.sin(angle)
        cos = math.cos(angle)
        a, j = acceleration(free, x, v, sin, cos)
        add_oscillation(free, (x, v, a, j, sin, cos), 0.0, low, high, True, totals)
        if row[GAP] < 0.0:
            _, _, before, _ = motion(model, row, low)
            _, _, after, _ = motion(model, row, high)
            before = min(before, 0.0)
            after = min(after, 0.0)
            totals[LOSS] += 0.5 * model.touch.stiffness * (before - after) * (before + after)
        return
    start = pair_at(model, row)
    z = advance(model.touch, model.table, start, low) if low > 0.0 else start
    _add(model, integrals, z, high - low, totals)
    peak = float(totals[PEAK])
    if peak < math.inf:  # nothing is above that
        totals[PEAK] = _peak(model, integrals.displacement, start, z, low, high, peak)


@compiled
def _values(touch, z):
    """The four integrands."""
    x = z[0] + touch.reduced * z[2]
    v = z[1] + touch.reduced * z[3]
    return x * x, v * v, z[4] * v, touch.damping * z[3] * z[3]


@compiled
def _fill(touch, table, forms):
    """Quadratic forms over the shortest interval by a Gauss sum, then by doubling."""
    propagator = np.zeros((6, 6))
    form = np.zeros((_FORMS, 6, 6))
    # X less the first variable, over the gap.
    beta = touch.reduced - touch.shift
    for a, b in ((0, 0), (0, 2), (2, 0), (2, 2)):
        weight = beta if a + b == 2 else (beta * beta if a + b == 4 else 1.0)
        form[0, a, b] = weight
        form[1, a + 1, b + 1] = weight
    form[2, 4, 1] = form[2, 1, 4] = 0.5
    form[2, 4, 3] = form[2, 3, 4] = 0.5 * beta
    form[3, 3, 3] = touch.damping
    for node in range(len(_NODES)):
        tau = touch.shortest * float(_NODES[node])
        for column in range(6):
            unit = unit_state(column)
            z = unshifted(touch, unit)
            change = shifted(touch, short_increment(touch, z, tau))
            for row in range(6):
                propagator[row, column] = unit[row] + change[row]
        for kind in range(_FORMS):
            _accumulate(
                form[kind], propagator, touch.shortest * float(_WEIGHTS[node]), forms[0, kind]
            )
    for level in range(touch.levels):
        for column in range(6):
            after = leap(table[level], unit_state(column))
            for row in range(6):
                propagator[row, column] = after[row]
        for kind in range(_FORMS):
            forms[level + 1, kind] = forms[level, kind]
            _accumulate(forms[level, kind], propagator, 1.0, forms[level + 1, kind])


@compiled
def _accumulate(form, propagator, weight, result):
    """Add weight T' G T to the result."""
    half = np.zeros((6, 6))
    for i in range(6):
        for j in range(6):
            total = 0.0
            for k in range(6):
                total += form[i, k] * propagator[k, j]
            half[i, j] = total
    for i in range(6):
        for j in range(6):
            total = 0.0
            for k in range(6):
                total += propagator[k, i] * half[k, j]
            result[i, j] += weight * total


@compiled
def _quadratic(form, z):
    total = 0.0
    for i in range(6):
        inner = 0.0
        for j in range(6):
            inner += float(form[i, j]) * z[j]
        total += z[i] * inner
    return total


@compiled
def _add(model, integrals, z, duration, totals):
    """Add the integrals over a time in contact."""
    touch = model.touch
    length = touch.shortest * math.ldexp(1.0, touch.levels)
    square = speed_square = work = loss = 0.0
    own = shifted(touch, z)
    for level in range(touch.levels, -1, -1):
        while duration >= length:
            forms = integrals.forms[level]
            square += _quadratic(forms[0], own)
            speed_square += _quadratic(forms[1], own)
            work += _quadratic(forms[2], own)
            loss += _quadratic(forms[3], own)
            own = leap(model.table[level], own)
            duration -= length
        length *= 0.5
    z = unshifted(touch, own)
    for node in range(len(_NODES)):
        a, b, c, d, e, f = short_increment(touch, z, duration * float(_NODES[node]))
        part = duration * float(_WEIGHTS[node])
        values = _values(touch, (z[0] + a, z[1] + b, z[2] + c, z[3] + d, z[4] + e, z[5] + f))
        square += part * values[0]
        speed_square += part * values[1]
        work += part * values[2]
        loss += part * values[3]
    totals[SQUARE] += square
    totals[SPEED_SQUARE] += speed_square
    totals[WORK] += work
    totals[LOSS] += loss


@compiled
def _peak(model, watch, start, z, low, high, peak):
    """Largest of `peak` and |x| on [low, high] of a contact that began with the state `start`."""
    touch = model.touch
    beta = touch.reduced
    omega = touch.omega
    tau = low
    step = high - low
    x = z[0] + beta * z[2]
    peak = max(peak, abs(x))
    while tau < high and tau + step > tau:
        end = min(tau + step, high)
        span = end - tau
        new = advance(touch, model.table, start, end)
        x = z[0] + beta * z[2]
        v = z[1] + beta * z[3]
        x2 = new[0] + beta * new[2]
        v2 = new[1] + beta * new[3]
        peak = max(peak, abs(x2))
        limit = peak * (1.0 + ROUNDING)
        eighth = 0.125 * span * span
        first = derivative(touch, z)
        a = first[1] + beta * first[3]
        # The displacement's second and third derivative are velocities of derived motions.
        bound2 = energy_size(touch, first) + omega * span
        bound3 = energy_size(touch, derivative(touch, first)) + omega * omega * span
        settled = max(abs(x), abs(x2)) + bound2 * eighth <= limit
        if not settled:
            same = (v > 0.0 and v2 > 0.0) or (v < 0.0 and v2 < 0.0)
            if same:
                settled = min(abs(v), abs(v2)) > bound3 * eighth
            elif abs(a) > bound3 * span:
                peak = max(peak, _turn(model, start, tau, end, v, a))
                settled = True
        if not settled and watch.separated != 0.0:
            settled = _slowly(watch, z, new, span, limit, omega)
        if settled:
            tau = end
            z = new
            step = 2.0 * span
        else:
            step = 0.5 * span
    return peak


@compiled
def _slowly(watch, z, new, span, limit, omega):
    """Whether slow part and ring together cannot exceed `limit`, or cannot turn, in a step."""
    y = dot(watch.ring[0], z)
    y1 = dot(watch.ring[1], z)
    speed = math.sqrt(watch.ring_stiffness * y * y + y1 * y1)
    level = speed / math.sqrt(watch.ring_stiffness)
    f1 = dot(watch.slow[1], z)
    f2 = dot(watch.slow[2], z)
    f3 = dot(watch.slow[3], z)
    g1 = dot(watch.slow[1], new)
    stiffness = max(watch.stiffness, 0.0)
    eighth = 0.125 * span * span
    bound2 = math.sqrt(stiffness * f1 * f1 + f2 * f2) + watch.force * span
    largest = max(abs(dot(watch.slow[0], z)), abs(dot(watch.slow[0], new)))
    if largest + bound2 * eighth + level <= limit:
        return True
    bound3 = math.sqrt(stiffness * f2 * f2 + f3 * f3) + watch.force * omega * span
    same = (f1 > 0.0 and g1 > 0.0) or (f1 < 0.0 and g1 < 0.0)
    return same and min(abs(f1), abs(g1)) - bound3 * eighth > speed


@compiled
def _turn(model, start, low, high, v, a):
    """|x| where the velocity vanishes on [low, high], once and with v' of one sign."""
    touch = model.touch
    beta = touch.reduced
    rising = v > 0.0
    t = low - v / a
    x = 0.0
    for _ in range(MAX_ITERATIONS):
        if not low < t < high:
            t = 0.5 * (low + high)
        z = advance(touch, model.table, start, t)
        first = derivative(touch, z)
        x = z[0] + beta * z[2]
        v = z[1] + beta * z[3]
        a = first[1] + beta * first[3]
        if v * v <= ROUNDING * abs(x * a) or a == 0.0:
            break
        if (v > 0.0) == rising:
            low = t
        else:
            high = t
        t -= v / a
    return abs(x)

"""Motion of both masses together where the free mass varies: a Taylor series for each step.

    (1 + mu(t)) x'' + 2 zeta x' + x = S + mu(t) p,
    mu(t) = mean (1 + depth cos(frequency t + phase'))

S is the force, and p what the free mass's acceleration would be in flight: zero, or S in the frame
of a base that moves. The equation is solved for b = x'' - p; -b is the contact force over the free
mass on the right wall:

    (1 + mu(t)) b + 2 zeta x' + x = S - p

Nothing here is known in closed form. A step is the Taylor polynomial of x'' and b about its start,
short enough for a remainder below roundoff, which docs/models.md proves.
"""

import math
from typing import Any, NamedTuple

import numpy as np

from damper.engine import forcing as forces
from damper.engine.accumulation import sticks
from damper.engine.bodies import Ballistic, acceleration_of, strength_on, weight_on
from damper.engine.compiled import compiled
from damper.engine.dispatch import by_class, by_class_or_default
from damper.engine.forcing.harmonic import HarmonicForce
from damper.engine.forcing.weighed import WeighedForce
from damper.engine.oscillator import Oscillator
from damper.engine.roundoff import EPSILON
from damper.engine.search import HORIZON, ROUNDOFF
from damper.engine.trigonometry import sine_cosine
from damper.models.flights import VANISHES


class MassLaw(NamedTuple):
    """How the free mass varies: mean (1 + depth cos(frequency t + phase))."""

    mean: float
    """Mean mass ratio."""
    depth: float
    frequency: float
    order: float
    """Cycles in one period of the variation."""
    phase: float
    """At time 0."""


#: Degree of the polynomial of x''.
DEGREE = 30
#: Rate of a step's start times its length, at most, of forcing and of both masses' free motion.
_REACH = 2.0
#: Ratio of consecutive coefficients beyond the last one, at most.
DECAY = 0.2
#: Change of the mass in the complex plane that this decay allows, as a part of it.
CHANGE = 0.5
#: Largest remainder of x'' in units of its largest coefficient.
_REMAINDER = 1e-16
_HALVINGS = 60
#: Binomials C(DEGREE, k), to go over to the Bernstein basis.
_BINOMIALS = np.array([float(math.comb(DEGREE, k)) for k in range(DEGREE + 1)])
_STEPS = 10_000
_ROOT_STEPS = 100


@compiled
def mass_law(
    mean: float, depth: float, order: float, phase: float, frequency_ratio: float
) -> MassLaw:
    """Constants of the free mass's variation.

    `depth` is its amplitude as a part of the mean mass ratio, `order` its period in
    cycles, `phase` its phase at time 0 in radians.
    """
    reduced = math.atan2(math.sin(phase), math.cos(phase))
    return MassLaw(mean, depth, frequency_ratio / order, order, reduced)


@compiled
def modulation(law: MassLaw, periods: float, time: float) -> tuple[float, ...]:
    """Mass ratio at a moment, with sine and cosine of the variation's phase.

    The half angle keeps the digits that 1 + depth cos loses near the smallest mass.
    """
    mean, depth, frequency, order, phase = law
    turns = (periods % order) / order
    sin, cos, _ = sine_cosine(math.pi * turns + 0.5 * (frequency * time + phase))
    return (
        mean * ((1.0 - depth) + 2.0 * depth * cos * cos),
        2.0 * sin * cos,
        (cos - sin) * (cos + sin),
    )


@compiled
def advance_together(
    model: Any, periods: float, time: float, x: float, v: float, phase: Any, tau: float
) -> tuple[float, ...]:
    """Change of the displacement, and velocity, of both masses as one after a time `tau`.

    The start is at whole cycles of the clock plus a time; the force is smooth all the time.
    """
    terms = np.empty((2, DEGREE + 1))
    forcing = model.free.forcing
    passed = 0.0
    dx = 0.0
    here = phase
    for _ in range(_STEPS):
        step, _ = expand(model, periods, time + passed, x + dx, v, here, HORIZON, terms)
        last = passed + step >= tau
        part = (tau - passed) / step if last else 1.0
        more, v = evaluate(terms, step, v, part)
        dx += more
        if last:
            break
        passed += step
        here = forces.turned(forcing, phase, forces.turn_over(forcing, passed))
    return dx, v


@compiled
def step_together(
    model: Any, periods: float, time: float, side: float, x: float, v: float, phase: Any
) -> tuple[float, ...]:
    """Take a step of sticking, which ends at a release: tau, released, dx, v.

    The release is the first root of b, sought on the step's polynomial in the Bernstein basis,
    whose coefficients enclose it: none can be skipped. Without a wall (side = 0) there is none.
    """
    free = model.free
    terms = np.empty((2, DEGREE + 1))
    limit = min(HORIZON, forces.horizon(free.forcing, phase))
    step, roundoff = expand(model, periods, time, x, v, phase, limit, terms)
    part = 1.0
    released = 0.0
    if side != 0.0:
        # Where b is zero, its derivative has the sign of this.
        _, force1, _, _, _ = forces.force_rates(free.forcing, phase)
        own, own1 = acceleration_of(model.mass, 0.0, 0.0, phase), strength_on(model.mass) * force1
        jerk = (free.strength * force1 - own1) - 2.0 * free.damping * own - v
        jumps = forces.may_jump(free.forcing) and side * float(terms[1, 0]) > VANISHES * roundoff
        part = 0.0 if jumps else _first_loss(terms[1], side, jerk, roundoff)
        if part <= 1.0:
            released = 1.0
        else:
            part = 1.0
    dx, v = evaluate(terms, step, v, part)
    return part * step, released, dx, v


@compiled
def evaluate(terms: np.ndarray, step: float, v: float, part: float) -> tuple[float, ...]:
    """Change of the displacement and the velocity after a part of a step that `expand` has made."""
    dx = 0.0
    dv = 0.0
    for k in range(DEGREE, -1, -1):
        share = float(terms[0, k]) / (k + 1.0)
        dv = dv * part + share
        dx = dx * part + share / (k + 2.0)
    reach = part * step
    return reach * (v + reach * dx), v + reach * dv


@compiled
def expand(
    model: Any,
    periods: float,
    time: float,
    x: float,
    v: float,
    phase: Any,
    limit: float,
    terms: np.ndarray,
) -> tuple[float, ...]:
    """Length of the next step, at most `limit`, and the Taylor polynomials of x'' and b on it.

    Into `terms` (2, DEGREE + 1): x'' = sum of terms[0, k] (tau / step)^k for 0 <= tau <= step, and
    b by terms[1]. Returns the step, and the roundoff of b.
    """
    free = model.free
    law = model.variation
    zeta = free.damping
    forcing_rate = forces.rate_of(free.forcing)
    mass_ratio, sin_m, cos_m = modulation(law, periods, time)
    inertia = 1.0 + mass_ratio
    swing = law.mean * law.depth
    frequency = law.frequency
    fast = 2.0 * zeta / inertia
    weights = np.empty(DEGREE + 1)
    driving = (free.strength - strength_on(model.mass)) * forces.bound_of(free.forcing, 0)
    driving = with_weight(model.stuck.forcing, model.mass, driving)
    roundoff = ROUNDOFF * ((driving + 2.0 * zeta * abs(v)) + abs(x)) / inertia

    smooth = min(limit, _REACH / forcing_rate) if forcing_rate > 0.0 else limit
    smooth = min(
        smooth, _steady_span(swing / inertia * abs(sin_m), swing / inertia * abs(cos_m), law)
    )
    step = min(smooth, _REACH / (fast + 1.0 / math.sqrt(inertia)))
    for _ in range(_HALVINGS):
        count = _weigh(swing, frequency * step, sin_m, cos_m, inertia, weights)
        fill_force(free.forcing, phase, step, terms)
        _fill_terms(model, inertia, x, v, step, weights, count, terms)
        largest, left = _sizes(terms)
        if left <= _REMAINDER * largest:
            break
        step *= 0.5
    return step, max(roundoff, left)


@by_class_or_default
def with_weight(forcing: Any, mass: Any, size: float) -> float:
    """Add the size of a weight to that of a force."""
    return size


@with_weight.of(WeighedForce)
def _with_weight(forcing, mass, size):
    return size + abs(weight_on(mass))


@compiled
def _steady_span(first, second, law):
    """Time over which the mass changes little even for complex time: it sets the convergence.

    With first, second = |sin|, |cos| of the variation's phase times its amplitude over the mass,
    the mass's Taylor coefficients at y = frequency span / DECAY sum up to
    first sinh y + second (cosh y - 1) <= CHANGE, a condition that either form meets.
    """
    # For y <= 1: sinh y <= 1.1753 y and cosh y - 1 <= 0.5431 y^2.
    slope = 1.1753 * first
    near = (
        2.0 * CHANGE / (slope + math.sqrt(slope * slope + 4.0 * 0.5431 * second * CHANGE + 1e-99))
    )
    far = math.log(2.0 * CHANGE / max(first + second, 1e-99))
    return DECAY * max(min(near, 1.0), far) / law.frequency


@compiled
def _weigh(swing, angle, sin, cos, inertia, weights):
    """Taylor coefficients of the mass after a step; how many of them matter."""
    weights[0] = inertia
    size = swing
    count = 1
    derivative = cos
    following = -sin
    for k in range(1, DEGREE + 1):
        size *= angle / k
        if size < 1e-20 * inertia:
            break
        derivative, following = following, -derivative
        weights[k] = size * derivative
        count = k + 1
    return count


@by_class_or_default
def fill_force(forcing: Any, phase: Any, step: float, terms: np.ndarray) -> None:
    """Taylor coefficients of the force's shape on a step, into the first row of `terms`."""
    size = 1.0
    for k in range(DEGREE + 1):
        terms[0, k] = forces.derivative_of(forcing, phase, k) * size
        size *= step / (k + 1.0)


@fill_force.of(HarmonicForce)
def _fill_harmonic(forcing, phase, step, terms):
    force = phase.sin
    following = phase.cos
    size = 1.0
    for k in range(DEGREE + 1):
        terms[0, k] = force * size
        force, following = following, -force
        size *= forcing.omega * step / (k + 1.0)


@by_class
def own_term(mass: Any, force: float, k: int) -> float:
    """Coefficient of the free mass's own acceleration, from that of the force's shape."""


@own_term.of(Ballistic)
def _own_ballistic(mass, force, k):
    return mass.acceleration if k == 0 else 0.0


@own_term.of(Oscillator)
def _own_driven(mass, force, k):
    return own_part(mass.forcing, mass.strength, force, k)


@by_class_or_default
def own_part(forcing: Any, strength: float, force: float, k: int) -> float:
    """As `own_term`, by what the free mass's force is."""
    return strength * force


@own_part.of(WeighedForce)
def _own_with_weight(forcing, strength, force, k):
    own = forcing.share * force
    return own + forcing.weight if k == 0 else own


@compiled
def _fill_terms(model, inertia, x, v, step, weights, count, terms):
    """Fill in Taylor coefficients by the recurrence of the equation of motion; the first row holds
    the coefficients of the force's shape on entry."""
    strength = model.free.strength
    drag = 2.0 * model.free.damping
    both = terms[0]
    apart = terms[1]
    position = x
    velocity = v
    for k in range(DEGREE + 1):
        force = float(both[k])
        own = own_term(model.mass, force, k)
        rest = (strength * force - own) - drag * velocity - position
        for j in range(1, min(k + 1, count)):
            rest -= float(weights[j]) * float(apart[k - j])
        term = rest / inertia
        apart[k] = term
        term += own
        both[k] = term
        position = step * velocity / (k + 1.0)
        velocity = step * term / (k + 1.0)


@compiled
def _sizes(terms):
    """Largest coefficient of b, and a bound on the remainder by the decay of all of them."""
    largest = 0.0
    envelope = 0.0
    for k in range(DEGREE + 1):
        size = abs(float(terms[1, k]))
        largest = max(largest, size)
        envelope = max(DECAY * envelope, size)
    return largest, envelope * DECAY / (1.0 - DECAY)


@compiled
def _first_loss(terms, side, jerk, roundoff):
    """First part of a step at which the force -side x'' falls through zero; 2 if it does not.

    x'' is counted from what the free mass's acceleration would be in flight. `jerk` has the sign of
    its derivative at the start if it is zero there, up to roundoff, which heavy damping multiplies
    in the terms.
    The Bernstein coefficients of the force on an interval enclose it, and where they change sign
    once it has one root (Descartes' rule). Other intervals are halved.
    """
    size = DEGREE + 1
    rest = np.empty(size)
    ahead = np.empty(size)
    force = -side * float(terms[0])
    if force <= roundoff:
        if not sticks(side, 0.0, jerk, float(terms[2])):
            return _root(terms, side, 0.0, 1.0) if force > 0.0 else 0.0
        force = max(force, 0.0)
    for i in range(size):
        # b_i = sum of C(i, k) / C(DEGREE, k) terms[k]: all weights lie in [0, 1].
        total = force
        share = 1.0
        for k in range(1, i + 1):
            share *= (i - k + 1.0) / k
            total -= side * (share / float(_BINOMIALS[k])) * float(terms[k])
        rest[i] = total
    start = 0.0
    part = 1.0
    while True:
        # Split [start, 1] at `part` of it (de Casteljau): ahead is the left piece, rest the right.
        end = start + part * (1.0 - start)
        if end == start:
            return start
        kept = rest.copy()
        for i in range(size):
            ahead[i] = rest[0]
            if part < 1.0:
                for k in range(size - 1 - i):
                    rest[k] = (1.0 - part) * float(rest[k]) + part * float(rest[k + 1])
            else:
                ahead[i] = rest[i]
        changes = 0
        sign = 0.0
        sinks = False
        for i in range(size):
            value = float(ahead[i])
            if value < -roundoff:
                sinks = True
                changes += 1 if sign >= 0.0 else 0
                sign = -1.0
            elif value > roundoff:
                changes += 1 if sign < 0.0 else 0
                sign = 1.0
        if not sinks:
            if part == 1.0:
                return 2.0
            start = end
            part = min(1.0, 2.0 * part)
            continue
        if changes == 1:
            return _root(terms, side, start, end)
        # By elements: numba takes seconds to compile the message of a failed slice assignment.
        for i in range(size):
            rest[i] = kept[i]
        part *= 0.5


@compiled
def _root(terms, side, low, high):
    """Root of the force -side x'' where it falls through zero, by Newton's method in a bracket."""
    t = low
    for _ in range(_ROOT_STEPS):
        value = 0.0
        slope = 0.0
        for k in range(DEGREE, -1, -1):
            slope = slope * t + value
            value = value * t - side * float(terms[k])
        if value > 0.0:
            low = t
        else:
            high = t
        following = t - value / slope if slope < 0.0 else 2.0
        if not low <= following <= high:
            following = 0.5 * (low + high)
        if abs(following - t) <= EPSILON * following:
            return following
        t = following
    return t

"""What happens between the two masses: impact law, certified search, burst tail, sticking.

Everything here is relative to one wall (side = +1 right, -1 left): the gap
``g = clearance - side (y - x) >= 0``, zero in contact, and its rate. In flight g'' = side x''
exactly. A bounce keeps its digits however small it gets, because the gap is never formed as a
difference of positions. Derivations and proofs: docs/method.md.
"""

import math

from damper.engine.compiled import compiled
from damper.engine.oscillator import (
    OVERDAMPED,
    Oscillator,
    acceleration,
    advance,
    coasting_jerk,
    derivative_bounds,
    energy_norm,
    fifth_derivative,
    fourth_derivative,
    higher_derivatives,
    increments,
    relax,
)

#: What a step of the search may span, in units of the faster of 1 and 1/omega.
SPAN = 1.5
#: Parts of a step by which it stops short of the contact it aims at: the largest and the smallest
#: one, and their growth with the fourth power of step times fastest rate. They steer only.
MARGIN, LEAST_MARGIN, MARGIN_GROWTH = 0.1, 1e-7, 0.01
#: The same for a contact that is close, where little of the series is left out.
NEAR_MARGIN = 1e-3
#: Largest correction by its second or third term for which the series of the root is used.
NEAR_BEND = 0.2
#: Longest segment without an event, in units of sqrt(M/K): phases lose digits with time. The sine
#: and cosine of this one are doubles to 5e-21, so many such segments of an undamped flight do not
#: add up one rounding.
HORIZON = 25.293586195180865
#: Certified steps in one segment before the search gives up and says so.
MAX_STEPS = 100_000
#: Evaluations from which on a search is long; so many of them count as an event of the budget.
LONG_SEARCH = 100
#: Length of a segment without an event below which it gets nowhere, in units of the faster of 1 and
#: 1/omega. Its evaluations count as those of long searches do.
BRIEF = 1e-3
#: Wall code of a search that ran out of steps.
GAVE_UP = 2.0
#: Rounding of a gap or an acceleration, relative to the sizes of its terms.
ROUNDING = 4.0 * 2.220446049250313e-16


@compiled
def search_budget(max_events: int) -> float:
    """Evaluations that a run's long searches and brief segments may take.

    A hundred for each event, and one whole search more. Others are not counted: they are as many as
    events and time ask for.
    """
    return float(LONG_SEARCH) * max_events + MAX_STEPS


@compiled
def impact(
    mass_ratio: float, restitution: float, side: float, v: float, approach_speed: float
) -> tuple[float, ...]:
    """Velocity of the primary and gap rate just after an impact.

    Momentum is kept and the relative velocity is reversed and multiplied by the restitution.

    Returns
    -------
    v, gap_rate : float
    """
    v += side * mass_ratio * (1.0 + restitution) / (1.0 + mass_ratio) * approach_speed
    return v, restitution * approach_speed


@compiled
def stays(side: float, a: float, j: float, snap: float, crackle: float) -> bool:
    """Whether masses in contact with no relative velocity stay together.

    They do while the wall pushes the free mass inwards, -side x'' > 0; at zero the first derivative
    after it that is not zero decides.
    """
    if a == 0.0:
        a = j
    if a == 0.0:
        a = snap
    if a == 0.0:
        a = crackle
    return side * a <= 0.0


@compiled
def tail_duration(
    osc: Oscillator,
    mass_ratio: float,
    restitution: float,
    side: float,
    a: float,
    j: float,
    sin: float,
    gap_rate: float,
) -> tuple[float, ...]:
    """Remaining time of a complete burst by the second-order accumulation formula.

    Parameters
    ----------
    side, a, j : float
        Wall and the primary's second and third derivative just after the impact.
    sin : float
        Sine of the forcing phase then.
    gap_rate : float
        Rebound speed w.

    Returns
    -------
    duration, error : float
        Time to sticking and an estimate of its error, O(w^3). An infinite error says that the
        burst need not complete from here.
    """
    push = -side * a
    if not (push > 0.0 and restitution < 1.0):
        return 0.0, math.inf
    if gap_rate == 0.0:
        return 0.0, 0.0
    first, duration = accumulation_times(osc[0], mass_ratio, restitution, push, side * j, gap_rate)
    lag = (abs(j) / push + 2.0 * osc[0]) * first
    # Sizes, not the fourth derivative itself: its parts need not cancel along the burst.
    snap = osc[2] * osc[3] * osc[3] * abs(sin) + 2.0 * osc[0] * abs(j) + osc[1] * push
    error = first * (lag * lag + snap / push * first * first)
    if not duration > 0.0 or not lag < 0.5:
        return 0.0, math.inf
    return duration, error


@compiled
def accumulation_times(
    damping_ratio: float,
    mass_ratio: float,
    restitution: float,
    push: float,
    jerk: float,
    gap_rate: float,
) -> tuple[float, ...]:
    """Time that infinitely many bounces take, to first and to second order in their speed.

    Parameters
    ----------
    push, jerk : float
        -g'' > 0 and g''' of the gap just after an impact.
    gap_rate : float
        Rebound speed w.

    Returns
    -------
    first, second : float
        T1 and T2 of docs/theory.md, whatever they are worth here.
    """
    first = 2.0 * gap_rate / (push * (1.0 - restitution))
    # Each part is relative to `first` and of order w.
    bend = jerk / push * first / 3.0
    drag = damping_ratio * mass_ratio * restitution / (1.0 + mass_ratio) * first
    return first, first * (1.0 + bend - drag)


@compiled
def tail_bounce(
    restitution: float, duration: float, gap_rate: float, tau: float
) -> tuple[float, ...]:
    """Gap and gap rate inside a closed burst tail: its bounces are self-similar.

    Returns
    -------
    gap, gap_rate : float
        With a relative error that vanishes with the rebound speed.
    """
    left = 1.0 - tau / duration
    if restitution == 0.0 or left <= 0.0:
        return 0.0, 0.0
    bounce = math.floor(math.log(left) / math.log(restitution))
    shrink = math.exp(bounce * math.log(restitution))
    length = duration * shrink * (1.0 - restitution)
    part = min(max((1.0 - left / shrink) / (1.0 - restitution), 0.0), 1.0)
    speed = gap_rate * shrink
    return speed * length * part * (1.0 - part), speed * (1.0 - 2.0 * part)


@compiled
def find_impact(
    osc: Oscillator,
    clearance: float,
    side: float,
    x0: float,
    v0: float,
    gap0: float,
    rate0: float,
    a0: float,
    j0: float,
    sin0: float,
    cos0: float,
) -> tuple[float, ...]:
    """First contact with either wall in a flight, by steps that cannot skip one.

    Each step aims a little short of the contact that the Taylor polynomial predicts, and is kept
    only if the motion at its two ends proves that the free mass stays off both walls in between.

    Parameters
    ----------
    osc : tuple
        The primary's `damper.engine.oscillator.oscillator` in flight.
    clearance, side : float
        Half gap, and the wall from which gap0 and its rate rate0 are measured.
    x0, v0, a0, j0 : float
        Motion of the primary at the start, to the third derivative.
    sin0, cos0 : float
        Sine and cosine of the forcing phase at the start.

    Returns
    -------
    tau, hit, dx, v, rate, steps : float
        Time of the contact; its wall, 0 if there is none before the horizon, `GAVE_UP` if
        MAX_STEPS ran out; the primary's displacement less x0 and velocity then; the gap rate,
        still from `side`; the number of evaluations.
    """
    width = 2.0 * clearance
    growth = osc[2] * osc[3] * osc[3] * osc[3]
    tau = 0.0
    dx = 0.0
    v = v0
    a = a0
    j = j0
    gap = gap0
    rate = rate0
    snap, crackle = higher_derivatives(osc, a, j, sin0, cos0)
    norm = energy_norm(osc, j, snap)
    lifting = gap0 == 0.0 and rate0 == 0.0 and a0 == 0.0
    shortest = SPAN / max(1.0, osc[3])
    longest = shortest
    if lifting:
        facing = 1.0
        aimed = False
        step = _lift_off_step(osc, side, j, snap, crackle, sin0, longest)
    else:
        step, facing, aimed = _aim(osc, longest, width, gap, rate, side, a, j, snap, crackle)
    for steps in range(1, MAX_STEPS):
        end = tau + step
        if end == tau:
            # The contact is nearer than time can resolve. Without a clearance both walls are.
            own = gap < clearance or (clearance == 0.0 and rate < 0.0)
            return tau, side if own else -side, dx, v, rate, steps

        dx1, dv1, sin1, cos1 = increments(osc, x0, v0, a0, j0, sin0, cos0, end)
        gap1 = gap0 + rate0 * end + side * dx1
        rate1 = rate0 + side * dv1
        rounding = ROUNDING * (gap0 + abs(rate0) * end + abs(dx1))
        # At a lift-off the gap surely grows throughout the step.
        if not (lifting and gap1 < width) and not stays_between(
            gap, rate, gap1, rate1, width, step, norm + growth * step, rounding
        ):
            # Aimed too far: twice the excess back; else the step was too bold.
            excess = 0.0
            if aimed and rate1 != 0.0:
                excess = 2.0 * (gap1 if facing > 0.0 else gap1 - width) / rate1

            aimed = 0.0 < excess < 0.5 * step
            step -= excess if aimed else 0.5 * step
            continue
        if step == longest:
            longest = min(2.0 * longest, max(shortest, HORIZON - end))
        lifting = False
        tau = end
        gap = gap1
        rate = rate1
        dx = dx1 + v0 * tau
        v = v0 + dv1
        a, j = acceleration(osc, x0 + dx, v, sin1, cos1)
        snap = fourth_derivative(osc, a, j, sin1)
        norm = energy_norm(osc, j, snap)
        if aimed:
            distance = gap if facing > 0.0 else width - gap
            slope = facing * rate
            turn = facing * side
            step = near_root(distance, slope, turn * a, turn * j, turn * snap)
            if step < math.inf:
                if facing < 0.0:
                    rounding += ROUNDING * width
                ahead = 2.0 * abs(step)
                bound3 = abs(j) + (norm + growth * ahead) * ahead
                left = distance + step * (
                    slope
                    + step
                    * turn
                    * (0.5 * a + step * (j * (1.0 / 6.0) + step * snap * (1.0 / 24.0)))
                )
                if distance <= rounding or (
                    falls_through(distance, slope, turn * a, bound3, ahead)
                    and abs(left) <= 0.25 * rounding
                    and _resolves(osc, j, snap, step, tau, rounding)
                ):
                    # One term more than the gap needs: it is what is left of the velocity's error.
                    # Over more than a time constant damping would multiply rounding into it.
                    crackle = 0.0
                    if osc[10] * abs(step) < 1.0:
                        crackle = fifth_derivative(osc, j, snap, cos1)
                    dv = step * (
                        a
                        + step
                        * (0.5 * j + step * (snap * (1.0 / 6.0) + step * crackle * (1.0 / 24.0)))
                    )
                    dx += step * (
                        v + step * (0.5 * a + step * (j * (1.0 / 6.0) + step * snap * (1.0 / 24.0)))
                    )
                    return tau + step, turn, dx, v + dv, rate + side * dv, steps
                if step > 0.0:
                    step -= NEAR_MARGIN * step
                    continue
        if tau >= HORIZON:
            return tau, 0.0, dx, v, rate, steps
        crackle = fifth_derivative(osc, j, snap, cos1)
        step, facing, aimed = _aim(osc, longest, width, gap, rate, side, a, j, snap, crackle)
    return tau, GAVE_UP, dx, v, rate, MAX_STEPS


@compiled
def find_release(
    osc: Oscillator, side: float, x0: float, v0: float, sin0: float, cos0: float
) -> tuple[float, ...]:
    """End of sticking: the first time at which the wall would have to pull, side x'' = 0.

    The same certified search as `find_impact`, on the thrust -side x''. Without a wall
    (side = 0, clearance = 0) there is no release.

    Returns
    -------
    tau, released, dx, v, steps : float
        As `find_impact`, with 1 for a release; x'' = 0 there by definition.
    """
    if side == 0.0:
        dx, v = advance(osc, x0, v0, sin0, cos0, HORIZON)
        return HORIZON, 0.0, dx, v, 1
    force4 = osc[2] * osc[3] * osc[3] * osc[3] * osc[3]
    shortest = SPAN / max(1.0, osc[3])
    longest = shortest
    tau = 0.0
    dx = 0.0
    v = v0
    sin = sin0
    cos = cos0
    a0, j0 = acceleration(osc, x0, v0, sin0, cos0)
    a = a0
    j = j0
    thrust = -side * a
    snap, crackle = higher_derivatives(osc, a, j, sin, cos)
    norm = 0.0
    step = 0.0
    certain = False
    fresh = True
    for steps in range(MAX_STEPS):
        rounding = ROUNDING * (osc[2] + 2.0 * osc[0] * abs(v) + osc[1] * abs(x0 + dx))
        if fresh:
            root = first_root(thrust, -side * j, -side * snap)
            if thrust <= rounding and _lets_go(osc, side, v, sin, cos):
                late = root if root < math.inf else 0.0
                dx += late * (v + 0.5 * a * late)
                return tau + late, 1.0, dx, v + a * late, steps
            if tau >= HORIZON:
                return tau, 0.0, dx, v, steps
            sixth = force4 * sin - 2.0 * osc[0] * crackle - osc[1] * snap
            norm = energy_norm(osc, crackle, sixth)
            certain = thrust == 0.0 and j == 0.0 and snap == 0.0
            if certain:
                step = _lift_off_step(osc, -side, 0.0, 0.0, crackle, sin, longest)
            else:
                step = short_of_root(
                    root,
                    longest,
                    osc[10],
                    thrust,
                    -side * j,
                    -side * snap,
                    -side * crackle,
                    -side * sixth,
                    0.0,
                )
        else:
            step = _pushing_step(osc, side, x0 + dx, v, a, j, snap, crackle, cos, step)
            certain = True
        end = tau + step
        if end == tau:
            return tau, 1.0, dx, v, steps
        dx1, dv1, sin1, cos1 = increments(osc, x0, v0, a0, j0, sin0, cos0, end)
        dx1 += v0 * end
        v1 = v0 + dv1
        if osc[4] == OVERDAMPED:
            # Twice the damping times a rounding of v0 would be left of x'' once v0 has died.
            dx1, v1 = relax(osc, x0, v0, sin0, cos0, end)
        a1, j1 = acceleration(osc, x0 + dx1, v1, sin1, cos1)
        bound = norm + force4 * osc[3] * step
        fresh = certain or stays_between(
            thrust, -side * j, -side * a1, -side * j1, math.inf, step, bound, rounding
        )
        if fresh:
            if step == longest:
                longest = min(2.0 * longest, max(shortest, HORIZON - end))
            tau = end
            dx = dx1
            v = v1
            a = a1
            j = j1
            sin = sin1
            cos = cos1
            thrust = -side * a
            snap, crackle = higher_derivatives(osc, a, j, sin, cos)
    return tau, GAVE_UP, dx, v, MAX_STEPS


@compiled
def _lets_go(osc, side, v, sin, cos):
    """Whether the thrust, which is zero, turns into a pull.

    From x'' = 0 and not as it rounded: heavy damping would multiply that into the third derivative.
    """
    third = coasting_jerk(osc, v, cos)
    snap, crackle = higher_derivatives(osc, 0.0, third, sin, cos)
    return not stays(side, 0.0, third, snap, crackle)


@compiled
def _pushing_step(osc, side, x, v, a, j, snap, crackle, cos, span):
    """Time for which the thrust -side x'' surely stays positive, at most `span`.

    Looks ahead from one end only, where rounding of the higher derivatives, which the damping
    multiplies, spoils a look from both.
    """
    force2 = osc[2] * osc[3] * osc[3]
    thrust = -side * a
    bound2, bound3 = derivative_bounds(osc, force2, a, j, snap, crackle, span)
    step = _certified_step(thrust, -side * j, -side * snap, bound2, bound3, span)
    # Each derivative multiplies rounding by the damping: the first one alone may reach further.
    hardest, steepest = derivative_bounds(osc, osc[2], x, v, a, j, span)
    # x'' relaxes at the rate 2 beta towards what drives it, so it keeps a sign that they share.
    drive = -side * coasting_jerk(osc, v, cos)
    return max(step, min(span, max(thrust / steepest, drive / (force2 + osc[1] * hardest))))


@compiled
def _certified_step(value, slope, curvature, bound2, bound3, span):
    """Time for which a smooth function surely stays positive.

    Given its value >= 0, slope and curvature now, and |second derivative| <= bound2,
    |third derivative| <= bound3 on [0, span], the function lies above the parabola with the
    curvature -min(bound2, bound3 span / 3 - curvature). Its first root, in the form that does not
    cancel, is the step; `span` if there is none before.
    """
    step = first_root(value, slope, -min(bound2, bound3 * span / 3.0 - curvature))
    if slope >= 0.0 and curvature > 0.0:
        # Opening at an increasing rate until the third derivative can have undone the curvature.
        step = max(step, 3.0 * curvature / bound3)
    return min(step, span)


@compiled
def stays_between(
    value: float,
    slope: float,
    value1: float,
    slope1: float,
    width: float,
    step: float,
    bound4: float,
    rounding: float,
) -> bool:
    """Whether a smooth function surely stays between 0 and `width` during a step.

    Known are its values and slopes at both ends, and |fourth derivative| <= bound4 in between.
    Cubic Hermite interpolation errs by at most bound4 t^2 (step - t)^2 / 24, and the interpolant is
    a mean of its four Bernstein coefficients; docs/method.md has the proof.
    """
    third = step / 3.0
    second = value + third * slope
    third = value1 - third * slope1
    middle = second + third
    error = bound4 * step * step * step * step / 72.0
    return (
        min(second, third, value1) >= -rounding
        and max(second, third, value1) <= width + rounding
        and error < middle < 2.0 * width - error
    )


@compiled
def _lift_off_step(osc, side, j, snap, crackle, sin, longest):
    """Time for which side x' and side x'' surely stay positive, by the first derivative not zero.

    x'' is zero at the start. Its rate then grows as j tau^2 / 2 (or snap tau^3 / 6, or crackle
    tau^4 / 24), and a bound on the derivative after that says how far.
    """
    force3 = osc[2] * osc[3] * osc[3] * osc[3]
    if j != 0.0:
        step = 2.0 * side * j / (energy_norm(osc, j, snap) + force3 * longest)
    elif snap != 0.0:
        step = 3.0 * side * snap / (energy_norm(osc, snap, crackle) + force3 * osc[3] * longest)
    else:
        sixth = force3 * osc[3] * sin - 2.0 * osc[0] * crackle - osc[1] * snap
        bound6 = energy_norm(osc, crackle, sixth) + force3 * osc[3] * osc[3] * longest
        step = 4.0 * side * crackle / bound6
    return min(longest, step)


@compiled
def _aim(osc, longest, width, gap, rate, side, a, j, snap, crackle):
    """Step towards the next contact as the Taylor polynomial has it, its wall, whether in reach."""

    bend = side * a
    own = first_root(gap, rate, bend)
    other = first_root(width - gap, -rate, -bend)
    facing = 1.0 if own <= other else -1.0
    turn = facing * side
    step = short_of_root(
        min(own, other),
        longest,
        osc[10],
        gap if own <= other else width - gap,
        facing * rate,
        turn * a,
        turn * j,
        turn * snap,
        turn * crackle,
    )
    return step, facing, step < longest


@compiled
def short_of_root(
    root: float,
    longest: float,
    fastest: float,
    value: float,
    slope: float,
    second: float,
    third: float,
    fourth: float,
    fifth: float,
) -> float:
    """Step that stops a little before a root of a Taylor polynomial; `longest` if that is less.

    `root` is the one of the parabola, which two Newton steps improve.
    """
    if root > 2.0 * longest:
        return longest
    second *= 0.5
    third *= 1.0 / 6.0
    fourth *= 1.0 / 24.0
    fifth *= 1.0 / 120.0
    t = root
    for _ in range(2):
        square = t * t
        value_t = (value + t * slope) + square * (
            (second + t * third) + square * (fourth + t * fifth)
        )
        slope_t = (slope + 2.0 * t * second) + square * (
            (3.0 * third + 4.0 * t * fourth) + 5.0 * square * fifth
        )
        if slope_t < 0.0:
            t = min(max(t - value_t / slope_t, 0.25 * t), 2.0 * t)
    reach = fastest * t
    reach *= reach
    return min(t - t * max(LEAST_MARGIN, min(MARGIN, MARGIN_GROWTH * reach * reach)), longest)


@compiled
def falls_through(value: float, slope: float, second: float, bound3: float, span: float) -> bool:
    """Whether a function surely falls throughout the coming span, and through zero.

    Its second derivative is known now, and |third derivative| <= bound3 on the span.
    """
    steepest = slope + span * (second + 0.5 * span * bound3)
    least = value + span * (slope + span * (0.5 * second + span * bound3 / 6.0))
    return slope < 0.0 and steepest < 0.0 and least < 0.0


@compiled
def near_root(value: float, slope: float, second: float, third: float, fourth: float) -> float:
    """Signed root near zero of a function falling through zero; inf where its bend matters much.

    The series of the inverse function to the fourth order.
    """
    if not slope < 0.0:
        return math.inf
    inverse = -1.0 / slope
    u = value * inverse
    b = 0.5 * second * inverse
    c = third * inverse * (1.0 / 6.0)
    d = fourth * inverse * (1.0 / 24.0)
    if not max(abs(u * b), abs(u * u * c)) < NEAR_BEND:
        return math.inf

    square = b * b
    return u + u * u * (b + u * ((2.0 * square + c) + u * (5.0 * b * (square + c) + d)))


@compiled
def _resolves(osc, j, snap, step, tau, rounding):
    """Whether fourth-order Taylor terms carry the state over `step` within rounding."""
    force3 = osc[2] * osc[3] * osc[3] * osc[3]
    bound5 = force3 + osc[11] * (energy_norm(osc, j, snap) + force3 * abs(step))
    square = step * step
    return bound5 * square * square * tau <= 24.0 * rounding


@compiled
def first_root(value: float, slope: float, curvature: float) -> float:
    """Smallest root >= 0 of value + slope t + curvature t^2 / 2 for value >= 0; inf if none.

    A value below zero, which only rounding can make, counts as zero.
    """
    value = max(value, 0.0)
    discriminant = slope * slope - 2.0 * curvature * value
    if discriminant < 0.0:
        return math.inf
    root = math.sqrt(discriminant)
    if slope < 0.0:
        return 2.0 * value / (root - slope)
    if curvature < 0.0:
        return (root + slope) / -curvature
    return math.inf

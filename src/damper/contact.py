"""What happens between the two masses: impact law, certified search, burst tail, sticking.

Everything here is relative to one wall (side = +1 right, -1 left): the gap
``g = clearance - side (y - x) >= 0``, zero in contact, and its rate. In flight g'' = side x''
exactly. A bounce keeps its digits however small it gets, because the gap is never formed as a
difference of positions. Derivations and proofs: docs/method.md.
"""

import math

from damper.compiled import compiled
from damper.flow import (
    Oscillator,
    acceleration,
    advance,
    derivative_bounds,
    fourth_derivative,
    higher_derivatives,
    increments,
)

#: What a step of the search may span, in units of the faster of 1 and 1/omega.
SPAN = 1.5
#: Part of the way to the expected contact for which its uniqueness is tried to be shown.
REACH = 1.25
#: Longest segment without an event, in units of sqrt(M/K): phases lose digits with time.
HORIZON = 25.0
#: Certified steps in one segment before the search gives up and says so.
MAX_STEPS = 100_000
#: Wall code of a search that ran out of steps.
GAVE_UP = 2.0
#: Shorter spans tried in one step, each a tenth of the one before.
MAX_NARROWINGS = 40
#: Rounding of a gap or an acceleration, relative to the sizes of its terms.
ROUNDING = 4.0 * 2.220446049250313e-16


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
    loss = 1.0 - restitution
    first = 2.0 * gap_rate / (push * loss)
    # Each part is relative to `first` and of order w.
    bend = side * j / push * first / 3.0
    drag = osc[0] * mass_ratio * restitution / (1.0 + mass_ratio) * first
    duration = first * (1.0 + bend - drag)
    lag = (abs(j) / push + 2.0 * osc[0]) * first
    # Sizes, not the fourth derivative itself: its parts need not cancel along the burst.
    snap = osc[2] * osc[3] * osc[3] * abs(sin) + 2.0 * osc[0] * abs(j) + osc[1] * push
    error = first * (lag * lag + snap / push * first * first)
    if not duration > 0.0 or not lag < 0.5:
        return 0.0, math.inf
    return duration, error


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

    Parameters
    ----------
    osc : tuple
        The primary's `damper.flow.oscillator` in flight.
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
    force = osc[2]
    longest = SPAN / max(1.0, osc[3])
    tau = 0.0
    x = x0
    v = v0
    a = a0
    j = j0
    gap = gap0
    rate = rate0
    dx = 0.0
    scale = gap0
    sin1 = sin0
    leaving = gap0 == 0.0 and rate0 >= 0.0
    confirmed = False
    facing = 1.0
    earliest = 0.0
    latest = 0.0
    for steps in range(MAX_STEPS):
        # The wall that the free mass approaches: distance and derivatives (facing = 1 for `side`).
        if not confirmed:
            facing = 1.0 if rate < 0.0 or (rate == 0.0 and side * a < 0.0) else -1.0
        distance = gap if facing > 0.0 else 2.0 * clearance - gap
        slope = facing * rate
        bend = facing * side * a
        third = facing * side * j
        rounding = ROUNDING * (scale if facing > 0.0 else scale + 2.0 * clearance)

        if leaving:
            # In contact at the start: the root at zero is divided out.
            leaving = False
            step, bound2, bound3 = _leaving_step(osc, side, x, v, a, j, sin0, cos0, rate, longest)
            step = _certified_step(2.0 * clearance, -rate, -side * a, bound2, bound3, step)
        elif confirmed or (distance <= rounding and slope <= 0.0):
            snap = fourth_derivative(osc, a, j, sin1)
            step = _near_root(distance, slope, bend, third, facing * side * snap)
            if not confirmed or _resolves(osc, j, snap, step, tau, rounding):
                dv = step * (a + step * (0.5 * j + step * snap / 6.0))
                dx += step * (v + step * (0.5 * a + step * (j / 6.0 + step * snap / 24.0)))
                v += dv
                rate += side * dv
                return tau + step, facing * side, dx, v, rate, steps
            if distance > 0.0:
                earliest = tau
            else:
                latest = tau
            if not earliest < tau + step < latest:
                step = 0.5 * (earliest + latest) - tau
        elif tau >= HORIZON:
            return tau, 0.0, dx, v, rate, steps
        else:
            root = _first_root(distance, slope, bend)
            span = min(longest, REACH * root)
            bound2, bound3 = derivative_bounds(osc, force, x, v, a, j, span)
            steepest = slope + min(bound2 * span, bend * span + 0.5 * bound3 * span * span)
            least = distance + span * (slope + span * (0.5 * bend + span * bound3 / 6.0))
            if slope < 0.0 and steepest < 0.0 and least < 0.0:
                # The gap surely falls to zero just once within the span: plain iteration is safe.
                confirmed = True
                earliest = tau
                latest = tau + span
                snap = fourth_derivative(osc, a, j, sin1)
                step = min(_near_root(distance, slope, bend, third, facing * side * snap), span)
            else:
                step = _certified_step(distance, slope, bend, bound2, bound3, span)
                away = 2.0 * clearance - distance
                if _certified_step(away, -slope, -bend, bound2, bound3, span) < step:
                    behind = _step_from_behind(osc, x, v, a, j, away, -slope, -bend, span)
                    if behind < step:
                        step = behind
                        facing = -facing
        if tau + step == tau:
            # The contact is nearer than time can resolve.
            return tau, facing * side, dx, v, rate, steps
        tau += step
        dx, dv, sin1, cos1 = increments(osc, x0, v0, a0, j0, sin0, cos0, tau)
        scale = gap0 + abs(rate0) * tau + abs(dx)
        gap = gap0 + rate0 * tau + side * dx
        rate = rate0 + side * dv
        dx += v0 * tau
        x = x0 + dx
        v = v0 + dv
        a, j = acceleration(osc, x, v, sin1, cos1)
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
    force2 = osc[2] * osc[3] * osc[3]
    longest = SPAN / max(1.0, osc[3])
    tau = 0.0
    x = x0
    v = v0
    dx = 0.0
    sin1 = sin0
    cos1 = cos0
    if side == 0.0:
        dx, v = advance(osc, x0, v0, sin0, cos0, HORIZON)
        return HORIZON, 0.0, dx, v, 1
    a, j = acceleration(osc, x, v, sin1, cos1)
    a0 = a
    j0 = j
    for steps in range(MAX_STEPS):
        thrust = -side * a
        snap, crackle = higher_derivatives(osc, a, j, sin1, cos1)
        scale = osc[2] + 2.0 * osc[0] * abs(v) + osc[1] * abs(x)
        root = _first_root(thrust, -side * j, -side * snap)
        if thrust <= ROUNDING * scale and not stays(side, 0.0, j, snap, crackle):
            late = root if root < math.inf else 0.0
            dx += late * (v + 0.5 * a * late)
            return tau + late, 1.0, dx, v + a * late, steps
        if tau >= HORIZON:
            return tau, 0.0, dx, v, steps
        span = min(longest, root)
        bound2, bound3 = derivative_bounds(osc, force2, a, j, snap, crackle, span)
        step = _certified_step(thrust, -side * j, -side * snap, bound2, bound3, span)
        # Each derivative multiplies rounding by the damping: the first one alone may reach further.
        _, steepest = derivative_bounds(osc, osc[2], x, v, a, j, span)
        step = max(step, min(span, thrust / steepest))
        if thrust == 0.0 and j == 0.0 and snap == 0.0:
            step = _lift_off_step(osc, -side, 0.0, 0.0, crackle, sin1, longest)
        if tau + step == tau:
            return tau, 1.0, dx, v, steps
        tau += step
        dx, dv, sin1, cos1 = increments(osc, x0, v0, a0, j0, sin0, cos0, tau)
        dx += v0 * tau
        x = x0 + dx
        v = v0 + dv
        a, j = acceleration(osc, x, v, sin1, cos1)
    return tau, GAVE_UP, dx, v, MAX_STEPS


@compiled
def _certified_step(value, slope, curvature, bound2, bound3, span):
    """Time for which a smooth function surely stays positive.

    Given its value >= 0, slope and curvature now, and |second derivative| <= bound2,
    |third derivative| <= bound3 on [0, span], the function lies above the parabola with the
    curvature -min(bound2, bound3 span / 3 - curvature). Its first root, in the form that does not
    cancel, is the step; `span` if there is none before.
    """
    step = _first_root(value, slope, -min(bound2, bound3 * span / 3.0 - curvature))
    if slope >= 0.0 and curvature > 0.0:
        # Opening at an increasing rate until the third derivative can have undone the curvature.
        step = max(step, 3.0 * curvature / bound3)
    return min(step, span)


@compiled
def _step_from_behind(osc, x, v, a, j, away, slope, bend, span):
    """Certified step for the wall that the free mass moves away from.

    Just after a lift-off gap, rate and curvature are tiny, and bounds over a long span say
    nothing; over a shorter one they are sharper.
    """
    step = 0.0
    for _ in range(MAX_NARROWINGS):
        bound2, bound3 = derivative_bounds(osc, osc[2], x, v, a, j, span)
        step = max(step, _certified_step(away, slope, bend, bound2, bound3, span))
        if step >= 0.1 * span:
            break
        span *= 0.1
    return step


@compiled
def _lift_off_step(osc, side, j, snap, crackle, sin, longest):
    """Time for which side x'' surely stays positive from zero, by its first non-zero derivative.

    The motion then starts as j tau^3 / 6 (or snap tau^4 / 24, or crackle tau^5 / 120) and a bound
    on the derivative after that says how far.
    """
    force2 = osc[2] * osc[3] * osc[3]
    bound4, bound5 = derivative_bounds(osc, force2, 0.0, j, snap, crackle, longest)
    if j != 0.0:
        step = 4.0 * side * j / bound4
    elif snap != 0.0:
        step = 5.0 * side * snap / bound5
    else:
        sixth = force2 * osc[3] * osc[3] * sin - 2.0 * osc[0] * crackle - osc[1] * snap
        _, bound6 = derivative_bounds(osc, force2 * osc[3], j, snap, crackle, sixth, longest)
        step = 4.0 * side * crackle / bound6
    return min(longest, step)


@compiled
def _leaving_step(osc, side, x, v, a, j, sin, cos, rate, longest):
    """Time for which a gap that starts from zero surely stays open.

    With rebound speed `rate` the parabola is that of gap / time. At lift-off rate and curvature
    are zero too, and the gap starts as side j tau^3 / 6. Also returns bounds on the second and
    third derivative that hold so far.
    """
    curvature = side * a
    span = longest
    if curvature < 0.0:
        span = min(span, -2.0 * rate / curvature)
    bound2, bound3 = derivative_bounds(osc, osc[2], x, v, a, j, span)
    if rate == 0.0 and curvature == 0.0:
        snap, crackle = higher_derivatives(osc, a, j, sin, cos)
        step = _lift_off_step(osc, side, j, snap, crackle, sin, longest)
    else:
        step = 2.0 * rate / bound2
        root = math.sqrt(0.25 * curvature * curvature + 2.0 / 3.0 * bound3 * rate)
        if curvature < 0.0:
            step = max(step, 2.0 * rate / (root - 0.5 * curvature))
        else:
            step = max(step, 3.0 * (root + 0.5 * curvature) / bound3)
    return min(step, span), bound2, bound3


@compiled
def _near_root(value, slope, curvature, third, fourth):
    """Signed root near zero of a function falling through zero, to fifth order.

    The near root of its parabola, then one Newton step on the Taylor polynomial. Zero where the
    parabola has no root, which is a touch within rounding.
    """
    discriminant = slope * slope - 2.0 * curvature * value
    if discriminant <= 0.0:
        return 0.0
    speed = math.sqrt(discriminant)
    t = 2.0 * value / (speed - slope)
    # The parabola is zero at t and falls there at the rate `speed`.
    change = t * t * (0.5 * third + t * fourth / 6.0)
    if abs(change) < 0.5 * speed:
        t += t * t * t * (third / 6.0 + t * fourth / 24.0) / (speed - change)
    return t


@compiled
def _resolves(osc, j, snap, step, tau, rounding):
    """Whether fourth-order Taylor terms carry the state over `step` within rounding."""
    force3 = osc[2] * osc[3] * osc[3] * osc[3]
    bound5 = force3 + osc[11] * (math.sqrt(osc[1] * j * j + snap * snap) + force3 * abs(step))
    square = step * step
    return bound5 * square * square * tau <= 24.0 * rounding


@compiled
def _first_root(value, slope, curvature):
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

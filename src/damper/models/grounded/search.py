"""First contact of two oscillators between two walls, by steps that cannot skip one.

The search of `damper.engine.search.find_impact` where the other mass moves as an oscillator too:
the gap then obeys g'' = side (x'' - y''), and is bounded by both. Either may be far stiffer or more
heavily damped than the other, so its derivatives can be huge while it hardly moves: docs/models.md.
"""

import math

from damper.engine.compiled import compiled
from damper.engine.oscillator import (
    NEARLY_CRITICAL,
    OVERDAMPED,
    RESONANT,
    TAYLOR_RANGE,
    Oscillator,
    acceleration,
    energy_norm,
    higher_derivatives,
    increments,
    sine_cosine,
)
from damper.engine.search import (
    GAVE_UP,
    HORIZON,
    MAX_STEPS,
    NEAR_MARGIN,
    ROUNDING,
    SPAN,
    falls_through,
    first_root,
    near_root,
    short_of_root,
    stays_between,
)

#: Rate, over the faster of 1 and omega, from which an oscillator's own motion is set apart.
FAST = 8.0
#: Part of the way to where fast motions can reach a wall that one step over them takes.
LEAP = 0.9
#: Own rate of the second oscillator times time, above which its motion is formed as a turn.
TURNED = 3.0

# What `_look` returns.
_A, _J, _SNAP, _CRACKLE, _BOUND4, _BOUND5, _BOUND6, _GROWTH = range(8)
_OWN, _OWN1, _OWN2, _CALM4, _CALM_GROWTH, _SIZE = range(8, 14)


@compiled
def first_contact(
    one: Oscillator,
    x0: float,
    v0: float,
    a0: float,
    j0: float,
    sin0: float,
    cos0: float,
    two: Oscillator,
    y0: float,
    u0: float,
    b0: float,
    k0: float,
    side: float,
    width: float,
    gap0: float,
    rate0: float,
    lifting: bool,
) -> tuple[float, ...]:
    """First time at which the gap between two oscillators leaves [0, width].

    Parameters
    ----------
    one, two : tuple
        From `damper.engine.oscillator.oscillator`; the second one has no force.
    x0, v0, a0, j0, y0, u0, b0, k0 : float
        Displacement of each and its first three derivatives at the start.
    sin0, cos0 : float
        Sine and cosine of the phase of the force on the first one.
    side, width : float
        The gap's second derivative is side (x'' - y''); `width` may be infinite.
    gap0, rate0 : float
        Gap and its rate.
    lifting : bool
        Gap, rate and second derivative are zero, and the gap is about to open.

    Returns
    -------
    tau, hit, dx, v, rate, steps : float
        Time of the contact; 1 where the gap vanishes, -1 where it fills the width, 0 if it does
        neither before the horizon, `GAVE_UP` if the search cannot go on; the first oscillator's
        displacement less x0 and its velocity then; the gap rate; the number of evaluations.
    """
    slow_x, fast_x = _modes(one, x0, v0, a0, sin0, cos0)
    slow_y, fast_y = _modes(two, y0, u0, b0, 0.0, 0.0)
    far = abs(x0) + abs(y0) + gap0
    tau = 0.0
    dx = 0.0
    v = v0
    gap = gap0
    rate = rate0
    p = _look(one, slow_x, fast_x, x0, v0, a0, j0, sin0, cos0, 0.0)
    q = _look(two, slow_y, fast_y, y0, u0, b0, k0, 0.0, 0.0, 0.0)
    shortest = SPAN / max(1.0, one[3])
    longest = shortest
    rounding = ROUNDING * gap0
    # A velocity may be off by the rounding of the gap over this time, or that of the flight.
    brief = math.inf if two[4] == OVERDAMPED else 1.0 / math.sqrt(two[1])
    short = _short(two)
    facing = 1.0
    aimed = False
    if lifting:
        step = _lift_off_step(one, side, p, q, longest)
        lifting = step > 0.0
    if not lifting:
        step, facing, aimed = _aim(one, two, longest, width, gap, rate, side, p, q)
    for steps in range(1, MAX_STEPS):
        end = tau + step
        if end == tau:
            # The contact is nearer than time can resolve.
            facing = 1.0 if gap <= width - gap else -1.0
            distance = gap if facing > 0.0 else width - gap
            if distance <= 2.0 * (rounding + ROUNDING * abs(rate) * tau):
                return tau, facing, dx, v, rate, steps
            break
        dx1, dv1, sin1, cos1 = increments(one, x0, v0, a0, j0, sin0, cos0, end)
        if end <= short:
            dy1, du1, _, _ = increments(two, y0, u0, b0, k0, 0.0, 0.0, end)
            gap1 = gap0 + rate0 * end + side * (dx1 - dy1)
            rate1 = rate0 + side * (dv1 - du1)
            rounding = ROUNDING * (gap0 + abs(rate0) * end + abs(dx1) + abs(dy1))
            y1 = y0 + (u0 * end + dy1)
            u1 = u0 + du1
        else:
            gap1, rate1, y1, u1, rounding = _move_far(
                two, y0, u0, b0, v0, dx1, dv1, side, gap0, rate0, end
            )
            rounding *= ROUNDING
        dx1 += v0 * end
        v1 = v0 + dv1
        # At a lift-off the gap surely grows throughout the step.
        bound4 = p[_BOUND4] + q[_BOUND4] + (p[_GROWTH] + q[_GROWTH]) * step
        sure = (lifting and gap1 < width) or stays_between(
            gap, rate, gap1, rate1, width, step, bound4, rounding
        )
        blur = p[_SIZE] + q[_SIZE]
        calm = gap - side * (p[_OWN] - q[_OWN])
        p1 = p
        q1 = q
        # Whole steps over fast motions that are too small to reach a wall.
        over = not sure and blur < calm < width - blur
        if sure or over:
            a, j = acceleration(one, x0 + dx1, v1, sin1, cos1)
            p1 = _look(one, slow_x, fast_x, x0 + dx1, v1, a, j, sin1, cos1, end)
            a, j = acceleration(two, y1, u1, 0.0, 0.0)
            q1 = _look(two, slow_y, fast_y, y1, u1, a, j, 0.0, 0.0, end)
        if over:
            margin = blur + ROUNDING * (far + abs(dx1) + abs(y1) + gap1)
            if width < math.inf:
                margin += ROUNDING * width
            sure = margin < calm < width - margin and stays_between(
                calm - margin,
                rate - side * (p[_OWN1] - q[_OWN1]),
                gap1 - side * (p1[_OWN] - q1[_OWN]) - margin,
                rate1 - side * (p1[_OWN1] - q1[_OWN1]),
                width - 2.0 * margin,
                step,
                p[_CALM4] + q[_CALM4] + (p[_CALM_GROWTH] + q[_CALM_GROWTH]) * step,
                0.0,
            )
        if not sure:
            # Aimed too far: twice the excess back; else the step was too bold.
            excess = 0.0
            if aimed and rate1 != 0.0:
                excess = 2.0 * (gap1 if facing > 0.0 else gap1 - width) / rate1
            if 0.0 < excess < 0.5 * step:
                step -= excess
            else:
                step *= 0.5
                aimed = False
                longest = step
            continue
        if step == longest:
            longest = min(2.0 * longest, max(shortest, HORIZON - end))
        lifting = False
        tau = end
        gap = gap1
        rate = rate1
        dx = dx1
        v = v1
        p = p1
        q = q1
        if aimed:
            distance = gap if facing > 0.0 else width - gap
            turn = facing * side
            slope = facing * rate
            second = turn * (p[_A] - q[_A])
            third = turn * (p[_J] - q[_J])
            fourth = turn * (p[_SNAP] - q[_SNAP])
            step = near_root(distance, slope, second, third, fourth)
            if step < math.inf:
                if facing < 0.0:
                    rounding += ROUNDING * width
                ahead = 2.0 * abs(step)
                bound4 = p[_BOUND4] + q[_BOUND4] + (p[_GROWTH] + q[_GROWTH]) * ahead
                bound5 = p[_BOUND5] + q[_BOUND5] + (p[_GROWTH] * one[11]) * ahead
                bend = step * (
                    0.5 * second + step * (third * (1.0 / 6.0) + step * fourth * (1.0 / 24.0))
                )
                square = step * step
                if distance <= rounding or (
                    falls_through(distance, slope, second, abs(third) + bound4 * ahead, ahead)
                    and abs(distance + step * (slope + bend)) <= 0.25 * rounding
                    and bound5 * square * square * min(tau, brief) <= 24.0 * rounding
                ):
                    a = p[_A]
                    j = p[_J]
                    snap = p[_SNAP]
                    dx += step * (
                        v + step * (0.5 * a + step * (j * (1.0 / 6.0) + step * snap * (1.0 / 24.0)))
                    )
                    v += step * (a + step * (0.5 * j + step * snap * (1.0 / 6.0)))
                    rate += (
                        facing
                        * step
                        * (second + step * (0.5 * third + step * fourth * (1.0 / 6.0)))
                    )
                    return tau + step, facing, dx, v, rate, steps
                if step > 0.0:
                    step -= NEAR_MARGIN * step
                    continue
        if tau >= HORIZON:
            return tau, 0.0, dx, v, rate, steps
        step, facing, aimed = _aim(one, two, longest, width, gap, rate, side, p, q)
    return tau, GAVE_UP, dx, v, rate, steps


@compiled
def move_apart(
    one: Oscillator,
    x0: float,
    v0: float,
    a0: float,
    j0: float,
    sin0: float,
    cos0: float,
    two: Oscillator,
    y0: float,
    u0: float,
    b0: float,
    k0: float,
    side: float,
    gap0: float,
    rate0: float,
    tau: float,
) -> tuple[float, ...]:
    """Gap between the two and motion of the first one over a time `tau`.

    A short one as increments: a bounce keeps its digits however small it gets. After many swings of
    the second oscillator they would round in units of rate0 tau, the way back and forth. Its
    displacement and velocity are turned by one angle, then: rounding of that is a delay, and takes
    no energy.

    Parameters
    ----------
    one, x0, v0, a0, j0, sin0, cos0, two, y0, u0, b0, k0, side, gap0, rate0
        As `first_contact`.
    tau : float
        Time, >= 0.

    Returns
    -------
    gap, rate, dx, v : float
        Gap and its rate; of the first oscillator the change of the displacement and the velocity.
    """
    dx, dv, _, _ = increments(one, x0, v0, a0, j0, sin0, cos0, tau)
    if tau <= _short(two):
        dy, du, _, _ = increments(two, y0, u0, b0, k0, 0.0, 0.0, tau)
        gap = gap0 + rate0 * tau + side * (dx - dy)
        rate = rate0 + side * (dv - du)
    else:
        gap, rate, _, _, _ = _move_far(two, y0, u0, b0, v0, dx, dv, side, gap0, rate0, tau)
    return gap, rate, v0 * tau + dx, v0 + dv


@compiled
def _short(two):
    """Time up to which the second oscillator moves by increments."""
    return (TAYLOR_RANGE if two[4] == OVERDAMPED else TURNED) / two[11]


@compiled
def _move_far(two, y0, u0, b0, v0, dx, dv, side, gap0, rate0, tau):
    """Gap, its rate, the second oscillator's state, and the size of the gap's terms; not short."""
    if two[4] == OVERDAMPED:
        return _ease(two, y0, u0, b0, v0, dx, dv, side, gap0, rate0, tau)
    dy, u, size = _turn(two, y0, u0, tau)
    gap = gap0 + side * ((v0 * tau + dx) - dy)
    return gap, side * (v0 + dv - u), y0 + dy, u, size + gap0 + abs(v0) * tau + abs(dx)


@compiled
def _ease(osc, y, u, b, v, dx, dv, side, gap, rate, tau):
    """As `_move_far`, of an overdamped oscillator by its modes, from its acceleration.

    That is a difference of forces that may be 1e12 times as large: formed anew for each time, it
    would round to another gap in each look at a small bounce.
    """
    slow = osc[6]
    fast = osc[7]
    own = (b - slow * u) / (fast * (fast - slow))
    rest = y - own
    z = slow * tau
    grow_slow = math.expm1(z)
    grow_fast = math.expm1(fast * tau)
    leap = own * grow_fast
    dy = leap + rest * grow_slow
    u1 = own * fast * (1.0 + grow_fast) + rest * slow * (1.0 + grow_slow)
    if z < -1.0:
        # Both modes have moved as far as they do: nothing small is left that these would hide.
        size = gap + abs(v) * tau + abs(dx) + abs(leap) + abs(rest * grow_slow)
        return gap + side * (v * tau + dx - dy), side * (v + dv - u1), y + dy, u1, size
    bend = grow_slow - z
    if z > -0.01:
        bend = z * z * (0.5 + z * (1.0 / 6.0 + z * (1.0 / 24.0 + z * (1.0 / 120.0 + z / 720.0))))
    # What is left of the gap rate once the fast mode has died, by the smaller terms.
    drift = rate + side * own * fast if abs(rate) <= abs(v) else side * (v - rest * slow)
    return (
        gap + drift * tau + side * (dx - leap - rest * bend),
        drift + side * (dv - own * fast * (1.0 + grow_fast) - rest * slow * grow_slow),
        y + dy,
        u1,
        gap + abs(drift) * tau + abs(dx) + abs(leap) + abs(rest * bend),
    )


@compiled
def _turn(osc, y, u, tau):
    """Change of the displacement of a free oscillator, its velocity, and the size of the former."""
    beta, kappa, _, _, regime, split, slow, _, _, _, _, _ = osc
    if regime == NEARLY_CRITICAL:
        decay = math.exp(slow * tau)
        drop = math.expm1(-2.0 * split * tau)
        c = decay * (1.0 + 0.5 * drop)
        s = decay * (-0.5 * drop / split if split > 0.0 else tau)
        c_less_1 = c + beta * s - 1.0
        s_dot = c - beta * s
    else:
        # The cosine less one: a whole swing later its digits are those of the gap.
        sine, cosine, c_less_1 = sine_cosine(split * tau)
        s = sine / split
        s_dot = cosine
        if beta > 0.0:
            drop = math.expm1(-beta * tau)
            decay = 1.0 + drop
            s *= decay
            c_less_1 = decay * c_less_1 + drop + beta * s
            s_dot = decay * cosine - beta * s
    own = y * c_less_1
    carried = u * s
    return own + carried, u * s_dot - kappa * s * y, abs(own) + abs(carried)


@compiled
def _modes(osc, x, v, a, sin, cos):
    """Sizes of the slow and the fast mode of a heavily damped oscillator; else zeros."""
    _, _, force, omega, regime, _, slow, fast, gain_re, gain_im, _, _ = osc
    if regime != OVERDAMPED:
        return 0.0, 0.0
    steady = force * (gain_re * sin + gain_im * cos)
    swing = force * (gain_re * cos - gain_im * sin)
    # From velocity and acceleration, in which the fast mode is largest.
    own = ((a + omega * omega * steady) - slow * (v - omega * swing)) / (fast * (fast - slow))
    return (x - steady) - own, own


@compiled
def _look(osc, slow_size, fast_size, x, v, a, j, sin, cos, tau):
    """Derivatives of a motion and bounds on them, a time `tau` after the modes were taken.

    Returns
    -------
    a, j, snap, crackle : float
        Second to fifth derivative.
    bound4, bound5, bound6, growth : float
        Over a coming span the n-th derivative is at most its bound + growth omega^(n-4) span, and
        more by the factor sqrt(4 beta^2 + kappa) of `growth` for the fifth.
    own, own1, own2 : float
        The part of the motion that is set apart as fast, and its first two derivatives.
    calm4, calm_growth, size : float
        Bound on the fourth derivative of the rest, as above; largest size of the part set apart.
    """
    beta, kappa, force, omega, regime, _, slow, fast, gain_re, gain_im, _, coupling = osc
    square = omega * omega
    steady = 0.0
    swing = 0.0
    most = 0.0
    if force != 0.0:
        steady = force * (gain_re * sin + gain_im * cos)
        swing = force * (gain_re * cos - gain_im * sin)
        most = abs(force) * math.hypot(gain_re, gain_im) * square * square
    rapid = 2.0 * beta + math.sqrt(kappa) > FAST * max(1.0, omega)
    if regime == OVERDAMPED:
        # From the modes: the equation of motion would multiply rounding by the damping each time.
        s0 = slow_size * math.exp(slow * tau)
        f0 = fast_size * math.exp(fast * tau)
        s1 = slow * s0
        f1 = fast * f0
        s2 = slow * s1
        f2 = fast * f1
        s3 = slow * s2
        f3 = fast * f2
        s4 = slow * s3
        f4 = fast * f3
        s5 = slow * s4
        f5 = fast * f4
        calm4 = most + abs(s4)
        bound5 = most * omega + abs(s5) + abs(f5)
        return (
            s2 + f2 - square * steady,
            s3 + f3 - square * omega * swing,
            s4 + f4 + square * square * steady,
            s5 + f5 + square * square * omega * swing,
            calm4 + abs(f4),
            bound5,
            bound5 * max(omega, -fast),
            0.0,
            f0 if rapid else 0.0,
            f1 if rapid else 0.0,
            f2 if rapid else 0.0,
            calm4 if rapid else calm4 + abs(f4),
            0.0,
            abs(f0) if rapid else 0.0,
        )
    snap, crackle = higher_derivatives(osc, a, j, sin, cos)
    norm = energy_norm(osc, j, snap)
    growth = abs(force) * square * omega
    own = 0.0
    own1 = 0.0
    own2 = 0.0
    size = 0.0
    calm4 = norm
    calm_growth = growth
    if rapid and regime != RESONANT:
        own = x - steady
        own1 = v - omega * swing
        own2 = a + square * steady
        size = math.sqrt(own * own + own1 * own1 / kappa)
        calm4 = most
        calm_growth = 0.0
    return (
        a,
        j,
        snap,
        crackle,
        norm,
        coupling * norm + growth,
        coupling * (energy_norm(osc, snap, crackle) + growth * omega) + growth * omega,
        growth,
        own,
        own1,
        own2,
        calm4,
        calm_growth,
        size,
    )


@compiled
def _lift_off_step(one, side, p, q, longest):
    """Time for which gap, rate and curvature surely grow, by the first derivative not zero."""
    third = side * (p[_J] - q[_J])
    fourth = side * (p[_SNAP] - q[_SNAP])
    growth = p[_GROWTH] + q[_GROWTH]
    if third != 0.0:
        step = 2.0 * third / (p[_BOUND4] + q[_BOUND4] + growth * longest)
    elif fourth != 0.0:
        step = 3.0 * fourth / (p[_BOUND5] + q[_BOUND5] + one[11] * growth * longest)
    else:
        bound6 = p[_BOUND6] + q[_BOUND6] + one[11] * growth * one[3] * longest
        step = 4.0 * side * (p[_CRACKLE] - q[_CRACKLE]) / bound6
    return min(longest, step)


@compiled
def _aim(one, two, longest, width, gap, rate, side, p, q):
    """Step towards the next contact as the motion now has it, its wall, whether in reach."""
    bend = side * (p[_A] - q[_A])
    own = first_root(gap, rate, bend)
    other = first_root(width - gap, -rate, -bend) if width < math.inf else math.inf
    facing = 1.0 if own <= other else -1.0
    turn = facing * side
    step = short_of_root(
        min(own, other),
        longest,
        max(one[10], two[10]),
        gap if own <= other else width - gap,
        facing * rate,
        facing * bend,
        turn * (p[_J] - q[_J]),
        turn * (p[_SNAP] - q[_SNAP]),
        turn * (p[_CRACKLE] - q[_CRACKLE]),
    )
    blur = p[_SIZE] + q[_SIZE]
    calm = gap - side * (p[_OWN] - q[_OWN])
    if 0.0 < blur < min(calm, width - calm) and step < longest:
        # Close to where the fast motions begin to matter, if that is further.
        rate -= side * (p[_OWN1] - q[_OWN1])
        bend -= side * (p[_OWN2] - q[_OWN2])
        own = first_root(calm - blur, rate, bend)
        if width < math.inf:
            other = first_root(width - blur - calm, -rate, -bend)
        leap = min(longest, LEAP * min(own, other))
        if leap > step:
            return leap, facing, False
    return step, facing, step < longest

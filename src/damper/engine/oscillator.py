"""Exact flow of a forced linear oscillator, and closed-form bounds on its derivatives.

    x'' + 2 beta x' + kappa x = force sin(theta + omega tau)

Flight of the primary is kappa = 1, beta = damping_ratio, force = 1; sticking divides all three
by 1 + mass_ratio. This is the only place that knows how the oscillator moves.

The motion from (x0, v0) is x0 C(tau) + v0 S(tau) + force (Re Q sin theta + Im Q cos theta):
C and S solve the free equation from (1, 0) and (0, 1), and the complex Q solves the equation
forced by exp(i omega tau) from rest. Each is evaluated in the form that does not cancel for the
regime at hand; see docs/method.md.
"""

import math

from damper.engine.compiled import compiled

#: Constants of one oscillator; see `oscillator`.
Oscillator = tuple[float, ...]

# Regimes of the homogeneous solution.
UNDERDAMPED, RESONANT, NEARLY_CRITICAL, OVERDAMPED = 0, 1, 2, 3

# Below this product of fastest rate and time the Taylor series is used: it keeps *relative*
# accuracy in the increments as the time shrinks, where differences of closed forms lose it.
TAYLOR_RANGE = 0.5
# The series stops where its remainder is below this part of its scale.
TAYLOR_REMAINDER = 1e-18
# Steady amplitude over the static one, above which homogeneous + steady part would cancel.
RESONANT_GAIN = 4.0

QUARTERS_PER_RADIAN = 2.0 / math.pi
# pi / 2 in two parts: the first one has 33 bits, so that its product with a count is exact.
HALF_PI_HIGH, HALF_PI_LOW = 1.5707963267341256, 6.077100506303966e-11
# Adding and taking away 1.5 * 2**52 rounds to a whole number.
ROUNDER = 6755399441055744.0


@compiled
def sine_cosine(angle: float) -> tuple[float, ...]:
    """Sine and cosine of an angle up to some 1e6, and the cosine less one without cancellation.

    Taylor polynomials after taking away quarter turns (Cody and Waite, Software Manual for the
    Elementary Functions, 1980, ch. 8), to 2e-16 and 1.5e-21 of the angle. The C library branches
    on the angle, and each wrong guess of the processor costs as much as this whole function.

    Returns
    -------
    sine, cosine, cosine_less_1 : float
    """
    quarters = (angle * QUARTERS_PER_RADIAN + ROUNDER) - ROUNDER
    r = (angle - quarters * HALF_PI_HIGH) - quarters * HALF_PI_LOW
    z = r * r
    w = z * z
    sine = r + r * z * (
        ((-1.0 / 6.0 + z * (1.0 / 120.0)) + w * (-1.0 / 5040.0 + z * (1.0 / 362880.0)))
        + (w * w) * ((-1.0 / 39916800.0 + z * (1.0 / 6227020800.0)) - w * (1.0 / 1307674368000.0))
    )
    less_1 = (
        w
        * (
            ((1.0 / 24.0 - z * (1.0 / 720.0)) + w * (1.0 / 40320.0 - z * (1.0 / 3628800.0)))
            + (w * w)
            * ((1.0 / 479001600.0 - z * (1.0 / 87178291200.0)) + w * (1.0 / 20922789888000.0))
        )
        - 0.5 * z
    )
    cosine = 1.0 + less_1
    quarter = int(quarters) & 3
    if quarter & 1:
        sine, cosine = cosine, -sine
    if quarter & 2:
        sine = -sine
        cosine = -cosine
    if quarter:
        less_1 = cosine - 1.0
    return sine, cosine, less_1


@compiled
def oscillator(beta: float, kappa: float, force: float, omega: float) -> Oscillator:
    """Constants of one oscillator, as a tuple of floats that the other functions take.

    Parameters
    ----------
    beta : float
        Half the damping coefficient, >= 0.
    kappa : float
        Stiffness over mass, > 0.
    force : float
        Amplitude of the force over mass.
    omega : float
        Forcing frequency, > 0.

    Returns
    -------
    tuple of float
        beta, kappa, force, omega, regime, split, slow, fast, gain_re, gain_im, rate,
        coupling: `split` is the damped frequency or half the difference of the real
        roots, `slow` and `fast` the real roots, `gain` the steady response to exp(i omega tau),
        `rate` the fastest rate, `coupling` sqrt(4 beta^2 + kappa).
    """
    root = math.sqrt(kappa)
    difference = (root - beta) * (root + beta)
    # Products keep the digits that kappa - omega**2 would lose near resonance.
    detuning = (root - omega) * (root + omega)
    loss = 2.0 * beta * omega
    modulus = math.hypot(detuning, loss)
    split = math.sqrt(abs(difference))
    slow = 0.0
    fast = 0.0
    if difference > 0.0:
        regime = RESONANT if kappa > RESONANT_GAIN * modulus else UNDERDAMPED
    else:
        fast = -(beta + split)
        slow = kappa / fast  # not split - beta, which cancels
        regime = NEARLY_CRITICAL if beta * beta < 2.0 * kappa else OVERDAMPED
    gain_re = 0.0
    gain_im = 0.0
    if regime != RESONANT:
        gain_re = detuning / modulus / modulus
        gain_im = -loss / modulus / modulus
    rate = max(omega, 2.0 * beta + root)
    return (
        beta,
        kappa,
        force,
        omega,
        float(regime),
        split,
        slow,
        fast,
        gain_re,
        gain_im,
        rate,
        math.sqrt(4.0 * beta * beta + kappa),
    )


@compiled
def increments(
    osc: Oscillator,
    x0: float,
    v0: float,
    a0: float,
    j0: float,
    sin0: float,
    cos0: float,
    tau: float,
) -> tuple[float, ...]:
    """Exact motion over a time `tau` from a known state, as increments.

    Parameters
    ----------
    osc : tuple
        From `oscillator`.
    x0, v0, a0, j0 : float
        Displacement and its first three derivatives at tau = 0.
    sin0, cos0 : float
        Sine and cosine of the forcing phase theta at tau = 0.
    tau : float
        Time, >= 0.

    Returns
    -------
    dx, dv, sin1, cos1 : float
        x(tau) - x0 - v0 tau, accurate relative to itself as tau -> 0; v(tau) - v0; sine and
        cosine of the phase at `tau`.
    """
    beta, kappa, force, omega, regime, split, slow, fast, gain_re, gain_im, rate, _ = osc
    angle = omega * tau
    sin_f, cos_f, cos_less_1 = sine_cosine(angle)
    sin1 = sin0 * cos_f + cos0 * sin_f
    cos1 = cos0 * cos_f - sin0 * sin_f
    if rate * tau <= TAYLOR_RANGE:
        dx, dv = _taylor(osc, a0, j0, sin0, cos0, tau)
        return dx, dv, sin1, cos1

    if (2.0 * beta + math.sqrt(kappa)) * tau <= TAYLOR_RANGE:
        # Only the force is fast: the free motion still needs its series.
        c_less_1, s_less_tau = _free_taylor(beta, kappa, tau)
        s = tau + s_less_tau
        s_dot_less_1 = c_less_1 - 2.0 * beta * s
    elif regime == OVERDAMPED:
        grow_fast = math.expm1(fast * tau)
        grow_slow = math.expm1(slow * tau)
        width = fast - slow
        c_less_1 = (fast * grow_slow - slow * grow_fast) / width
        s = (grow_fast - grow_slow) / width
        s_less_tau = s - tau
        s_dot_less_1 = (fast * grow_fast - slow * grow_slow) / width
    elif regime == NEARLY_CRITICAL:
        decay = math.exp(slow * tau)
        drop = math.expm1(-2.0 * split * tau)
        c = decay * (1.0 + 0.5 * drop)
        s = decay * (-0.5 * drop / split if split > 0.0 else tau)
        c_less_1 = c + beta * s - 1.0
        s_less_tau = s - tau
        s_dot_less_1 = c - beta * s - 1.0
    else:
        decay = math.exp(-beta * tau) if beta > 0.0 else 1.0
        sine, cosine, _ = sine_cosine(split * tau)
        c = decay * cosine
        s = decay / split * sine
        c_less_1 = c + beta * s - 1.0
        s_less_tau = s - tau
        s_dot_less_1 = c - beta * s - 1.0

    if regime == RESONANT:
        q_re, q_im, q_dot_re, q_dot_im = _resonant(beta, split, omega, c_less_1, s, tau)
    else:
        # gain (exp(i angle) - C - i omega S) and its derivative.
        re = cos_less_1 - c_less_1
        im = sin_f - omega * s
        q_re = gain_re * re - gain_im * im
        q_im = gain_re * im + gain_im * re
        re = kappa * s - omega * sin_f
        im = omega * (cos_less_1 - s_dot_less_1)
        q_dot_re = gain_re * re - gain_im * im
        q_dot_im = gain_re * im + gain_im * re

    dx = x0 * c_less_1 + v0 * s_less_tau + force * (q_re * sin0 + q_im * cos0)
    dv = v0 * s_dot_less_1 - kappa * s * x0 + force * (q_dot_re * sin0 + q_dot_im * cos0)
    return dx, dv, sin1, cos1


@compiled
def acceleration(osc: Oscillator, x: float, v: float, sin: float, cos: float) -> tuple[float, ...]:
    """Second and third derivative of the displacement from the equation of motion.

    Returns
    -------
    a, j : float
        x'' and x'''.
    """
    beta = osc[0]
    kappa = osc[1]
    force = osc[2]
    a = force * sin - 2.0 * beta * v - kappa * x
    return a, force * osc[3] * cos - 2.0 * beta * a - kappa * v


@compiled
def coasting_jerk(osc: Oscillator, v: float, cos: float) -> float:
    """Third derivative where the second one vanishes: exactly, and not as that rounds."""
    return osc[2] * osc[3] * cos - osc[1] * v


@compiled
def advance(
    osc: Oscillator, x: float, v: float, sin: float, cos: float, tau: float
) -> tuple[float, ...]:
    """Exact motion over a time `tau` from displacement and velocity alone.

    Returns
    -------
    dx, v : float
        Change of the displacement, and the velocity at `tau`.
    """
    a, j = acceleration(osc, x, v, sin, cos)
    dx, dv, _, _ = increments(osc, x, v, a, j, sin, cos, tau)
    return v * tau + dx, v + dv


@compiled
def arrive(
    osc: Oscillator, x: float, v: float, sin: float, cos: float, tau: float
) -> tuple[float, ...]:
    """State after a long time, formed as such: increments round in units of v tau."""
    beta, kappa, _, _, regime, split, _, _, _, _, _, _ = osc
    if regime == NEARLY_CRITICAL:
        dx, v = advance(osc, x, v, sin, cos, tau)
        return x + dx, v
    if regime == OVERDAMPED:
        dx, v = relax(osc, x, v, sin, cos, tau)
        return x + dx, v
    decay = math.exp(-beta * tau) if beta > 0.0 else 1.0
    sine, cosine, _ = sine_cosine(split * tau)
    c = decay * cosine
    s = decay / split * sine
    a, j = acceleration(osc, 0.0, 0.0, sin, cos)
    dx, dv, _, _ = increments(osc, 0.0, 0.0, a, j, sin, cos, tau)
    end = x * (c + beta * s) + v * s + dx
    return end, v * (c - beta * s) - kappa * s * x + dv


@compiled
def relax(
    osc: Oscillator, x: float, v: float, sin: float, cos: float, tau: float
) -> tuple[float, ...]:
    """Motion of a heavily overdamped oscillator, without a rounding of what the damping has eaten.

    Increments keep one of v tau and of v, however little is left of v.

    Returns
    -------
    dx, v : float
        As `advance`.
    """
    slow = osc[6]
    fast = osc[7]
    width = fast - slow
    grow_fast = math.expm1(fast * tau)
    grow_slow = math.expm1(slow * tau)
    s = (grow_fast - grow_slow) / width
    c_less_1 = (fast * grow_slow - slow * grow_fast) / width
    s_dot = (fast * math.exp(fast * tau) - slow * math.exp(slow * tau)) / width
    a, j = acceleration(osc, 0.0, 0.0, sin, cos)
    dx, dv, _, _ = increments(osc, 0.0, 0.0, a, j, sin, cos, tau)
    return x * c_less_1 + v * s + dx, v * s_dot - osc[1] * s * x + dv


@compiled
def fourth_derivative(osc: Oscillator, a: float, j: float, sin: float) -> float:
    """Fourth derivative of the displacement, by differentiating the equation of motion."""
    return -osc[2] * osc[3] * osc[3] * sin - 2.0 * osc[0] * j - osc[1] * a


@compiled
def fifth_derivative(osc: Oscillator, j: float, snap: float, cos: float) -> float:
    """Fifth derivative of the displacement, by differentiating the equation of motion."""
    force3 = osc[2] * osc[3] * osc[3] * osc[3]
    return -force3 * cos - 2.0 * osc[0] * snap - osc[1] * j


@compiled
def higher_derivatives(
    osc: Oscillator, a: float, j: float, sin: float, cos: float
) -> tuple[float, ...]:
    """Fourth and fifth derivative of the displacement, by differentiating the equation of motion.

    Returns
    -------
    snap, crackle : float
        x'''' and x'''''.
    """
    snap = fourth_derivative(osc, a, j, sin)
    return snap, fifth_derivative(osc, j, snap, cos)


@compiled
def energy_norm(osc: Oscillator, lower: float, upper: float) -> float:
    """Bound on a derivative of the displacement, from it (`upper`) and the one below it.

    sqrt(kappa x**2 + v**2) of a damped oscillator grows by at most force * span over a time `span`,
    and the n-th derivative of the motion obeys the same equation with the force's n-th derivative:
    |x^(n+1)| <= energy_norm(osc, x^(n), x^(n+1)) + force * omega**n * span on [0, span].
    """
    return math.sqrt(osc[1] * lower * lower + upper * upper)


@compiled
def derivative_bounds(
    osc: Oscillator, force: float, x: float, v: float, a: float, j: float, span: float
) -> tuple[float, ...]:
    """Bounds on the second and third derivative over the coming time `span`.

    The energy norm sqrt(kappa x**2 + v**2) of a damped oscillator grows by at most force * span,
    and each derivative of the motion obeys the same equation with the force's derivative. The
    bounds stay sharp at resonance (no large cancelling amplitudes) and follow a fast overdamped
    mode down as it dies; heavy damping sharpens them further. For the second derivative of the
    motion pass force * omega**2 and the derivatives from the second on.

    Returns
    -------
    bound2, bound3 : float
        |x''| <= bound2 and |x'''| <= bound3 on [0, span].
    """
    beta = osc[0]
    kappa = osc[1]
    omega = osc[3]
    force1 = force * omega
    coupling = osc[11]
    norm0 = energy_norm(osc, x, v) + force * span
    norm1 = energy_norm(osc, v, a) + force1 * span
    norm2 = energy_norm(osc, a, j) + force1 * omega * span
    bound2 = min(norm1, force + coupling * norm0)
    bound3 = min(norm2, force1 + coupling * norm1)
    if osc[4] == OVERDAMPED:
        # Each derivative relaxes at the rate 2 beta towards what drives it, from x on upwards.
        rate = 2.0 * beta
        bound1 = max(abs(v), (force + math.sqrt(kappa) * norm0) / rate)
        bound2 = min(bound2, max(abs(a), (force1 + kappa * bound1) / rate))
        bound3 = min(bound3, max(abs(j), (force1 * omega + kappa * bound2) / rate))
    return bound2, bound3


@compiled
def _taylor(osc, a0, j0, sin0, cos0, tau):
    """x - x0 - v0 tau and v - v0 by their Taylor series, relative accuracy as tau -> 0."""
    beta = osc[0]
    kappa = osc[1]
    omega = osc[3]
    force_even = -osc[2] * omega * omega * sin0
    force_odd = -osc[2] * omega * omega * omega * cos0
    decrease = -omega * omega
    twice = 2.0 * beta
    reach = osc[10] * tau
    lower = a0
    upper = j0
    power = 0.5 * tau  # tau**(n-1) / n! of the n-th derivative
    dv = a0 * tau
    dx = a0 * power
    remainder = 0.5 * reach
    n = 3.0
    # Relative to the second term, since the first one may be zero.
    while remainder > TAYLOR_REMAINDER * reach:
        dv += upper * power * tau
        power *= tau / n
        dx += upper * power
        following = (force_even - kappa * lower) - twice * upper
        lower = upper
        upper = following
        force_next = force_even * decrease
        force_even = force_odd
        force_odd = force_next
        remainder *= reach / n
        n += 1.0
    return dx * tau, dv


@compiled
def _free_taylor(beta, kappa, tau):
    """C - 1 and S - tau of the free oscillator by their Taylor series."""
    c_less_1 = 0.0
    s_less_tau = 0.0
    # n-th derivatives at zero of C and S, from the equation of motion.
    c_lower, c_upper = 0.0, -kappa
    s_lower, s_upper = 1.0, -2.0 * beta
    power = 0.5 * tau * tau
    remainder = 1.0
    n = 2.0
    while remainder > TAYLOR_REMAINDER:
        c_less_1 += c_upper * power
        s_less_tau += s_upper * power
        c_lower, c_upper = c_upper, -2.0 * beta * c_upper - kappa * c_lower
        s_lower, s_upper = s_upper, -2.0 * beta * s_upper - kappa * s_lower
        n += 1.0
        power *= tau / n
        remainder *= TAYLOR_RANGE / n
    return c_less_1, s_less_tau


@compiled
def _resonant(beta, split, omega, c_less_1, s, tau):
    """Q and Q' as divided differences of the exponential: nothing grows as damping -> 0.

    With lambda = -beta + i split, E = (exp(i omega tau) - exp(lambda tau)) / (i omega - lambda);
    Q = (E - S) / (i omega - conj(lambda)) and Q' = E + conj(lambda) Q.
    """
    shift = omega - split
    growth = math.expm1(beta * tau) if beta > 0.0 else 0.0
    half, half_cosine, _ = sine_cosine(0.5 * shift * tau)
    turn = 2.0 * half * half_cosine
    # exp((beta + i shift) tau) - 1
    re = growth * (1.0 - 2.0 * half * half) - 2.0 * half * half
    im = (1.0 + growth) * turn
    square = beta * beta + shift * shift
    if square > 0.0:
        ratio_re = (re * beta + im * shift) / square
        ratio_im = (im * beta - re * shift) / square
    else:
        ratio_re = tau
        ratio_im = 0.0
    # exp(lambda tau) = c + i sine
    c = 1.0 + c_less_1 - beta * s
    sine = s * split
    e_re = c * ratio_re - sine * ratio_im
    e_im = c * ratio_im + sine * ratio_re
    total = omega + split
    square = beta * beta + total * total
    re = e_re - s
    q_re = (re * beta + e_im * total) / square
    q_im = (e_im * beta - re * total) / square
    return q_re, q_im, e_re - beta * q_re + split * q_im, e_im - beta * q_im - split * q_re

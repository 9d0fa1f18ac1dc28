"""Impact law, certified search, burst tail and release, each on its own."""

import math
import random

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from mpmath import mp, mpf
from reference.accumulation import accumulation_time

from damper.comparison import reference_rigid as mp_reference
from damper.engine.oscillator import acceleration, higher_derivatives, increments, oscillator
from damper.engine.search import (
    HORIZON,
    _certified_step,
    _lift_off_step,
    _pushing_step,
    falls_through,
    find_impact,
    find_release,
    first_root,
    impact,
    near_root,
    stays,
    stays_between,
    tail_bounce,
    tail_duration,
)

EPS = np.finfo(float).eps

# --- impact law


@given(
    mu=st.floats(-9, 9).map(lambda k: 10.0**k),
    r=st.floats(0, 1),
    side=st.sampled_from([-1.0, 1.0]),
    v=st.floats(-10, 10),
    approach=st.floats(0, 10),
)
def test_impact_keeps_momentum_and_reverses_relative_velocity(
    mu: float, r: float, side: float, v: float, approach: float
) -> None:
    """The closed form of model section 1, whose terms need not cancel in exact arithmetic."""
    after, rate = impact(mu, r, side, v, approach)
    with mp.workdps(40):
        m, e, x, y = mpf(mu), mpf(r), mpf(v), v + side * mpf(approach)
        x_after = ((1 - m * e) * x + m * (1 + e) * y) / (1 + m)
        y_after = ((1 + e) * x + (m - e) * y) / (1 + m)
        scale = abs(v) + approach + 1e-290  # subnormal numbers have fewer digits
        assert abs(after - x_after) <= 4 * EPS * scale
        assert rate == r * approach
        assert abs(-side * (y_after - x_after) - rate) <= 2 * EPS * scale
        momentum = x + m * y
        assert abs(after + m * (after - side * mpf(rate)) - momentum) <= 4 * EPS * scale * (1 + m)


@pytest.mark.parametrize("side", [-1.0, 1.0])
def test_stays_while_the_wall_pushes(side: float) -> None:
    for j in (-3.0, 0.0, 3.0):
        assert stays(side, -side * 1e-300, j, side, side)
        assert not stays(side, side * 1e-300, j, -side, -side)
    assert stays(side, 0.0, -side, side, side)
    assert not stays(side, 0.0, side, -side, -side)
    assert stays(side, 0.0, 0.0, -side, side)
    assert not stays(side, 0.0, 0.0, side, -side)
    assert stays(side, 0.0, 0.0, 0.0, -side)
    assert not stays(side, 0.0, 0.0, 0.0, side)
    assert stays(side, 0.0, 0.0, 0.0, 0.0)


# --- roots and certified steps


@settings(max_examples=500)
@given(
    value=st.floats(0, 10),
    slope=st.floats(-10, 10),
    curvature=st.floats(-10, 10),
    tiny=st.floats(-16, 0),
)
def test_first_root_is_the_smallest_and_does_not_cancel(
    value: float, slope: float, curvature: float, tiny: float
) -> None:
    value *= 10.0**tiny
    found = first_root(value, slope, curvature)
    with mp.workdps(60):
        h, s, c = mpf(value), mpf(slope), mpf(curvature) / 2
        d = s**2 - 4 * c * h
        # Double precision cannot tell the sign of a discriminant smaller than its rounding.
        if abs(d) <= 8 * EPS * s**2 or abs(d) < 1e-290:
            return
        roots = []
        if c != 0 and d > 0:
            q = -(s + (1 if s > 0 else -1) * mp.sqrt(d)) / 2
            roots = [root for root in (q / c, h / q if q else mpf(0)) if root >= 0]
        elif c == 0 and s != 0:
            roots = [-h / s] if -h / s >= 0 else []
        if value == 0.0 and slope > 0.0:
            roots = [root for root in roots if root > 0]
        exact = min(roots, default=mp.inf)
        if not 1e-290 < exact < 1e290:
            return
        condition = 4 + abs(s) * abs(s) / abs(d)
        assert abs(found - exact) <= 4 * EPS * condition * exact


@settings(max_examples=500)
@given(
    value=st.floats(0, 5),
    slope=st.floats(-5, 5),
    curvature=st.floats(-5, 5),
    fourth=st.floats(-5, 5),
    third=st.floats(-5, 5),
    span=st.floats(1e-3, 3),
    tiny=st.floats(-14, 0),
)
def test_certified_step_passes_no_root(
    value: float,
    slope: float,
    curvature: float,
    third: float,
    fourth: float,
    span: float,
    tiny: float,
) -> None:
    """On quartics, with their largest second and third derivative as bounds."""
    value *= 10.0**tiny
    slope *= 10.0 ** (0.5 * tiny)
    p = np.polynomial.Polynomial([value, slope, curvature / 2, third / 6, fourth / 24])
    second, jerk = p.deriv(2), p.deriv(3)
    ends = [0.0, span]
    if abs(fourth) > 1e-9:
        ends.append(min(max(-third / fourth, 0.0), span))
    bound2 = max(abs(second(t)) for t in ends) + 1e-12
    bound3 = max(abs(jerk(0.0)), abs(jerk(span))) + 1e-12
    step = _certified_step(value, slope, curvature, bound2, bound3, span)
    assert 0.0 <= step <= span
    inside = np.linspace(0.0, step, 400)[1:-1]
    assert np.all(p(inside) >= -1e-15 * (1 + value))


def test_certified_step_takes_the_form_that_does_not_cancel() -> None:
    """S = sqrt(g'^2 + 2 B g): (S + g')/B when opening, 2 g/(S - g') when closing."""
    gap, rate, bound = 1e-14, -1.0, 1e-3
    step = _certified_step(gap, rate, -bound, bound, 0.0, 10.0)
    with mp.workdps(50):
        root = mp.sqrt(mpf(rate) ** 2 + 2 * mpf(bound) * mpf(gap))
        assert abs(step / (2 * mpf(gap) / (root - rate)) - 1) < 4 * EPS
        opening = _certified_step(gap, -rate, -bound, bound, 0.0, math.inf)
        assert abs(opening / ((root - rate) / bound) - 1) < 4 * EPS


def test_near_root_leaves_only_the_fifth_order() -> None:
    """The error falls as h^5; where the bend matters as much as the fall there is no answer."""
    for curvature, third, fourth in ((0.7, 0.9, 1.2), (-0.5, 1.3, -0.6), (1.1, -0.8, 0.4)):
        errors = []
        for h in (1e-2, 1e-3):
            with mp.workdps(40):
                c, j, s = mpf(curvature) / 2, mpf(third) / 6, mpf(fourth) / 24

                def quartic(t, h=h, c=c, j=j, s=s):
                    return h - t + c * t**2 + j * t**3 + s * t**4

                error = near_root(h, -1.0, curvature, third, fourth) - mp.findroot(quartic, h)
                errors.append(float(abs(error)))
        assert errors[0] < 2e-10
        assert errors[1] < 2e-15
    assert near_root(1.0, -1.0, 2.0, 0.0, 0.0) == math.inf
    assert near_root(1.0, 0.0, -2.0, 0.0, 0.0) == math.inf
    assert near_root(1.0, 1.0, -2.0, 0.0, 0.0) == math.inf


coefficients = st.floats(-5, 5)


def quintics(
    value: float, slope: float, second: float, third: float, fourth: float, fifth: float
) -> np.polynomial.Polynomial:
    """Polynomial with these derivatives at zero."""
    return np.polynomial.Polynomial([value, slope, second / 2, third / 6, fourth / 24, fifth / 120])


@settings(max_examples=2000)
@given(
    value=st.floats(0, 2),
    slope=coefficients,
    second=coefficients,
    third=coefficients,
    fourth=coefficients,
    fifth=coefficients,
    step=st.floats(-2, 0.5).map(lambda k: 10.0**k),
    tiny=st.floats(-14, 0),
)
def test_what_stays_between_the_walls_stays(
    value: float,
    slope: float,
    second: float,
    third: float,
    fourth: float,
    fifth: float,
    step: float,
    tiny: float,
) -> None:
    """Polynomials of degree 5 with the largest fourth derivative that they have on the step."""
    value *= 10.0**tiny
    slope *= 10.0 ** (0.5 * tiny)
    p = quintics(value, slope, second, third, fourth, fifth)
    rate = p.deriv()
    bound4 = max(abs(fourth), abs(fourth + fifth * step))
    ends = value, slope, p(step), rate(step), 3.0, step
    if stays_between(*ends, bound4, 0.0):
        inside = p(np.linspace(0.0, step, 500)[1:-1])
        assert inside.min() >= -1e-15 * (1 + value)
        assert inside.max() <= 3.0 + 1e-14


def test_the_certificate_is_sharp() -> None:
    """A quartic that dips through zero between its ends is refused with the very bound that holds.

    The Hermite interpolant of depth + (t (1 - t))^2 fourth / 24 is the constant `depth`, and the
    quartic takes all of the error: fourth / 384 in the middle.
    """
    fourth = -24.0
    p = np.polynomial.Polynomial([0.0, 1.0, -1.0]) ** 2 * (fourth / 24)
    for depth in (-p(0.5) * 0.999, -p(0.5) * 0.5):
        assert (p + depth)(0.5) < 0.0
        assert not stays_between(depth, 0.0, depth, 0.0, 10.0, 1.0, abs(fourth), 0.0)
        assert not stays_between(10 - depth, 0.0, 10 - depth, 0.0, 10.0, 1.0, abs(fourth), 0.0)
    assert stays_between(0.2, 0.0, 0.2, 0.0, 10.0, 1.0, abs(fourth), 0.0)
    # Not idle: a bounce of constant push is seen through to its end, one above the other wall not.
    assert stays_between(0.0, 1.0, 1e-9, -1.0, 1.0, 2.0, 1e-3, 0.0)
    assert not stays_between(0.0, 1.0, 1e-9, -1.0, 0.5, 2.0, 1e-3, 0.0)


@settings(max_examples=500)
@given(
    value=st.floats(0, 1),
    slope=st.floats(-5, 0),
    second=coefficients,
    third=coefficients,
    fourth=coefficients,
    fifth=coefficients,
    span=st.floats(-3, 0.5).map(lambda k: 10.0**k),
)
def test_a_function_that_falls_through_has_one_root(
    value: float,
    slope: float,
    second: float,
    third: float,
    fourth: float,
    fifth: float,
    span: float,
) -> None:
    p = quintics(value, slope, second, third, fourth, fifth)
    time = np.linspace(0.0, span, 300)
    bound3 = np.abs(p.deriv(3)(time)).max() * 1.01
    if falls_through(value, slope, second, bound3, span):
        assert p.deriv()(time).max() <= 1e-14
        assert p(span) <= 1e-14


def test_falling_through_is_sharp() -> None:
    """On .1 - t + t^3/6, which is below zero at 2 but rises there, and on a higher one."""
    assert not falls_through(0.1, -1.0, 0.0, 1.0, 2.0)
    assert falls_through(0.1, -1.0, 0.0, 1.0, 1.4)
    assert not falls_through(1.0, -1.0, 0.0, 1.0, 1.4)
    assert not falls_through(0.1, 0.0, -1.0, 0.0, 1.4)


@pytest.mark.parametrize("order", [0, 1])
def test_lift_off_step_is_sharp(order: int) -> None:
    """Where the bound on the next derivative is nearly reached, x'' ends close to zero again."""
    small, omega = 1e-3, 1.7
    osc = oscillator(0.0, 1.0, 1.0, omega)
    # The third derivative is small and the fourth -omega^2, or the fourth and the fifth -omega^3.
    phase = math.pi / 2 if order == 0 else -math.asin(small / omega**2)
    sin, cos = math.sin(phase), math.cos(phase)
    v = omega * cos - (small if order == 0 else 0.0)
    j = acceleration(osc, sin, v, sin, cos)[1] if order == 0 else 0.0
    snap, crackle = higher_derivatives(osc, 0.0, j, sin, cos)
    back = 2 * small / omega**2 if order == 0 else 3 * small / omega**3
    step = _lift_off_step(osc, 1.0, j, snap, crackle, sin, 1.5 * back)
    assert 0.9 * back < step < back

    def second(tau: float) -> float:
        dx, dv, sin1, cos1 = increments(osc, sin, v, 0.0, j, sin, cos, tau)
        return acceleration(osc, sin + v * tau + dx, v + dv, sin1, cos1)[0]

    assert second(0.9 * step) > 0.0
    assert second(1.1 * back) < 0.0


@pytest.mark.parametrize("seed", range(60))
def test_lift_off_step_keeps_gap_rate_and_curvature_positive(seed: int) -> None:
    """For each first derivative that may decide, by 40 digits of the motion itself."""
    rng = random.Random(seed)
    zeta, omega = rng.choice([0.0, 0.05, 2.0]), rng.choice([0.2, 1.0, 5.0])
    order = seed % 3
    phase = rng.uniform(-3, 3) if order < 2 else rng.choice([0.0, math.pi])
    sin, cos = math.sin(phase), math.cos(phase) if order < 2 else round(math.cos(phase))
    # The second derivative is zero, then the third as well (v = omega cos), then the fourth (sin).
    v = rng.uniform(-2, 2) if order == 0 else omega * cos
    x = sin - 2 * zeta * v
    if order == 2:
        sin, x = 0.0, -2 * zeta * v
    osc = oscillator(zeta, 1.0, 1.0, omega)
    j = 0.0 if order else acceleration(osc, x, v, sin, cos)[1]
    snap, crackle = higher_derivatives(osc, 0.0, j, sin, cos)
    snap = 0.0 if order == 2 else snap
    side = math.copysign(1.0, (j, snap, crackle)[order])
    step = _lift_off_step(osc, side, j, snap, crackle, sin, 1.5 / max(1.0, omega))
    assert step > 0.0
    with mp.workdps(40):
        # x'' obeys the same equation, forced by the second derivative of the force.
        c = [mpf(0), mpf(j)]
        force = [-(mpf(omega) ** 2) * value for value in (sin, omega * cos, 0, 0)]
        force[2:] = [-(mpf(omega) ** 2) * value for value in (force[0], force[1])]
        power = mpf(1)
        for n in range(60):
            f = force[n % 2] * (-(mpf(omega) ** 2)) ** (n // 2) * power
            c.append((f - 2 * mpf(zeta) * (n + 1) * c[n + 1] - c[n]) / ((n + 1) * (n + 2)))
            power /= n + 1
        rate = [mpf(0)] + [value / (n + 1) for n, value in enumerate(c)]
        for part in np.linspace(0.0, 1.0, 80)[1:]:
            tau = mpf(step) * part
            assert side * mp_reference.horner(c, tau)[0] > -1e-16
            assert side * mp_reference.horner(rate, tau)[0] > -1e-16


# --- search for impacts


def fly_both(
    scene: tuple[float, float, float], x: float, v: float, phase: float, gap: float, rate: float
) -> tuple[tuple, mp_reference.Hit | None]:
    """Return the engine's and the reference's end of one flight that starts inside the box."""
    zeta, omega, d = scene
    osc = oscillator(zeta, 1.0, 1.0, omega)
    sin, cos = math.sin(phase), math.cos(phase)
    a, j = acceleration(osc, x, v, sin, cos)
    found = find_impact(osc, d, 1.0, x, v, gap, rate, a, j, sin, cos)
    with mp.workdps(40):
        p = mp_reference.Parameters(*(mpf(value) for value in (0, zeta, omega, d, 1, phase)))
        state = (mpf(0), mpf(x), mpf(v))
        exact = mp_reference.fly(p, state, 1, (mpf(gap), mpf(rate)), mpf(HORIZON), int(gap == 0.0))
    return found, exact


@pytest.mark.parametrize("seed", range(120))
def test_find_impact_against_the_reference(seed: int) -> None:
    """Random flights: same wall, same time; errors as the approach speed conditions them."""
    rng = random.Random(seed)
    zeta = rng.choice([0.0, 10 ** rng.uniform(-3, 1.5)])
    omega = rng.choice([1.0, 10 ** rng.uniform(-2, 1)])
    size = 1 / max(math.hypot(1 - omega**2, 2 * zeta * omega), 0.2)
    d = size * 10 ** rng.uniform(-4, 0.5)
    x, v = rng.uniform(-1, 1) * size, rng.uniform(-1, 1) * size * omega
    gap = rng.choice([0.0, 1.0, 1e-6, rng.random()]) * d * 1.9
    rate = rng.uniform(-1, 1) * size * 10 ** rng.uniform(-4, 0)
    if gap == 0.0:
        rate = abs(rate)
    (tau, hit, dx, speed, slope, _), exact = fly_both(
        (zeta, omega, d), x, v, rng.uniform(-4, 4), gap, rate
    )
    if exact is None:
        assert hit == 0.0
        assert tau >= HORIZON
        return
    assert hit == exact.side
    # The gap is known to rounding of what it is made of; the approach speed turns that into time.
    noise = 8 * EPS * (gap + abs(rate) * tau + abs(x) + size * (1 + omega * tau))
    assert abs(tau - exact.time) <= noise / exact.approach_speed + 4 * EPS * tau
    push = 2 * size * (1 + omega**2 + 2 * zeta) + abs(v)
    late = push * float(abs(tau - exact.time)) + noise * (1 + zeta + omega)
    assert abs(abs(slope) - exact.approach_speed) <= late
    assert abs(speed - exact.v) <= late
    assert abs(x + dx - exact.x) <= late + abs(exact.v) * abs(tau - exact.time)


def test_velocity_at_an_impact_is_good_to_rounding() -> None:
    """Of itself and of the force's push until then, however fast the free mass flies.

    The search ends one Taylor step short of the wall; its length is set by the gap's rounding, of
    which a fast free mass leaves much.
    """
    rng = random.Random(3)
    worst = 0.0
    for _ in range(300):
        zeta, omega = rng.choice([0.0, 0.02, 0.3]), 10 ** rng.uniform(-1.5, 1)
        d = 10 ** rng.uniform(-3, 1.5)
        x, v = (rng.gauss(0, 1) * 10 ** rng.uniform(-3, 1) for _ in range(2))
        rate = 10 ** rng.uniform(-1, 4)
        (tau, _, _, speed, _, _), exact = fly_both(
            (zeta, omega, d), x, v, rng.uniform(-4, 4), 0.0, rate
        )
        if exact is None:
            continue
        size = abs(v) + min(tau, 1.0) * (1.0 + abs(x) + abs(v))
        late = abs(tau - exact.time) * (1.0 + abs(x) + abs(v))
        worst = max(worst, float((abs(speed - exact.v) - late) / (EPS * size)))
    assert worst <= 30.0


LONG_ENOUGH = 160  # Taylor terms that carry 50 digits over a time of 8 at rates up to 6


def grazing_rate(
    zeta: float, omega: float, x: float, v: float, phase: float, gap: float
) -> tuple[mpf, float] | None:
    """Return the gap rate whose flight just touches its own wall, and when; None at the ends.

    With D = x(tau) - x - v tau the gap is gap + rate tau + D, so the touching rate is the largest
    -(gap + D) / tau.
    """
    p = mp_reference.Parameters(*map(mpf, (0, zeta, omega, 1, 1, phase)))
    c = mp_reference.taylor(p, mpf(1), mpf(0), mpf(x), mpf(v), LONG_ENOUGH)
    c[:2] = [mpf(gap), mpf(0)]

    def turning(tau: mpf) -> mpf:
        value, slope = mp_reference.horner(c, tau)
        return tau * slope - value

    grid = np.linspace(0.05, 8.0, 400)
    rates = [float(-mp_reference.horner(c, mpf(tau))[0] / tau) for tau in grid]
    k = int(np.argmax(rates))
    if k in (0, len(grid) - 1):
        return None
    tau = mp.findroot(turning, (grid[k - 1], grid[k + 1]), solver="anderson")
    return -mp_reference.horner(c, tau)[0] / tau, float(tau)


@pytest.mark.parametrize("seed", range(24))
def test_grazing_is_decided_like_the_reference(seed: int) -> None:
    """The smallest gap of a flight moves through zero: hit below, miss above, down to 1e-13."""
    rng = random.Random(seed)
    with mp.workdps(50):
        found = None
        while found is None:
            zeta, omega = rng.choice([0.0, 0.05, 1.0, 2.0]), rng.choice([0.3, 1.0, 2.5])
            x, v, phase = rng.uniform(-1, 1), rng.uniform(-1, 1), rng.uniform(-3, 3)
            gap = 10 ** rng.uniform(-2, 0)
            found = grazing_rate(zeta, omega, x, v, phase, gap)
        rate, touch = found
        for off in (1e-2, 1e-5, 1e-8, 1e-11, 1e-13):
            # The other wall is far away.
            scene = (zeta, omega, 100.0)
            (tau, hit, *_), exact = fly_both(scene, x, v, phase, gap, float(rate + off))
            assert exact is None or exact.time > touch + 0.01
            assert hit == 0.0 or tau > touch + 0.01
            (tau, hit, *_), exact = fly_both(scene, x, v, phase, gap, float(rate - off))
            assert exact is not None
            assert (hit, exact.side) == (1.0, 1)
            assert exact.time < touch
            noise = 4 * EPS * (gap + (abs(rate) + 1) * tau + 2)
            assert abs(tau - exact.time) <= noise / exact.approach_speed + 4 * EPS * tau


def test_two_crossings_in_a_short_time_are_not_skipped() -> None:
    """A dip of 1e-9 below the wall that lasts 1e-4: steps of ordinary size would pass it."""
    with mp.workdps(50):
        rate, touch = grazing_rate(0.05, 0.8, 0.3, -0.2, 0.4, 0.5)
    osc = oscillator(0.05, 1.0, 1.0, 0.8)
    sin, cos = math.sin(0.4), math.cos(0.4)
    a, j = acceleration(osc, 0.3, -0.2, sin, cos)
    start = float(rate) - 1e-9
    tau, hit, *_ = find_impact(osc, 100.0, 1.0, 0.3, -0.2, 0.5, start, a, j, sin, cos)
    gaps = [
        0.5 + start * time + increments(osc, 0.3, -0.2, a, j, sin, cos, time)[0]
        for time in (tau - 1e-3, tau + 2 * (touch - tau) + 1e-3)
    ]
    assert hit == 1.0
    assert 0.0 < touch - tau < 1e-3
    assert min(gaps) > 0.0


def test_the_wall_ahead_is_not_passed_after_a_lift_off() -> None:
    """A box so small that the first step after a lift-off would reach beyond its other wall."""
    osc = oscillator(0.02, 1.0, 1.0, 1.3)
    phase, v = 0.4, -1.2
    sin, cos = math.sin(phase), math.cos(phase)
    x = sin - 0.04 * v
    _, j = acceleration(osc, x, v, sin, cos)
    side = math.copysign(1.0, j)
    for d in (0.05, 1e-3, 1e-6, 1e-12):
        tau, hit, *_ = find_impact(osc, d, side, x, v, 0.0, 0.0, 0.0, j, sin, cos)
        assert hit == -side
        reached = side * increments(osc, x, v, 0.0, j, sin, cos, tau)[0]
        assert reached == pytest.approx(2 * d, rel=1e-13)
        inside = np.linspace(0.0, tau, 50)[1:-1]
        gaps = [side * increments(osc, x, v, 0.0, j, sin, cos, t)[0] for t in inside.tolist()]
        assert min(gaps) > 0.0
        assert max(gaps) < 2 * d


def test_no_contact_before_the_horizon() -> None:
    osc = oscillator(0.1, 1.0, 1.0, 0.5)
    a, j = acceleration(osc, 0.0, 0.0, 0.0, 1.0)
    tau, hit, *_ = find_impact(osc, 1e3, 1.0, 0.0, 0.0, 1e3, 0.0, a, j, 0.0, 1.0)
    assert hit == 0.0
    assert HORIZON <= tau < HORIZON + 2


# --- burst tail


ON_WALL = (0.5, 0.2, 0.3, 0.6)  # mass ratio, zeta, omega, r; at t = 2, x = 2, x' = .1


def tail_on_the_wall(w: float) -> tuple[float, float, float]:
    """Return second-order duration, its error estimate, and the first-order duration."""
    mu, zeta, omega, r = ON_WALL
    osc = oscillator(zeta, 1.0, 1.0, omega)
    a, j = acceleration(osc, 2.0, 0.1, math.sin(omega * 2), math.cos(omega * 2))
    duration, error = tail_duration(osc, mu, r, 1.0, a, j, math.sin(omega * 2), w)
    return duration, error, 2 * w / (-a * (1 - r))


@pytest.mark.parametrize("side", [1.0, -1.0])
def test_tail_is_the_same_on_both_walls(side: float) -> None:
    mu, zeta, omega, r = ON_WALL
    osc = oscillator(zeta, 1.0, 1.0, omega)
    sin, cos = side * math.sin(omega * 2), side * math.cos(omega * 2)
    a, j = acceleration(osc, 2.0 * side, 0.1 * side, sin, cos)
    found = tail_duration(osc, mu, r, side, a, j, sin, 0.01)
    assert found == tail_on_the_wall(0.01)[:2]


def test_orders_of_the_accumulation_formulas() -> None:
    """Halving w divides the errors by 4.06 and 8.07 (model section 4)."""
    mu, zeta, omega, r = ON_WALL
    first, second = [], []
    for w in (0.01, 0.005):
        exact = accumulation_time(
            mu, zeta, omega, r, time=2, position=2, velocity=0.1, rebound_speed=w
        )
        two, _, one = tail_on_the_wall(w)
        first.append(float(one - exact))
        second.append(float(two - exact))
    assert first[0] / first[1] == pytest.approx(4.06, abs=0.006)
    assert second[0] / second[1] == pytest.approx(8.07, abs=0.006)


@pytest.mark.parametrize("part", range(6))
def test_tail_error_estimate_bounds_the_true_error(part: int) -> None:
    """Over random walls, masses and damping: the accuracy setting rests on this."""
    rng = random.Random(1000 + part)
    ratios = []
    while len(ratios) < 20:
        mu = 10 ** rng.uniform(-4, 2)
        zeta = rng.choice([0.0, 0.02, 0.2, 1.0, 3.0, 20.0])
        omega = 10 ** rng.uniform(-1, 1)
        r = rng.choice([0.05, 0.3, 0.6, 0.8, 0.9, 0.95])
        time, x, v = rng.uniform(0, 2 * math.pi / omega), rng.uniform(-2, 2), rng.uniform(-2, 2)
        osc = oscillator(zeta, 1.0, 1.0, omega)
        sin = math.sin(omega * time)
        a, j = acceleration(osc, x, v, sin, math.cos(omega * time))
        if a >= 0.0:
            continue
        # The rebound speed at which the estimate is what an accuracy setting might ask for.
        target, low, high = 10 ** rng.uniform(-11, -5), 1e-12, 1e3
        for _ in range(60):
            w = math.sqrt(low * high)
            duration, error = tail_duration(osc, mu, r, 1.0, a, j, sin, w)
            low, high = (low, w) if error > target else (w, high)
        duration, error = tail_duration(osc, mu, r, 1.0, a, j, sin, low)
        assert 0.9 * target < error <= target
        exact = accumulation_time(
            mu,
            zeta,
            omega,
            r,
            time=time,
            position=x,
            velocity=v,
            rebound_speed=low,
            dps=25,
            burst_floor=1e-13,
        )
        ratios.append(float(abs(exact - duration)) / error)
    assert max(ratios) <= 1.0
    assert max(ratios) > 1e-4  # not a bound that no tail would ever pass


def test_tail_refuses_where_a_burst_need_not_complete() -> None:
    osc = oscillator(0.1, 1.0, 1.0, 0.5)
    assert tail_duration(osc, 0.1, 0.5, 1.0, 0.2, 0.1, 0.5, 1e-9) == (0.0, math.inf)  # opening
    assert tail_duration(osc, 0.1, 0.5, 1.0, 0.0, 0.1, 0.5, 1e-9) == (0.0, math.inf)
    assert tail_duration(osc, 0.1, 1.0, 1.0, -0.2, 0.1, 0.5, 1e-9) == (0.0, math.inf)  # r = 1
    assert tail_duration(osc, 0.1, 0.5, 1.0, -1e-3, 0.1, 0.5, 0.1) == (0.0, math.inf)  # too bent
    assert tail_duration(osc, 0.1, 0.0, 1.0, -0.2, 0.1, 0.5, 0.0) == (0.0, 0.0)


@pytest.mark.parametrize("r", [0.05, 0.5, 0.9])
def test_tail_bounces_are_those_of_a_constant_push(r: float) -> None:
    """Against bounces computed one after the other: g = w t - a t^2 / 2, w -> r w."""
    push, w = 0.7, 1e-6
    duration = 2 * w / (push * (1 - r))
    start, speed = 0.0, w
    while start < 0.999 * duration and speed > 1e-3 * w:
        flight = 2 * speed / push
        for part in (0.01, 0.3, 0.5, 0.9):
            t = part * flight
            gap, rate = tail_bounce(r, duration, w, start + t)
            assert gap == pytest.approx(speed * t - push * t * t / 2, rel=1e-9)
            assert rate == pytest.approx(speed - push * t, rel=1e-9, abs=1e-9 * speed)
        start += flight
        speed *= r
    assert tail_bounce(r, duration, w, 0.0) == (0.0, w)
    assert tail_bounce(r, duration, w, duration) == (0.0, 0.0)


def test_plastic_tail_has_no_bounces() -> None:
    assert tail_bounce(0.0, 1.0, 0.0, 0.5) == (0.0, 0.0)


# --- release


@pytest.mark.parametrize("seed", range(80))
def test_find_release_against_the_reference(seed: int) -> None:
    rng = random.Random(seed)
    mu = 10 ** rng.uniform(-3, 2)
    zeta = rng.choice([0.0, 0.05, 1.0, 20.0, 10 ** rng.uniform(-3, 1)])
    omega = rng.choice([1.0, 10 ** rng.uniform(-2, 1)])
    phase, x, v = rng.uniform(-4, 4), rng.uniform(-2, 2), rng.uniform(-2, 2)
    inertia = 1 + mu
    osc = oscillator(zeta / inertia, 1 / inertia, 1 / inertia, omega)
    a, _ = acceleration(osc, x, v, math.sin(phase), math.cos(phase))
    side = -math.copysign(1.0, a)
    tau, released, dx, speed, _ = find_release(osc, side, x, v, math.sin(phase), math.cos(phase))
    with mp.workdps(40):
        p = mp_reference.Parameters(*map(mpf, (mu, zeta, omega, 1, 0.5, phase)))
        exact = mp_reference.stick_until_release(p, mpf(0), mpf(x), mpf(v), int(side), mpf(HORIZON))
        if exact is None:
            assert released == 0.0
            assert tau >= HORIZON
            return
        time, x_end, v_end = exact
        assert released == 1.0
        angle = omega * time + phase
        jerk = abs((omega * mp.cos(angle) - v_end) / inertia)  # x'' = 0 there
        # Rounding of the pair's acceleration, whose terms cancel at the release.
        # The velocity is v plus an increment, so it keeps the rounding of the start's.
        terms = abs(x) + abs(v) + 1 + abs(x_end) + 2 * zeta * (abs(v) + abs(v_end))
        noise = 4 * EPS * (1 + omega * time) * terms / inertia
        assert abs(tau - time) <= noise / jerk + 4 * EPS * time
        late = float(abs(tau - time)) + 8 * EPS * (1 + omega * time)
        assert abs(x + dx - x_end) <= late * (terms + abs(v_end))
        assert abs(speed - v_end) <= late * terms


@settings(max_examples=500)
@given(
    zeta=st.floats(-2, 3).map(lambda k: 10.0**k),
    omega=st.floats(-1, 1).map(lambda k: 10.0**k),
    v=st.floats(-1, 1),
    phase=st.floats(-4, 4),
    push=st.floats(-9, 0).map(lambda k: 10.0**k),
    near=st.booleans(),
)
def test_the_wall_pushes_throughout_a_pushing_step(
    zeta: float, omega: float, v: float, phase: float, push: float, near: bool
) -> None:
    """On the right wall; `near` starts close to the motion that heavy damping relaxes to."""
    osc = oscillator(zeta, 1.0, 1.0, omega)
    sin, cos = math.sin(phase), math.cos(phase)
    if near:
        # The drive F omega cos - kappa v is then -2 zeta push.
        v = omega * cos + 2 * zeta * push
    x = sin - 2 * zeta * v + push
    a, j = acceleration(osc, x, v, sin, cos)
    if a >= 0.0:
        return
    snap, crackle = higher_derivatives(osc, a, j, sin, cos)
    step = _pushing_step(osc, 1.0, x, v, a, j, snap, crackle, cos, 1.5 / max(1.0, omega))
    assert step > 0.0
    noise = 64 * EPS * (1 + omega) * (1 + (1 + 2 * zeta) * (abs(x) + abs(v)))
    for tau in np.linspace(0.0, step, 60).tolist():
        dx, dv, sin1, cos1 = increments(osc, x, v, a, j, sin, cos, tau)
        assert acceleration(osc, x + v * tau + dx, v + dv, sin1, cos1)[0] <= noise


def test_no_release_between_two_walls() -> None:
    osc = oscillator(0.05, 0.9, 0.9, 0.8)
    tau, released, dx, v, _ = find_release(osc, 0.0, 0.3, 0.1, 0.0, 1.0)
    assert (tau, released) == (HORIZON, 0.0)
    a, j = acceleration(osc, 0.3, 0.1, 0.0, 1.0)
    add_x, add_v, _, _ = increments(osc, 0.3, 0.1, a, j, 0.0, 1.0, HORIZON)
    assert (dx, v) == (add_x + 0.1 * HORIZON, 0.1 + add_v)

"""The certified search: no root is skipped, and the one it finds is exact to roundoff.

What is searched here are sums of three sines and a straight line, whose derivatives and bounds are
known, and of which some almost touch what they must not pass.
"""

import math
import random
from typing import Any, NamedTuple

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from mpmath import mp, mpf

from damper import Parameters, State, events
from damper.engine import search as engine_search
from damper.engine.compiled import compiled
from damper.engine.search import (
    GAVE_UP,
    HORIZON,
    MAX_STEPS,
    ROUNDOFF,
    EventPoint,
    first_root,
    near_root,
    point_at,
    rates_of,
    stays_inside,
)

FAR = math.inf


class Sines(NamedTuple):
    """offset + slope t + sum of amplitude sin(rate t + phase); what is added to the bound."""

    offset: float
    slope: float
    amplitudes: np.ndarray
    rates: np.ndarray
    phases: np.ndarray
    bound: float


@compiled
def _derivative(moving, order, tau):
    total = 0.0
    for k in range(len(moving.rates)):
        rate = float(moving.rates[k])
        angle = rate * tau + float(moving.phases[k]) + 0.5 * math.pi * order
        total += float(moving.amplitudes[k]) * rate**order * math.sin(angle)
    if order == 0:
        total += moving.offset + moving.slope * tau
    elif order == 1:
        total += moving.slope
    return total


@point_at.of(Sines)
def _point_at(moving, tau):
    size = abs(moving.offset) + abs(moving.slope * tau)
    growth = 0.0
    for k in range(len(moving.rates)):
        size += abs(float(moving.amplitudes[k])) * (1.0 + moving.rates[k] * tau)
        growth += abs(float(moving.amplitudes[k])) * float(moving.rates[k]) ** 5
    fourth = _derivative(moving, 4, tau)
    return EventPoint(
        tau,
        _derivative(moving, 0, tau),
        _derivative(moving, 1, tau),
        _derivative(moving, 2, tau),
        _derivative(moving, 3, tau),
        fourth,
        _derivative(moving, 5, tau),
        abs(fourth) + moving.bound,
        growth,
        ROUNDOFF * size,
        0.0,
    )


@rates_of.of(Sines)
def _rates_of(moving):
    rate = float(moving.rates.max())
    return rate, rate, rate


@compiled
def search(offset, slope, amplitudes, rates, phases, bound, width, lifts_off, limit, samples):
    """Side, time and steps of the first root; value there and its roundoff; extremes before it."""
    moving = Sines(offset, slope, amplitudes, rates, phases, bound)
    start = point_at(moving, 0.0)
    if lifts_off:
        # Exactly: at such a start the caller knows it.
        start = EventPoint(
            0.0,
            0.0,
            0.0,
            0.0,
            start.third,
            start.fourth,
            start.fifth,
            start.bound4,
            start.growth,
            start.roundoff,
            0.0,
        )
    root = first_root(moving, start, width, lifts_off, limit, 0.0)
    tau = root.point.tau + root.step
    lowest = math.inf
    highest = -math.inf
    for k in range(1, samples):
        value = _derivative(moving, 0, tau * k / samples)
        lowest = min(lowest, value)
        highest = max(highest, value)
    return (
        root.side,
        tau,
        root.steps,
        _derivative(moving, 0, tau),
        point_at(moving, tau).roundoff,
        lowest,
        highest,
    )


def find(
    offset, slope=0.0, sines=(), width=FAR, lifts_off=False, bound=0.0, limit=HORIZON, samples=2000
):
    """Search a sum given as (amplitude, rate, phase) each."""
    numbers = np.array([*sines, *[(0.0, 1.0, 0.0)] * (3 - len(sines))], dtype=float)
    a, w, p = np.ascontiguousarray(numbers.T)
    numbers = map(float, (offset, slope, bound, width, limit))
    offset, slope, bound, width, limit = numbers
    return search(offset, slope, a, w, p, bound, width, lifts_off, limit, samples)


sine = st.tuples(
    st.floats(-1, 1, allow_subnormal=False),
    st.floats(-1, 1.5).map(lambda k: 10.0**k),
    st.floats(-3.2, 3.2),
)


@settings(max_examples=80)
@given(
    depth=st.floats(-9, 0).map(lambda k: 10.0**k),
    dips=st.booleans(),
    width=st.one_of(st.just(FAR), st.floats(0.5, 4)),
    slope=st.floats(-0.1, 0.1),
    sines=st.lists(sine, min_size=1, max_size=3),
)
def test_no_root_is_skipped(
    depth: float, dips: bool, width: float, slope: float, sines: list
) -> None:
    """Dense samples before the root lie inside; at the root the value is roundoff.

    The lowest place before the horizon is just above zero, or just below it.
    """
    grid = np.linspace(0.0, HORIZON, 3000)
    path = slope * grid + sum(a * np.sin(w * grid + p) for a, w, p in sines)
    offset = (-depth if dips else depth) - path.min()
    if not 0.0 < path[0] + offset < width:
        offset = min(depth, 0.5 * width) - path[0]
    side, tau, _, value, roundoff, lowest, highest = find(offset, slope, sines, width)
    assert side != GAVE_UP
    assert lowest >= -2.0 * roundoff
    assert highest <= width + 2.0 * roundoff
    if side == 0.0:
        assert tau == HORIZON
    else:
        assert abs(value - (0.0 if side > 0.0 else width)) <= 2.0 * roundoff


@pytest.mark.parametrize("upper", [False, True])
@pytest.mark.parametrize("depth", [1e-2, 1e-6, 1e-10, 1e-13])
@pytest.mark.parametrize("rate", [0.3, 1.0, 7.0])
def test_touch_and_miss(rate: float, depth: float, upper: bool) -> None:
    """h + 1 - cos(rate (t - t0)) touches zero at h = 0: a dip of 1e-13 below it lasts 1e-7."""
    touch = 2.0 / rate
    for h in (depth, -depth):
        # The same upside down: width - f rises through the width.
        sign = -1.0 if upper else 1.0
        offset = 3.0 - (1.0 + h) if upper else 1.0 + h
        sines = [(-sign, rate, math.pi / 2 - rate * touch)]
        width = 3.0 if upper else FAR
        side, tau, steps, *_ = find(offset, 0.0, sines, width, limit=touch + 1.0 / rate)
        assert steps < 120
        if h > 0.0:
            assert side == 0.0
            continue
        assert side == (-1.0 if upper else 1.0)
        exact = touch - math.acos(1.0 + h) / rate
        slope = rate * math.sqrt(-2.0 * h)
        assert abs(tau - exact) <= 20 * ROUNDOFF / slope + 1e-15


@pytest.mark.parametrize("c", [0.6, 5.0, 100.0, 1e4])
def test_leaving_at_third_order(c: float) -> None:
    """t - sin(t) - c (1 - cos(t))^2 = t^3/6 - c t^4/4 + ...: back through zero near 2 / (3 c)."""
    sines = [(-1.0, 1.0, 0.0), (2.0 * c, 1.0, math.pi / 2), (-0.5 * c, 2.0, math.pi / 2)]
    side, tau, steps, value, roundoff, lowest, _ = find(-1.5 * c, 1.0, sines, lifts_off=True)
    assert side == 1.0
    assert steps < 30
    assert abs(value) <= 4.0 * roundoff
    assert lowest > -4.0 * roundoff
    with mp.workdps(30):
        exact = mp.findroot(
            lambda t: (t - mp.sin(t)) / t**3 - c * (1 - mp.cos(t)) ** 2 / t**3,
            mpf(2) / (3 * mpf(c)) * (1 if c > 1 else mpf("1.3")),
        )
        assert abs(tau / exact - 1) < 1e-3 + 1e-8 * c**3


def test_a_search_that_only_crawls_says_so() -> None:
    """A bound 1e30 times too large: steps of 1e-7 are all that it proves."""
    side, tau, steps, *_ = find(1.0, bound=1e30, samples=1)
    assert (side, steps) == (GAVE_UP, MAX_STEPS)
    assert 0.0 < tau < 1.0


def test_a_root_nearer_than_time_resolves() -> None:
    """At the start itself: without a width it is both walls at once."""
    assert find(0.0, -1.0)[:2] == (1.0, 0.0)
    assert find(1.0, 1.0, width=1.0)[:2] == (-1.0, 0.0)
    assert find(0.0, -1.0, width=0.0)[:2] == (1.0, 0.0)
    assert find(0.0, 1.0, width=0.0)[:2] == (-1.0, 0.0)


# --- what it rests on


def point(
    p: np.polynomial.Polynomial, tau: float, bound4: float, growth: float = 0.0
) -> EventPoint:
    d = [float(p.deriv(k)(tau)) if k else float(p(tau)) for k in range(6)]
    return EventPoint(tau, *d, bound4, growth, 0.0, 0.0)


def test_the_certificate_is_sharp() -> None:
    """A quartic that dips through zero between its ends is refused with the very bound that holds.

    The Hermite interpolant of depth + (t (1 - t))^2 fourth / 24 is the constant `depth`, and the
    quartic takes all of the error: fourth / 384 in the middle.
    """
    fourth = -24.0
    p = np.polynomial.Polynomial([0.0, 1.0, -1.0]) ** 2 * (fourth / 24)

    def stays(q: np.polynomial.Polynomial, bound: float, width: float, end: float) -> bool:
        return stays_inside(point(q, 0.0, bound), point(q, end, bound), width)

    for depth in (-p(0.5) * 0.999, -p(0.5) * 0.5):
        assert (p + depth)(0.5) < 0.0
        assert not stays(p + depth, abs(fourth), 10.0, 1.0)
        assert not stays(10.0 - depth - p, abs(fourth), 10.0, 1.0)
    assert stays(p + 0.2, abs(fourth), 10.0, 1.0)
    # Not idle: a bounce of constant force is seen through to its end, one above the width not.
    bounce = np.polynomial.Polynomial([1e-9, 1.0, -0.5])
    assert stays(bounce, 1e-3, 1.0, 2.0)
    assert not stays(bounce, 1e-3, 0.5, 2.0)


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
    # A speed whose third power is below the smallest number.
    assert near_root(4e-208, -3e-103, -30.0, 1.0, 1.0) == math.inf


# --- what only steers


def bold(
    moving: Any, p: EventPoint, rate: float, width: float, longest: float
) -> tuple[float, float, bool]:
    """As far as it may go, to either wall."""
    return longest, 1.0 if p.value <= width - p.value else -1.0, True


def test_steering_decides_nothing(monkeypatch: pytest.MonkeyPatch) -> None:
    """However boldly steps are aimed, the certificate finds the same first contact."""
    careful, draw, hits = engine_search._aim, random.Random(4), 0
    for k in range(60):
        swing, d = 10 ** draw.uniform(0.3, 1.5), 10 ** draw.uniform(-0.5, 0.5)
        support = 0.1 * swing * swing if k % 2 else 0.0
        p = Parameters(0.1, 0.02, 0.7, d, 0.5, support_stiffness_ratio=support)
        y, u = draw.uniform(-0.7, 0.7) * d, draw.uniform(-0.7, 0.7) * d * swing
        found = []
        for steer in (careful, bold):
            monkeypatch.setattr(engine_search, "_aim", steer)
            table = events(p, State(0.2 * d, 0.1, y, u), until=p.cycle, max_events=1)
            found.append(table["time"][table["kind"] == 0].tolist())
        assert len(found[0]) == len(found[1])
        if found[0]:
            hits += 1
            assert abs(found[0][0] - found[1][0]) < 1e-11
    assert hits > 25

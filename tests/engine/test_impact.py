"""The impact: momentum is kept, and the coefficient of restitution is that of the contact law."""

import math
from typing import NamedTuple

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from mpmath import mp, mpf

from damper import Parameters
from damper.engine.impact import (
    ConstantRestitution,
    YieldingRestitution,
    impact,
    rebound_slope,
    restitution_at,
)
from damper.engine.segment import CAUSE, GAP_RATE, IMPACT, MODE, SIDE, SPEED, TAIL, V_BEFORE, V
from damper.engine.trajectory import Trajectory
from damper.models import model_of

EPS = np.finfo(float).eps


@settings(max_examples=300)
@given(
    mu=st.floats(-6, 18).map(lambda k: 10.0**k),
    r=st.floats(0, 1),
    side=st.sampled_from([-1.0, 1.0]),
    v=st.floats(-10, 10),
    approach=st.floats(0, 10),
)
def test_momentum_and_relative_velocity(
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


def test_laws() -> None:
    """Constant; and falling with a power of the speed above the one where it yields."""
    assert restitution_at(ConstantRestitution(0.6), 3.0) == 0.6
    law = YieldingRestitution(0.6, 0.5, 0.25)
    for speed in (0.0, 0.1, 0.5):
        assert restitution_at(law, speed) == 0.6
    assert restitution_at(law, 8.0) == pytest.approx(0.3, rel=1e-15)
    assert restitution_at(law, math.nextafter(0.5, 1.0)) == pytest.approx(0.6, rel=1e-15)
    # With the power 1 the rebound is as fast for every harder hit.
    law = YieldingRestitution(0.6, 0.5, 1.0)
    assert [restitution_at(law, v) * v for v in (0.5, 2.0, 8.0)] == [0.3, 0.3, 0.3]
    assert rebound_slope(law, 2.0) == 0.0


class Softening(NamedTuple):
    """A contact law as a user of the library writes it."""

    least: float
    most: float
    speed: float


@restitution_at.of(Softening)
def _softening(law, approach_speed):
    return law.least + (law.most - law.least) / (1.0 + approach_speed / law.speed)


def test_the_engine_takes_the_coefficient_from_the_law_alone() -> None:
    """A law that damper does not know, in a run with complete chatter sequences."""
    # Plain; tests/test_extending.py compiles one.
    model = model_of(Parameters(0.1, 0.05, 0.2, 0.25, 0.999))
    run = Trajectory(model._replace(law=Softening(0.2, 0.7, 0.05)))
    log = np.concatenate([piece.copy() for piece in run.segments(10.0)])
    hits = log[log[:, CAUSE] == IMPACT]
    assert len(hits) > 100
    mu, seen = 0.1, set()
    for row in hits:
        speed, side = row[SPEED], row[SIDE]
        r = 0.2 + 0.5 / (1.0 + speed / 0.05)
        seen.add(round(r, 2))
        assert row[GAP_RATE] == pytest.approx(r * speed, rel=1e-15)
        # Both velocities before and after: momentum.
        u_before, u_after = row[V_BEFORE] + side * speed, row[V] - side * row[GAP_RATE]
        momentum = row[V_BEFORE] + mu * u_before
        assert row[V] + mu * u_after == pytest.approx(momentum, abs=1e-15)
    assert len(seen) > 15
    # A tail is closed where the law hardly changes any more.
    tails = log[log[:, MODE] == TAIL]
    assert len(tails) > 5
    assert tails[:, SPEED].max() < 1e-4

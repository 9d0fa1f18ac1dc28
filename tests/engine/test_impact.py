"""The impact: momentum is kept, and the coefficient of restitution is that of the contact law."""

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st
from mpmath import mp, mpf

from damper.engine.impact import (
    impact,
)

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

"""Lift-off and resting contact at their most degenerate: several derivatives vanish at once."""

import random

import numpy as np
import pytest

import damper
from damper import Parameters, State
from damper.engine.segment import CAUSE, RELEASE, TIME, V, X
from damper.engine.trajectory import Trajectory


@pytest.mark.parametrize("side", [1, -1])
def test_contact_with_zero_acceleration_and_jerk(side):
    """x'' = x''' = x'''' = 0 exactly; the fifth derivative decides: right sticks, left flies."""
    p = Parameters(0.1, 0.0, 0.5, 0.25, 0.6)
    found = damper.events(p, State(0.0, 0.5, 0.25 * side, 0.5), until=10.0, max_events=1000)
    assert len(found) < 20  # is 1001, all at t = 0
    early = found[found["time"] < 0.5]
    assert set(early["side"]) <= {side}  # it also jumps between walls that are .5 apart, at t = 0


SCENES = [
    (Parameters(0.12076685907929043, 0.5, 3.0, 0.5, 0.5, 0.29778700216203324), 1.1504456856),
    (Parameters(0.11700547121569109, 0.5, 3.0, 0.5, 0.5, -0.5545448101646397), 1.97753043912051),
]


@pytest.mark.parametrize("k", range(-40, 41))
def test_release_where_the_push_only_touches_zero(k):
    """The push has a double zero within a few ulps of x0: release or not, never a far wall."""
    p, x0 = SCENES[1]
    x = x0 + k * np.spacing(x0)
    found = damper.events(p, State(x, 0.0, x + p.clearance, 0.0), until=3.0, max_events=3000)
    assert 3 not in found["kind"]  # the search gives up
    release = found["time"][found["kind"] == 2]
    far = found["time"][(found["kind"] == 0) & (found["side"] == -1)]
    assert (
        not len(far) or far[0] > release[0] + 0.1
    )  # the far wall is 1.0 away: 1e-8 later is a jump


def test_heavy_damping_does_not_let_go_for_rounding():
    """Damping ratios of 1e3 to 1e6 multiply rounding of x'' into x''': time went back by 1e-5."""
    draw = random.Random(1)
    for _ in range(100):
        zeta = 10 ** draw.uniform(3, 6)
        p = Parameters(
            mass_ratio=10 ** draw.uniform(-3, 2),
            damping_ratio=zeta,
            frequency_ratio=10 ** draw.uniform(-3, 0),
            clearance=10 ** draw.uniform(-9, -2) / zeta,
            restitution=draw.choice([0, 0.3, 0.6, 0.9]),
            phase=draw.uniform(-3, 3),
        )
        found = damper.events(p, until=3 * p.period, max_events=3000)
        assert (np.diff(found["time"]) >= 0.0).all(), p


def test_heavy_damping_lets_go_at_the_velocity_that_the_force_leaves():
    """A release is x'' = 0. The velocity that sticking began with must not leave its rounding."""
    p = Parameters(0.1, 1e3, 8437.84, 2.86e-11, 0.0138, phase=3.13053)
    trajectory = Trajectory(p, State(-1.0, 0.821533, -1.0, 2.763603))
    log = next(trajectory.segments(20.0))
    rows = log[log[:, CAUSE] == RELEASE]
    assert len(rows) > 0
    for row in rows:
        force = np.sin(p.phase + p.frequency_ratio * row[TIME])
        left = (force - row[X]) / (2.0 * p.damping_ratio)
        assert abs(row[V] - left) < 2e-15 * abs(left)

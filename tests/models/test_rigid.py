"""The rigid damper: against closed forms and many digits, one rule a case."""

import math
import random
from typing import Any

import numpy as np
import pytest
from event_pairs import largest_error, log_of, pairs_of
from scipy.optimize import brentq

import damper
from damper import Parameters, State
from damper.engine.segment import (
    CAUSE,
    GAP,
    PERIODS,
    RELEASE,
    SIDE,
    TIME,
    V,
    X,
)
from damper.models import start_run
from damper.parameters.dampers import BASIC

EPS = np.finfo(float).eps
REST = (0.0, 0.0, 0.0, 0.0)


def events(scene: tuple, state: tuple = REST, **settings: Any) -> np.ndarray:
    """Run the engine on a scene (mu, zeta, omega, d, r[, phase])."""
    return damper.events(Parameters(*scene), State(*state), **settings)


def test_slow_chatter_to_what_a_double_position_allows() -> None:
    """At omega = 1e-3 all but the time scale is small: speeds 1e-3, accelerations 1e-6, jerk 1e-9.

    Roundoff of x alone moves the release by eps / jerk, an impact by eps / approach speed.
    """
    omega = 1e-3
    scene, state = (0.1, 0.5, omega, 0.05, 0.4, 1.5), (1.0, 7e-5, 1.0, 7e-5)
    pairs = pairs_of(dict(zip(BASIC, scene, strict=True)), state, 1700.0, digits=25)
    assert [row.kind for row, _ in pairs][-2:] == ["stick", "release"]
    assert largest_error(pairs[:-1]) < 1e-12 / omega
    assert largest_error(pairs[-1:]) < 4 * EPS / omega**3


# --- cases that have a rule each


def test_roundoff_outside_the_wall_is_on_the_wall() -> None:
    x = 1.0 / 3.0
    y = math.nextafter(math.nextafter(x + 0.1, 9.0), 9.0)
    p = Parameters(0.1, 0.05, 0.2, 0.1, 0.6)
    assert y - x > 0.1
    row = log_of(start_run(p, State(x, 0.0, y, 0.0)), 0.1)[0]
    assert (row[GAP], row[SIDE]) == (0.0, 1.0)
    with pytest.raises(ValueError, match="outside the box"):
        start_run(p, State(x, 0.0, y + 1e-12, 0.0))


@pytest.mark.parametrize(("zeta", "omega"), [(0.05, 1.7), (1.5, 0.9)])
def test_grazing(zeta: float, omega: float) -> None:
    """The free mass rests at 0; with the wall just beyond max|x| nothing ever happens."""
    until = 30.0
    rates = np.roots([1.0, 2.0 * zeta, 1.0]).astype(complex)
    gain = 1 / complex(1 - omega**2, 2 * zeta * omega)
    shares = np.linalg.solve([[1, 1], rates], [-gain.imag, -omega * gain.real])

    def motion(time: Any) -> tuple[Any, Any]:
        free = shares * np.exp(np.multiply.outer(time, rates))
        steady = gain * np.exp(1j * omega * np.asarray(time))
        return free.sum(-1).real + steady.imag, (free @ rates).real + omega * steady.real

    times = np.linspace(0.0, until, 3001)
    speeds = motion(times)[1]
    crests = [
        brentq(lambda t: motion(t)[1], *times[k : k + 2], xtol=1e-14)
        for k in np.flatnonzero(speeds[1:-1] * speeds[2:] < 0.0) + 1
    ]
    peak = float(np.abs(motion(np.array(crests))[0]).max())
    for off in (1e-3, 1e-6, 1e-9, 1e-11):
        assert len(events((0.1, zeta, omega, peak * (1.0 + off), 0.5), until=until)) == 0
        first = events((0.1, zeta, omega, peak * (1.0 - off), 0.5), until=until)[0]
        assert first["kind"] == 0
        # At depth h under the crest the speed is sqrt(2 |x''| h).
        assert 0.0 < first["approach_speed"] < 4.0 * (1.0 + omega) * math.sqrt(off) * peak


# --- lift-off


@pytest.mark.parametrize("side", [1, -1])
def test_contact_with_zero_acceleration_and_jerk(side: int) -> None:
    """x'' = x''' = x'''' = 0 exactly; the fifth derivative decides: right sticks, left flies."""
    found = events((0.1, 0.0, 0.5, 0.25, 0.6), (0.0, 0.5, 0.25 * side, 0.5), until=10.0)
    assert len(found) < 20
    early = found[found["time"] < 0.5]
    assert set(early["side"]) <= {side}
    assert (side == 1) == (early["kind"].tolist() == [1])


def test_heavy_damping_releases_for_good() -> None:
    """A release is x'' = 0, whatever velocity sticking began with; time does not go back."""
    draw = random.Random(1)
    releases = 0
    for _ in range(15):
        zeta = 10 ** draw.uniform(0, 1)
        p = Parameters(
            mass_ratio=10 ** draw.uniform(-3, 2),
            damping_ratio=zeta,
            frequency_ratio=10 ** draw.uniform(-3, 1),
            clearance=10 ** draw.uniform(-9, -2) / zeta,
            restitution=draw.choice([0, 0.3, 0.6, 0.9]),
            phase=draw.uniform(-3, 3),
        )
        v = draw.uniform(-1, 1)
        run = start_run(p, State(-1.0, v, -1.0, 2.0 * v), max_events=300)
        log = log_of(run, 3 * p.cycle)
        assert (np.diff(log[:, PERIODS] * p.cycle + log[:, TIME]) >= 0.0).all(), p
        for row in log[log[:, CAUSE] == RELEASE]:
            releases += 1
            force = math.sin(p.phase + p.frequency_ratio * row[TIME]) - row[X]
            size = 1.0 + abs(row[X]) + 2.0 * zeta * abs(row[V])
            assert abs(force - 2.0 * zeta * row[V]) < 8 * EPS * size * (1 + p.frequency_ratio)
    assert releases > 15

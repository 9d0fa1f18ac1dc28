"""Response against numerical integration of the motion, and its energy balance."""

import itertools
import math
import warnings
from collections.abc import Callable
from functools import cache, partial
from typing import Any

import numpy as np
import pytest
from cases import thinned
from scenes import SCENES
from scipy.integrate import IntegrationWarning, quad

from damper import Parameters, State
from damper.engine.segment import (
    CAUSE,
    COLUMNS,
    DURATION,
    GAP_RATE,
    IMPACT,
    MODE,
    PERIODS,
    SPEED,
    TAIL,
    TIME,
)
from damper.engine.trajectory import LOG_ROWS, Trajectory
from damper.models import start_run
from damper.observers import response
from damper.observers.common.base import Window
from damper.parameters.dampers import BASIC


def logged(
    trajectory: Trajectory, periods: float, time: float = 0.0, rows: int = LOG_ROWS
) -> np.ndarray:
    buffer = np.empty((rows, COLUMNS))
    return np.concatenate([log.copy() for log in trajectory.segments(periods, time, buffer)])


def over(trajectory: Trajectory, log: np.ndarray, window: Window) -> dict[str, float]:
    """Results for any window of a log."""
    observer = response.Response()
    observer.allocate(1, window.length)
    observer.begin(0, trajectory, window)
    observer.observe(log)
    observer.finish(True)
    return {name: float(array[0]) for name, array in observer.arrays.items()}


#: Damping and frequency ratio of a primary that nothing touches.
LINEAR = {
    "resonance": (0.0, 1.0),
    "near resonance": (1e-6, 1.0 + 1e-7),
    "critical": (1.0, 0.5),
    "heavily damped": (10.0, 0.6),
    "very fast": (0.1, 1e3),
    "slow force": (0.2, 0.03),
}
ALONE = {
    name: dict(zip(BASIC, (0.1, *two, 1e6, 0.5), strict=False)) for name, two in LINEAR.items()
}


@pytest.mark.parametrize(
    "name", [*ALONE, *thinned(SCENES, {"chattering", "plastic", "overdamped"}.__contains__)]
)
def test_integrals_and_peak_are_those_of_the_motion(name: str) -> None:
    """By scipy's quad over every segment of the log, bounces of tails one by one."""
    p = Parameters(**(ALONE | SCENES)[name])
    trajectory = start_run(p, State(0.3, 2.0, 0.3, 2.0) if name in ALONE else None)
    log = logged(trajectory, 5)
    found = over(trajectory, log, Window(0.0, 0.0, 5))
    rates = 40.0 / np.array([max(p.frequency_ratio, 1.0), 2 * p.damping_ratio + 1.0])
    sums, peak = np.zeros(3), 0.0
    for row in log:
        end = float(row[DURATION])
        motion = cache(partial(trajectory.motion_in, row))
        times = [*np.linspace(0.0, end, 100), *np.geomspace(1e-6, 1.0, 25) * end]
        peak = max(peak, *(abs(motion(t)[0]) for t in times))
        cuts = [0.0, *(c for c in sorted({*(rates / 40), *rates}) if c < end), end]
        if row[MODE] == TAIL and end > 0.0:
            r = p.restitution
            cuts = [end * (1.0 - r**k) for k in range(40) if r**k > 1e-9] + [end]
        angle = p.frequency_ratio * row[TIME] + p.phase
        for k in range(3):

            def value(t: float, motion: Any = motion, k: int = k, angle: float = angle) -> float:
                x, v, _, _ = motion(t)
                return (x * x, v * v, v * math.sin(angle + p.frequency_ratio * t))[k]

            with warnings.catch_warnings():
                warnings.simplefilter("ignore", IntegrationWarning)
                for low, high in itertools.pairwise(cuts):
                    sums[k] += quad(value, low, high, epsrel=1e-13, epsabs=0.0, limit=200)[0]
    assert found["rms_displacement"] ** 2 * 5 * p.cycle == pytest.approx(sums[0], rel=2e-12)
    assert found["dashpot_loss"] * 5 == pytest.approx(2 * p.damping_ratio * sums[1], rel=2e-12)
    assert peak * (1.0 - 1e-15) <= found["peak_displacement"] == pytest.approx(peak, rel=1e-3)
    scale = math.sqrt(sums[1] * 5 * p.cycle)
    assert found["energy_input"] * 5 == pytest.approx(sums[2], abs=1e-12 * scale)


# --- the balance


@pytest.mark.parametrize("edge", [0.0, 0.4, 1.0])
@pytest.mark.parametrize("name", ["plastic", "chattering"])
def test_a_window_may_begin_and_end_anywhere(name: str, edge: float) -> None:
    """At impacts, within tails, within sticking: two windows make one, and each one closes."""
    trajectory = start_run(Parameters(**SCENES[name]))
    log = logged(trajectory, 40)
    for mode in set(log[:, MODE]):
        rows = log[(log[:, MODE] == mode) & (log[:, PERIODS] >= 10) & (log[:, PERIODS] < 20)]
        for row in rows[:: max(1, len(rows) // 2)]:
            start = (float(row[PERIODS]), float(row[TIME] + edge * row[DURATION]))
            parts = [Window(start[0] + k, start[1], 3) for k in (-3, 0)]
            before, after = (over(trajectory, log, part) for part in parts)
            whole = over(trajectory, log, Window(start[0] - 3, start[1], 6))
            for part in (before, after, whole):
                assert abs(part["energy_residual"]) < 4e-13
            for key in ("energy_input", "dashpot_loss"):
                mean = 0.5 * (before[key] + after[key])
                assert whole[key] == pytest.approx(mean, rel=1e-13, abs=1e-14), key
            top = max(before["peak_displacement"], after["peak_displacement"])
            assert whole["peak_displacement"] == pytest.approx(top, rel=4e-16)
            # An impact at the common end of two windows counts in both.
            there = (log[:, PERIODS] == start[0]) & (log[:, TIME] == start[1])
            speeds = log[there & (log[:, CAUSE] == IMPACT), SPEED]
            mu, r = trajectory.model.mass_ratio, SCENES[name]["restitution"]
            both = 0.5 * mu / (1 + mu) * (1 - r * r) * float((speeds**2).sum()) / 6
            mean = 0.5 * (before["impact_loss"] + after["impact_loss"]) - both
            if edge < 1.0:  # the ends of segments are rounded
                assert whole["impact_loss"] == pytest.approx(mean, abs=1e-13)


# --- tails


def near_wall(v: float, w: float = 0.01) -> tuple[Parameters, State]:
    """Model section 4: on the right wall at t = 2, x = 2, with rebound speed w."""
    p = Parameters(0.5, 0.2, 0.3, 0.5, 0.6)
    return p, State(2.0, v, 2.5, v - w, time=2.0)


def near_left_wall(v: float, w: float = 0.01) -> tuple[Parameters, State]:
    """On the left wall while x grows: the bounces keep x below its centre."""
    p = Parameters(0.5, 0.2, 0.3, 0.5, 0.6, phase=0.5 * math.pi - 0.6)
    return p, State(0.2, v, -0.3, v + w, time=2.0)


@pytest.mark.parametrize("wall", [near_wall, near_left_wall])
@pytest.mark.parametrize("v", [-0.3, 0.012, 0.018, 0.024])
def test_peak_and_integrals_within_a_tail(wall: Callable, v: float) -> None:
    """A tail closed early against the same burst resolved: third order in the rebound speed."""
    results, tail = [], None
    for accuracy in (1e-3, 1e-15):
        p, state = wall(v)
        trajectory = start_run(p, state, accuracy)
        periods, time = trajectory.start
        log = logged(trajectory, periods, time + 1.0)
        if tail is None:
            tail = log[log[:, MODE] == TAIL][0]
        for until in (0.2, 0.45, 0.75, 1.0):
            # Backwards from a moment within the tail: the record starts a period earlier.
            moment = float(tail[TIME] + until * tail[DURATION])
            window = Window(float(tail[PERIODS]) - 1, moment, 1)
            results.append(over(trajectory, log, window))
    assert tail[GAP_RATE] == pytest.approx(0.006, rel=0.1)
    early, resolved = results[:4], results[4:]
    # The third power of the rebound speed is 2e-7.
    for one, other in zip(early, resolved, strict=True):
        assert one["peak_displacement"] == pytest.approx(other["peak_displacement"], abs=1e-7)
        for key in ("energy_input", "dashpot_loss"):
            assert one[key] == pytest.approx(other[key], abs=1.5e-7), key
        assert abs(one["energy_residual"]) < 3e-8

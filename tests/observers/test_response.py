"""Response against closed forms in 60 digits, numerical integration, and its energy balance."""

import itertools
import math
import warnings
from collections.abc import Callable

import mpmath as mp
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
from damper.sweep.runs import run_points

EPS = np.finfo(float).eps


def observed(values: dict[str, float], *more: str, **run: object) -> dict[str, np.ndarray]:
    """Results of the observer for one run."""
    settings = {"response": {}, "stroboscopic_section": {"free_mass": True}}
    asked = {name: settings[name] for name in ("response", *more)}
    arrays, _ = run_points([values], asked, **run)
    return {name: array[0] for name, array in arrays.items()}


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


# --- closed forms of the linear response, without contact


def linear(values, state: State, transient: int, periods: int, inertia: float = 1.0):
    """rms, peak, input and loss of a linear oscillator from sums of exponentials, 60 digits.

    Double roots and undamped resonance are taken as limits: damping off by 1e-30.
    """
    with mp.workdps(100):
        zeta, omega, phase = (
            mp.mpf(values[name]) for name in ("damping_ratio", "frequency_ratio", "phase")
        )
        zeta += mp.mpf(10) ** -30
        inertia = mp.mpf(inertia)
        root = mp.sqrt(mp.mpc(zeta * zeta - inertia))
        forced = mp.exp(1j * phase) / (2j * (1 - inertia * omega**2 + 2j * zeta * omega))
        rates = [(-zeta + root) / inertia, (-zeta - root) / inertia, 1j * omega, -1j * omega]
        weights = [forced, mp.conj(forced)]
        rest_x = state.x - sum(weights)
        rest_v = state.v - sum(c * k for c, k in zip(weights, rates[2:], strict=True))
        first = (rest_v - rates[1] * rest_x) / (rates[0] - rates[1])
        weights = [first, rest_x - first, *weights]
        speeds = [c * k for c, k in zip(weights, rates, strict=True)]
        force = [0, 0, mp.exp(1j * phase) / 2j, -mp.exp(-1j * phase) / 2j]
        period = 2 * mp.pi / omega
        low, high = transient * period, (transient + periods) * period

        def integral(one, other):
            total = mp.mpf(0)
            for (c, k), (e, m) in itertools.product(
                zip(one, rates, strict=True), zip(other, rates, strict=True)
            ):
                if c == 0 or e == 0:
                    continue
                rate = k + m
                if rate == 0:
                    total += c * e * (high - low)
                else:
                    total += c * e * (mp.exp(rate * high) - mp.exp(rate * low)) / rate
            return total.real

        def at(t, factors=weights):
            return sum(c * mp.exp(k * t) for c, k in zip(factors, rates, strict=True)).real

        # Equal steps for the steady part, geometric ones for a fast mode at the start.
        times = [low + (high - low) * k / (80 * periods) for k in range(80 * periods + 1)]
        times += [low + (high - low) * mp.mpf(2) ** -k for k in range(8, 60)]
        times.sort()
        xs = [abs(at(t)) for t in times]
        best = max(range(len(xs)), key=xs.__getitem__)
        peak = xs[best]
        for a, b in itertools.pairwise(times[max(best - 1, 0) : best + 2]):
            if at(a, speeds) * at(b, speeds) < 0:
                peak = max(
                    peak, abs(at(mp.findroot(lambda t: at(t, speeds), (a, b), solver="anderson")))
                )
        return {
            "rms_displacement": float(mp.sqrt(integral(weights, weights) / (high - low))),
            "peak_displacement": float(peak),
            "energy_input": float(integral(force, speeds) / periods),
            "dashpot_loss": float(2 * zeta * integral(speeds, speeds) / periods),
        }


REST = State(0.0, 0.0, 0.0, 0.0)
LINEAR = {
    "later": (0.05, 0.8, 0.3, State(2.0, -1.0, 0.0, 0.0), 5, 6),
    "resonance, later": (0.0, 1.0, 0.7, State(0.3, 0.4, 0.0, 0.0), 30, 4),
    "near resonance": (1e-6, 1.0 + 1e-7, 0.0, REST, 3, 6),
    "critical": (1.0, 0.5, 0.0, State(1.0, 3.0, 0.0, 0.0), 0, 3),
    "very overdamped": (10.0, 0.6, 0.2, State(0.1, 5.0, 0.0, 0.0), 0, 2),
    "very fast": (0.1, 1e3, 0.4, REST, 0, 30),
    "slow": (0.2, 1e-3, 0.4, REST, 0, 1),
}


@pytest.mark.parametrize("case", LINEAR)
def test_linear_response_is_that_of_the_closed_form(case: str) -> None:
    zeta, omega, phase, state, transient, periods = LINEAR[case]
    values = dict(zip(BASIC, (0.1, zeta, omega, 1e6, 0.5, phase), strict=True))
    found = observed(values, transient=transient, periods=periods, state=state)
    expected = linear(values, state, transient, periods)
    # The flow gives x and v to the rounding of v0 tau and v0, tau <= 25; the work is a difference.
    speed = (
        max(math.sqrt(expected["dashpot_loss"] / (2 * zeta * periods * 2 * math.pi / omega)), 1e-9)
        if zeta
        else 1.0
    )
    lost = (
        4 * EPS * 25 * abs(state.v) / min(expected["rms_displacement"], speed) if zeta > 1 else 0.0
    )
    for name, value in expected.items():
        size = value + (periods * speed if name == "energy_input" else 0.0)
        assert abs(found[name] - value) <= (4e-13 + lost) * size + 1e-25, name
    assert found["impact_loss"] == 0.0


# --- with impacts


@pytest.mark.parametrize(
    "name", thinned(SCENES, {"chattering", "plastic", "overdamped"}.__contains__)
)
def test_integrals_are_those_of_the_motion(name: str) -> None:
    """By scipy's quad over every segment of the log, bounces of tails one by one."""
    p = Parameters(**SCENES[name])
    trajectory = start_run(p)
    log = logged(trajectory, 5)
    found = over(trajectory, log, Window(0.0, 0.0, 5))
    rates = 40.0 / np.array([max(p.frequency_ratio, 1.0), 2 * p.damping_ratio + 1.0])
    sums = np.zeros(3)
    for row in log:
        end = float(row[DURATION])
        cuts = [0.0, *(c for c in sorted({*(rates / 40), *rates}) if c < end), end]
        if row[MODE] == TAIL and end > 0.0:
            r = p.restitution
            cuts = [end * (1.0 - r**k) for k in range(40) if r**k > 1e-9] + [end]
        angle = p.frequency_ratio * row[TIME] + p.phase
        for k in range(3):

            def value(t: float, row: np.ndarray = row, k: int = k, angle: float = angle) -> float:
                x, v, _, _ = trajectory.motion_in(row, t)
                return (x * x, v * v, v * math.sin(angle + p.frequency_ratio * t))[k]

            with warnings.catch_warnings():
                warnings.simplefilter("ignore", IntegrationWarning)
                for low, high in itertools.pairwise(cuts):
                    sums[k] += quad(value, low, high, epsrel=1e-13, epsabs=0.0, limit=200)[0]
    assert found["rms_displacement"] ** 2 * 5 * p.cycle == pytest.approx(sums[0], rel=2e-12)
    assert found["dashpot_loss"] * 5 == pytest.approx(2 * p.damping_ratio * sums[1], rel=2e-12)
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


# --- the peak


# --- how it is computed

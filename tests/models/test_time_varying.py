"""The time-varying free mass: many digits, another solver, limits, the search for releases."""

import functools
import itertools
import math
import random

import numpy as np
import pytest
from cases import thinned
from hypothesis import given, settings
from hypothesis import strategies as st
from mpmath import mp, mpf

from damper import Parameters, State, events
from damper.engine.segment import CAUSE, DURATION, IMPACT, RELEASE, SPEED, V
from damper.models import start_run
from damper.models.time_varying.motion import DEGREE, _first_loss, mass_law, modulation
from damper.verification.reference import exact_run

EPS = np.finfo(float).eps


# --- the mass


@pytest.mark.parametrize("order", [1, 3, 1000])
def test_mass_ratio_after_many_periods(order: int) -> None:
    """Sharp after 1e6 periods, and near its smallest value."""
    depth, phase, omega = 0.999999, 0.7, 0.3
    law = mass_law(1e6, depth, order, phase, omega)
    period = 2 * math.pi / omega
    for periods, part in itertools.product((0, 5, 10**6 + 1, 10**6 + 499), (0.0, 0.3, 0.9)):
        time = part * period
        mass_ratio, sin, cos = modulation(law, float(periods), time)
        with mp.workdps(40):
            angle = 2 * mp.pi * (mpf(periods) / order) + mpf(omega) / order * mpf(time) + mpf(phase)
            assert abs(sin - mp.sin(angle)) < 1e-14
            assert abs(cos - mp.cos(angle)) < 1e-14
            exact = mpf(1e6) * (1 + mpf(depth) * mp.cos(angle))
            assert abs(mass_ratio - exact) <= 1e-14 * 1e6 * (abs(sin) + EPS) + 4 * EPS * exact


# --- both masses together


def corner(seed: int) -> dict[str, float]:
    draw = random.Random(seed)
    return {
        "mass_ratio": 10 ** draw.choice([-6, 18, draw.uniform(-6, 6)]),
        "damping_ratio": draw.choice([0.0, 0.1, 1.0, 10.0]),
        "frequency_ratio": 10 ** draw.uniform(-3, 3) if seed % 3 else 1.0,
        "clearance": 0.0,
        "restitution": 0.5,
        "modulation_depth": draw.choice([1e-3, 0.5, 0.95, 0.999999]),
        "modulation_phase": draw.uniform(-3, 3),
        "modulation_order": draw.choice([1, 2, 5, 1000]),
    }


def shortest_time(values: dict[str, float]) -> float:
    """Time in which the motion of both masses together changes."""
    mean, depth, omega = (
        values[name] for name in ("mass_ratio", "modulation_depth", "frequency_ratio")
    )
    least = 1.0 + mean * (1.0 - depth)
    pole = math.acosh((1.0 + 1.0 / mean) / depth) * values["modulation_order"] / omega
    rates = 2.0 * values["damping_ratio"] / least + 1.0 / math.sqrt(least) + omega
    return min(1.0 / rates, pole / 8.0)


def state_after(values: dict[str, float], state: State, time: float) -> State:
    run = start_run(Parameters(**values), state)
    at = run.whole_periods(time)
    run.skip(*at)
    assert run.status == 0
    return run.state_at(*at)


@pytest.mark.parametrize("seed", thinned(range(15), range(3).__contains__))
def test_sticking_in_the_corners_of_the_parameters(seed: int) -> None:
    """Both masses together over many steps, against short panels in 40 digits."""
    values = corner(seed)
    time = min(8.0, 20.0 * random.Random(seed).random() * shortest_time(values))
    end = state_after(values, State(0.7, -0.3, 0.7, -0.3), time)
    x, v, _, _ = exact_run(values, (0.7, -0.3, 0.7, -0.3), until=time, digits=25).final
    assert abs(end.x - x) < 1e-14
    assert abs(end.v - v) < 1e-14 * max(1.0, values["frequency_ratio"] * 1e-2)


# --- the release


@given(
    roots=st.lists(st.floats(0.02, 1.5), min_size=1, max_size=7),
    close=st.floats(1e-7, 1e-2),
    side=st.sampled_from([-1.0, 1.0]),
)
@settings(max_examples=40)
def test_no_loss_of_contact_is_skipped(roots: list[float], close: float, side: float) -> None:
    """Forces with chosen roots, two of them close together: the first sign change is found."""
    roots = sorted([*roots, roots[0] + close])
    p = np.polynomial.Polynomial.fromroots(roots)
    p = p if p(0.0) > 0.0 else -p
    terms = np.zeros(DEGREE + 1)
    terms[: len(p.coef)] = -side * p.coef
    roundoff = 8 * EPS * float(np.abs(p.coef).sum())
    found = _first_loss(terms, side, side, roundoff)
    with mp.workdps(40):
        exact = [mpf(float(c)) for c in p.coef[::-1]]

        def force(t: float) -> mpf:
            return functools.reduce(lambda total, c: total * mpf(float(t)) + c, exact)

        low = min(found, 1.0)
        inner = [(a + b) / 2 for a, b in itertools.pairwise([r for r in roots if r < low])]
        # Nowhere before it does the force lie below zero by more than roundoff.
        for t in [*np.linspace(0.0, low, 60)[:-1], *inner]:
            assert force(t) >= -4 * roundoff
        if found <= 1.0:
            assert abs(force(found)) <= 4 * roundoff
            assert p.deriv()(found) < 1e-6 * float(np.abs(p.coef).sum())


@pytest.mark.parametrize("clearance", [1e-3, pytest.param(1.0, marks=pytest.mark.exhaustive)])
def test_a_flight_after_a_release_is_read_as_it_was_flown(clearance: float) -> None:
    """Where a varying mass has driven the primary to 1e14, x'' at a release rounds to 1e-2."""
    p = Parameters(1e6, 0.0, 0.01, clearance, 0.5, modulation_depth=0.999)
    run = start_run(p, State(0.0, 0.0, clearance, 1.0))
    log = np.concatenate([piece.copy() for piece in run.segments(19.0)])
    fast = 0
    for row, end in itertools.pairwise(log):
        if row[CAUSE] == RELEASE and end[CAUSE] == IMPACT:
            _, _, _, rate = run.motion_in(row, row[DURATION])
            assert abs(rate) == pytest.approx(float(end[SPEED]), rel=1e-14)
            fast += abs(row[V]) > 1e12
    assert fast > 2


# --- limits and corners


@pytest.mark.parametrize("runs", [10, pytest.param(80, marks=pytest.mark.exhaustive)])
def test_corners_finish_in_order(runs: int) -> None:
    draw = random.Random(0)
    for _ in range(runs):
        zeta = draw.choice([0.0, 0.05, 1.0, 10.0])
        omega = 10 ** draw.uniform(-3, 3)
        p = Parameters(
            mass_ratio=10 ** draw.choice([-6, 18, draw.uniform(-6, 6)]),
            damping_ratio=zeta,
            frequency_ratio=omega,
            clearance=draw.choice([0.0, 10 ** draw.uniform(-3, 1)])
            / max(1, zeta)
            / max(1, omega**2),
            restitution=draw.choice([0.0, 0.3, 0.6, 0.9, 1.0]),
            phase=draw.uniform(-3, 3),
            modulation_depth=draw.choice([1e-9, 0.1, 0.9, 0.999, 0.999999]),
            modulation_order=draw.choice([1, 2, 7, 1000]),
            modulation_phase=draw.uniform(-3, 3),
        )
        x, v = draw.uniform(-1, 1), draw.uniform(-1, 1) / max(1, zeta)
        state = State(x, v, x + p.clearance * draw.choice([-1, 0, 1]), v)
        rows = events(p, state, until=min(30 * p.cycle, 400.0), max_events=2000)
        for column in ("time", "x", "v", "approach_speed"):
            assert np.isfinite(rows[column]).all()
        assert (np.diff(rows["time"]) >= 0.0).all(), p

"""Condition: what is sharp, what grows, and what turns on a hair."""

import numpy as np
import pytest

from damper.engine.segment import CAUSE, MODE, RELEASE, STICKING, TIME, V, X
from damper.parameters import Parameters, State
from damper.verification.stress.condition import (
    BORDER,
    EPS,
    GRAZING,
    GROWING,
    NOISE,
    POINTLESS,
    WELL,
    condition_of,
    differences,
    matching,
    scale_of,
)
from damper.verification.stress.runs import events_of, noisy_run, short_run


def condition(parameters, state=None, periods=20, events=100, seed=1):
    settings = {"periods": periods, "events": events}
    run = short_run(parameters, state, **settings)
    random = np.random.default_rng(seed)
    return run, condition_of(run, state, random=random, **settings)


def test_a_driven_orbit_is_well_conditioned():
    p = Parameters(0.1, 0.1, 1.0, 5.5, 0.5, phase=4.3308)
    state = State(1.716240408729, -3.2, 1.716240408729 + 5.5, 4.59)
    run, found = condition(p, state)
    assert found.kind == WELL
    assert found.comparable == len(events_of(run).kind)
    assert found.growth[-1] < 1e5


def test_chaos_grows_about_tenfold_every_few_impacts():
    run, found = condition(Parameters(0.1, 0.05, 0.8, 1.0, 0.9), periods=60)
    assert found.kind == GROWING
    assert 10 < found.comparable < len(events_of(run).kind)
    decades = np.log10(found.growth[found.comparable - 1])
    assert 1.0 < found.comparable / decades < 6.0


def grazing(extra):
    """Near the right wall, which draws away at the acceleration 1; zero extra speed: it touches."""
    gap = 1e-4
    return State(-1.0, 0.0, -1.0 + 0.5 - gap, np.sqrt(2.0 * gap) + extra)


def test_grazing_is_recognised():
    p = Parameters(1e-6, 0.0, 0.01, 0.5, 0.9)
    # Bisect to the speed at which the free mass just does or does not touch.
    low, high = -1e-3, 1e-3
    for _ in range(60):
        middle = 0.5 * (low + high)
        first = events_of(short_run(p, grazing(middle), periods=1, events=1))
        early = first.time[0] < 0.1
        low, high = (low, middle) if early else (middle, high)
    kinds = [condition(p, grazing(high), periods=1, events=5, seed=n)[1].kind for n in range(4)]
    assert set(kinds) == {GRAZING}
    assert condition(p, grazing(1e-2), periods=1, events=5)[1].kind == WELL


def test_rest_at_a_wall_that_does_not_accelerate_is_a_border():
    p = Parameters(0.1, 0.0, 0.8, 1.0, 0.5, phase=0.7)
    x = float(np.sin(0.7))
    state = State(x, 0.0, x + 1.0, 0.0)
    kinds = {condition(p, state, seed=seed)[1].kind for seed in range(4)}
    assert BORDER in kinds


def test_noise_is_of_the_size_that_it_says_and_deterministic():
    p = Parameters(0.1, 0.05, 0.2, 0.25, 0.6)
    runs = [
        noisy_run(p, None, periods=5, events=99, size=NOISE, random=np.random.default_rng(seed))
        for seed in (1, 1, 2)
    ]
    np.testing.assert_array_equal(runs[0].log, runs[1].log)
    assert not np.array_equal(runs[0].log, runs[2].log)
    run = short_run(p, None, periods=5, events=99)
    own, other = events_of(run), events_of(runs[0])
    same = matching(own, other)
    found = differences(own, other, slice(0, same), slice(0, same), scale_of(run, own))
    assert 0.01 * NOISE < found[0] < 100.0 * NOISE
    # No segment starts where the one before it ends: each event adds some.
    noisy = runs[0].log
    flights = np.flatnonzero((noisy[1:, CAUSE] == RELEASE) & (noisy[:-1, MODE] == STICKING))
    pushes = [
        np.sin(p.phase + runs[0].parameters.frequency_ratio * row[TIME])
        - 2.0 * runs[0].parameters.damping_ratio * row[V]
        - row[X]
        for row in noisy[flights + 1]
    ]
    assert len(pushes) > 0
    assert min(abs(push) for push in pushes) > 0.01 * NOISE


def test_the_end_of_comparison_is_where_rounding_reaches_it():
    _, found = condition(Parameters(0.1, 0.05, 0.8, 1.0, 0.9), periods=60)
    last = found.comparable
    assert found.growth[last - 1] * EPS < POINTLESS
    assert np.all(np.diff(found.growth) >= 0.0)


@pytest.mark.parametrize("restitution", [0.0, 1.0])
def test_limits_of_restitution_stay(restitution):
    p = Parameters(0.1, 0.05, 0.8, 1.0, restitution)
    noisy = noisy_run(p, None, periods=5, events=20, size=NOISE, random=np.random.default_rng(1))
    assert noisy.parameters.restitution == restitution
    assert noisy.parameters.mass_ratio != p.mass_ratio

"""Sizes: exponents, and what a size is made of."""

import math

import pytest

from damper.verification.cost import ladder
from damper.verification.cost.scaling import LEAST, run_size, slope

BASE = {
    "mass_ratio": 0.1,
    "damping_ratio": 0.05,
    "frequency_ratio": 0.8,
    "clearance": 1.0,
    "restitution": 0.6,
}


@pytest.mark.parametrize("power", [0.0, 1.0, 2.0])
def test_slope_finds_the_power_and_does_not_look_at_small_sizes(power):
    sizes = [1, LEAST // 2, LEAST, 10 * LEAST, 100 * LEAST]
    values = [77.0, 88.0, *(3.0 * size**power for size in sizes[2:])]
    assert slope(sizes, values) == pytest.approx(power, abs=1e-12)


def test_slope_needs_two_sizes_with_a_value():
    assert math.isnan(slope([1, LEAST, 10 * LEAST], [1.0, 1.0, 0.0]))


def test_observers_keep_what_they_were_asked_for_and_the_bare_engine_nothing():
    observers = {"stroboscopic_section": None}
    size = run_size(BASE, lanes=4, periods=25, observers=observers, repeats=2)
    assert size["asked"] == 4 * (2 * 25 * 8 + 1)
    assert 1 <= size["repeats"] <= 2
    bare = run_size(BASE, lanes=4, periods=25, observers=None, repeats=2)
    assert bare["asked"] == 0
    assert bare["seconds"] > 0.0


def test_a_size_beyond_the_usual_event_budget_is_run_to_its_end():
    scene = {
        "mass_ratio": 0.1,
        "damping_ratio": 0.05,
        "frequency_ratio": 0.2,
        "clearance": 0.25,
        "restitution": 0.3,
    }
    # It raises an error where a run stops early.
    assert ladder.bare([scene], 50_000) > 1_000_000

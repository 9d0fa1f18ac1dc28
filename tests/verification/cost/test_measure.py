"""The benchmark suite and growth: which runs are compared, and with what."""

import math

import numpy as np
import pytest

from damper.verification.cost import measure
from damper.verification.cost.measure import (
    LEAST,
    bare,
    exponent,
    measure_size,
    measure_suite,
    observed,
    points_near,
    rigid_part,
)

BASE = {
    "mass_ratio": 0.1,
    "damping_ratio": 0.05,
    "frequency_ratio": 0.8,
    "clearance": 1.0,
    "restitution": 0.6,
}
CHATTERING = BASE | {"frequency_ratio": 0.2, "clearance": 0.25, "restitution": 0.3}
SECTION = {"stroboscopic_section": None}


def test_ratios_are_taken_within_a_repeat_and_per_event(monkeypatch):
    cases = {
        "bare": {"parameters": BASE, "observers": {}},
        "observed": {"parameters": BASE, "observers": SECTION},
        "chattering": {"parameters": CHATTERING, "observers": {}},
        "grounded": {"parameters": BASE | {"support_stiffness_ratio": 0.01}, "observers": {}},
    }
    pace = np.array([1.0, 5.0, 2.0])[:, None]
    # base twice, bare and observed, chattering, grounded and its rigid counterpart
    columns = np.array([1.0, 1.1, 1.0, 1.5, 3.0, 2.0, 1.0])

    def fake(timed, repeats):
        assert len(timed) == len(columns)
        assert repeats == 3
        return pace * columns

    monkeypatch.setattr(measure, "take_turns", fake)
    found = measure_suite(cases, runs=2, periods=30, repeats=3, memory=False)
    assert found["noise"].median == pytest.approx(1.1)
    names = found["cases"]
    assert names["observed"]["over_bare"] == pytest.approx([1.5] * 3)
    events = {name: case["events"] for name, case in names.items()}
    assert names["observed"]["observed"].median == pytest.approx(1e6 * 3.0 / events["bare"])
    assert events["bare"] == bare(points_near(BASE, 2), 30)
    assert events["chattering"] > 2 * events["bare"]
    over_base = 3.0 * events["bare"] / events["chattering"]
    assert names["chattering"]["over_base"].median == pytest.approx(over_base)
    over_rigid = 2.0 * events["bare"] / events["grounded"]
    assert names["grounded"]["over_rigid"].median == pytest.approx(over_rigid)
    assert [name for name in names if "over_rigid" in names[name]] == ["grounded"]
    assert [name for name in names if "over_bare" in names[name]] == ["observed"]


def test_runs_differ_and_lie_about_the_scene():
    assert rigid_part(BASE | {"contact_stiffness_ratio": 1e4}) == BASE
    clearances = [point["clearance"] for point in points_near(BASE, 4)]
    assert clearances == pytest.approx([0.985, 0.995, 1.005, 1.015])
    assert list(points_near(BASE, 1)) == [BASE]


def test_observers_keep_what_they_were_asked_for_and_the_bare_engine_nothing():
    size = measure_size(BASE, SECTION, runs=4, periods=25, repeats=2)
    # displacement and velocity of each period of each run, and the status of each run
    assert size["arrays"] == 4 * (2 * 25 * 8 + 1)
    alone = measure_size(BASE, None, runs=4, periods=25)
    assert alone["arrays"] == 0
    assert alone["seconds"] > 0.0
    assert alone["peak"] >= alone["memory"] >= 0


def test_a_size_beyond_the_usual_event_budget_is_run_to_its_end():
    # It raises an error where a run stops early.
    assert bare([CHATTERING], 50_000) > 1_000_000


def test_a_run_that_stops_early_is_not_measured(monkeypatch):
    monkeypatch.setattr(measure, "NO_BUDGET", 5)
    for run in (lambda: bare([BASE], 50), lambda: observed([BASE], 50, SECTION)):
        with pytest.raises(RuntimeError, match="did not finish"):
            run()


@pytest.mark.parametrize("power", [0.0, 1.0, 2.0])
def test_slope_finds_the_power_and_ignores_small_sizes(power):
    sizes = [1, LEAST // 2, LEAST, 10 * LEAST, 100 * LEAST]
    values = [77.0, 88.0, *(3.0 * size**power for size in sizes[2:])]
    assert math.isclose(exponent(sizes, values), power, abs_tol=1e-12)
    assert exponent(sizes[:3], values[:3]) is None

"""Metamorphic tests: sound runs pass, by comparison or backward error; a wrong engine fails."""

import numpy as np
import pytest

from damper.engine.segment import SPEED, V
from damper.verification.stress import metamorphic, runs
from damper.verification.stress.backward import LONG
from damper.verification.stress.box import random_points
from damper.verification.stress.metamorphic import (
    FAILED,
    PASSED,
    PASSED_BACKWARD,
    PASSED_LAWS,
    RELATIONS,
    run_metamorphic,
)

pytestmark = pytest.mark.skipif(not LONG, reason="long double has no digits to spare")

GENERIC = {
    "mass_ratio": 0.1,
    "damping_ratio": 0.05,
    "frequency_ratio": 0.8,
    "clearance": 1.0,
    "restitution": 0.6,
}
CHAOTIC = GENERIC | {"restitution": 0.9}
CHATTERING = GENERIC | {"frequency_ratio": 0.2, "clearance": 0.25}
BOX = {
    "share": 0.5,
    "parameters": {
        "mass_ratio": {"range": [1e-6, 1e6], "values": [1e-6, 1e-3, 0.1, 1.0, 1e6]},
        "damping_ratio": {
            "range": [1e-6, 10.0],
            "values": [0.0, 1e-12, 1.0 - 1e-12, 1.0, 1.0 + 1e-12, 10.0],
        },
        "frequency_ratio": {
            "range": [1e-3, 1e3],
            "values": [1e-3, 1.0 - 1e-9, 1.0, 1.0 + 1e-9, 1e3],
        },
        "clearance": {"range": [1e-12, 1e6], "values": [0.0, 1e-12, 1e-3, 1.0, 1e6]},
        "restitution": {"range": [0.0, 1.0], "values": [0.0, 1e-6, 0.5, 0.999999, 1.0]},
        "phase": {"range": [-3.2, 3.2], "values": [0.0]},
        "initial_displacement": {"range": [-2.0, 2.0], "values": [0.0, -1.0]},
        "initial_velocity": {"range": [-2.0, 2.0], "values": [0.0]},
        "initial_position": {"range": [-1.0, 1.0], "values": [0.0, 1.0, -1.0]},
        "initial_relative_velocity": {"range": [-2.0, 2.0], "values": [0.0]},
    },
}


def verdicts(found):
    return {name: found[f"{name}_verdict"] for name in RELATIONS}


def test_an_ordinary_run_passes_all():
    found = run_metamorphic([CHATTERING])
    for name, verdict in verdicts(found).items():
        assert verdict[0] == PASSED, name
    # A shift whose time is exact leaves every bit as it is.
    assert found["shifted_far_difference"][0] == 0.0
    assert 0.0 < found["units_difference"][0] < 1e-11
    assert 0.0 < found["looser_difference"][0] < 1e-9


def test_a_chaotic_run_passes_by_its_backward_error():
    found = run_metamorphic([CHAOTIC], periods=60)
    assert found["condition"][0] == 1
    assert found["comparable_events"][0] < found["compared_of_events"][0]
    assert all(verdict[0] == PASSED_BACKWARD for verdict in verdicts(found).values())
    assert found["backward_error"][0] < 60.0


@pytest.mark.exhaustive
def test_random_points_of_the_whole_box_pass():
    runs = random_points(100, 1, BOX)
    found = run_metamorphic(runs)
    for name, verdict in verdicts(found).items():
        assert set(verdict) <= {PASSED, PASSED_BACKWARD}, name
        assert (verdict == PASSED).mean() > 0.7, name
    assert found["backward_error"].max() < 100.0


def test_a_run_does_not_depend_on_its_part():
    runs = random_points(4, 1, BOX)
    whole, part = run_metamorphic(runs, events=20), run_metamorphic(runs[2:], events=20, first=2)
    for name, values in part.items():
        np.testing.assert_array_equal(values, whole[name][2:])
    assert run_metamorphic([]) == {}


def test_a_follow_up_that_differs_fails(monkeypatch):
    """A log whose impacts are too fast by 1e-9 agrees with nothing, and obeys no law."""
    honest = runs.short_run

    def wrong(parameters, state, **settings):
        run = honest(parameters, state, **settings)
        if parameters.phase == 0.0:
            return run
        log = run.log.copy()
        log[:, SPEED] *= 1.0 + 1e-9
        return run._replace(log=log)

    monkeypatch.setattr(metamorphic, "short_run", wrong)
    found = run_metamorphic([CHATTERING])
    assert found["mirrored_verdict"][0] == FAILED
    assert found["units_verdict"][0] == PASSED


def test_another_model_is_judged_by_the_laws(monkeypatch):
    """Runs without events agree with nothing; the laws distinguish a sound log from a wrong one."""
    honest = runs.short_run
    wrong_by = {"v": 0.0}

    def without_events(run):
        found = honest_events(run)
        if run.parameters.phase == 0.0:
            return found
        return found._replace(kind=found.kind + 20.0)

    def wrong(parameters, state, **settings):
        run = honest(parameters, state, **settings)
        if parameters.phase == 0.0:
            return run
        log = run.log.copy()
        log[:, V] *= 1.0 + wrong_by["v"]
        return run._replace(log=log)

    honest_events = metamorphic.events_of
    monkeypatch.setattr(metamorphic, "events_of", without_events)
    monkeypatch.setattr(metamorphic, "short_run", wrong)
    points = [GENERIC | {"support_stiffness_ratio": 0.1}]
    found = run_metamorphic(points, events=12)
    assert found["mirrored_verdict"].tolist() == [PASSED_LAWS] * len(points)
    assert (found["laws_excess"] < 0.1).all()
    wrong_by["v"] = 1e-9
    found = run_metamorphic(points, events=12)
    assert found["mirrored_verdict"].tolist() == [FAILED] * len(points)


def test_a_run_that_is_refused_is_an_outcome():
    found = run_metamorphic([GENERIC | {"mass_ratio": -1.0}, CHATTERING])
    assert found["condition"].tolist() == [metamorphic.REFUSED, 0]
    assert all(v.tolist() == [metamorphic.NOT_APPLICABLE, PASSED] for v in verdicts(found).values())
    assert np.isnan(found["growth"][0])
    assert np.isnan(found["backward_error"][0])


def test_other_models_are_compared_too():
    grounded = GENERIC | {"support_stiffness_ratio": 0.1}
    modulated = GENERIC | {"modulation_depth": 0.2, "modulation_order": 2.0}
    found = run_metamorphic([grounded, modulated], events=12)
    assert np.isnan(found["backward_error"]).all()
    assert list(found["mirrored_verdict"]) == [PASSED, PASSED]
    # Three forcing periods are no whole number of the modulation's.
    assert list(found["shifted_verdict"]) == [PASSED, metamorphic.NOT_APPLICABLE]
    assert list(found["shifted_far_verdict"]) == [PASSED, PASSED]

"""Metamorphic tests: sound runs pass, by comparison or backward error; a wrong engine fails."""

import numpy as np
import pytest
from scenes import GENERIC

from damper.engine.compiled import plain
from damper.engine.roundoff import EPSILON
from damper.engine.segment import SPEED, V
from damper.parameters import Parameters, State
from damper.sweep.branches import draw
from damper.verification.metamorphic import relations, runs
from damper.verification.metamorphic.backward import LONG
from damper.verification.metamorphic.condition import (
    NOISE,
    POINTLESS,
    condition_of,
    differences,
    scale_of,
)
from damper.verification.metamorphic.verdicts import (
    FAILED,
    NOT_APPLICABLE,
    PASSED,
    PASSED_BY_STEPS,
    RELATIONS,
)

# To compile it takes longer than these runs.
run_metamorphic = plain(relations.run_metamorphic)
pytestmark = pytest.mark.skipif(not LONG, reason="long double has no digits to spare")

CHAOTIC = GENERIC | {"restitution": 0.9}
CHATTERING = GENERIC | {"frequency_ratio": 0.2, "clearance": 0.25}


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


def test_a_chaotic_run_is_judged_step_by_step():
    found = run_metamorphic([CHAOTIC], periods=60)
    assert found["comparable_events"][0] < found["compared_of_events"][0]
    assert all(verdict[0] == PASSED_BY_STEPS for verdict in verdicts(found).values())
    assert found["backward_error"][0] < 60.0
    assert found["laws_excess"][0] < 0.1


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

    monkeypatch.setattr(relations, "short_run", wrong)
    found = run_metamorphic([CHATTERING])
    assert found["mirrored_verdict"][0] == FAILED
    assert found["units_verdict"][0] == PASSED


def test_the_laws_judge_where_there_is_no_backward_error(monkeypatch):
    """Runs without events agree with nothing; the laws distinguish a sound log from a wrong one."""
    honest, honest_events, wrong_by = runs.short_run, relations.events_of, {"v": 0.0}

    def without_events(run):
        found = honest_events(run)
        return found if run.parameters.phase == 0.0 else found._replace(kind=found.kind + 20.0)

    def wrong(parameters, state, **settings):
        run = honest(parameters, state, **settings)
        if parameters.phase == 0.0:
            return run
        log = run.log.copy()
        log[:, V] *= 1.0 + wrong_by["v"]
        return run._replace(log=log)

    monkeypatch.setattr(relations, "events_of", without_events)
    monkeypatch.setattr(relations, "short_run", wrong)
    monkeypatch.setattr(relations, "LONG", False)
    assert run_metamorphic([GENERIC], events=12)["mirrored_verdict"] == [PASSED_BY_STEPS]
    wrong_by["v"] = 1e-9
    assert run_metamorphic([GENERIC], events=12)["mirrored_verdict"] == [FAILED]


def test_a_run_that_is_refused_is_an_outcome():
    found = run_metamorphic([GENERIC | {"mass_ratio": -1.0}, CHATTERING])
    assert all(v.tolist() == [NOT_APPLICABLE, PASSED] for v in verdicts(found).values())
    assert np.isnan(found["growth"]).tolist() == [True, False]


def test_parts_are_stretches_of_the_draws():
    """What comes of a run does not depend on the part it is in; a quantity not drawn is default."""
    scene = {name: {"values": (value,)} for name, value in CHATTERING.items()}
    draws = {"count": 3, "seed": 5, **scene, "initial_velocity": {"range": (-1.0, 1.0)}}
    run_part = plain(relations.run_part)
    whole = run_part((), draws, 0, 3).arrays
    parts = [run_part((), draws, *ends).arrays for ends in ((0, 2), (2, 3))]
    for name, values in whole.items():
        np.testing.assert_array_equal(values, np.concatenate([part[name] for part in parts]))
    assert whole["initial_velocity"].tolist() == draw(draws)["initial_velocity"]
    assert whole["contact_stiffness_ratio"].tolist() == [np.inf] * 3
    assert (whole["mirrored_verdict"] == PASSED).all()


def test_other_models_are_compared_too():
    modulated = GENERIC | {"modulation_depth": 0.2, "modulation_order": 2.0}
    found = run_metamorphic([modulated], events=12)
    assert np.isnan(found["backward_error"]).all()
    assert found["mirrored_verdict"] == found["shifted_far_verdict"] == [PASSED]
    # Three cycles are no whole number of the modulation's.
    assert found["shifted_verdict"] == [NOT_APPLICABLE]


def test_runs_under_gravity_and_friction_are_compared_too():
    for more in ({"gravity": 0.1, "restitution_left": 0.3}, {"friction": 0.05}):
        found = run_metamorphic([GENERIC | more], events=12)
        sound = (PASSED, PASSED_BY_STEPS)
        assert all(verdict[0] in sound for verdict in verdicts(found).values()), found


# --- condition: how far roundoff alone may move events


@plain
def condition(parameters, state=None, periods=20, events=100, seed=1):
    size = {"periods": periods, "events": events}
    run = runs.short_run(parameters, state, **size)
    found = condition_of(run, state, random=np.random.default_rng(seed), **size)
    return len(runs.events_of(run).kind), found


def test_chaos_grows_about_tenfold_every_few_impacts():
    count, found = condition(Parameters(0.1, 0.05, 0.8, 1.0, 0.9), periods=60)
    assert 10 < found.comparable < count
    assert found.growth[found.comparable - 1] * EPSILON < POINTLESS
    assert np.all(np.diff(found.growth) >= 0.0)
    decades = np.log10(found.growth[found.comparable - 1])
    assert 1.0 < found.comparable / decades < 6.0


def test_what_turns_on_a_hair_is_not_compared():
    """At rest at a wall that does not accelerate: noise decides whether it sticks."""
    p = Parameters(0.1, 0.0, 0.8, 1.0, 0.5, phase=0.7)
    x = float(np.sin(0.7))
    found = [condition(p, State(x, 0.0, x + 1.0, 0.0), seed=seed)[1] for seed in range(4)]
    assert min(one.comparable for one in found) == 0


@pytest.mark.parametrize("restitution", [0.0, 0.6])
@plain
def test_noise_is_of_the_size_that_it_says_and_deterministic(restitution):
    p = Parameters(0.1, 0.05, 0.2, 0.25, restitution)
    size = {"periods": 5, "events": 99}
    noisy = [
        runs.noisy_run(p, None, **size, size=NOISE, random=np.random.default_rng(seed))
        for seed in (1, 1, 2)
    ]
    np.testing.assert_array_equal(noisy[0].log, noisy[1].log)
    assert not np.array_equal(noisy[0].log, noisy[2].log)
    # The limits of the restitution stay.
    assert (noisy[0].parameters.restitution == restitution) == (restitution != 0.6)
    run = runs.short_run(p, None, **size)
    own, other = runs.events_of(run), runs.events_of(noisy[0])
    found = differences(own, other, slice(0, 1), slice(0, 1), scale_of(run, own))
    assert 0.01 * NOISE < found[0] < 100.0 * NOISE

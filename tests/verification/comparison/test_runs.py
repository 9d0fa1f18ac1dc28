"""Runs of all solvers on a scene, with solvers whose errors are known."""

from typing import Any

import numpy as np
import pytest
from verification.comparison.fake_solvers import REFERENCE, STALLS, fake

from damper.verification.comparison import runs
from damper.verification.comparison.errors import MEASURES, VERDICTS
from damper.verification.comparison.runs import NOT_APPLICABLE, run_scene, solver_names
from damper.verification.comparison.scene import read_scene
from damper.verification.comparison.solution import CAPPED, FINISHED, OUTCOMES, STALLED

VALUES = {
    "mass_ratio": 0.1,
    "damping_ratio": 0.05,
    "frequency_ratio": 2.0,
    "clearance": 0.25,
    "restitution": 0.6,
}
SCENE = read_scene(VALUES, 6.0)
SETTINGS = {"rk45": [0.1, 0.01], "exact": [0.5, 0.1, 1e-4], "radau": [0.1], "lsoda": [0.1]}


@pytest.fixture
def calls(monkeypatch: pytest.MonkeyPatch) -> list[dict[str, Any]]:
    made: list[dict[str, Any]] = []
    solvers = {
        "exact": fake(order=2.0, per_second=1e4, calls=made),
        "rk45": fake(order=1.0),
        "lsoda": STALLS,
        "radau": fake(models=("compliant",)),
    }
    monkeypatch.setattr(runs, "load", solvers.__getitem__)
    return made


def test_errors_and_outcomes_of_every_level(calls: list[dict[str, Any]]) -> None:
    found = run_scene(SCENE, SETTINGS, REFERENCE, 2.0)
    assert set(found) == {
        *MEASURES,
        *("setting", "outcome", "verdict", "reached"),
        *("reference_impacts", "sensitivity", "until", "periods", "rigid"),
    }
    nan = np.nan
    # In the order of SOLVERS: exact, rk45, lsoda, radau.
    np.testing.assert_array_equal(
        found["setting"], [[0.5, 0.1, 1e-4], [0.1, 0.01, nan], [0.1, nan, nan], [0.1, nan, nan]]
    )
    done, stalled, capped = (OUTCOMES.index(name) for name in (FINISHED, STALLED, CAPPED))
    none = NOT_APPLICABLE
    np.testing.assert_array_equal(
        found["outcome"],
        [[done, done, capped], [done, done, none], [stalled, none, none], [none, none, none]],
    )
    names = [VERDICTS[k] for k in found["verdict"][found["verdict"] >= 0]]
    assert names == ["good", "good", "capped", "good", "good", "stalled"]
    np.testing.assert_array_equal(found["verdict"] >= 0, found["outcome"] >= 0)
    np.testing.assert_allclose(
        found["state_error"],
        [[0.3 / 4, 0.3 / 100, nan], [0.03, 0.003, nan], [nan] * 3, [nan] * 3],
    )
    np.testing.assert_allclose(found["impact_time_error"][:2, :2], [[0.05, 0.002], [0.02, 0.002]])
    np.testing.assert_array_equal(found["evaluations"][0], [200, 1000, 20000])
    np.testing.assert_array_equal(found["reached"][:, 0], [6.0, 6.0, 2.0, nan])
    # The stalled one passed over the impact at 1, but never came to 3 and 5.
    np.testing.assert_array_equal(found["missed_impacts"][:, 0], [0.0, 0.0, 1.0, nan])
    assert (found["reference_impacts"], found["sensitivity"]) == (3, 7.0)
    assert found["periods"] == pytest.approx(6.0 / np.pi)
    assert found["rigid"] == 1


def test_solvers_are_asked_for_state_and_balance_within_their_cap(
    calls: list[dict[str, Any]],
) -> None:
    run_scene(SCENE, {"exact": [0.5]}, REFERENCE, 0.5)
    assert calls == [{"setting": 0.5, "times": [6.0], "balance": True, "max_evaluations": 5000}]


def test_same_arrays_twice(calls: list[dict[str, Any]]) -> None:
    first, second = (run_scene(SCENE, SETTINGS, REFERENCE, 2.0) for _ in range(2))
    for name, array in first.items():
        assert array.tobytes() == second[name].tobytes()


def test_scenes_of_another_model_are_not_run(calls: list[dict[str, Any]]) -> None:
    scene = read_scene(VALUES | {"contact_stiffness_ratio": 1e4}, 6.0)
    found = run_scene(scene, SETTINGS, REFERENCE, 2.0)
    assert (found["outcome"][:3] == NOT_APPLICABLE).all()
    assert np.isnan(found["state_error"][:3]).all()
    assert found["outcome"][3, 0] == 0
    assert found["rigid"] == 0
    assert not calls


@pytest.mark.parametrize("levels", [[], [0.0], [-1.0], [np.inf], [np.nan]])
def test_levels_are_positive(levels: list[float]) -> None:
    with pytest.raises(ValueError, match=r"exact = .*: must be finite numbers above 0"):
        run_scene(SCENE, {"exact": levels}, REFERENCE, 1.0)


def test_unknown_solvers_are_named() -> None:
    with pytest.raises(ValueError, match="unknown solver 'rk54': did you mean 'rk45'"):
        solver_names({"rk54": [1.0]})
    with pytest.raises(ValueError, match="must be one of exact, rk4_step_end"):
        solver_names({"?": [1.0]})

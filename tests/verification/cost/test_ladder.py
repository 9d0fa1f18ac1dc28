"""The ladder and what is unused: which runs are compared, and with what."""

import numpy as np
import pytest

from damper.engine.segment import COLUMNS
from damper.engine.trajectory import LOG_ROWS
from damper.models.rigid import Rigid
from damper.verification.cost import ladder, without
from damper.verification.cost.ladder import bare, climb, memory_of, observed, read_rungs
from damper.verification.cost.without import run_as, unused

BASE = {
    "mass_ratio": 0.1,
    "damping_ratio": 0.05,
    "frequency_ratio": 0.8,
    "clearance": 1.0,
    "restitution": 0.6,
}
CHATTERING = BASE | {"frequency_ratio": 0.2, "clearance": 0.25, "restitution": 0.3}


def test_ratios_are_taken_within_a_repeat_and_per_event(monkeypatch):
    rungs = read_rungs(
        {
            "bare": {"parameters": BASE},
            "observed": {"parameters": BASE, "observers": ["stroboscopic_section"]},
            "chattering": {"parameters": CHATTERING},
            "grounded": {"parameters": BASE | {"support_stiffness_ratio": 0.01}},
        }
    )
    pace = np.array([1.0, 5.0, 2.0])[:, None]
    # base twice, then bare and observed of each rung, and the grounded one's rigid counterpart
    columns = np.array([1.0, 1.1, 1.0, 1.2, 1.0, 1.5, 3.0, 3.0, 2.0, 2.0, 1.0])

    def fake(cases, repeats):
        assert len(cases) == len(columns)
        assert repeats == 3
        return pace * columns

    monkeypatch.setattr(ladder, "take_turns", fake)
    found = climb(rungs, lanes=2, periods=30, repeats=3, memory=False)
    assert found["noise"].median == pytest.approx(1.1)
    names = found["rungs"]
    assert names["observed"]["over_bare"].median == pytest.approx(1.5)
    assert names["observed"]["over_bare"].low == pytest.approx(1.5)
    assert names["observed"]["time"].median == pytest.approx(1e6 * 3.0 / names["bare"]["events"])
    events = {name: rung["events"] for name, rung in names.items()}
    assert events["bare"] == bare(rungs[0].points(2), 30)
    assert events["chattering"] > 2 * events["bare"]
    assert names["chattering"]["over_base"].median == pytest.approx(
        3.0 * events["bare"] / events["chattering"]
    )
    rigid = bare(rungs[0].points(2), 30)
    assert names["grounded"]["over_rigid"].median == pytest.approx(2.0 * rigid / events["grounded"])
    assert "over_rigid" not in names["chattering"]


def test_the_rigid_counterpart_has_the_same_numbers():
    (rung,) = read_rungs({"soft": {"parameters": BASE | {"contact_stiffness_ratio": 1e4}}})
    assert rung.model == "compliant"
    assert rung.rigid.parameters == BASE
    assert rung.rigid.model == "rigid"


def test_lanes_differ_and_lie_about_the_scene():
    (rung,) = read_rungs({"base": {"parameters": BASE}})
    clearances = [point["clearance"] for point in rung.points(3)]
    assert clearances == pytest.approx([0.98, 1.0, 1.02])
    assert rung.points(1) == [BASE]


@pytest.mark.parametrize(
    ("given", "words"),
    [
        ({"parameters": BASE, "observer": []}, "unknown key 'observer'"),
        ({"parameters": BASE | {"restitution": 2.0}}, "restitution = 2.0"),
    ],
)
def test_a_rung_that_is_none_is_refused(given, words):
    with pytest.raises(ValueError, match=words):
        read_rungs({"odd": given})


def test_memory_asked_for_is_log_and_arrays():
    points = [BASE] * 3
    log = LOG_ROWS * COLUMNS * 8
    # displacement and velocity of each sample in each lane, and the status of each lane
    expected = log + 3 * (2 * 50 * 8 + 1)
    assert observed(points, 50, {"stroboscopic_section": None}) == expected
    assert memory_of(points, 50, {"stroboscopic_section": None})["asked"] == expected
    assert memory_of(points, 50, None)["asked"] == 0
    assert observed(points, 50, {}) == 3


def test_the_engine_that_closes_no_burst_is_the_engine_where_there_are_none():
    lossless = BASE | {"restitution": 0.9}
    assert run_as(without._Unclosed, [lossless], 300) == run_as(Rigid, [lossless], 300) > 300
    known = run_as(Rigid, [CHATTERING], 5)
    assert run_as(without._Unclosed, [CHATTERING], 5) > 1.5 * known


@pytest.mark.parametrize(
    ("changes", "words"),
    [(CHATTERING, "no bursts"), ({"modulation_depth": 0.1}, "rigid damper")],
)
def test_unused_features_must_be_unused(changes, words):
    with pytest.raises(ValueError, match=words):
        unused(BASE | changes, lanes=1, periods=5, repeats=1)

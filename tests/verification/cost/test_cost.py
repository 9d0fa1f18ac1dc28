"""The cost study: which runs are compared and with what, and what its table and figure show."""

import csv
import io
import json
import math

import numpy as np
import pytest
from figures.drawing import assert_nothing_overlaps, drawn_by
from scenes import GENERIC as BASE
from scenes import SI

from damper.engine.compiled import plain
from damper.verification.cost import measure as measuring
from damper.verification.cost.figures import cost
from damper.verification.cost.measure import bare, measure, observed, points_near, rigid_part
from damper.verification.cost.settings import Case
from damper.verification.cost.tables.cost import CostTable, make

CHATTERING = BASE | {"frequency_ratio": 0.2, "clearance": 0.25, "restitution": 0.3}
SECTION = {"stroboscopic_section": None}
CASES = {
    "bare": {"parameters": BASE},
    "observed": {"parameters": BASE, "observers": SECTION},
    "chattering": {"parameters": CHATTERING},
    "grounded": {"parameters": BASE | {"support_stiffness_ratio": 0.01}},
    "two": {
        "parameters": BASE,
        "forcing": {"kind": "harmonics", "orders": [1, 2], "amplitudes": [1.0, 1.0]},
    },
}
CASES = {name: {"forcing": {"kind": "harmonic"}, "observers": {}} | c for name, c in CASES.items()}


@pytest.fixture(scope="module")
def timings():
    """What is measured on a machine whose pace changes from one repeat to the next."""
    pace = np.array([1.0, 5.0, 2.0])[:, None]
    # base twice, bare and observed, chattering, grounded and its rigid counterpart, two
    columns = np.array([1.0, 1.1, 1.0, 1.5, 3.0, 2.0, 1.0, 1.0])
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(measuring, "take_turns", lambda timed, repeats: pace * columns[: len(timed)])
        patch.setattr(measuring, "compile_at_once", lambda: None)
        found = plain(measure)(CASES, runs=2, periods=30, repeats=3)
    return json.loads(json.dumps(found))


def test_ratios_are_taken_within_a_repeat_and_per_event(timings):
    assert timings["noise"] == pytest.approx([1.1] * 3)
    cases = timings["cases"]
    events = {name: case["events"] for name, case in cases.items()}
    assert events["bare"] == plain(bare)(points_near(BASE, 2), 30)
    assert cases["observed"]["over_bare"] == pytest.approx([1.5] * 3)
    assert cases["observed"]["observed"][1] == pytest.approx(1e6 * 3.0 / events["bare"])
    assert events["two"] not in (0, events["bare"])
    assert events["chattering"] > 2 * events["bare"]
    over_base = 3.0 * events["bare"] / events["chattering"]
    assert cases["chattering"]["over_base"][1] == pytest.approx(over_base)
    over_rigid = 2.0 * events["bare"] / events["grounded"]
    assert cases["grounded"]["over_rigid"][1] == pytest.approx(over_rigid)
    assert [name for name in cases if "over_rigid" in cases[name]] == ["grounded"]
    # Displacement and velocity of each period of each run, and the status of each run.
    assert cases["observed"]["arrays"] == 2 * (2 * 30 * 8 + 1)


def test_a_frequency_in_hertz_is_one():
    fast = SI | {"forcing_frequency": {"value": 2.0, "unit": "Hz"}}
    found = Case.model_validate({"parameters": fast}).settings()["parameters"]
    assert found == SI | {"forcing_frequency": 4.0 * math.pi}


def test_runs_differ_and_lie_about_the_scene():
    assert rigid_part(BASE | {"contact_stiffness_ratio": 1e4}) == BASE
    clearances = [point["clearance"] for point in points_near(BASE, 4)]
    assert clearances == pytest.approx([0.985, 0.995, 1.005, 1.015])
    assert list(points_near(BASE, 1)) == [BASE]


def test_a_run_that_stops_early_or_has_no_event_is_not_measured(monkeypatch):
    with pytest.raises(RuntimeError, match="no event"):
        plain(bare)([BASE | {"clearance": 1e3}], 2)
    monkeypatch.setattr(measuring, "NO_BUDGET", 5)
    for run, rest in ((bare, ()), (observed, (SECTION,))):
        with pytest.raises(RuntimeError, match="did not finish"):
            plain(run)([BASE], 50, *rest)


def test_table_keeps_digits_and_rounds_for_readers(timings):
    table = make({"cost": timings}, CostTable.model_construct(caption="Suite"))
    rows = {row["case"]: row for row in csv.DictReader(io.StringIO(table.csv()))}
    assert list(rows) == list(CASES)
    assert float(rows["observed"]["over_bare_median"]) == pytest.approx(1.5)
    assert rows["observed"]["over_rigid_median"] == rows["bare"]["arrays"] == ""
    assert rows["observed"]["arrays"] == "962"
    markdown = table.markdown()
    assert "1.500 [1.500, 1.500]" in markdown
    assert timings["machine"]["processor"] in markdown


def test_figure_shows_each_ratio_that_there_is(timings):
    figure = drawn_by(cost, {"cost": timings})
    time, memory = figure.axes
    assert [tick.get_text() for tick in time.get_yticklabels()] == list(CASES)
    points = [container.lines[0].get_xydata() for container in time.containers]
    assert points[0] == pytest.approx(np.array([[1.5, 1]]))
    assert points[1][:, 1] == pytest.approx([0.0, 2.0, 2.8, 4.0])
    assert points[2][:, 1] == pytest.approx([3.2])
    assert [bar.get_width() for bar in memory.patches] == [0.0, 962 / 1e6, 0.0, 0.0, 0.0]
    assert_nothing_overlaps(figure)

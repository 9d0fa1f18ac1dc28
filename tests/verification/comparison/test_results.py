"""Runs, cubes, tables and figures of a comparison, of solvers whose errors and times are known."""

import csv
import io
import math
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
import xarray as xr
from figures.drawing import drawn_by, legend_texts
from scenes import SLOW

from damper.observers import class_in
from damper.study.study_file import ProductBase
from damper.sweep.parts import PartData
from damper.verification import timing
from damper.verification.comparison import OUTCOMES, runs
from damper.verification.comparison.errors import Reference
from damper.verification.comparison.figures import work_precision
from damper.verification.comparison.figures.work_precision import SOLVER_MARKS
from damper.verification.comparison.runs import RUN_TIME, dataset, gather, time_solvers
from damper.verification.comparison.solvers import (
    CAPPED,
    FINISHED,
    STALLED,
    Solution,
    Solver,
    read_scene,
)
from damper.verification.comparison.tables import solver_errors

IMPACTS, SIDES = np.array([1.0, 3.0, 5.0]), np.array([-1.0, 1.0, -1.0])
FINAL = np.array([0.5, -0.25, 0.125, 1.0])
#: Three impacts, no sticking.
REFERENCE = Reference(IMPACTS, SIDES, np.ones(3), np.empty(0), np.empty(0), FINAL)
SCENES = [read_scene(SLOW | {"frequency_ratio": 2.0}, 6.0)]


def fake(
    order: float = 1.0,
    per_second: float = 1e6,
    outcome: str = FINISHED,
    seen: int = 3,
    penetration: float = 0.0,
) -> Solver:
    """Solver whose errors are the setting to some power; a hundred evaluations per refinement.

    It sees the first `seen` impacts.
    """

    def solve(scene: Any, setting: float, most: int) -> Solution:
        evaluations = int(100 / setting)
        if evaluations > most:
            return Solution(outcome=CAPPED, evaluations=most, reached=0.5)
        if outcome != FINISHED:
            return Solution(outcome=outcome, evaluations=evaluations, reached=2.0)
        error = setting**order
        return Solution(
            impact_times=(IMPACTS + error * np.array([0.1, -0.2, 0.05]))[:seen],
            impact_sides=SIDES[:seen],
            approach_speeds=np.ones(seen),
            end_state=FINAL + 0.3 * error,
            penetration=penetration,
            evaluations=evaluations,
            reached=scene.until,
        )

    return Solver(per_second, solve)


#: One that does all well, and one for each way to fail.
FAKES = {
    "exact": fake(order=2.0, per_second=1e15),
    "dop853": fake(order=3.0, per_second=1e4),
    "rk4_located": fake(outcome=STALLED),
    "rk4_step_end": fake(penetration=0.1),
    "moreau_jean": fake(seen=2),
}
SETTINGS = {
    "dop853": (0.1, 0.01, 1e-3),
    "exact": (0.1, 0.01, 1e-3, 1e-10),
    "rk4_step_end": (0.1, 0.01),
    "rk4_located": (0.1,),
    "moreau_jean": (0.1,),
}
TITLES = {"one": "hard walls"}


@pytest.fixture(scope="module")
def cubes():
    """Errors and timings of the fakes; an evaluation takes 1 us."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(runs, "load", FAKES.__getitem__)
        parts = [PartData(runs.run_scene(s, SETTINGS, REFERENCE, 1.0)) for s in SCENES]
        about = {"title": "Fakes compared"}
        errors = gather(parts, SETTINGS, TITLES, about)
        arrays = {"run_time": 1e-6 * errors.evaluations.values}
        about |= {"processor": "A processor", "cores": "2", "numpy": "9.9"}
        yield errors, dataset(arrays, [RUN_TIME], SETTINGS, TITLES, about)


@pytest.fixture
def errors(cubes) -> xr.Dataset:
    return cubes[0].copy(deep=True)


def test_errors_and_outcomes_of_every_level(errors):
    assert errors.solver.values.tolist() == list(FAKES)  # in the order of SOLVERS
    one = errors.sel(scene="one")
    nan = np.nan
    np.testing.assert_allclose(
        one.state_error.sel(solver=["exact", "dop853"]),
        [[3e-3, 3e-5, 3e-7, 0.0], [3e-4, 3e-7, nan, nan]],
        rtol=1e-6,
    )
    np.testing.assert_allclose(one.impact_time_error.sel(solver="dop853", level=1), 2e-4)
    assert one.setting.sel(solver="dop853", level=2) == 0.01
    found = [OUTCOMES[int(k)] if k >= 0 else None for k in one.outcome.sel(solver="dop853")]
    assert found == ["good", "good", "capped", None]
    found = [OUTCOMES[int(k)] for k in one.outcome.sel(level=1)]
    assert found == ["good", "good", "stalled", "left_box", "missed"]
    assert one.reference_impacts == 3
    assert one.outcome.encoding == {"dtype": np.int8, "_FillValue": -1}
    assert one.outcome.attrs["flag_meanings"].split() == list(OUTCOMES)
    for name, array in errors.variables.items():
        assert array.attrs["long_name"], name


# --- run times


@pytest.fixture
def clock(monkeypatch):
    """A clock that moves only while a solver runs; each run is logged."""
    made = SimpleNamespace(now=0.0, log=[])

    def use(**costs):
        def timed(name, cost):
            def solve(scene, setting, most):
                made.log.append((name, setting))
                made.now += next(cost) if hasattr(cost, "__next__") else cost(scene)
                return Solution(impact_times=np.arange(round(scene.until)), reached=scene.until)

            return Solver(1e6, solve)

        made_up = {name: timed(name, cost) for name, cost in costs.items()}
        monkeypatch.setattr(runs, "load", made_up.__getitem__)

    made.use = use
    monkeypatch.setattr(timing, "process_time", lambda: made.now)
    return made


def test_median_without_the_first_run(clock):
    clock.use(dop853=iter([99.0, 1.0, 5.0, 2.0, 4.0, 3.0]))
    found = time_solvers(SCENES, {"dop853": [0.5]}, 5, 2.0, math.inf)
    assert found.tolist() == [[[3.0]]]


# --- tables


def cells_of(markdown):
    return [line.strip("| ").split(" | ") for line in markdown.splitlines() if line[:1] == "|"]


def made(kind, errors, timings):
    settings = class_in(kind, ProductBase).model_construct()
    return kind.make({"cube": errors, "timings": timings}, settings)


def test_errors_table(errors):
    table = made(solver_errors, errors, None)
    rows = list(csv.DictReader(io.StringIO(table.csv())))
    assert len(rows) == sum(map(len, SETTINGS.values()))
    one = next(row for row in rows if row["solver"] == "dop853" and row["setting"] == "0.01")
    assert float(one["state_error"]) == pytest.approx(3e-7)
    assert one["outcome"] == "good"
    assert table.title == "Fakes compared: errors"
    cells = dict(zip(FAKES, cells_of(table.markdown())[2:], strict=True))
    assert cells["exact"][1] == "accuracy 1e-10"
    assert cells["exact"][5] == "0"
    assert cells["rk4_step_end"][-1] == "beyond a wall by 0.1"
    assert cells["dop853"][5] == "3e-7"
    assert cells["dop853"][-1] == "0.1, 0.01: good; 1e-3: capped at t = 0.5"
    assert cells["rk4_located"][-1] == "stalled at t = 2"
    assert cells["moreau_jean"][-1] == "events missed"


# --- figures


def drawn(kind, cubes, **settings):
    return drawn_by(kind, dict(zip(("cube", "timings"), cubes, strict=True)), **settings)


def test_good_runs_are_lines_and_failures_lie_in_strips(cubes):
    errors, times = cubes
    figure = drawn(work_precision, cubes)
    (ax,) = figure.axes
    lines: dict[str, list] = {}
    for line in ax.lines:
        for name, look in SOLVER_MARKS.items():
            if line.get_marker() == look["marker"]:
                lines.setdefault(name, []).append(line)
    place = errors.sel(scene="one", solver="exact")
    np.testing.assert_array_equal(lines["exact"][0].get_ydata()[:-1], place.state_error[:-1])
    run_time = times.run_time.sel(scene="one", solver="exact")
    np.testing.assert_array_equal(lines["exact"][0].get_xdata(), run_time)
    texts = [text.get_text() for text in ax.get_yticklabels()]
    strips = dict(zip(texts, ax.get_yticks(), strict=True))
    assert list(strips)[-4:] == ["events missed", "beyond a wall", "stalled", "capped"]
    failed = [("moreau_jean", "events missed"), ("rk4_step_end", "beyond a wall")]
    failed += [("rk4_located", "stalled")]
    for solver, strip in failed:
        assert set(lines[solver][1].get_ydata()) == {strips[strip]}
    # An error of nothing is drawn on the floor.
    assert lines["exact"][0].get_ydata()[-1] == 1e-16
    assert len(legend_texts(figure)) == len(FAKES)
    figure = drawn(work_precision, cubes, error="release_error")
    assert [text.get_text() for text in figure.axes[0].texts] == ["nothing to compare"]

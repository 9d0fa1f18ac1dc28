"""Several masses side by side: their number, and no start of theirs that is worse."""

import math
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from machines import FRAME, MACHINE
from matplotlib.patches import Circle
from studies import cube_of

from damper.parameters import State
from damper.sizing.answer import Design, design
from damper.sizing.contact import STEEL, ball_diameter
from damper.sizing.machine import machine_of, read_machine
from damper.sizing.page import box
from damper.sizing.search import Search
from damper.sizing.study import Sizes, WorstCase
from damper.study.config import load_study
from damper.sweep.runs import run_points

pytestmark = pytest.mark.usefixtures("few_starts_throughout")


@pytest.fixture(scope="module")
def of_two(few_starts_throughout: None) -> Design:
    """The card of two masses side by side, where they are better than one and three."""
    worst = {1: 0.2, 2: 0.1, 3: 0.3}
    sizes = Sizes(8.0, 0.01, 0.3)

    def best(search: Search) -> Sizes:
        search.bounds[sizes] = worst[search.judge.count]
        return sizes

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(Search, "best", best)
        for others in ("best_of_masses", "gaps_about"):
            patch.setattr(Search, others, lambda search, found: [found])
        return design(MACHINE | {"units": [3, 1, 2]})


def test_the_best_number_of_masses_is_named(of_two: Design, tmp_path: Path) -> None:
    assert (of_two.count, of_two.counts.units.tolist()) == (2.0, ["2", "1", "3"])
    assert "2 boxes side by side, with a ball of 1/2 of the free mass in each" in repr(of_two)
    diameter, across, _ = of_two.ball_and_box(STEEL.density)
    assert diameter == ball_diameter(4.0, STEEL.density)
    (build,) = (table for heading, _, table in of_two.tables if heading == "What to build")
    assert build[["boxes", "diameter"]].iloc[0].tolist() == ["2", across]
    reduced, v = 400.0 / 104.0, of_two.approach_speed
    assert math.isclose(of_two.impulse, 1.3 * reduced * v, rel_tol=1e-9)  # of one of them
    circles = [one for one in box(of_two).axes[0].patches if isinstance(one, Circle)]
    assert len(circles) == 4  # two balls, at both ends of their way
    of_two.save(tmp_path)
    for path in (tmp_path / "studies").glob("*.yaml"):
        assert len(load_study(path).masses) == (0 if path.stem == "alike" else 2)
    worst, alike = (
        float(cube_of(load_study(tmp_path / f"studies/{name}.yaml")).peak_displacement.max())
        for name in ("worst", "alike")
    )
    assert math.isclose(of_two.worst, worst, rel_tol=1e-12)
    assert math.isclose(of_two.alike, alike, rel_tol=1e-12)
    table = pd.read_csv(tmp_path / "history.csv")
    assert {"relative_0", "relative_1"} <= {*table}
    assert read_machine(tmp_path / "machine.yaml").counts_of_masses == [1, 2, 3]


def test_two_masses_begin_nowhere_worse(monkeypatch: pytest.MonkeyPatch) -> None:
    """Each of them anywhere, at any speed, against the search's starts alike and in even steps.

    Twice the best gap of one mass: that rattles, and two masses out of step are better. The same
    with one thread and with two.
    """
    machine = machine_of(FRAME | {"damping_ratio": 0.02, "largest_mass": 10.0, "restitution": 0.3})
    asked, draw = Sizes(10.0, 2e-3, 0.3), np.random.default_rng(5)
    judge, found = WorstCase(machine, 2), []
    for threads in (1, 2):
        monkeypatch.setattr("damper.sweep.runs._threads", lambda *_, count=threads: count)
        search = Search(judge)
        found.append((search.worst(asked), search.hardest[asked]))
    assert found[0] == found[1]
    worst, length, brute = found[0][0], machine.length, []
    for _ in range(100):
        point = machine.primary | judge.sizes(asked)
        point["forcing_frequency"] = math.tau * draw.uniform(28.0, 36.0)
        point["masses"] = [{"mass_share": 0.5, "clearance_factor": 1.0 + 1e-3 * draw.uniform()}] * 2
        x, v = draw.uniform(-1.0, 1.0, 2) * judge.far * [1.0, machine.rate]
        place, speed = draw.uniform(-0.99e-3, 0.99e-3, 2), draw.uniform(-0.3, 0.3, 2)
        state = State(x, v, (x + place).tolist(), (v + speed).tolist())
        arrays, _ = run_points([point], judge.observers, state=state, **judge.run)
        brute.append(length * float(arrays["peak_displacement"][0]))
    assert 0.9 * worst < max(brute) < 1.02 * worst
    assert worst < 0.9 * Search(WorstCase(machine)).worst(asked)

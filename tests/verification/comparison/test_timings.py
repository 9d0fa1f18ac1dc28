"""Times of solvers whose cost is known: a fake clock, not the machine's."""

import math
from collections.abc import Iterator
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from verification.comparison.fake_solvers import fake

from damper.verification import timing
from damper.verification.comparison import runs, timings
from damper.verification.comparison.runs import NOT_APPLICABLE
from damper.verification.comparison.scene import read_scene
from damper.verification.comparison.solution import OUTCOMES, STALLED, Solution
from damper.verification.comparison.timings import time_peers, time_solvers

VALUES = {
    "mass_ratio": 0.1,
    "damping_ratio": 0.05,
    "frequency_ratio": 2.0,
    "clearance": 0.25,
    "restitution": 0.6,
}
RIGID = read_scene(VALUES, 6.0)
COMPLIANT = read_scene(VALUES | {"contact_stiffness_ratio": 1e4}, 6.0)


class Clock:
    """Seconds that pass only while a solver runs; each run is logged."""

    def __init__(self) -> None:
        self.now = 0.0
        self.log: list[tuple[str, float]] = []

    def solver(self, name: str, costs: Iterator[float] | float, **known: Any) -> Any:
        inner = fake(**known)

        def solve(scene: Any, setting: float, **options: Any) -> Solution:
            assert set(options) == {"max_evaluations"}  # the bare run
            self.log.append((name, setting))
            self.now += costs if isinstance(costs, float) else next(costs)
            return inner.solve(scene, setting, **options)

        return SimpleNamespace(**vars(inner) | {"solve": solve})


@pytest.fixture
def clock(monkeypatch: pytest.MonkeyPatch) -> Clock:
    made = Clock()
    monkeypatch.setattr(timing, "perf_counter", lambda: made.now)
    monkeypatch.setattr(timings, "first_use", lambda *_: (0.25, 0.5))
    return made


def use(monkeypatch: pytest.MonkeyPatch, **solvers: Any) -> None:
    for module in (runs, timings):
        monkeypatch.setattr(module, "load", solvers.__getitem__)


def test_median_and_quartiles(clock: Clock, monkeypatch: pytest.MonkeyPatch) -> None:
    # The first run only warms up, and no sample holds it.
    costs = iter([99.0, 1.0, 5.0, 2.0, 4.0, 3.0])
    use(monkeypatch, exact=clock.solver("exact", costs))
    found = time_solvers({"a": RIGID}, {"exact": [0.5]}, 5, 2.0, math.inf)
    at = (0, 0, 0)
    assert found["run_time"][at] == 3.0
    assert (found["run_time_low"][at], found["run_time_high"][at]) == (2.0, 4.0)
    assert found["repeats"][at] == 5
    assert found["periods"] == pytest.approx([6.0 / np.pi])
    assert (found["import_time"][0], found["warm_up_time"][0]) == (0.25, 0.5)


def test_solvers_and_levels_take_turns(clock: Clock, monkeypatch: pytest.MonkeyPatch) -> None:
    use(monkeypatch, exact=clock.solver("exact", 0.1), rk45=clock.solver("rk45", 0.2))
    time_solvers({"a": RIGID}, {"rk45": [0.2], "exact": [0.5, 0.25]}, 3, 2.0, math.inf)
    turn = [("exact", 0.5), ("exact", 0.25), ("rk45", 0.2)]
    assert clock.log == [("exact", 0.5), ("rk45", 0.2), *turn, *reversed(turn), *turn]


def test_each_model_is_warmed_up(clock: Clock, monkeypatch: pytest.MonkeyPatch) -> None:
    both = clock.solver("exact", 1.0, models=("rigid", "compliant"))
    use(monkeypatch, exact=both, rk45=clock.solver("rk45", 1.0))
    scenes = {"a": RIGID, "b": COMPLIANT, "c": RIGID}
    found = time_solvers(scenes, {"exact": [0.5], "rk45": [0.5]}, 1, 2.0)
    assert [name for name, _ in clock.log] == [
        *("exact", "rk45", "exact", "rk45"),
        *("exact", "exact"),
        *("exact", "rk45"),
    ]
    assert found["outcome"][:, 1, 0].tolist() == [0, NOT_APPLICABLE, 0]
    assert found["repeats"][:, 1, 0].tolist() == [1, 0, 1]
    assert np.isnan(found["run_time"][1, 1, 0])


def test_failures_are_timed_too(clock: Clock, monkeypatch: pytest.MonkeyPatch) -> None:
    exact = clock.solver("exact", 1.0, outcome=STALLED)
    use(monkeypatch, exact=exact, rk45=clock.solver("rk45", 1.0, per_second=100.0))
    found = time_solvers({"a": RIGID}, {"exact": [0.5], "rk45": [0.5, 1.0]}, 1, 1.0)
    assert OUTCOMES[found["outcome"][0, 0, 0]] == STALLED
    assert [OUTCOMES[k] for k in found["outcome"][0, 1]] == ["capped", "finished"]


def test_solver_that_no_scene_suits(clock: Clock, monkeypatch: pytest.MonkeyPatch) -> None:
    use(monkeypatch, exact=clock.solver("exact", 1.0, models=("compliant",)))
    found = time_solvers({"a": RIGID}, {"exact": [0.5]}, 1, 2.0)
    assert np.isnan(found["import_time"]).all()
    assert np.isnan(found["run_time"]).all()


def test_a_call_is_separated_from_the_motion(clock: Clock, monkeypatch: pytest.MonkeyPatch) -> None:
    made = fake()

    def solve(scene: Any, setting: float, **_: Any) -> Solution:
        clock.now += 0.25 + 0.5 * scene.until
        return Solution(impact_times=np.arange(round(scene.until)), reached=scene.until)

    timed = SimpleNamespace(**vars(made) | {"solve": solve})
    use(monkeypatch, exact=timed, rk45=timed)
    found = time_peers({"a": RIGID}, {"exact": [0.5], "rk45": [0.5]}, 3, 2.0)
    values = [found[name][0, 0, 0] for name in ("call_time", "stretch_time", "stretch_impacts")]
    assert values == pytest.approx([0.25, 0.5 * 6.0, 6.0], rel=1e-4)
    assert np.isnan(found["call_time"][0, 1]).all()  # neither the engine nor its peer


def test_a_peer_that_fails_has_no_cost(clock: Clock, monkeypatch: pytest.MonkeyPatch) -> None:
    use(monkeypatch, rk4_located=clock.solver("rk4_located", 1.0, outcome=STALLED))
    found = time_peers({"a": RIGID}, {"rk4_located": [0.5]}, 1, 2.0)
    assert np.isnan(found["stretch_time"]).all()

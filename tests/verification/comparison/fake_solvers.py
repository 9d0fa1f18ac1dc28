"""Solvers with known errors, costs and failures, in place of the real ones."""

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
import xarray as xr

from damper.verification.comparison import cube as comparison_cube
from damper.verification.comparison import runs
from damper.verification.comparison.runs import run_scene
from damper.verification.comparison.scene import Scene, read_scene
from damper.verification.comparison.solution import CAPPED, FAILED, FINISHED, STALLED, Solution

IMPACTS = np.array([1.0, 3.0, 5.0])
SIDES = np.array([-1, 1, -1])
FINAL = np.array([0.5, -0.25, 0.125, 1.0])

#: Three impacts, no sticking.
REFERENCE: Any = SimpleNamespace(
    impact_times=IMPACTS,
    impact_sides=SIDES,
    approach_speeds=np.ones(3),
    stick_times=np.empty(0),
    release_times=np.empty(0),
    final_state=FINAL,
    sensitivity=7.0,
)


def fake(
    order: float = 1.0,
    models: tuple[str, ...] = ("rigid",),
    finer: int = -1,
    per_second: float = 1e6,
    outcome: str = FINISHED,
    seen: int = 3,
    penetration: float = 0.0,
    calls: list[dict[str, Any]] | None = None,
) -> Any:
    """Solver whose errors are the setting to some power; a hundred evaluations per refinement.

    It sees the first `seen` impacts.
    """

    def solve(
        scene: Scene,
        setting: float,
        *,
        times: Any = (),
        balance: bool = False,
        max_evaluations: int,
    ) -> Solution:
        if calls is not None:
            calls.append(
                {
                    "setting": setting,
                    "times": list(times),
                    "balance": balance,
                    "max_evaluations": max_evaluations,
                }
            )
        refinement = setting if finer > 0 else 1.0 / setting
        evaluations = int(100 * refinement)
        if evaluations > max_evaluations:
            return Solution(outcome=CAPPED, evaluations=max_evaluations, reached=0.5)
        if outcome != FINISHED:
            return Solution(outcome=outcome, evaluations=evaluations, reached=2.0)
        error = refinement**-order
        return Solution(
            impact_times=(IMPACTS + error * np.array([0.1, -0.2, 0.05]))[:seen],
            impact_sides=SIDES[:seen],
            approach_speeds=np.ones(seen),
            states=np.array([FINAL + 0.3 * error for _ in times]).reshape(len(times), 4),
            penetration=penetration,
            energy_residual=error if balance else np.nan,
            evaluations=evaluations,
            outcome=FINISHED,
            reached=scene.until,
        )

    return SimpleNamespace(
        setting="step",
        finer=finer,
        models=models,
        evaluations_per_second=per_second,
        solve=solve,
    )


STALLS = fake(outcome=STALLED)


#: One that does all well, one for which larger is finer, and one for each way to fail.
SOLVERS = {
    "exact": fake(order=2.0, models=("rigid", "compliant"), per_second=1e15),
    "rk4_step_end": fake(order=1.0, finer=1, penetration=0.1),
    "rk4_located": fake(order=3.0, finer=1),
    "rk45": fake(order=1.0, per_second=1e4),
    "lsoda": STALLS,
    "radau": fake(seen=2),
    "compliant_flow": fake(outcome=FAILED, models=("compliant",)),
}
SETTINGS = {
    "exact": (0.1, 0.01, 1e-3, 1e-10),
    "rk4_step_end": (10.0, 100.0),
    "rk4_located": (10.0, 20.0, 40.0, 80.0),
    "rk45": (0.1, 0.01, 1e-3),
    "lsoda": (0.1,),
    "radau": (0.1,),
    "compliant_flow": (1.0,),
}
_VALUES = {
    "mass_ratio": 0.1,
    "damping_ratio": 0.05,
    "frequency_ratio": 2.0,
    "clearance": 0.25,
    "restitution": 0.6,
}
SCENES = {
    "hard": read_scene(_VALUES, 6.0),
    "soft": read_scene(_VALUES | {"contact_stiffness_ratio": 1e4}, 6.0),
}
TITLES = {"hard": "hard walls", "soft": "compliant contact"}
ATTRIBUTES = {"title": "Fakes compared"}


def fake_cubes(patch: pytest.MonkeyPatch) -> tuple[xr.Dataset, xr.Dataset]:
    """Errors and timings of the fakes; an evaluation takes 1 us, in lsoda 1 ms."""
    for module in (runs, comparison_cube):
        patch.setattr(module, "load", SOLVERS.__getitem__)
    parts = {name: run_scene(scene, SETTINGS, REFERENCE, 1.0) for name, scene in SCENES.items()}
    errors = comparison_cube.gather_errors(parts, SETTINGS, TITLES, ATTRIBUTES)
    names = errors.solver.values.tolist()
    each = np.where(np.array(names) == "lsoda", 1e-3, 1e-6)[:, None]
    times = np.stack([part["evaluations"] for part in parts.values()]) * each
    arrays = {
        "run_time": times,
        "run_time_low": 0.9 * times,
        "run_time_high": 1.2 * times,
        "call_time": np.where(np.isnan(times), times, 2e-5),
        "stretch_time": times,
        "stretch_impacts": np.where(np.isnan(times), times, 3.0),
        "repeats": np.where(np.isnan(times), 0, 3),
        "outcome": np.stack([part["outcome"] for part in parts.values()]),
        "import_time": np.linspace(0.1, 0.2, len(names)),
        "warm_up_time": np.full(len(names), 0.5),
        "periods": np.array([scene.periods for scene in SCENES.values()]),
    }
    about = ATTRIBUTES | {"processor": "A processor", "cores": "2", "numpy": "9.9"}
    timings = comparison_cube.gather_timings(arrays, list(SCENES), SETTINGS, TITLES, about)
    return errors, timings

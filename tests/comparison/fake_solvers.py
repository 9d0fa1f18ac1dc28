"""Solvers with known errors, costs and failures, in place of the real ones."""

from types import SimpleNamespace
from typing import Any

import numpy as np

from damper.comparison.scene import Scene
from damper.comparison.solution import CAPPED, FINISHED, STALLED, Solution

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
    calls: list[dict[str, Any]] | None = None,
) -> Any:
    """Solver whose errors are the setting to some power; a hundred evaluations per refinement."""

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
            impact_times=IMPACTS + error * np.array([0.1, -0.2, 0.05]),
            impact_sides=SIDES,
            approach_speeds=np.ones(3),
            states=np.array([FINAL + 0.3 * error for _ in times]).reshape(len(times), 4),
            penetration=0.0,
            energy_residual=error if balance else np.nan,
            evaluations=evaluations,
            outcome=FINISHED,
            reached=scene.until,
        )

    return SimpleNamespace(
        LABEL="a fake",
        SETTING="step",
        FINER=finer,
        MODELS=models,
        EVALUATIONS_PER_SECOND=per_second,
        solve=solve,
    )


STALLS = fake(outcome=STALLED)

"""scipy's DOP853 restarted at every impact, and no more: without sticking made by hand.

What a first attempt with events looks like. A complete burst has infinitely many impacts, so there
it ends: the known failure of event-driven integrators, see
`damper.verification.comparison.restarted`.
"""

from collections.abc import Sequence

from damper.verification.comparison.restarted import solve_restarted
from damper.verification.comparison.scene import Scene
from damper.verification.comparison.solution import Solution

LABEL = "scipy DOP853, restarted, no sticking"
SETTING = "tolerance"
FINER = -1
MODELS = ("rigid",)
EVALUATIONS_PER_SECOND = 120000


def solve(
    scene: Scene,
    setting: float,
    *,
    times: Sequence[float] = (),
    balance: bool = False,
    max_evaluations: int = 2 * EVALUATIONS_PER_SECOND,
) -> Solution:
    """Run a scene with `setting` as rtol; see `damper.verification.comparison.restarted`."""
    return solve_restarted(
        "DOP853", scene, setting, times, balance, max_evaluations, sticking=False
    )

"""scipy's Radau, the implicit Radau IIA method of order 5, restarted at every impact."""

from collections.abc import Sequence

from damper.verification.comparison.restarted import solve_restarted
from damper.verification.comparison.scene import Scene
from damper.verification.comparison.solution import Solution

LABEL = "scipy Radau, restarted"
SETTING = "tolerance"
FINER = -1
MODELS = ("rigid", "compliant")
EVALUATIONS_PER_SECOND = 40000


def solve(
    scene: Scene,
    setting: float,
    *,
    times: Sequence[float] = (),
    balance: bool = False,
    max_evaluations: int = 2 * EVALUATIONS_PER_SECOND,
) -> Solution:
    """Run a scene with `setting` as rtol; see `damper.verification.comparison.restarted`."""
    return solve_restarted("Radau", scene, setting, times, balance, max_evaluations)

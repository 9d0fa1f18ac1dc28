"""Stiff springs for rigid walls, by scipy's Radau from one change of the equations to the next.

The tolerance is fixed so tight that what the springs do to the solution is its error. Sticking is a
contact that lasts for at least one period of its own oscillation, twice as long as a bounce; it
begins where that contact begins.
"""

from collections.abc import Sequence

from damper.verification.comparison.restarted import solve_restarted
from damper.verification.comparison.scene import Scene
from damper.verification.comparison.solution import Solution
from damper.verification.comparison.springs import with_springs

LABEL = "stiff springs, scipy Radau"
SETTING = "contact_stiffness"
FINER = +1
MODELS = ("rigid",)
EVALUATIONS_PER_SECOND = 40_000
TOLERANCE = 1e-8


def solve(
    scene: Scene,
    setting: float,
    *,
    times: Sequence[float] = (),
    balance: bool = False,
    max_evaluations: int = 2 * EVALUATIONS_PER_SECOND,
) -> Solution:
    """Run a scene with walls of stiffness `setting` in units of the primary's."""
    springs = with_springs(scene, setting)
    return solve_restarted(
        "Radau", springs, TOLERANCE, times, balance, max_evaluations, lasting=True
    )

"""Methods of scipy's solve_ivp, restarted at every event.

``dop853_free`` is what a first attempt with events looks like: restarted, but without sticking made
by hand. A complete burst has infinitely many impacts, so there it ends.

``compliant_stiff`` puts stiff springs in place of rigid walls. Its tolerance is so tight that what
the springs do to the solution is its error. Sticking is a contact that lasts for at least one
period of its own oscillation, twice as long as a bounce; it begins where that contact begins.
"""

from collections.abc import Sequence
from typing import Any

from damper.verification.comparison.restarted import solve_restarted
from damper.verification.comparison.scene import Scene
from damper.verification.comparison.solution import Solution
from damper.verification.comparison.solvers import Solver
from damper.verification.comparison.springs import with_springs

_SPRINGS_TOLERANCE = 1e-8


def _restarted(method: str, evaluations_per_second: float, **options: Any) -> Solver:
    def run(
        scene: Scene, setting: float, times: Sequence[float], balance: bool, most: int
    ) -> Solution:
        return solve_restarted(method, scene, setting, times, balance, most, **options)

    models = ("rigid",) if options else ("rigid", "compliant")
    return Solver("tolerance", -1, models, evaluations_per_second, run)


def _springs(
    scene: Scene, setting: float, times: Sequence[float], balance: bool, most: int
) -> Solution:
    springs = with_springs(scene, setting)
    return solve_restarted("Radau", springs, _SPRINGS_TOLERANCE, times, balance, most, lasting=True)


SOLVERS = {
    "dop853": _restarted("DOP853", 120_000),
    "dop853_free": _restarted("DOP853", 120_000, sticking=False),
    "rk45": _restarted("RK45", 100_000),
    "lsoda": _restarted("LSODA", 60_000),
    "radau": _restarted("Radau", 40_000),
    "compliant_stiff": Solver("contact_stiffness", +1, ("rigid",), 40_000, _springs),
}

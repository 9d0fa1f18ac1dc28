"""Stiff springs for rigid walls, by the exact flow of the engine's own model of such walls.

What the springs do to the solution is its only error. Sticking is a contact that lasts for at least
one period of its own oscillation, twice as long as a bounce; it begins where that contact begins.
"""

import math
from collections.abc import Sequence

from damper.engine.trajectory import DEFAULT_ACCURACY
from damper.verification.comparison.scene import Scene
from damper.verification.comparison.solution import Solution
from damper.verification.comparison.solvers import Solver, exact
from damper.verification.comparison.springs import with_springs


def solve(
    scene: Scene, setting: float, times: Sequence[float], balance: bool, max_evaluations: int
) -> Solution:
    """Run a scene with walls of stiffness `setting` in units of the primary's."""
    springs = with_springs(scene, setting)
    found = exact.solve(springs, DEFAULT_ACCURACY, times, balance, max_evaluations)
    # The engine reports that a contact sticks once it has lasted for one period.
    p = springs.parameters
    reduced = p.mass_ratio / (1.0 + p.mass_ratio)
    found.stick_times -= 2.0 * math.pi * math.sqrt(reduced / p.contact_stiffness_ratio)
    return found


SOLVERS = {"compliant_flow": Solver("contact_stiffness", +1, ("rigid",), 4e6, solve)}
